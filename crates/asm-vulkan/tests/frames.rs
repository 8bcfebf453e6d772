//! Frame after frame: the same bits, nothing new allocated, times per step; and inside a host application.

#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(unsafe_code, reason = "a host hands its own objects over")]

mod device;
mod host;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use asm_vulkan::ash::vk;
use asm_vulkan::{HostImage, VulkanExecutor};
use device::{compiled, executor, read, words};
use frame_plan::{ExecuteError, Executor, Lifetime, Plan, Resource, Step, TextureFormat};
use host::Host;
use passes::*;

const SIZE: [u32; 2] = [61, 47];

#[test]
fn two_runs_give_the_same_bits() {
    let plans = [mips_plan(), layers_plan(0, 0), visibility_plan(SIZE, &fan(), 3), indirect_plan()];
    for plan in &plans {
        let Some(mut first) = executor(PASSES) else { return };
        let mut second = executor(PASSES).unwrap();
        let frame = |gpu: &mut VulkanExecutor, lifetime: Lifetime| -> Vec<Vec<u8>> {
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
    assert_eq!(gpu.pipeline_count(), 3);
    gpu.prepare(&scale_plan()).unwrap();
    gpu.prepare(&indirect_plan()).unwrap();
    assert_eq!(gpu.pipeline_count(), 4);
}

fn names(gpu: &mut VulkanExecutor) -> Vec<String> {
    gpu.step_times().into_iter().map(|t| t.name).collect()
}

#[test]
fn step_times_cover_the_steps() {
    let Some(mut gpu) = executor(PASSES) else { return };
    assert!(gpu.step_times().is_empty());
    let plan = indirect_plan();
    gpu.prepare(&plan).unwrap();
    assert!(gpu.step_times().is_empty(), "no frame yet");
    for _ in 0..10 {
        gpu.execute().unwrap();
        assert_eq!(names(&mut gpu), ["clear bins", "histogram", "plan_groups", "increment"]);
    }
}

/// Software devices put timestamps off after a draw: the time of a step must not go to its neighbour.
#[test]
fn times_belong_to_their_steps() {
    let Some(mut gpu) = executor(PASSES) else { return };
    // A step of 65,535 workgroups between steps of one.
    let mut plan = visibility_plan(SIZE, &fan(), 1);
    let state = plan.add_resource(Resource::buffer("state", 16 << 20).with_lifetime(Lifetime::Persistent));
    for (label, groups) in [("light", 1), ("heavy", 65_535), ("light", 1)] {
        let mut pass = pass("increment", None, &[state.into()]);
        pass.label = label.into();
        plan.steps.push(Step::Dispatch { pass, groups: [groups, 1, 1] });
    }
    gpu.prepare(&plan).unwrap();
    for _ in 0..3 {
        gpu.execute().unwrap();
        read(&mut gpu, &plan, "ids");
        let times = gpu.step_times();
        let longest = times.iter().max_by(|a, b| a.milliseconds.total_cmp(&b.milliseconds)).unwrap();
        assert_eq!(longest.name, "increment (heavy)", "{times:?}");
    }
}

#[test]
fn a_hundred_frames_make_no_objects() {
    for plan in [indirect_plan(), mips_plan(), visibility_plan(SIZE, &fan(), 3)] {
        let Some(mut gpu) = executor(PASSES) else { return };
        gpu.prepare(&plan).unwrap();
        let frame = |gpu: &mut VulkanExecutor, i: u32| {
            if let Some(params) = plan.params.first() {
                // Other bytes each time, so that they have to go over.
                let mut bytes = params.bytes.clone();
                bytes[0] ^= i as u8;
                gpu.set_params(plan.params_id(&params.name).unwrap(), &bytes).unwrap();
            }
            gpu.execute().unwrap();
            gpu.step_times();
        };
        // Every place in the ring takes its upload buffer with its first frame.
        (0..3).for_each(|i| frame(&mut gpu, i));
        let before = gpu.live_objects();
        (0..100).for_each(|i| frame(&mut gpu, i));
        assert_eq!(gpu.live_objects(), before);
        assert!(before.iter().all(|(_, count)| *count < 100), "{before:?}");

        // Negative control: the report sees what a first read-back keeps.
        let readable = plan.resources.iter().find(|r| r.readable).unwrap();
        read(&mut gpu, &plan, &readable.name);
        assert_ne!(gpu.live_objects(), before);
    }
}

/// Plans of other sizes, one after the other: what the last one held is all there is.
#[test]
fn changing_plans_leaks_nothing() {
    let Some(host) = Host::new(true) else { return };
    let mut gpu = host.executor(compiled(PASSES));
    let plans = |size: u32| [visibility_plan([size, size], &fan(), 2), mips_plan(), indirect_plan()];
    let mut counts = Vec::new();
    for size in [64, 16, 128, 31] {
        for plan in plans(size) {
            gpu.prepare(&plan).unwrap();
            gpu.execute().unwrap();
        }
        counts.push(gpu.live_objects());
    }
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    assert!(counts[0].iter().any(|(_, count)| *count > 0));
    // When the host destroys its device, validation finds what the executor might have left.
    drop(gpu);
}

/// The visibility plan with its integer target owned by the host.
fn hosted_plan() -> Plan {
    let mut plan = visibility_plan(SIZE, &fan(), 3);
    let ids = plan.resource("ids").unwrap();
    plan.resources[ids.0 as usize] =
        Resource::texture("ids", TextureFormat::R32Uint, SIZE).with_lifetime(Lifetime::Imported);
    plan
}

const TARGET: vk::ImageUsageFlags = vk::ImageUsageFlags::COLOR_ATTACHMENT;

fn target(host: &Host) -> HostImage {
    host.image(vk::Format::R32_UINT, SIZE, TARGET | vk::ImageUsageFlags::TRANSFER_SRC)
}

fn import(gpu: &mut VulkanExecutor, name: &str, image: HostImage) -> Result<(), ExecuteError> {
    // SAFETY: the host's images live as long as the host, which waits for its frames.
    unsafe { gpu.import_image(name, image) }
}

/// Read a host's image by a plan that imports it and does nothing.
fn pixels(host: &Host, image: HostImage) -> Vec<u32> {
    let mut plan = Plan { name: "read".into(), ..Plan::default() };
    let resource = Resource::texture("image", TextureFormat::R32Uint, SIZE).readable();
    plan.add_resource(resource.with_lifetime(Lifetime::Imported));
    let mut reader = host.executor(compiled(PASSES));
    import(&mut reader, "image", image).unwrap();
    reader.prepare(&plan).unwrap();
    words(&read(&mut reader, &plan, "image"))
}

#[test]
fn frames_are_recorded_into_a_hosts_commands_and_image() {
    // Devices that do not keep accesses inside buffers take the other variant of the shaders.
    for robust in [true, false] {
        let Some(host) = Host::new(robust) else { return };
        let reference =
            words(&device::run(&mut executor(PASSES).unwrap(), &visibility_plan(SIZE, &fan(), 3), "ids"));
        let (first, second) = (target(&host), target(&host));
        let mut gpu = host.executor(compiled(PASSES));
        import(&mut gpu, "ids", first).unwrap();
        gpu.prepare(&hosted_plan()).unwrap();
        let frame = |gpu: &mut VulkanExecutor| {
            // SAFETY: the host submits the commands at once and waits for them.
            host.frame(|commands| unsafe { gpu.record(commands) }.unwrap());
        };
        frame(&mut gpu);
        assert_eq!(pixels(&host, first), reference);
        let untouched = pixels(&host, second);

        // The next frame goes into another image, as with a swap chain, and makes nothing new.
        let before = gpu.live_objects();
        import(&mut gpu, "ids", second).unwrap();
        frame(&mut gpu);
        assert_eq!(gpu.live_objects(), before);
        assert_eq!(pixels(&host, second), reference);
        assert_ne!(untouched, reference);

        // Without a view of the host's the executor makes its own, and lets go of the old ones.
        for i in 0..6 {
            import(&mut gpu, "ids", HostImage { view: None, ..if i % 2 == 0 { first } else { second } })
                .unwrap();
            frame(&mut gpu);
        }
        let own_views = gpu.live_objects();
        import(&mut gpu, "ids", HostImage { view: None, ..first }).unwrap();
        frame(&mut gpu);
        assert_eq!(gpu.live_objects(), own_views);
        assert_eq!(pixels(&host, first), reference);
    }
}

#[test]
fn a_host_buffer_is_read_and_one_of_the_plan_is_lent() {
    let Some(host) = Host::new(true) else { return };
    let mut plan = scale_plan();
    plan.resources[0].initial = None;
    plan.resources[0].lifetime = Lifetime::Imported;
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
    let input = host.buffer(&[2; 1000], usage);
    let mut gpu = host.executor(compiled(PASSES));
    // SAFETY: the host's buffers live as long as the host.
    unsafe { gpu.import_buffer("input", input) }.unwrap();
    assert_eq!(words(&device::run(&mut gpu, &plan, "output"))[999], 13);
    assert!(gpu.buffer(plan.resource("output").unwrap()).is_some());
    assert!(gpu.image(plan.resource("output").unwrap()).is_none());

    // Another buffer, written to before the next frame.
    let other = host.buffer(&[10; 1000], usage);
    // SAFETY: as above.
    unsafe { gpu.import_buffer("input", other) }.unwrap();
    gpu.write_buffer(plan.resource("input").unwrap(), 4, bytemuck::bytes_of(&20_u32)).unwrap();
    gpu.execute().unwrap();
    assert_eq!(words(&read(&mut gpu, &plan, "output"))[..3], [37, 67, 37]);
}

#[test]
fn imports_that_do_not_fit_are_refused() {
    let Some(host) = Host::new(true) else { return };
    let mut gpu = host.executor(compiled(PASSES));
    let refused = |result: Result<(), ExecuteError>, text: &str| {
        let error = result.unwrap_err();
        assert!(matches!(error, ExecuteError::Usage(_)), "{error}");
        assert!(error.to_string().contains(text), "{error}");
    };
    refused(gpu.prepare(&hosted_plan()), "\"ids\" was not handed over");
    let sampled = vk::ImageUsageFlags::SAMPLED;
    for (format, size, usage, text) in [
        (vk::Format::R32_SFLOAT, SIZE, TARGET, "is R32_SFLOAT, the plan wants R32_UINT"),
        (vk::Format::R32_UINT, [61, 48], TARGET, "is 61 x 48, the plan wants 61 x 47"),
        (vk::Format::R32_UINT, SIZE, sampled, "lacks the usages COLOR_ATTACHMENT"),
    ] {
        import(&mut gpu, "ids", host.image(format, size, usage)).unwrap();
        refused(gpu.prepare(&hosted_plan()), text);
    }
    let good = target(&host);
    let lost = HostImage { layout_after: vk::ImageLayout::UNDEFINED, ..good };
    import(&mut gpu, "ids", lost).unwrap();
    refused(gpu.prepare(&hosted_plan()), "left in the undefined layout");
    import(&mut gpu, "ids", good).unwrap();
    gpu.prepare(&hosted_plan()).unwrap();
    let bad = host.image(vk::Format::R32_SFLOAT, SIZE, TARGET);
    refused(import(&mut gpu, "ids", bad), "is R32_SFLOAT");

    let mut read_back = hosted_plan();
    read_back.resources[1].readable = true;
    let unreadable = host.image(vk::Format::R32_UINT, SIZE, TARGET);
    import(&mut gpu, "ids", unreadable).unwrap();
    refused(gpu.prepare(&read_back), "lacks the usages TRANSFER_SRC");
}

#[test]
fn empty_dispatches_and_plans_run() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let mut plan = scale_plan();
    let Step::Dispatch { groups, .. } = &mut plan.steps[0] else { unreachable!() };
    *groups = [0, 1, 1];
    assert!(words(&device::run(&mut gpu, &plan, "output")).iter().all(|&w| w == 0));
    plan.steps.clear();
    assert!(words(&device::run(&mut gpu, &plan, "output")).iter().all(|&w| w == 0));
}
