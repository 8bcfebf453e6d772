//! One plan on every executor: the same books and bits each time, the same light as on the others, and what is spoiled noticed.

use asm_core::{BakePlan, Settings, Statistics, bake_plan};
use frame_plan::{DeviceInfo, Executor, Limits};
use spectral_scene::IrradianceMaps;
use xtask::checks::{Bound, judge};
use xtask::executors::bake;
use xtask::layers::Layer;
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

use crate::SIZE;

/// A bake of the small size.
///
/// # Panics
/// If there is no such plan.
#[must_use]
pub fn plan_of(subject: &Subject, settings: &Settings) -> BakePlan {
    bake_plan(&subject.scene, subject.receiver, SIZE, settings, &Limits::default())
        .unwrap_or_else(|error| panic!("{}: {error}", subject.name))
}

/// What a plan bakes.
///
/// # Panics
/// If it does not run, or its books do not balance.
pub fn run(plan: &BakePlan, executor: &mut dyn Executor) -> (IrradianceMaps, Statistics) {
    let (maps, statistics) = bake(plan, executor).unwrap_or_else(|error| panic!("{error}"));
    for light in &statistics.lights {
        let ledgers = light.ledgers.iter().chain(&light.reflected);
        assert!(ledgers.into_iter().all(|ledger| ledger.balances()), "{light:?}");
    }
    (maps, statistics)
}

fn bits(maps: &IrradianceMaps) -> impl Iterator<Item = u32> + '_ {
    [&maps.direct, &maps.refracted, &maps.reflected].into_iter().flatten().flatten().map(|v| v.to_bits())
}

fn disparities(subject: &Subject, a: &IrradianceMaps, b: &IrradianceMaps, bound: Bound) -> Vec<String> {
    let mut found = Vec::new();
    for layer in [Layer::Refracted, Layer::Reflected] {
        if layer.is_negligible(a) && layer.is_negligible(b) {
            continue;
        }
        let judgement = judge(&layer.of(a), &layer.of(b), subject.expected(layer, true), Some(bound));
        found.extend(judgement.problems.into_iter().map(|p| format!("{}: {p}", layer.name())));
    }
    found
}

/// Whether the same instructions run on both.
#[must_use]
pub fn on_one_driver(a: &DeviceInfo, b: &DeviceInfo) -> bool {
    (&a.device, &a.driver) == (&b.device, &b.driver)
}

/// Runs a plan on every executor. Those on one driver agree bit for bit, all others within the bound, beyond which is a plan with
/// another glass or without a channel. Every driver runs it twice: by a second executor, or by the same one again.
///
/// # Panics
/// If they do not.
pub fn assert_executors_agree(
    executors: &mut [(&'static str, Box<dyn Executor>)],
    subject: &Subject,
    settings: &Settings,
    bound: Bound,
) {
    let name = &subject.name;
    let plan = plan_of(subject, settings);
    let mut results = Vec::new();
    let devices: Vec<DeviceInfo> = executors.iter().map(|(_, executor)| executor.info().clone()).collect();
    for (i, (id, executor)) in executors.iter_mut().enumerate() {
        let device = &devices[i];
        let result = run(&plan, executor.as_mut());
        let is_alone = devices.iter().filter(|other| on_one_driver(other, device)).count() == 1;
        if is_alone {
            results.push((*id, device, run(&plan, executor.as_mut())));
        }
        results.push((*id, device, result));
    }
    for (i, (a, device_a, (maps_a, statistics_a))) in results.iter().enumerate() {
        for (b, device_b, (maps_b, statistics_b)) in &results[..i] {
            let found = disparities(subject, maps_a, maps_b, bound);
            assert!(found.is_empty(), "{name}, {a} and {b}: {found:?}");
            if on_one_driver(device_a, device_b) {
                assert!(bits(maps_a).eq(bits(maps_b)), "{name}, {a} and {b}, on one driver");
                assert_eq!(statistics_a.lights, statistics_b.lights, "{name}, {a} and {b}, on one driver");
            }
        }
    }
    for sabotage in [Sabotage::Ior, Sabotage::Channel] {
        let spoiled = sabotage.spoil(&plan);
        if spoiled == plan {
            continue;
        }
        let (spoiled, _) = run(&spoiled, executors[0].1.as_mut());
        let found = disparities(subject, &spoiled, &results[0].2.0, bound);
        assert!(!found.is_empty(), "{name}: {} went unnoticed", sabotage.description());
    }
}
