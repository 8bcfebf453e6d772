//! Frame after frame: the same bits, nothing new allocated, times per step; and inside a host application.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use asm_wgpu::WgpuExecutor;
use device::{executor, read, words};
use frame_plan::{ExecuteError, Executor, Lifetime, Plan, Resource, Step, TextureFormat};
use passes::*;

const SIZE: [u32; 2] = [61, 47];

#[test]
fn two_runs_give_the_same_bits() {
    let plans = [mips_plan(), layers_plan(0, 0), visibility_plan(SIZE, &fan(), 3), indirect_plan()];
    for plan in &plans {
        let Some(mut first) = executor(PASSES) else { return };
        let mut second = executor(PASSES).unwrap();
        let frame = |gpu: &mut WgpuExecutor, lifetime: Lifetime| -> Vec<Vec<u8>> {
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

#[test]
fn pipelines_are_made_once_per_pass() {
    let Some(mut gpu) = executor(PASSES) else { return };
    gpu.prepare(&indirect_plan()).unwrap();
    assert_eq!(gpu.pipeline_count(), 3);
    gpu.prepare(&scale_plan()).unwrap();
    gpu.prepare(&indirect_plan()).unwrap();
    assert_eq!(gpu.pipeline_count(), 4);
}

fn names(gpu: &mut WgpuExecutor) -> Vec<String> {
    gpu.step_times().into_iter().map(|t| t.name).collect()
}

#[test]
fn step_times_cover_the_steps() {
    let Some(mut gpu) = executor(PASSES) else { return };
    assert!(gpu.step_times().is_empty());
    let plan = indirect_plan();
    gpu.prepare(&plan).unwrap();
    let features = gpu.device().features();
    let expected: &[&str] = if features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS) {
        &["clear bins", "histogram", "plan_groups", "increment"]
    } else if features.contains(wgpu::Features::TIMESTAMP_QUERY) {
        &["histogram", "plan_groups", "increment"]
    } else {
        &[]
    };
    assert!(gpu.step_times().is_empty(), "no frame yet");
    for _ in 0..10 {
        gpu.execute().unwrap();
        assert_eq!(names(&mut gpu), expected);
    }
}

#[test]
fn a_device_that_times_passes_only_leaves_other_steps_out() {
    let Some(host) = host_with(wgpu::Features::TIMESTAMP_QUERY) else { return };
    let mut gpu = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
    gpu.prepare(&indirect_plan()).unwrap();
    gpu.execute().unwrap();
    let timed = host.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    assert_eq!(names(&mut gpu).len(), if timed { 3 } else { 0 });
    gpu.prepare(&mips_plan()).unwrap();
    gpu.execute().unwrap();
    assert_eq!(names(&mut gpu), if timed { vec!["pyramid"] } else { vec![] });
}

/// Software devices put timestamps off after a draw: the time of a step must not go to its neighbour.
#[test]
fn times_belong_to_their_steps() {
    let Some(mut gpu) = executor(PASSES) else { return };
    if !gpu.device().features().contains(wgpu::Features::TIMESTAMP_QUERY) {
        return;
    }
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

/// A host application: it owns instance, device and queue.
struct Host {
    instance: wgpu::Instance,
    device: wgpu::Device,
    queue: wgpu::Queue,
}

fn host() -> Option<Host> {
    host_with(wgpu::Features::empty())
}

/// A host whose device has those of the features that the adapter has.
fn host_with(features: wgpu::Features) -> Option<Host> {
    // The same rule for skipping as everywhere.
    executor(PASSES)?;
    let instance = wgpu::Instance::default();
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: features & adapter.features(),
        ..wgpu::DeviceDescriptor::default()
    }))
    .unwrap();
    Some(Host { instance, device, queue })
}

/// Objects that wgpu holds, by kind.
fn objects(host: &Host) -> Vec<(&'static str, usize)> {
    let hub = host.instance.generate_report().unwrap().hub;
    vec![
        ("buffers", hub.buffers.num_allocated),
        ("textures", hub.textures.num_allocated),
        ("texture views", hub.texture_views.num_allocated),
        ("bind groups", hub.bind_groups.num_allocated),
        ("bind group layouts", hub.bind_group_layouts.num_allocated),
        ("pipeline layouts", hub.pipeline_layouts.num_allocated),
        ("shader modules", hub.shader_modules.num_allocated),
        ("compute pipelines", hub.compute_pipelines.num_allocated),
        ("render pipelines", hub.render_pipelines.num_allocated),
        ("query sets", hub.query_sets.num_allocated),
        ("samplers", hub.samplers.num_allocated),
        ("command buffers", hub.command_buffers.num_allocated),
    ]
}

#[test]
fn a_hundred_frames_make_no_objects() {
    for plan in [indirect_plan(), mips_plan(), visibility_plan(SIZE, &fan(), 3)] {
        let Some(host) = host() else { return };
        let mut gpu = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
        gpu.prepare(&plan).unwrap();
        let frame = |gpu: &mut WgpuExecutor| {
            if let Some(params) = plan.params.first() {
                gpu.set_params(plan.params_id(&params.name).unwrap(), &params.bytes).unwrap();
            }
            gpu.execute().unwrap();
            gpu.step_times();
        };
        // The first frames fill pools; wait, so that no command buffer is still on its way.
        (0..3).for_each(|_| frame(&mut gpu));
        host.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let before = objects(&host);
        (0..100).for_each(|_| frame(&mut gpu));
        host.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        assert_eq!(objects(&host), before);
        assert!(before.iter().any(|(_, count)| *count > 0));

        // Negative control: the report sees what a read-back allocates while it is held.
        let held = host.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 4,
            usage: wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        assert_ne!(objects(&host), before);
        drop(held);
    }
}

/// The visibility plan with its integer target owned by the host.
fn hosted_plan() -> Plan {
    let mut plan = visibility_plan(SIZE, &fan(), 3);
    let ids = plan.resource("ids").unwrap();
    plan.resources[ids.0 as usize] =
        Resource::texture("ids", TextureFormat::R32Uint, SIZE).with_lifetime(Lifetime::Imported);
    plan
}

fn target(
    host: &Host,
    format: wgpu::TextureFormat,
    size: [u32; 2],
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    host.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host target"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// Read a host's texture by a plan that imports it and does nothing.
fn pixels(host: &Host, texture: &wgpu::Texture) -> Vec<u32> {
    let mut plan = Plan { name: "read".into(), ..Plan::default() };
    let resource = Resource::texture("image", TextureFormat::R32Uint, SIZE).readable();
    plan.add_resource(resource.with_lifetime(Lifetime::Imported));
    let mut reader = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
    reader.import_texture("image", texture.clone()).unwrap();
    reader.prepare(&plan).unwrap();
    words(&read(&mut reader, &plan, "image"))
}

#[test]
fn frames_are_recorded_into_a_hosts_encoder_and_texture() {
    let Some(host) = host() else { return };
    let reference =
        words(&device::run(&mut executor(PASSES).unwrap(), &visibility_plan(SIZE, &fan(), 3), "ids"));
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let new_target = || target(&host, wgpu::TextureFormat::R32Uint, SIZE, usage);
    let (first, second) = (new_target(), new_target());

    let mut gpu = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
    gpu.import_texture_view("ids", first.create_view(&wgpu::TextureViewDescriptor::default())).unwrap();
    gpu.prepare(&hosted_plan()).unwrap();
    let frame = |gpu: &mut WgpuExecutor| {
        let mut encoder = host.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        gpu.record(&mut encoder).unwrap();
        host.queue.submit([encoder.finish()]);
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
    let Some(host) = host() else { return };
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
    let mut gpu = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
    gpu.import_buffer("input", input).unwrap();
    assert_eq!(words(&device::run(&mut gpu, &plan, "output"))[999], 13);
    assert_eq!(gpu.buffer(plan.resource("output").unwrap()).unwrap().size(), 4000);
    assert!(gpu.texture(plan.resource("output").unwrap()).is_none());
}

#[test]
fn imports_that_do_not_fit_are_refused() {
    let Some(host) = host() else { return };
    let mut gpu = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
    let refused = |result: Result<(), ExecuteError>, text: &str| {
        let error = result.unwrap_err();
        assert!(matches!(error, ExecuteError::Usage(_)), "{error}");
        assert!(error.to_string().contains(text), "{error}");
    };
    refused(gpu.prepare(&hosted_plan()), "\"ids\" was not handed over");
    let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
    let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
    for (format, size, usage, text) in [
        (wgpu::TextureFormat::R32Float, SIZE, attachment, "is R32Float, the plan wants R32Uint"),
        (wgpu::TextureFormat::R32Uint, [61, 48], attachment, "is 61 x 48, the plan wants 61 x 47"),
        (wgpu::TextureFormat::R32Uint, SIZE, sampled, "lacks the usages"),
    ] {
        gpu.import_texture("ids", target(&host, format, size, usage)).unwrap();
        refused(gpu.prepare(&hosted_plan()), text);
    }
    let good = target(&host, wgpu::TextureFormat::R32Uint, SIZE, attachment);
    gpu.import_texture("ids", good).unwrap();
    gpu.prepare(&hosted_plan()).unwrap();
    let bad = target(&host, wgpu::TextureFormat::R32Float, SIZE, attachment);
    refused(gpu.import_texture("ids", bad), "is R32Float");

    let mut read_back = hosted_plan();
    read_back.steps.truncate(1);
    read_back.resources[1].readable = true;
    let view = target(&host, wgpu::TextureFormat::R32Uint, SIZE, attachment | wgpu::TextureUsages::COPY_SRC)
        .create_view(&wgpu::TextureViewDescriptor::default());
    let mut gpu = WgpuExecutor::from_host(host.device.clone(), host.queue.clone(), PASSES);
    gpu.import_texture_view("ids", view).unwrap();
    refused(gpu.prepare(&read_back), "is a view, but is copied or read back");
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
