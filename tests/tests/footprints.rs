//! Footprints on every executor.

use asm_core::{BakePlan, Method, Settings, bake_plan};
use frame_plan::Limits;
use spectral_scene::IrradianceMaps;
use workspace_tests::{executors, subject};
use xtask::checks::{Bound, judge};
use xtask::executors::bake;
use xtask::layers::Layer;
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

/// Flat faces and a slit; smooth normals; internal reflections; an open surface; mirrors; two lamps with eyes.
const SCENES: [&str; 6] = ["prism", "sphere", "gem", "water", "metal-ring", "lamps"];

/// Between executors on different drivers: rounding decides on which side of an edge a path goes.
const PARITY: Bound = Bound { delta_e_mean: Some(0.3), rms_64: Some(0.01), total_y: Some(1e-3) };

fn footprints_of(subject: &Subject) -> BakePlan {
    let settings = Settings { emission_size: 48, ..Settings::of(Method::Footprint) };
    bake_plan(&subject.scene, subject.receiver, [64; 2], &settings, &Limits::default())
        .unwrap_or_else(|error| panic!("{}: {error}", subject.name))
}

fn bits(maps: &IrradianceMaps) -> impl Iterator<Item = u32> + '_ {
    [&maps.direct, &maps.refracted, &maps.reflected].into_iter().flatten().flatten().map(|v| v.to_bits())
}

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

#[test]
fn footprints_agree_on_every_executor() {
    for name in SCENES {
        let subject = subject(name);
        let plan = footprints_of(&subject);
        let mut executors = executors();
        let mut results = Vec::new();
        for (id, executor) in &mut executors {
            let run = |executor: &mut dyn frame_plan::Executor| {
                bake(&plan, executor).unwrap_or_else(|error| panic!("{name} on {id}: {error}"))
            };
            let (maps, statistics) = run(executor.as_mut());
            let (again, statistics_again) = run(executor.as_mut());
            assert!(bits(&maps).eq(bits(&again)), "{name}: {id} gave two results");
            assert_eq!(statistics.lights, statistics_again.lights, "{name}: {id} gave two ledgers");
            for light in &statistics.lights {
                assert!(
                    light.ledgers.iter().chain(&light.reflected).all(|l| l.balances()),
                    "{name}: {light:?}"
                );
            }
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
            let (spoiled, _) = bake(&spoiled, executors[0].1.as_mut())
                .unwrap_or_else(|error| panic!("{name}, {}: {error}", sabotage.description()));
            let found = disparities(&subject, &spoiled, &results[0].2);
            assert!(!found.is_empty(), "{name}: {} went unnoticed", sabotage.description());
        }
    }
}
