//! Frame after frame: the same bits, nothing new allocated, times per step; and inside a host application.

#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(unsafe_code, reason = "a host hands its own objects over")]

mod device;
#[path = "../../frame-plan/tests/on_device/frames.rs"]
mod frames;
mod host;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use asm_vulkan::ash::vk;
use asm_vulkan::{HostImage, VulkanExecutor};
use device::{compiled, executor, read, words};
use frame_plan::{ExecuteError, Executor, Lifetime, TextureFormat};
use frames::{SIZE, hosted_plan, refused};
use host::Host;
use passes::*;

/// And nothing is left when the executor is gone.
#[test]
fn changing_plans_leaks_nothing() {
    let Some(host) = Host::new(true) else { return };
    let mut gpu = host.executor(compiled(PASSES));
    frames::changing_plans_leaks_nothing(&mut gpu, |gpu| gpu.live_objects());
    // When the host destroys its device, validation finds what the executor might have left.
    drop(gpu);
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
    let plan = device::image_plan(TextureFormat::R32Uint, SIZE);
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
