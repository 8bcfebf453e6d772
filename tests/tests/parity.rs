//! The same plan on every executor: one body, every scene.

use asm_core::{LightStatistics, Statistics};
use frame_plan::DeviceInfo;
use spectral_scene::IrradianceMaps;
use workspace_tests::{EMISSION_SIZE, executors, small_bake, subject};
use xtask::checks::{Bound, Snapping, judge};
use xtask::executors::bake;
use xtask::layers::Layer;
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

/// What is wrong between two bakes of a scene, one line per finding.
fn disparities(subject: &Subject, a: &IrradianceMaps, b: &IrradianceMaps, bound: Bound) -> Vec<String> {
    let mut found = Vec::new();
    for layer in Layer::ALL {
        if layer.is_negligible(a) && layer.is_negligible(b) {
            continue;
        }
        let shadowed = layer.of(a).check_varies().is_ok();
        let judgement = judge(&layer.of(a), &layer.of(b), subject.expected(layer, shadowed), Some(bound));
        found.extend(judgement.problems.into_iter().map(|p| format!("{}: {p}", layer.name())));
    }
    found
}

/// Photons that two executors may round into different ends, as a share of all.
const ROUNDED_PHOTONS: f64 = 1e-3;

/// The ledgers agree but for rounding, and each one balances exactly.
fn assert_ledgers_agree(name: &str, a: &Statistics, b: &Statistics) {
    assert_eq!(a.lights.len(), b.lights.len(), "{name}: lights with photons");
    for ledger in a.lights.iter().chain(&b.lights).flat_map(|l| l.ledgers.iter().chain(&l.reflected)) {
        assert!(ledger.balances(), "{name}: {ledger:?}");
    }
    for (a, b) in a.lights.iter().zip(&b.lights) {
        let paths = |l: &LightStatistics| [l.ledgers.clone(), l.reflected.clone()].concat();
        let (a_paths, b_paths) = (paths(a), paths(b));
        assert_eq!(a_paths.len(), b_paths.len(), "{name}: paths with photons");
        for (nm, (a, b)) in a.wavelengths_nm.iter().cycle().zip(a_paths.iter().zip(&b_paths)) {
            assert_eq!(a.aimed.photons, b.aimed.photons, "{name}, {nm} nm: photons");
            let room = ROUNDED_PHOTONS * a.aimed.flux as f64;
            for (what, a, b) in [
                ("aimed", a.aimed, b.aimed),
                ("emitted", a.emitted, b.emitted),
                ("landed", a.landed, b.landed),
            ] {
                let difference = a.flux.abs_diff(b.flux) as f64;
                assert!(difference <= room, "{name}, {nm} nm: {what} {a:?} against {b:?}");
            }
        }
    }
}

fn executors_agree_on(name: &str) {
    let subject = subject(name);
    let plan = small_bake(&subject);
    let mut executors = executors();
    let mut results = Vec::new();
    for (id, executor) in &mut executors {
        let first = bake(&plan, executor.as_mut()).unwrap_or_else(|e| panic!("{name} on {id}: {e}"));
        let again = bake(&plan, executor.as_mut()).unwrap_or_else(|e| panic!("{name} on {id}: {e}"));
        // Bits, not values: a NaN would equal nothing, and 0 would equal -0.
        assert!(bits(&first.0).eq(bits(&again.0)), "{name}: {id} gave two results");
        assert_eq!(first.1.lights, again.1.lights, "{name}: {id} gave two ledgers");
        results.push((*id, executor.info().clone(), first));
    }
    for (i, (id, device, (maps, statistics))) in results.iter().enumerate() {
        for (other_id, other_device, (other, other_statistics)) in &results[..i] {
            let bound = Snapping::between(device, other_device).parity(EMISSION_SIZE);
            let found = disparities(&subject, maps, other, bound);
            assert!(found.is_empty(), "{name}: {id} against {other_id}: {found:?}");
            assert_ledgers_agree(name, other_statistics, statistics);
            if (&device.device, &device.driver) == (&other_device.device, &other_device.driver) {
                assert!(bits(maps).eq(bits(other)), "{name}: {id} and {other_id} on one driver");
                assert_eq!(statistics.lights, other_statistics.lights, "{name}: {id} and {other_id}");
            }
        }
    }
    let (_, first_device, (first, _)) = &results[0];
    // Not even the coarsest rasteriser's bound lets a fault through.
    let coarsest = Snapping::between(&DeviceInfo::default(), first_device).parity(EMISSION_SIZE);
    for sabotage in Sabotage::ALL {
        let spoiled = sabotage.spoil(&plan);
        if spoiled == plan {
            assert_eq!(subject.scene.refractors().count(), 0, "{name}: nothing to spoil");
            continue;
        }
        let (spoiled, _) = bake(&spoiled, executors[0].1.as_mut())
            .unwrap_or_else(|e| panic!("{name}, {}: {e}", sabotage.description()));
        let found = disparities(&subject, &spoiled, first, coarsest);
        assert!(!found.is_empty(), "{name}: {} went unnoticed", sabotage.description());
    }
}

fn bits(maps: &IrradianceMaps) -> impl Iterator<Item = u32> + '_ {
    [&maps.direct, &maps.refracted, &maps.reflected].into_iter().flatten().flatten().map(|v| v.to_bits())
}

macro_rules! parity {
    ($($test:ident: $scene:literal,)*) => {
        $(#[test]
        fn $test() {
            executors_agree_on($scene);
        })*

        #[test]
        fn every_scene_is_tested() {
            assert!(Subject::names().eq([$($scene),*]), "scenes: {:?}", Subject::names().collect::<Vec<_>>());
        }
    };
}

parity! {
    prism: "prism",
    sphere: "sphere",
    sphere_fine: "sphere-fine",
    ring: "ring",
    gem: "gem",
    diamond: "diamond",
    glass: "glass",
    organic: "organic",
    water: "water",
    metal_ring: "metal-ring",
    underwater: "underwater",
    lamps: "lamps",
    bunny_glass: "bunny-glass",
}
