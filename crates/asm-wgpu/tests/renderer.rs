//! asm-core's plans through [`AsmRenderer`], and pictures on their way to a host's texture.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;

use asm_core::{PASSES, Settings, bake_plan};
use asm_wgpu::{AsmError, AsmRenderer, DisplayPass, WgpuExecutor};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{ExecuteError, Executor, Lifetime, Limits, Plan, Resource, TextureFormat};
use spectral_core::display::{Display, ToneMap};
use spectral_core::observer::Observer;
use spectral_core::rgb::D65_WHITE_XYZ;
use spectral_scene::{IrradianceMaps, Scene};

fn renderer() -> Option<AsmRenderer> {
    let executor = device::executor(PASSES)?;
    Some(AsmRenderer::from_host(executor.device().clone(), executor.queue().clone()))
}

fn small() -> Settings {
    Settings { emission_size: 128, ..Settings::default() }
}

fn receiver(scene: &Scene) -> usize {
    scene.receiver("receiver").unwrap()
}

fn bake_on_cpu(scene: &Scene, settings: &Settings) -> IrradianceMaps {
    let mut cpu = CpuExecutor::new(PASSES, None).unwrap();
    let bake = bake_plan(scene, receiver(scene), [64, 64], settings, &Limits::default()).unwrap();
    cpu.prepare(&bake.plan).unwrap();
    cpu.execute().unwrap();
    bake.read(&mut cpu).unwrap().0
}

/// RMS of the difference of Y over RMS of the first.
fn relative_rms(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let square = |v: f32| f64::from(v) * f64::from(v);
    let reference: f64 = a.iter().map(|a| square(a[1])).sum();
    assert!(a.len() == b.len() && reference > 0.0, "something to compare");
    let difference: f64 = a.iter().zip(b).map(|(a, b)| square(a[1] - b[1])).sum();
    (difference / reference).sqrt()
}

/// Drivers may snap vertices to 1/16 texel, the CPU takes 1/256: that takes texels at silhouettes and at edges between facets
/// to the other side, in a view of 128 x 128. Drivers that snap as the CPU does stay below 1e-5.
const BOUND: f64 = 0.02;

#[test]
fn bakes_agree_with_the_cpu() {
    for name in ["sphere", "gem"] {
        let scene = spectral_scene::bundled(name).unwrap();
        let Some(mut renderer) = renderer() else { return };
        let (gpu, statistics) = renderer.bake(&scene, receiver(&scene), [64, 64], &small()).unwrap();
        let cpu = bake_on_cpu(&scene, &small());
        for (cpu, gpu) in [(&cpu.direct, &gpu.direct), (&cpu.refracted, &gpu.refracted)] {
            let error = relative_rms(cpu, gpu);
            assert!(error <= BOUND, "{name}: {error}");
        }
        assert!(statistics.photons > 10_000);
        assert!(statistics.lights.iter().flat_map(|l| &l.ledgers).all(asm_core::Ledger::balances));

        // Negative control: another glass.
        let mut other = scene.clone();
        for material in &mut other.materials {
            if let spectral_core::dispersion::Dispersion::Cauchy { a, .. } = &mut material.dispersion {
                *a += 0.1;
            }
        }
        assert_ne!(other, scene);
        let error = relative_rms(&bake_on_cpu(&other, &small()).refracted, &gpu.refracted);
        assert!(error > 10.0 * BOUND, "{name}: another glass differs by only {error}");
    }
}

#[test]
fn frames_in_a_hosts_encoder_show_the_picture() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let Some(mut renderer) = renderer() else { return };
    let size = [64, 48];
    let display = Display { exposure: 2.0, tone_map: ToneMap::Reinhard { white: 4.0 } };
    let (device, queue) = (renderer.executor().device().clone(), renderer.executor().queue().clone());
    let target = target(&device, wgpu::TextureFormat::Rgba8Unorm, size);
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let nothing = renderer.record(&mut encoder, &view, &display);
    assert!(matches!(nothing, Err(AsmError::Execute(ExecuteError::Usage(_)))), "nothing is prepared");

    renderer.prepare(&scene, 0, size, &small()).unwrap();
    for _ in 0..2 {
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        renderer.record(&mut encoder, &view, &display).unwrap();
        queue.submit([encoder.finish()]);
    }
    let (picture, _) = renderer.read().unwrap();
    let shown = pixels(&device, &queue, &target, size);
    assert!(shown.iter().any(|p| p[..3] != shown[0][..3]), "something to see");
    assert_eq!(levels_apart(&picture.xyz, &shown, &display), 0..=1);

    let (again, _) = renderer.render(&scene, 0, size, &small()).unwrap();
    assert!(again == picture, "the same picture at once and in a host's frame");
}

/// Pictures of all spectral colours at several luminances, of greys, and of what is darker than black.
fn colors() -> Vec<[f32; 3]> {
    let spectral = (0..32).flat_map(|i| {
        let xyz = Observer::Cie1931.xyz_bar(400.0 + 9.0 * f64::from(i));
        [0.02, 0.5, 1.5, 40.0].map(|y| xyz.map(|v| (v * y / xyz[1].max(1e-3)) as f32))
    });
    let greys = (0..30).map(|i| D65_WHITE_XYZ.map(|v| (v * f64::from(i * i) / 400.0) as f32));
    spectral.chain(greys).chain([[0.3, -0.1, 0.2], [0.2, 0.0, 0.1]]).collect()
}

#[test]
fn the_display_on_the_device_is_that_of_the_core() {
    let Some(executor) = device::executor(PASSES) else { return };
    let (device, queue) = (executor.device(), executor.queue());
    let colors = colors();
    let size = [16, colors.len() as u32 / 16];
    assert_eq!(colors.len() % 16, 0);
    let picture = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: colors.len() as u64 * 16,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let padded: Vec<[f32; 4]> = colors.iter().map(|c| [c[0], c[1], c[2], 0.0]).collect();
    queue.write_buffer(&picture, 0, bytemuck::cast_slice(&padded));
    let other = Display { exposure: 0.5, tone_map: ToneMap::Clip };
    for format in [wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Rgba8UnormSrgb] {
        let mut pass = DisplayPass::new(device, format);
        for tone_map in [ToneMap::Clip, ToneMap::Reinhard { white: 3.0 }] {
            let display = Display { exposure: 0.8, tone_map };
            let target = target(device, format, size);
            let view = target.create_view(&wgpu::TextureViewDescriptor::default());
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            pass.record(device, queue, &mut encoder, (&picture, size), &view, &display);
            queue.submit([encoder.finish()]);
            let shown = pixels(device, queue, &target, size);
            assert_eq!(levels_apart(&colors, &shown, &display), 0..=1, "{format:?} {tone_map:?}");
            // Negative control.
            assert!(*levels_apart(&colors, &shown, &other).end() > 20);
        }
    }
}

/// Smallest and largest difference in 8-bit levels from what the core would show, at least up to 1.
fn levels_apart(xyz: &[[f32; 3]], shown: &[[u8; 4]], display: &Display) -> std::ops::RangeInclusive<u8> {
    assert_eq!(xyz.len(), shown.len());
    let pairs = xyz.iter().zip(shown).flat_map(|(xyz, shown)| {
        let wanted = display.srgb8_from_xyz(xyz.map(f64::from));
        (0..3).map(move |c| wanted[c].abs_diff(shown[c]))
    });
    let differences: Vec<u8> = pairs.collect();
    *differences.iter().min().unwrap()..=(*differences.iter().max().unwrap()).max(1)
}

fn target(device: &wgpu::Device, format: wgpu::TextureFormat, size: [u32; 2]) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// What a target holds, as it is encoded there.
fn pixels(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    target: &wgpu::Texture,
    size: [u32; 2],
) -> Vec<[u8; 4]> {
    // A texture of the same bytes whose format plans know, imported by a plan that only reads it.
    let copy = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: target.size(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_texture_to_texture(target.as_image_copy(), copy.as_image_copy(), target.size());
    queue.submit([encoder.finish()]);
    let mut plan = Plan { name: "read".into(), ..Plan::default() };
    let image = Resource::texture("image", TextureFormat::Rgba8Unorm, size).readable();
    plan.add_resource(image.with_lifetime(Lifetime::Imported));
    let mut reader = WgpuExecutor::from_host(device.clone(), queue.clone(), PASSES);
    reader.import_texture("image", copy).unwrap();
    bytemuck::pod_collect_to_vec(&device::run(&mut reader, &plan, "image"))
}
