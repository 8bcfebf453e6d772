//! asm-core's plans through `AsmRenderer`, and pictures on their way to a host's target.
//!
//! The tests of the executors' crates include this file. Around it they have `device`, whose `executor()` gives an executor of
//! asm-core's passes or none where skipping is allowed, and `Screen`, a host application with a target.

use asm_core::{AsmError, AsmRenderer, Method, PASSES, Settings, Updated, bake_plan};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{ExecuteError, Executor, Limits, Plan, Resource};
use spectral_core::display::{Display, ToneMap};
use spectral_core::observer::Observer;
use spectral_core::rgb::D65_WHITE_XYZ;
use spectral_scene::{IrradianceMaps, Scene};

use crate::{Screen, device};

fn small() -> Settings {
    Settings { emission_size: 128, ..Settings::of(Method::CausticsMap) }
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
        let Some(executor) = device::executor(PASSES) else { return };
        let mut renderer = AsmRenderer::new(executor);
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
    let mut scene = spectral_scene::bundled("sphere").unwrap();
    let size = [64, 48];
    let Some(mut screen) = Screen::new(size, false) else { return };
    let mut renderer = AsmRenderer::new(screen.executor());
    let display = Display { exposure: 2.0, tone_map: ToneMap::Reinhard { white: 4.0 } };
    let nothing = screen.show_frame(&mut renderer, &display);
    assert!(matches!(nothing, Err(AsmError::Execute(ExecuteError::Usage(_)))), "nothing is prepared");

    assert_eq!(renderer.update(&scene, 0, size, &small()).unwrap(), Updated::Prepared);
    (0..2).for_each(|_| screen.show_frame(&mut renderer, &display).unwrap());
    let (picture, _) = renderer.read().unwrap();
    let shown = screen.pixels();
    assert!(shown.iter().any(|p| p[..3] != shown[0][..3]), "something to see");
    assert_eq!(levels_apart(&picture.xyz, &shown, &display), 0..=1);

    let error = screen.show_frame_where_it_does_not_fit(&mut renderer, &display).unwrap_err();
    assert!(
        matches!(&error, AsmError::Execute(ExecuteError::Usage(what)) if what.contains("display")),
        "{error}"
    );

    let (again, statistics) = renderer.render(&scene, 0, size, &small()).unwrap();
    assert!(again == picture, "the same picture at once and in a host's frame");
    assert!(statistics.photons > 10_000);
    assert_eq!(renderer.latest_statistics().unwrap().lights, statistics.lights, "come by themselves");

    // A picture that has moved is the one of a renderer that starts there.
    scene.lights[0].intensity *= 1.5;
    scene.cameras[0].world_from_camera.w_axis.x += 0.01;
    assert_eq!(renderer.update(&scene, 0, size, &small()).unwrap(), Updated::Moved);
    screen.show_frame(&mut renderer, &display).unwrap();
    let (moved, _) = renderer.read().unwrap();
    let (fresh, _) = AsmRenderer::new(screen.executor()).render(&scene, 0, size, &small()).unwrap();
    assert!(moved == fresh, "moved or made anew");
    assert!(moved != picture, "the picture has moved");
    assert_eq!(levels_apart(&moved.xyz, &screen.pixels(), &display), 0..=1);
}

/// Scenes and sizes that change between frames: once all of them have been seen, and their pipelines made, there is never more.
#[test]
fn resizing_and_changing_scenes_leaks_nothing() {
    let Some(mut screen) = Screen::new([64, 48], false) else { return };
    let mut renderer = AsmRenderer::new(screen.executor());
    let settings = Settings { emission_size: 32, map_size: Some(64), ..Settings::of(Method::Asm) };
    let mut counts = Vec::new();
    for _ in 0..3 {
        for (name, size) in [("prism", [64, 48]), ("sphere", [32, 32]), ("sphere", [48, 64])] {
            let scene = spectral_scene::bundled(name).unwrap();
            assert_eq!(renderer.update(&scene, 0, size, &settings).unwrap(), Updated::Prepared);
            (0..2).for_each(|_| screen.show_frame(&mut renderer, &Display::default()).unwrap());
        }
        counts.push(screen.live_objects(&mut renderer));
    }
    assert_eq!(counts[0], counts[1]);
    assert_eq!(counts[1], counts[2]);
    // Negative control: a plan with more in it is seen.
    let scene = spectral_scene::bundled("prism").unwrap();
    let more = Settings { prune: false, ..settings };
    assert_eq!(renderer.update(&scene, 0, [48, 64], &more).unwrap(), Updated::Prepared);
    assert_ne!(screen.live_objects(&mut renderer), counts[2]);
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
    let colors = colors();
    let size = [16, colors.len() as u32 / 16];
    assert_eq!(colors.len() % 16, 0);
    let padded: Vec<[f32; 4]> = colors.iter().map(|c| [c[0], c[1], c[2], 0.0]).collect();
    let mut plan = Plan { name: "show".into(), ..Plan::default() };
    let picture = plan.add_resource(Resource::buffer_with("picture", &padded));
    let other = Display { exposure: 0.5, tone_map: ToneMap::Clip };
    for encodes_srgb in [false, true] {
        let Some(mut screen) = Screen::new(size, encodes_srgb) else { return };
        let mut gpu = screen.executor();
        gpu.prepare(&plan).unwrap();
        for tone_map in [ToneMap::Clip, ToneMap::Reinhard { white: 3.0 }, ToneMap::Sigmoid { contrast: 1.5 }]
        {
            let display = Display { exposure: 0.8, tone_map };
            screen.show(&mut gpu, picture, &display);
            let shown = screen.pixels();
            assert_eq!(levels_apart(&colors, &shown, &display), 0..=1, "{encodes_srgb} {tone_map:?}");
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
