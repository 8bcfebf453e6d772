//! asm-core's plans through [`AsmRenderer`], and pictures on their way to a host's texture.

#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(unsafe_code, reason = "a host hands its own commands and images over")]

mod device;
mod host;

use asm_core::{PASSES, Settings, bake_plan};
use asm_vulkan::ash::vk;
use asm_vulkan::{ASM_PASSES, AsmError, AsmRenderer, DisplayPass, HostImage};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{ExecuteError, Executor, Lifetime, Limits, Plan, Resource, TextureFormat};
use host::Host;
use spectral_core::display::{Display, ToneMap};
use spectral_core::observer::Observer;
use spectral_core::rgb::D65_WHITE_XYZ;
use spectral_scene::{IrradianceMaps, Scene};

fn renderer() -> Option<AsmRenderer> {
    match AsmRenderer::new(&device::options()) {
        Ok(renderer) => Some(renderer),
        Err(AsmError::Execute(error)) => device::made(Err(error)),
        Err(error) => panic!("{error}"),
    }
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
fn frames_in_a_hosts_commands_show_the_picture() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let Some(host) = Host::new(true) else { return };
    // SAFETY: the host outlives its renderers, and uses its queue when no method of theirs runs.
    let mut renderer = unsafe { AsmRenderer::from_host(host.lend()) }.unwrap();
    let size = [64, 48];
    let display = Display { exposure: 2.0, tone_map: ToneMap::Reinhard { white: 4.0 } };
    let target = target(&host, vk::Format::R8G8B8A8_UNORM, size);
    let record = |renderer: &mut AsmRenderer, target: &HostImage| {
        let mut result = Ok(());
        // SAFETY: the host submits the commands at once and waits for them.
        host.frame(|commands| result = unsafe { renderer.record(commands, target, &display) });
        result
    };
    let nothing = record(&mut renderer, &target);
    assert!(matches!(nothing, Err(AsmError::Execute(ExecuteError::Usage(_)))), "nothing is prepared");

    renderer.prepare(&scene, 0, size, &small()).unwrap();
    (0..2).for_each(|_| record(&mut renderer, &target).unwrap());
    let before = renderer.executor().live_objects();
    (0..3).for_each(|_| record(&mut renderer, &target).unwrap());
    assert_eq!(renderer.executor().live_objects(), before, "frames make nothing");
    let (picture, _) = renderer.read().unwrap();
    let shown = pixels(&host, &target);
    assert!(shown.iter().any(|p| p[..3] != shown[0][..3]), "something to see");
    assert_eq!(levels_apart(&picture.xyz, &shown, &display), 0..=1);

    let without_view = HostImage { view: None, ..target };
    let error = record(&mut renderer, &without_view).unwrap_err();
    assert!(error.to_string().contains("needs a view"), "{error}");

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
    let Some(host) = Host::new(true) else { return };
    let colors = colors();
    let size = [16, colors.len() as u32 / 16];
    assert_eq!(colors.len() % 16, 0);
    let padded: Vec<[f32; 4]> = colors.iter().map(|c| [c[0], c[1], c[2], 0.0]).collect();
    let mut plan = Plan { name: "show".into(), ..Plan::default() };
    let picture = plan.add_resource(Resource::buffer_with("picture", &padded));
    let mut gpu = host.executor(ASM_PASSES);
    gpu.prepare(&plan).unwrap();
    let other = Display { exposure: 0.5, tone_map: ToneMap::Clip };
    for format in [vk::Format::R8G8B8A8_UNORM, vk::Format::R8G8B8A8_SRGB] {
        let mut pass = DisplayPass::new(&gpu, format).unwrap();
        for tone_map in [ToneMap::Clip, ToneMap::Reinhard { white: 3.0 }] {
            let display = Display { exposure: 0.8, tone_map };
            let target = target(&host, format, size);
            // SAFETY: the host submits the commands at once and waits for them; its images live as long as it does.
            host.frame(|commands| unsafe {
                gpu.record(commands).unwrap();
                pass.record(&mut gpu, commands, (picture, size), &target, &display).unwrap();
            });
            let shown = pixels(&host, &target);
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

fn target(host: &Host, format: vk::Format, size: [u32; 2]) -> HostImage {
    host.image(format, size, vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC)
}

/// What a target holds, as it is encoded there.
fn pixels(host: &Host, target: &HostImage) -> Vec<[u8; 4]> {
    // An image of the same bytes whose format plans know, imported by a plan that only reads it.
    let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
    let copy = host.image(vk::Format::R8G8B8A8_UNORM, target.size, usage);
    host.copy_image(target, &copy);
    let mut plan = Plan { name: "read".into(), ..Plan::default() };
    let image = Resource::texture("image", TextureFormat::Rgba8Unorm, target.size).readable();
    plan.add_resource(image.with_lifetime(Lifetime::Imported));
    let mut reader = host.executor(ASM_PASSES);
    // SAFETY: the host's images live as long as the host.
    unsafe { reader.import_image("image", copy) }.unwrap();
    bytemuck::pod_collect_to_vec(&device::run(&mut reader, &plan, "image"))
}
