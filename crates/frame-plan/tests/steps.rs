//! Every kind of step on the CPU executor.
#![allow(clippy::unwrap_used, reason = "tests")]

mod passes;

use frame_plan::cpu::CpuExecutor;
use frame_plan::{
    ExecuteError, Executor, Lifetime, Load, ParamsId, Plan, Resource, ResourceId, Step, TextureFormat,
};
use passes::*;

fn executor() -> CpuExecutor {
    CpuExecutor::new(PASSES, Some(2)).unwrap()
}

fn read<T: bytemuck::NoUninit + bytemuck::AnyBitPattern>(
    executor: &mut dyn Executor,
    plan: &Plan,
    name: &str,
) -> Vec<T> {
    bytemuck::pod_collect_to_vec(&executor.read(plan.resource(name).unwrap()).unwrap())
}

fn run<T: bytemuck::NoUninit + bytemuck::AnyBitPattern>(plan: &Plan, name: &str) -> Vec<T> {
    let mut executor = executor();
    executor.prepare(plan).unwrap();
    executor.execute().unwrap();
    read(&mut executor, plan, name)
}

#[test]
fn dispatch_reads_params_and_writes() {
    let output: Vec<u32> = run(&scale_plan(), "output");
    assert!(output.iter().zip(0..).all(|(&out, i)| out == i * 3 + 7));
}

#[test]
fn params_and_buffers_change_between_frames() {
    let plan = scale_plan();
    let mut executor = executor();
    executor.prepare(&plan).unwrap();
    let params = Scale { factor: 5, offset: 1, count: 2, padding: 0 };
    executor.set_params(plan.params_id("scale").unwrap(), bytemuck::bytes_of(&params)).unwrap();
    let input = plan.resource("input").unwrap();
    executor.write_buffer(input, 4, bytemuck::bytes_of(&100_u32)).unwrap();
    executor.execute().unwrap();
    assert_eq!(read::<u32>(&mut executor, &plan, "output")[..3], [1, 501, 0]);
}

#[test]
fn atomics_count_and_feed_an_indirect_dispatch() {
    let plan = indirect_plan();
    let bins: Vec<u32> = run(&plan, "bins");
    assert_eq!(bins.iter().sum::<u32>(), 5000);
    assert!(bins.iter().all(|&b| b > 600), "{bins:?}");
    let groups = bins[0].div_ceil(64);
    let state: Vec<u32> = run(&plan, "state");
    let touched = groups as usize * 64;
    assert!(state[..touched].iter().all(|&s| s == 1) && state[touched..].iter().all(|&s| s == 0));
}

#[test]
fn persistent_buffers_keep_their_contents_and_transient_ones_are_cleared_by_their_plan() {
    let plan = indirect_plan();
    let mut executor = executor();
    executor.prepare(&plan).unwrap();
    for frame in 1..=3 {
        executor.execute().unwrap();
        assert_eq!(read::<u32>(&mut executor, &plan, "state")[0], frame);
        assert_eq!(read::<u32>(&mut executor, &plan, "bins").iter().sum::<u32>(), 5000);
    }
    executor.prepare(&plan).unwrap();
    executor.execute().unwrap();
    assert_eq!(read::<u32>(&mut executor, &plan, "state")[0], 1, "a new plan starts anew");
}

#[test]
fn indirect_groups_are_clamped() {
    let mut plan = indirect_plan();
    let Some(Step::DispatchIndirect { arguments, .. }) = plan.steps.last_mut() else { unreachable!() };
    let huge = Resource::buffer_with("huge", &[0_u32, u32::MAX, 1, 1]);
    plan.resources.push(huge);
    *arguments = ResourceId(4);
    let state: Vec<u32> = run(&plan, "state");
    assert!(state.iter().all(|&s| s == 1));
}

#[test]
fn repeat_takes_its_iterations_params_and_mips() {
    let plan = mips_plan();
    let finest = |x: usize, y: usize| ((y * 16 + x) * (y * 16 + x) % 61) as f32;
    let first: Vec<f32> = run(&plan, "level 1");
    for (i, value) in first.iter().enumerate() {
        let (x, y) = (i % 8 * 2, i / 8 * 2);
        let mean = (finest(x, y) + finest(x + 1, y) + finest(x, y + 1) + finest(x + 1, y + 1)) / 4.0;
        assert!((value - mean).abs() < 1e-4);
    }
    // Iteration i multiplies by 2^i on top of the mean: 1 x 2 x 4 x 8 at level 4.
    let total: f32 = (0..256).map(|i| finest(i % 16, i / 16)).sum();
    let last: Vec<f32> = run(&plan, "level 4");
    assert!((last[0] / (total / 256.0 * 64.0) - 1.0).abs() < 1e-5);
}

#[test]
fn unsigned_textures_and_buffer_copies_keep_every_bit() {
    let plan = uint_plan();
    let words: Vec<u32> = run(&plan, "words");
    assert!(words.iter().zip(0_u32..).all(|(&w, i)| w == i.wrapping_mul(2_654_435_761)));
    assert_eq!(run::<u32>(&plan, "image"), words);
    let copy: Vec<u32> = run(&plan, "copy");
    assert_eq!(copy[..2], [0, 0]);
    assert_eq!(copy[2..40], words[19..57]);
    assert!(copy[40..].iter().all(|&w| w == 0));
}

#[test]
fn layers_and_levels_are_loaded_and_sampled() {
    // Layer by layer 16 + 4 texels of 4 channels; channel c of texel t of layer l starts as (80 l + 4 t + c) / 2.
    let level_0: Vec<[f32; 4]> = run(&layers_plan(2, 0), "output");
    assert_eq!(level_0[5], [90.0, 90.5, 91.0, 91.5]);
    let level_1: Vec<[f32; 4]> = run(&layers_plan(1, 1), "output");
    assert_eq!(level_1[5][0], (80 + 16 * 4 + 3 * 4) as f32 / 2.0);
    assert_eq!(level_1[3], [0.0; 4], "outside of the level");
    // u = 0.25, v = -0.125 of a 4 x 4 texture: halfway between texels 0 and 1 of the first row.
    assert_eq!(level_0[17], [1.0, 1.5, 2.0, 2.5]);
}

#[test]
fn clear_buffer_clears_plain_buffers() {
    let mut plan = scale_plan();
    plan.steps.push(Step::ClearBuffer { buffer: plan.resource("output").unwrap() });
    assert!(run::<u32>(&plan, "output").iter().all(|&w| w == 0));
}

#[test]
fn draw_indirect_draws_what_the_buffer_says() {
    let square = [corner(-1.0, -1.0, 0.5), corner(1.0, -1.0, 0.5), corner(1.0, 1.0, 0.5)];
    let corners = [square, [corner(1.0, 1.0, 0.5), corner(-1.0, 1.0, 0.5), corner(-1.0, -1.0, 0.5)]].concat();
    let mut plan = visibility_plan([4, 4], &corners, 1);
    let arguments = plan.add_resource(Resource::buffer_with("counts", &[3_u32, 1, 3, 2]));
    let Step::Draw { pass, targets, .. } = plan.steps[0].clone() else { unreachable!() };
    plan.steps[0] = Step::DrawIndirect { pass, targets, arguments, offset_bytes: 0 };
    let ids: Vec<u32> = run(&plan, "ids");
    // Second triangle, third instance (shifted by half the width and a quarter of the height).
    assert_eq!(ids.iter().filter(|&&id| id == 2002).count(), ids.iter().filter(|&&id| id != 0).count());
    assert_eq!(ids[2], 2002);
    assert_eq!(ids[12], 0);
}

#[test]
fn load_keep_keeps_and_clear_clears() {
    let half = [corner(-1.0, -1.0, 0.5), corner(0.0, -1.0, 0.5), corner(0.0, 1.0, 0.5)];
    let mut plan = color_plan("glow", TextureFormat::Rgba16Float, [8, 8], &half);
    let Step::Draw { mut targets, pass, vertices, instances } = plan.steps[0].clone() else { unreachable!() };
    targets.color[0].load = Load::Keep;
    plan.steps.push(Step::Draw { targets, pass, vertices, instances });
    let picture: Vec<[u16; 4]> = run(&plan, "picture");
    let values: Vec<f32> = picture.iter().map(|t| half::f16::from_bits(t[0]).to_f32()).collect();
    assert!(values.contains(&2.0) && values.contains(&0.0) && !values.contains(&1.0), "{values:?}");
}

#[test]
fn imports_are_handed_over_by_name() {
    let mut plan = scale_plan();
    plan.resources[0].initial = None;
    plan.resources[0].lifetime = Lifetime::Imported;
    let mut executor = executor();
    let missing = executor.prepare(&plan).unwrap_err();
    assert!(missing.to_string().contains("\"input\" was not handed over"), "{missing}");
    executor.import("input", vec![0; 8]).unwrap();
    let short = executor.prepare(&plan).unwrap_err();
    assert!(short.to_string().contains("8 bytes, the plan wants 4000"), "{short}");
    executor.import("input", bytemuck::cast_slice(&[2_u32; 1000]).to_vec()).unwrap();
    executor.prepare(&plan).unwrap();
    executor.execute().unwrap();
    assert_eq!(read::<u32>(&mut executor, &plan, "output")[9], 13);
    executor.import("input", bytemuck::cast_slice(&[4_u32; 1000]).to_vec()).unwrap();
    executor.execute().unwrap();
    assert_eq!(read::<u32>(&mut executor, &plan, "output")[9], 19);
}

#[test]
fn calls_that_do_not_fit_are_refused_and_change_nothing() {
    let mut executor = executor();
    assert!(matches!(executor.execute(), Err(ExecuteError::Usage(_))));
    let mut plan = scale_plan();
    let hidden = plan.add_resource(Resource::buffer("hidden", 16));
    executor.prepare(&plan).unwrap();
    let (params, input) = (plan.params_id("scale").unwrap(), plan.resource("input").unwrap());
    let refused = |result: Result<(), ExecuteError>, words: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refused(executor.set_params(params, &[0; 8]), "16 bytes, got 8");
    refused(executor.set_params(ParamsId(7), &[0; 16]), "params 7 of 1");
    refused(executor.write_buffer(input, 3996, &[0; 8]), "8 bytes at 3996 of \"input\", which has 4000");
    refused(executor.write_buffer(input, u64::MAX - 3, &[0; 8]), "which has 4000");
    refused(executor.write_buffer(input, 2, &[0; 4]), "multiples of 4");
    refused(executor.write_buffer(ResourceId(9), 0, &[0; 4]), "resource 9 of 3");
    refused(executor.read(hidden).map(drop), "\"hidden\" is not readable");
    executor.execute().unwrap();
    assert_eq!(read::<u32>(&mut executor, &plan, "output")[999], 3004);
}

#[test]
fn step_times_name_the_top_level_steps() {
    let plan = mips_plan();
    let mut executor = executor();
    assert!(executor.step_times().is_empty());
    executor.prepare(&plan).unwrap();
    executor.execute().unwrap();
    let times = executor.step_times();
    assert_eq!(
        times.iter().map(|t| &*t.name).collect::<Vec<_>>()[..2],
        ["pyramid", "copy pyramid to level 1"]
    );
    assert!(times[0].milliseconds > 0.0);
}

#[test]
fn plans_survive_serialisation() {
    for plan in [scale_plan(), indirect_plan(), mips_plan(), visibility_plan([8, 8], &fan(), 2)] {
        let json = serde_json::to_string(&plan).unwrap();
        assert_eq!(serde_json::from_str::<Plan>(&json).unwrap(), plan);
    }
}
