//! Frame after frame: the same bits, nothing new made, times per step. Executors include this beside their `device`, which makes
//! them.

use frame_plan::{
    ExecuteError, Executor, Lifetime, Plan, Resource, ResourceId, ResourceKind, Step, TextureFormat,
};

use crate::device::{Timed, executor, read, run, timed, words};
use crate::passes::*;

pub(crate) const SIZE: [u32; 2] = [61, 47];

#[test]
fn two_runs_give_the_same_bits() {
    let plans = [mips_plan(), layers_plan(0, 0), visibility_plan(SIZE, &fan(), 3), indirect_plan()];
    for plan in &plans {
        let Some(mut first) = executor(PASSES) else { return };
        let mut second = executor(PASSES).unwrap();
        let frame = |gpu: &mut dyn Executor, lifetime: Lifetime| -> Vec<Vec<u8>> {
            gpu.execute().unwrap();
            let readable = plan.resources.iter().filter(|r| r.readable && r.lifetime == lifetime);
            readable.map(|r| read(gpu, plan, &r.name)).collect()
        };
        first.prepare(plan).unwrap();
        second.prepare(plan).unwrap();
        let once = frame(&mut first, Lifetime::Transient);
        assert!(!once.is_empty());
        assert!(once == frame(&mut second, Lifetime::Transient), "another executor, {}", plan.name);
        assert!(once == frame(&mut first, Lifetime::Transient), "another frame, {}", plan.name);
        assert!(frame(&mut first, Lifetime::Persistent).iter().all(|bytes| bytes.iter().any(|&b| b > 0)));
    }
}

#[test]
fn persistent_buffers_keep_their_contents() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let plan = indirect_plan();
    gpu.prepare(&plan).unwrap();
    for frame in 1..=3 {
        gpu.execute().unwrap();
        assert_eq!(words(&read(&mut gpu, &plan, "state"))[0], frame);
        assert_eq!(words(&read(&mut gpu, &plan, "bins")).iter().sum::<u32>(), 5000);
    }
    gpu.prepare(&plan).unwrap();
    gpu.execute().unwrap();
    assert_eq!(words(&read(&mut gpu, &plan, "state"))[0], 1, "a new plan starts anew");
}

/// More frames than may be unfinished, with no read-back between them.
#[test]
fn frames_follow_each_other_without_being_read() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let plan = indirect_plan();
    gpu.prepare(&plan).unwrap();
    (0..20).for_each(|_| gpu.execute().unwrap());
    assert_eq!(words(&read(&mut gpu, &plan, "state"))[0], 20);
}

/// Each frame sees what was written before it, and not what was written after it, with several unfinished.
#[test]
fn writes_between_frames_belong_to_their_frame() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let mut plan = scale_plan();
    // The outputs of all frames one after the other: each frame copies its first word behind the last one's.
    let log = plan.add_resource(Resource::buffer("log", 400).readable().with_lifetime(Lifetime::Persistent));
    let held = plan.add_resource(Resource::buffer("held", 400).with_lifetime(Lifetime::Persistent));
    let output = plan.resource("output").unwrap();
    let copy = |source, source_offset_bytes, target, target_offset_bytes, size_bytes| Step::CopyBuffer {
        source,
        source_offset_bytes,
        target,
        target_offset_bytes,
        size_bytes,
    };
    plan.steps.push(copy(log, 0, held, 4, 396));
    plan.steps.push(copy(output, 0, held, 0, 4));
    plan.steps.push(copy(held, 0, log, 0, 400));
    gpu.prepare(&plan).unwrap();
    for frame in 0..50_u32 {
        let params = Scale { factor: 1, offset: frame, count: 1, padding: 0 };
        gpu.set_params(plan.params_id("scale").unwrap(), bytemuck::bytes_of(&params)).unwrap();
        let first = 1000 * frame;
        gpu.write_buffer(plan.resource("input").unwrap(), 0, bytemuck::bytes_of(&first)).unwrap();
        gpu.execute().unwrap();
    }
    let log = words(&read(&mut gpu, &plan, "log"));
    let expected: Vec<u32> = (0..50).rev().map(|frame| 1001 * frame).collect();
    assert_eq!(log[..50], expected);
}

/// Statistics that come a frame late, with nobody waiting for them.
#[test]
fn watched_resources_follow_the_frames() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let mut plan = visibility_plan(SIZE, &fan(), 2);
    let state =
        plan.add_resource(Resource::buffer("state", 4096).readable().with_lifetime(Lifetime::Persistent));
    plan.steps.push(dispatch("increment", None, &[state.into()], 16));
    let ids = plan.resource("ids").unwrap();
    gpu.prepare(&plan).unwrap();
    let hidden = plan.resource("positions").unwrap();
    assert!(matches!(gpu.watch(&[hidden]), Err(ExecuteError::Usage(_))));
    gpu.watch(&[state, ids]).unwrap();
    assert_eq!(gpu.latest(state), None, "no frame yet");
    let mut last = 0;
    for frame in 1..=20 {
        gpu.execute().unwrap();
        let seen = gpu.latest(state).map_or(0, |bytes| words(bytes)[0]);
        assert!(last <= seen && seen <= frame, "after {last}, {seen} in frame {frame}");
        // At most all frames but those that may be unfinished are behind.
        assert!(seen + 3 >= frame, "{seen} in frame {frame}");
        last = seen;
    }
    let read = read(&mut gpu, &plan, "ids");
    assert_eq!(words(gpu.latest(state).unwrap()), [20; 1024], "reading has waited");
    assert_eq!(gpu.latest(ids).unwrap(), read);
    assert_eq!(gpu.latest(hidden), None);
    gpu.prepare(&plan).unwrap();
    assert_eq!(gpu.latest(state), None, "a new plan is not watched");
}

#[test]
fn pipelines_are_made_once_per_pass() {
    let Some(mut gpu) = executor(PASSES) else { return };
    gpu.prepare(&indirect_plan()).unwrap();
    assert_eq!(gpu.made().pipelines, 3);
    gpu.prepare(&scale_plan()).unwrap();
    gpu.prepare(&indirect_plan()).unwrap();
    assert_eq!(gpu.made().pipelines, 4);
}

fn names(gpu: &mut dyn Executor) -> Vec<String> {
    gpu.step_times().into_iter().map(|t| t.name).collect()
}

#[test]
fn step_times_cover_the_steps() {
    let Some(mut gpu) = executor(PASSES) else { return };
    assert!(gpu.step_times().is_empty());
    let plan = indirect_plan();
    gpu.prepare(&plan).unwrap();
    assert!(gpu.step_times().is_empty(), "no frame yet");
    let expected: &[&str] = match timed(&gpu) {
        Timed::Steps => &["clear bins", "histogram", "plan_groups", "increment"],
        Timed::Passes => &["histogram", "plan_groups", "increment"],
        Timed::Nothing => &[],
    };
    for _ in 0..10 {
        gpu.execute().unwrap();
        assert_eq!(names(&mut gpu), expected);
    }
}

#[test]
fn a_hundred_frames_make_nothing() {
    for plan in [indirect_plan(), mips_plan(), visibility_plan(SIZE, &fan(), 3)] {
        let Some(mut gpu) = executor(PASSES) else { return };
        gpu.prepare(&plan).unwrap();
        let ids = (0..).map(ResourceId).zip(&plan.resources);
        let (readable, _) = ids.clone().find(|(_, r)| r.readable).unwrap();
        gpu.watch(&[readable]).unwrap();
        let frame = |gpu: &mut dyn Executor, i: u32| {
            if let Some(params) = plan.params.first() {
                // Other bytes each time, so that they have to go over.
                let mut bytes = params.bytes.clone();
                bytes[0] ^= i as u8;
                gpu.set_params(plan.params_id(&params.name).unwrap(), &bytes).unwrap();
            }
            for (id, resource) in ids.clone() {
                if let (ResourceKind::Buffer { .. }, Some(bytes)) = (&resource.kind, &resource.initial) {
                    gpu.write_buffer(id, 0, bytes).unwrap();
                }
            }
            gpu.execute().unwrap();
            gpu.latest(readable);
            gpu.step_times();
        };
        (0..2).for_each(|i| frame(&mut gpu, i));
        let before = gpu.made();
        (0..100).for_each(|i| frame(&mut gpu, i));
        assert_eq!(gpu.made(), before, "{}", plan.name);
        assert!(before.buffers > 0 && before.bytes > 0 && before.buffers < 100, "{before:?}");

        // Negative control: the counts see what a new plan makes.
        gpu.prepare(&plan).unwrap();
        assert!(gpu.made().buffers > before.buffers && gpu.made().bytes > before.bytes);
    }
}

#[test]
fn empty_dispatches_and_plans_run() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let mut plan = scale_plan();
    let Step::Dispatch { groups, .. } = &mut plan.steps[0] else { unreachable!() };
    *groups = [0, 1, 1];
    assert!(words(&run(&mut gpu, &plan, "output")).iter().all(|&w| w == 0));
    plan.steps.clear();
    assert!(words(&run(&mut gpu, &plan, "output")).iter().all(|&w| w == 0));
}

/// Plans of other sizes, one after the other: what the last one held is all there is.
pub(crate) fn changing_plans_leaks_nothing<E: Executor>(
    gpu: &mut E,
    live_objects: impl Fn(&E) -> Vec<(&'static str, usize)>,
) {
    let plans = |size: u32| [visibility_plan([size, size], &fan(), 2), mips_plan(), indirect_plan()];
    let mut counts = Vec::new();
    for size in [64, 16, 128, 31] {
        for plan in plans(size) {
            gpu.prepare(&plan).unwrap();
            gpu.execute().unwrap();
        }
        counts.push(live_objects(gpu));
    }
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    assert!(counts[0].iter().any(|(_, count)| *count > 0));
}

/// The visibility plan with its integer target owned by the host.
pub(crate) fn hosted_plan() -> Plan {
    let mut plan = visibility_plan(SIZE, &fan(), 3);
    let ids = plan.resource("ids").unwrap();
    plan.resources[ids.0 as usize] =
        Resource::texture("ids", TextureFormat::R32Uint, SIZE).with_lifetime(Lifetime::Imported);
    plan
}

/// A call that does not fit, and says this.
pub(crate) fn refused(result: Result<(), ExecuteError>, text: &str) {
    let error = result.unwrap_err();
    assert!(matches!(error, ExecuteError::Usage(_)), "{error}");
    assert!(error.to_string().contains(text), "{error}");
}
