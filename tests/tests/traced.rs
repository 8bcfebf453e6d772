//! Photons along exact paths: against the oracle, and on every executor.

use asm_core::{GapFilling, Method, Refraction, Settings};
use spectral_reference::{BakeSettings, Effort};
use spectral_scene::IrradianceMaps;
use workspace_tests::agreement::{assert_executors_agree, plan_of, run};
use workspace_tests::{SIZE, executors, subject};
use xtask::checks::Bound;
use xtask::layers::Layer;
use xtask::metrics::{Metrics, compare};
use xtask::subject::Subject;

/// Of refracted light.
fn distance(subject: &Subject, a: &IrradianceMaps, b: &IrradianceMaps) -> Metrics {
    compare(&Layer::Refracted.of(a), &Layer::Refracted.of(b), subject.white_xyz()).expect("maps of one size")
}

/// Photons of the oracle: its own noise is 2 % of RMS.
const PHOTONS: u64 = 500_000;

fn oracle(subject: &Subject) -> IrradianceMaps {
    let effort = Effort::Photons(PHOTONS);
    let settings = BakeSettings { size: SIZE, effort, direct_samples: 1, ..BakeSettings::default() };
    let bake = spectral_reference::bake(&subject.scene, subject.receiver, &settings, &|_| {})
        .unwrap_or_else(|error| panic!("{}: {error}", subject.name));
    bake.maps
}

#[test]
fn traced_photons_follow_what_image_space_cannot() {
    let mut cpu = frame_plan::cpu::CpuExecutor::new(asm_core::PASSES, None).expect("threads start");
    for (name, convex) in [("gem", false), ("diamond", false), ("sphere", true)] {
        let subject = subject(name);
        let oracle = oracle(&subject);
        let mut of = |refraction, bounces| {
            // What fills gaps between wavelengths blurs the small lights of a gem.
            let settings = Settings {
                refraction: Some(refraction),
                bounces,
                emission_size: 256,
                gap_filling: Some(GapFilling::None),
                ..Settings::of(Method::Asm)
            };
            let (maps, _) = run(&plan_of(&subject, &settings), &mut cpu);
            let metrics = distance(&subject, &maps, &oracle);
            (maps, metrics)
        };
        let is_right = |metrics: &Metrics| metrics.rms_64 < 0.05 && (metrics.total_y - 1.0).abs() < 0.01;
        let (_, traced) = of(Refraction::Traced, 3);
        assert!(is_right(&traced), "{name}: {traced:?}");
        let (short_maps, short) = of(Refraction::Traced, 0);
        let (image_maps, image_space) = of(Refraction::ImageSpace, 3);
        assert_eq!((is_right(&short), is_right(&image_space)), (convex, convex), "{name}");
        if !convex {
            assert!(image_space.rms_64 > 20.0 * traced.rms_64, "{name}: {image_space:?}");
        }
        // Without reflections inside the two are the same light.
        let apart = distance(&subject, &short_maps, &image_maps);
        assert!(apart.rms_64 < 0.02, "{name}: {apart:?}");
    }
}

/// Flat faces and a slit; smooth normals; internal reflections; an open surface; nested surfaces; lamps with eyes and mirrors.
const SCENES: [(&str, Method); 6] = [
    ("prism", Method::Asm),
    ("sphere", Method::CausticsMap),
    ("gem", Method::Asm),
    ("water", Method::Acm),
    ("glass", Method::CausticsMap),
    ("lamps", Method::Acm),
];

/// Between executors on different drivers: rounding decides on which side of an edge a photon goes.
const PARITY: Bound = Bound { delta_e_mean: Some(0.01), rms_64: Some(1e-3), total_y: Some(1e-5) };

#[test]
fn traced_photons_agree_on_every_executor() {
    let mut executors = executors();
    for (name, method) in SCENES {
        let refraction = Some(Refraction::Traced);
        let wavelengths = Some(if method == Method::Acm { 1 } else { 3 });
        let settings = Settings {
            refraction,
            wavelengths,
            emission_size: 64,
            map_size: Some(96),
            ..Settings::of(method)
        };
        assert_executors_agree(&mut executors, &subject(name), &settings, PARITY);
    }
}
