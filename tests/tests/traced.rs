//! Photons along exact paths: against the oracle, and on every executor.

use asm_core::{BakePlan, GapFilling, Method, Refraction, Settings, Statistics, bake_plan};
use frame_plan::{Executor, Limits};
use spectral_reference::{BakeSettings, Effort};
use spectral_scene::IrradianceMaps;
use workspace_tests::{executors, subject};
use xtask::checks::{Bound, judge};
use xtask::executors::bake;
use xtask::layers::Layer;
use xtask::metrics::{Metrics, compare};
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

const SIZE: [u32; 2] = [64, 64];

fn traced(method: Method) -> Settings {
    Settings { refraction: Some(Refraction::Traced), ..Settings::of(method) }
}

fn plan_of(subject: &Subject, settings: &Settings) -> BakePlan {
    bake_plan(&subject.scene, subject.receiver, SIZE, settings, &Limits::default())
        .unwrap_or_else(|error| panic!("{}: {error}", subject.name))
}

fn run(plan: &BakePlan, executor: &mut dyn Executor) -> (IrradianceMaps, Statistics) {
    let (maps, statistics) = bake(plan, executor).unwrap_or_else(|error| panic!("{error}"));
    for light in &statistics.lights {
        let ledgers = light.ledgers.iter().chain(&light.reflected);
        assert!(ledgers.into_iter().all(|ledger| ledger.balances()), "{light:?}");
    }
    (maps, statistics)
}

/// Of refracted light.
fn distance(subject: &Subject, a: &IrradianceMaps, b: &IrradianceMaps) -> Metrics {
    compare(&Layer::Refracted.of(a), &Layer::Refracted.of(b), subject.white_xyz()).expect("maps of one size")
}

/// Photons of the oracle: its own noise is 2 % of RMS.
const PHOTONS: u64 = 500_000;

fn oracle(subject: &Subject) -> IrradianceMaps {
    let settings = BakeSettings { size: SIZE, effort: Effort::Photons(PHOTONS), ..BakeSettings::default() };
    spectral_reference::bake(&subject.scene, subject.receiver, &settings, &|_| {})
        .unwrap_or_else(|error| panic!("{}: {error}", subject.name))
        .maps
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

fn disparities(subject: &Subject, a: &IrradianceMaps, b: &IrradianceMaps) -> Vec<String> {
    let mut found = Vec::new();
    for layer in [Layer::Refracted, Layer::Reflected] {
        if layer.is_negligible(a) && layer.is_negligible(b) {
            continue;
        }
        let judgement = judge(&layer.of(a), &layer.of(b), subject.expected(layer, true), Some(PARITY));
        found.extend(judgement.problems.into_iter().map(|p| format!("{}: {p}", layer.name())));
    }
    found
}

fn bits(maps: &IrradianceMaps) -> impl Iterator<Item = u32> + '_ {
    [&maps.direct, &maps.refracted, &maps.reflected].into_iter().flatten().flatten().map(|v| v.to_bits())
}

#[test]
fn traced_photons_agree_on_every_executor() {
    let mut executors = executors();
    for (name, method) in SCENES {
        let subject = subject(name);
        let settings = Settings { emission_size: 96, map_size: Some(96), ..traced(method) };
        let plan = plan_of(&subject, &settings);
        let mut results = Vec::new();
        for (id, executor) in &mut executors {
            let (maps, statistics) = run(&plan, executor.as_mut());
            let (again, statistics_again) = run(&plan, executor.as_mut());
            assert!(bits(&maps).eq(bits(&again)), "{name}: {id} gave two results");
            assert_eq!(statistics.lights, statistics_again.lights, "{name}: {id} gave two ledgers");
            results.push((*id, executor.info().clone(), maps));
        }
        for (i, (a, device_a, maps_a)) in results.iter().enumerate() {
            for (b, device_b, maps_b) in &results[..i] {
                let found = disparities(&subject, maps_a, maps_b);
                assert!(found.is_empty(), "{name}, {a} and {b}: {found:?}");
                if (&device_a.device, &device_a.driver) == (&device_b.device, &device_b.driver) {
                    assert!(bits(maps_a).eq(bits(maps_b)), "{name}, {a} and {b}, on one driver");
                }
            }
        }
        for sabotage in [Sabotage::Ior, Sabotage::Channel] {
            let spoiled = sabotage.spoil(&plan);
            if spoiled == plan {
                continue;
            }
            let (spoiled, _) = run(&spoiled, executors[0].1.as_mut());
            let found = disparities(&subject, &spoiled, &results[0].2);
            assert!(!found.is_empty(), "{name}: {} went unnoticed", sabotage.description());
        }
    }
}
