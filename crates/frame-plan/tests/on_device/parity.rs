//! The same plans on the CPU and on a device. Executors include this beside their `device`, which makes them.

use frame_plan::cpu::CpuExecutor;
use frame_plan::{Executor, Plan, TextureFormat};

use crate::device::{self, executor, floats, halves, run, words};
use crate::passes::*;

const SIZE: [u32; 2] = [61, 47];

/// Run a plan on both; none if there is no device and skipping is allowed.
fn both(plan: &Plan, name: &str) -> Option<(Vec<u8>, Vec<u8>)> {
    let mut gpu = executor(PASSES)?;
    let mut cpu = CpuExecutor::new(PASSES, Some(2)).unwrap();
    let (cpu, gpu) = (run(&mut cpu, plan, name), run(&mut gpu, plan, name));
    assert!(cpu.iter().any(|&b| b != cpu[0]), "something to compare");
    Some((cpu, gpu))
}

/// Texels whose neighbours all show the same value on the CPU: rasterisers agree there.
fn inner(ids: &[u32]) -> Vec<bool> {
    let [width, height] = SIZE.map(|s| s as usize);
    (0..ids.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            rows.flat_map(|v| (x.saturating_sub(1)..(x + 2).min(width)).map(move |u| v * width + u))
                .all(|j| ids[j] == ids[i])
        })
        .collect()
}

/// Largest difference where `counts` holds.
fn largest(a: &[f32], b: &[f32], counts: impl Fn(usize) -> bool) -> f32 {
    assert_eq!(a.len(), b.len());
    (0..a.len()).filter(|&i| counts(i)).map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max)
}

/// Whether two interpolated images are equal but for the snapping of vertices, where `counts` holds for a texel.
///
/// Vulkan lets rasterisers snap vertices to 1/16 texel (`subPixelPrecisionBits` is at least 4) and interpolate between the
/// snapped ones, so that an image moves by up to 1/32 texel in x and in y; perspective takes up to twice that.
fn equal_but_for_snapping(a: &[f32], b: &[f32], channels: usize, rounding: f32, counts: &[bool]) -> bool {
    assert_eq!(a.len(), b.len());
    let [width, height] = SIZE.map(|s| s as usize);
    let mut compared = 0;
    for (x, y) in (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))) {
        if !counts[y * width + x] {
            continue;
        }
        compared += 1;
        for channel in 0..channels {
            let at = |x: usize, y: usize| (y * width + x) * channels + channel;
            let slope = (a[at(x + 1, y)] - a[at(x - 1, y)]).abs() + (a[at(x, y + 1)] - a[at(x, y - 1)]).abs();
            if (a[at(x, y)] - b[at(x, y)]).abs() > slope / 2.0 / 16.0 + rounding {
                return false;
            }
        }
    }
    assert!(compared * 4 > counts.len(), "{compared} texels are compared");
    true
}

/// `image` moved by one texel to the right.
fn moved(image: &[f32], channels: usize) -> Vec<f32> {
    [&image[..channels], &image[..image.len() - channels]].concat()
}

#[test]
fn integers_are_equal_bit_for_bit() {
    let cases: [(Plan, &[&str]); 3] = [
        (scale_plan(), &["output"]),
        (indirect_plan(), &["bins", "arguments", "state"]),
        (uint_plan(), &["image", "words", "copy"]),
    ];
    for (plan, names) in cases {
        for name in names {
            let Some((cpu, gpu)) = both(&plan, name) else { return };
            assert_eq!(words(&cpu), words(&gpu), "{} {name}", plan.name);
        }
    }
}

#[test]
fn mip_levels_with_params_per_iteration_are_equal() {
    for name in ["level 1", "level 2", "pyramid"] {
        let Some((cpu, gpu)) = both(&mips_plan(), name) else { return };
        assert_eq!(floats(&cpu), floats(&gpu), "{name}");
    }
}

#[test]
fn layers_and_levels_are_equal_and_sampled_alike() {
    for (layer, level) in [(0, 0), (2, 0), (1, 1)] {
        let Some((cpu, gpu)) = both(&layers_plan(layer, level), "output") else { return };
        let (cpu, gpu) = (floats(&cpu), floats(&gpu));
        assert_eq!(cpu[..64], gpu[..64], "loads");
        // Samplers weigh in steps of 1/256 of the difference between texels, at most 8 here in u and v each.
        assert!(largest(&cpu, &gpu, |i| i >= 64) <= 2.0 * 8.0 / 256.0);
    }
}

#[test]
fn visibility_is_equal_away_from_edges() {
    let plan = visibility_plan(SIZE, &fan(), 3);
    let Some((cpu, gpu)) = both(&plan, "ids") else { return };
    let (cpu, gpu) = (words(&cpu), words(&gpu));
    let inner = inner(&cpu);
    let compared = inner.iter().filter(|&&i| i).count();
    assert!(compared > cpu.len() / 3, "{compared} of {} texels are away from edges", cpu.len());
    assert!((0..cpu.len()).all(|i| !inner[i] || cpu[i] == gpu[i]));
    let differ = (0..cpu.len()).filter(|&i| cpu[i] != gpu[i]).count();
    assert!(differ * 100 <= cpu.len(), "{differ} texels differ at edges");

    let (cpu_depth, gpu_depth) = both(&plan, "depths").unwrap();
    let (cpu_depth, gpu_depth) = (floats(&cpu_depth), floats(&gpu_depth));
    assert!(equal_but_for_snapping(&cpu_depth, &gpu_depth, 1, 1e-6, &inner));
    assert!(!equal_but_for_snapping(&cpu_depth, &moved(&gpu_depth, 1), 1, 1e-6, &inner), "negative control");
    let (cpu_texture, gpu_texture) = both(&plan, "depth").unwrap();
    assert_eq!(floats(&cpu_texture), cpu_depth);
    assert_eq!(floats(&gpu_texture), gpu_depth);
}

/// Negative control: the comparison above sees another mesh.
#[test]
fn visibility_of_another_mesh_differs() {
    let mut other = fan();
    other.swap(7, 8);
    let Some((cpu, _)) = both(&visibility_plan(SIZE, &fan(), 3), "ids") else { return };
    let (_, gpu) = both(&visibility_plan(SIZE, &other, 3), "ids").unwrap();
    let (cpu, gpu) = (words(&cpu), words(&gpu));
    let inner = inner(&cpu);
    assert!((0..cpu.len()).any(|i| inner[i] && cpu[i] != gpu[i]));
}

#[test]
fn varyings_fragments_and_facing_are_alike() {
    let mut corners = fan();
    corners.swap(1, 2);
    let Some((cpu, gpu)) = both(&color_plan("shaded", TextureFormat::Rgba32Float, SIZE, &corners), "picture")
    else {
        return;
    };
    let (cpu, gpu) = (floats(&cpu), floats(&gpu));
    // A triangle's facing is its last channel; texels where neighbours face alike and lie in the same triangle change slowly.
    let facing: Vec<u32> = cpu.chunks_exact(4).map(|t| t[3].to_bits()).collect();
    assert!(facing.contains(&1.0_f32.to_bits()) && facing.contains(&(-1.0_f32).to_bits()));
    let ids = words(&both(&visibility_with_all(&corners), "ids").unwrap().0);
    let inner = inner(&ids);
    assert!(equal_but_for_snapping(&cpu, &gpu, 4, 2e-5, &inner));
    assert!(!equal_but_for_snapping(&cpu, &moved(&gpu, 4), 4, 2e-5, &inner), "negative control");
}

/// Which triangle of the last drawn ones covers each texel: depth decides as little as in `shaded`, all lie at one depth.
fn visibility_with_all(corners: &[[f32; 4]]) -> Plan {
    let count = corners.len() as f32;
    let ordered: Vec<_> = corners
        .chunks_exact(3)
        .enumerate()
        .flat_map(|(i, triangle)| {
            // Later triangles are nearer; back faces are turned round, as culling would drop them.
            let depth = 0.9 - 0.8 * i as f32 / count;
            let [a, b, c] = [0, 1, 2].map(|k| {
                let [x, y, _, w] = triangle[k];
                [x, y, depth * w, w]
            });
            if i == 0 { [a, c, b] } else { [a, b, c] }
        })
        .collect();
    visibility_plan(SIZE, &ordered, 1)
}

#[test]
fn additive_draws_add() {
    let plan = color_plan("glow", TextureFormat::Rgba16Float, SIZE, &fan());
    let Some((cpu, gpu)) = both(&plan, "picture") else { return };
    let (cpu, gpu) = (halves(&cpu), halves(&gpu));
    assert!(cpu.contains(&2.0), "triangles overlap");
    let red: Vec<u32> = cpu.chunks_exact(4).map(|t| t[0].to_bits()).collect();
    let inner = inner(&red);
    assert_eq!(largest(&cpu, &gpu, |i| inner[i / 4]), 0.0);
}

#[test]
fn indirect_draws_take_their_counts_from_the_buffer() {
    let mut plan = visibility_plan(SIZE, &fan(), 1);
    let counts = frame_plan::Resource::buffer_with("counts", &[0_u32, 15, 2, 6, 0]);
    let arguments = plan.add_resource(counts);
    let frame_plan::Step::Draw { pass, targets, .. } = plan.steps[0].clone() else { unreachable!() };
    plan.steps[0] = frame_plan::Step::DrawIndirect { pass, targets, arguments, offset_bytes: 4 };
    let Some((cpu, gpu)) = both(&plan, "ids") else { return };
    let (cpu, gpu) = (words(&cpu), words(&gpu));
    assert!(cpu.iter().any(|&id| id > 1000) && !cpu.contains(&1), "second instance, no first triangle");
    let inner = inner(&cpu);
    assert!((0..cpu.len()).all(|i| !inner[i] || cpu[i] == gpu[i]));
}

#[test]
fn params_and_buffers_change_between_frames() {
    let plan = scale_plan();
    let Some(mut gpu) = executor(PASSES) else { return };
    gpu.prepare(&plan).unwrap();
    gpu.execute().unwrap();
    let params = Scale { factor: 5, offset: 1, count: 2, padding: 0 };
    gpu.set_params(plan.params_id("scale").unwrap(), bytemuck::bytes_of(&params)).unwrap();
    gpu.write_buffer(plan.resource("input").unwrap(), 4, bytemuck::bytes_of(&100_u32)).unwrap();
    gpu.execute().unwrap();
    assert_eq!(words(&device::read(&mut gpu, &plan, "output"))[..3], [1, 501, 13]);
}
