//! Frame after frame: the same bits, nothing new allocated, times per step; and inside a host application.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/on_device/frames.rs"]
mod frames;
mod host;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use asm_wgpu::WgpuExecutor;
use device::{executor, read, words};
use frame_plan::{Executor, Lifetime, TextureFormat};
use frames::{SIZE, hosted_plan, refused};
use host::Host;
use passes::*;

fn names(gpu: &mut WgpuExecutor) -> Vec<String> {
    gpu.step_times().into_iter().map(|t| t.name).collect()
}

#[test]
fn a_device_that_times_passes_only_leaves_other_steps_out() {
    let Some(host) = Host::new(wgpu::Features::TIMESTAMP_QUERY) else { return };
    let mut gpu = host.executor(PASSES);
    gpu.prepare(&indirect_plan()).unwrap();
    gpu.execute().unwrap();
    let timed = host.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    assert_eq!(names(&mut gpu).len(), if timed { 3 } else { 0 });
    gpu.prepare(&mips_plan()).unwrap();
    gpu.execute().unwrap();
    assert_eq!(names(&mut gpu), if timed { vec!["pyramid"] } else { vec![] });
}

/// And nothing is left when the executor is gone.
#[test]
fn changing_plans_leaks_nothing() {
    let Some(host) = Host::new(wgpu::Features::empty()) else { return };
    let mut gpu = host.executor(PASSES);
    frames::changing_plans_leaks_nothing(&mut gpu, |_| host.live_objects());
    drop(gpu);
    let left = host.live_objects();
    assert!(left.iter().all(|(_, count)| *count == 0), "{left:?}");
}

/// Read a host's texture by a plan that imports it and does nothing.
fn pixels(host: &Host, texture: &wgpu::Texture) -> Vec<u32> {
    let plan = device::image_plan(TextureFormat::R32Uint, SIZE);
    let mut reader = host.executor(PASSES);
    reader.import_texture("image", texture.clone()).unwrap();
    reader.prepare(&plan).unwrap();
    words(&read(&mut reader, &plan, "image"))
}

#[test]
fn frames_are_recorded_into_a_hosts_encoder_and_texture() {
    let Some(host) = Host::new(wgpu::Features::empty()) else { return };
    let reference =
        words(&device::run(&mut executor(PASSES).unwrap(), &visibility_plan(SIZE, &fan(), 3), "ids"));
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let new_target = || host.texture(wgpu::TextureFormat::R32Uint, SIZE, usage);
    let (first, second) = (new_target(), new_target());

    let mut gpu = host.executor(PASSES);
    gpu.import_texture_view("ids", first.create_view(&wgpu::TextureViewDescriptor::default())).unwrap();
    gpu.prepare(&hosted_plan()).unwrap();
    let frame = |gpu: &mut WgpuExecutor| {
        host.frame(|encoder| gpu.record(encoder).unwrap());
    };
    frame(&mut gpu);
    assert_eq!(pixels(&host, &first), reference);
    assert!(pixels(&host, &second).iter().all(|&id| id == 0));

    // The next frame goes into another view, as with a swap chain.
    gpu.import_texture_view("ids", second.create_view(&wgpu::TextureViewDescriptor::default())).unwrap();
    frame(&mut gpu);
    assert_eq!(pixels(&host, &second), reference);
}

#[test]
fn a_host_buffer_is_read_and_one_of_the_plan_is_lent() {
    let Some(host) = Host::new(wgpu::Features::empty()) else { return };
    let mut plan = scale_plan();
    plan.resources[0].initial = None;
    plan.resources[0].lifetime = Lifetime::Imported;
    let input = host.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: 4000,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    host.queue.write_buffer(&input, 0, bytemuck::cast_slice(&[2_u32; 1000]));
    let mut gpu = host.executor(PASSES);
    gpu.import_buffer("input", input).unwrap();
    assert_eq!(words(&device::run(&mut gpu, &plan, "output"))[999], 13);
    assert_eq!(gpu.buffer(plan.resource("output").unwrap()).unwrap().size(), 4000);
    assert!(gpu.texture(plan.resource("output").unwrap()).is_none());
}

#[test]
fn imports_that_do_not_fit_are_refused() {
    let Some(host) = Host::new(wgpu::Features::empty()) else { return };
    let mut gpu = host.executor(PASSES);
    refused(gpu.prepare(&hosted_plan()), "\"ids\" was not handed over");
    let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
    let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
    for (format, size, usage, text) in [
        (wgpu::TextureFormat::R32Float, SIZE, attachment, "is R32Float, the plan wants R32Uint"),
        (wgpu::TextureFormat::R32Uint, [61, 48], attachment, "is 61 x 48, the plan wants 61 x 47"),
        (wgpu::TextureFormat::R32Uint, SIZE, sampled, "lacks the usages"),
    ] {
        gpu.import_texture("ids", host.texture(format, size, usage)).unwrap();
        refused(gpu.prepare(&hosted_plan()), text);
    }
    let good = host.texture(wgpu::TextureFormat::R32Uint, SIZE, attachment);
    gpu.import_texture("ids", good).unwrap();
    gpu.prepare(&hosted_plan()).unwrap();
    let bad = host.texture(wgpu::TextureFormat::R32Float, SIZE, attachment);
    refused(gpu.import_texture("ids", bad), "is R32Float");

    let mut read_back = hosted_plan();
    read_back.steps.truncate(1);
    read_back.resources[1].readable = true;
    let view = host
        .texture(wgpu::TextureFormat::R32Uint, SIZE, attachment | wgpu::TextureUsages::COPY_SRC)
        .create_view(&wgpu::TextureViewDescriptor::default());
    let mut gpu = host.executor(PASSES);
    gpu.import_texture_view("ids", view).unwrap();
    refused(gpu.prepare(&read_back), "is a view, but is copied or read back");
}
