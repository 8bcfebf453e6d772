//! The same plan on every executor: one body, every scene.

use asm_core::{BakePlan, LightStatistics, Reflections, Statistics};
use frame_plan::{DeviceInfo, Executor};
use spectral_scene::IrradianceMaps;
use workspace_tests::agreement::on_one_driver;
use workspace_tests::{EMISSION_SIZE, bake_of, executors, small_bake, subject};
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

/// What an executor makes of a plan.
struct Baked {
    id: &'static str,
    device: DeviceInfo,
    maps: IrradianceMaps,
    statistics: Statistics,
}

/// The plan on every executor: twice the same bits on each, the same bits on one driver, and near each other on two.
fn agreeing(
    subject: &Subject,
    plan: &BakePlan,
    executors: &mut [(&'static str, Box<dyn Executor>)],
) -> Vec<Baked> {
    let name = &subject.name;
    let mut results: Vec<Baked> = Vec::new();
    for (id, executor) in executors {
        let id = *id;
        let (maps, statistics) =
            bake(plan, executor.as_mut()).unwrap_or_else(|e| panic!("{name} on {id}: {e}"));
        let again = bake(plan, executor.as_mut()).unwrap_or_else(|e| panic!("{name} on {id}: {e}"));
        // Bits, not values: a NaN would equal nothing, and 0 would equal -0.
        assert!(bits(&maps).eq(bits(&again.0)), "{name}: {id} gave two results");
        assert_eq!(statistics.lights, again.1.lights, "{name}: {id} gave two ledgers");
        results.push(Baked { id, device: executor.info().clone(), maps, statistics });
    }
    for (i, a) in results.iter().enumerate() {
        for b in &results[..i] {
            let pair = format!("{name}: {} and {}", a.id, b.id);
            let bound = Snapping::between(&a.device, &b.device).parity(EMISSION_SIZE);
            let found = disparities(subject, &a.maps, &b.maps, bound);
            assert!(found.is_empty(), "{pair}: {found:?}");
            assert_ledgers_agree(name, &b.statistics, &a.statistics);
            if on_one_driver(&a.device, &b.device) {
                assert!(bits(&a.maps).eq(bits(&b.maps)), "{pair}, on one driver");
                assert_eq!(a.statistics.lights, b.statistics.lights, "{pair}, on one driver");
            }
        }
    }
    results
}

fn executors_agree_on(name: &str) {
    let subject = subject(name);
    let plan = small_bake(&subject);
    let mut executors = executors();
    let results = agreeing(&subject, &plan, &mut executors);
    let first = &results[0];
    // Not even the coarsest rasteriser's bound lets a fault through.
    let coarsest = Snapping::between(&DeviceInfo::default(), &first.device).parity(EMISSION_SIZE);
    for sabotage in Sabotage::ALL {
        let spoiled = sabotage.spoil(&plan);
        if spoiled == plan {
            assert_eq!(subject.scene.refractors().count(), 0, "{name}: nothing to spoil");
            continue;
        }
        let (spoiled, _) = bake(&spoiled, executors[0].1.as_mut())
            .unwrap_or_else(|e| panic!("{name}, {}: {e}", sabotage.description()));
        let found = disparities(&subject, &spoiled, &first.maps, coarsest);
        assert!(!found.is_empty(), "{name}: {} went unnoticed", sabotage.description());
    }
}

/// Light thrown back by the outside of glass too, which is a second pass of photons over the same triangles.
#[test]
fn reflections_of_all_that_is_smooth_agree() {
    // What is round sends light so far that the CPU's rounding shows: there the devices are held against each other.
    for (name, with_cpu) in [("gem", true), ("lamps", false)] {
        let subject = subject(name);
        let mirrors = small_bake(&subject);
        let all = bake_of(&subject, Reflections::All);
        assert!(all.plan.steps.len() >= mirrors.plan.steps.len() && all != mirrors, "{name}");
        let mut executors = executors();
        executors.retain(|(id, _)| with_cpu || *id != "cpu");
        if executors.is_empty() {
            continue;
        }
        let results = agreeing(&subject, &all, &mut executors);
        // They are there, and are not those of mirrors alone.
        assert!(!Layer::Reflected.is_negligible(&results[0].maps), "{name}");
        let (without, _) = bake(&mirrors, executors[0].1.as_mut()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(results[0].maps.reflected != without.reflected, "{name}");
        assert!(results[0].maps.refracted == without.refracted, "{name}: the other layers stay as they are");
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
