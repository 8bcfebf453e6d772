//! Adaptive emission: the fixed grid's photons, less those that miss.

use asm_core::{BakePlan, Emission, Ledger, Method, Reflections, Settings, Statistics, bake_plan};
use frame_plan::Executor;
use glam::DVec3;
use spectral_scene::{LightShape, Scene, bundled};

use crate::stage::*;

fn with_emission(settings: &Settings, emission: Emission) -> Settings {
    Settings { emission: Some(emission), ..settings.clone() }
}

/// The map's words after a frame, and the statistics.
fn map_of(mut plan: BakePlan) -> (Vec<u8>, Statistics) {
    let map = plan.plan.resource("map").unwrap();
    plan.plan.resources[map.0 as usize].readable = true;
    let mut cpu = cpu();
    cpu.prepare(&plan.plan).unwrap();
    // Twice: queues must start empty in every frame.
    cpu.execute().unwrap();
    cpu.execute().unwrap();
    (cpu.read(map).unwrap(), plan.read(&mut cpu).unwrap().1)
}

/// The books of a grid, less the photons that met nothing.
fn without_misses(ledger: &Ledger) -> Ledger {
    Ledger { aimed: Default::default(), missed: Default::default(), ..*ledger }
}

fn same_map_fewer_photons(name: &str, scene: &Scene, settings: &Settings, all_levels: &[u32]) {
    let receiver = scene.receiver("receiver").unwrap();
    let made = |emission| {
        let settings = with_emission(settings, emission);
        map_of(bake_plan(scene, receiver, [32; 2], &settings, &cpu().limits()).unwrap())
    };
    let (grid_map, grid) = made(Emission::Grid);
    assert!(grid_map.iter().any(|&b| b != 0), "{name}: an empty map shows nothing");
    for &levels in all_levels {
        let (map, adaptive) = made(Emission::Adaptive { levels });
        assert!(map == grid_map, "{name}: {levels} levels give another map");
        for (grid, adaptive) in grid.lights.iter().zip(&adaptive.lights) {
            for (grid, adaptive) in grid.ledgers.iter().zip(&adaptive.ledgers) {
                assert!(adaptive.balances());
                assert_eq!(without_misses(adaptive), without_misses(grid), "{name}");
                let misses = grid.missed.photons - adaptive.missed.photons;
                assert_eq!(adaptive.aimed.photons + misses, grid.aimed.photons, "{name}");
            }
            assert!(grid.levels.is_empty());
            assert_eq!(adaptive.levels.len(), levels as usize);
            // Every cell that is not dropped hands on four, at the end one: the photons.
            for pair in adaptive.levels.windows(2) {
                assert_eq!(4 * (pair[0].cells - pair[0].dropped), pair[1].cells, "{name}");
                assert_eq!(pair[0].cell_texels, 2 * pair[1].cell_texels);
            }
            let finest = adaptive.levels[levels as usize - 1];
            assert_eq!(finest.cell_texels, 8);
            for ledger in &adaptive.ledgers {
                // Tiles stick out of views that they do not divide.
                let tiles = (ledger.aimed.photons as f64 / 64.0).ceil() as u32;
                assert!((1..=finest.cells - finest.dropped).contains(&tiles), "{name}");
            }
        }
    }
}

#[test]
fn adaptive_emission_gives_the_grids_map_bit_for_bit() {
    // With blockers before the glass, open water, total reflection, and a size that no level divides.
    for name in ["prism", "ring", "gem", "organic", "water"] {
        let settings = Settings {
            emission_size: 100,
            map_size: Some(64),
            wavelengths: Some(2),
            ..Settings::of(Method::CausticsMap)
        };
        same_map_fewer_photons(name, &bundled(name).unwrap(), &settings, &[1, 3, 6]);
    }
}

#[test]
fn lights_take_turns_with_the_queues() {
    let mut scene = plate_over_floor(glass(1.5), 0.3, sun(DVec3::new(0.3, -1.0, 0.1)));
    let above = DVec3::new(0.1, 0.9, 0.0);
    scene.lights.push(light(LightShape::Point { position_m: above, range_m: None }, 2.0));
    // A block beside the plate, so that the view of both has a hole.
    place(&mut scene, "block", cuboid([0.1; 3]), glass(1.3), DVec3::new(0.4, 0.1, 0.4));
    let settings = Settings { prune: false, reflections: Reflections::None, ..aligned(48) };
    same_map_fewer_photons("two lights", &scene, &settings, &[3]);
}

#[test]
fn views_of_a_texel_and_deeper_chains_than_texels_work() {
    let scene = plate_over_floor(glass(1.5), 0.3, sun(DVec3::NEG_Y));
    for (size, levels) in [(1, 1), (1, 6), (3, 8)] {
        same_map_fewer_photons("plate", &scene, &aligned(size), &[levels]);
    }
}

#[test]
fn glass_under_a_lid_emits_no_photons() {
    let mut scene = plate_over_floor(glass(1.5), 0.3, sun(DVec3::NEG_Y));
    // The lid hides the glass, and without exits nobody asks what is behind a lid: 0 photons.
    place(&mut scene, "lid", cuboid([0.9, 0.1, 0.9]), opaque([1.0; 3]), DVec3::Y * 0.4);
    let settings = Settings {
        interfaces: asm_core::Interfaces::One,
        emission: Some(Emission::Adaptive { levels: 3 }),
        ..aligned(32)
    };
    let (maps, statistics) = bake(&scene, 16, &settings);
    assert_eq!(statistics.photons, 0);
    assert_eq!(statistics.lights[0].levels[0].dropped, statistics.lights[0].levels[0].cells);
    assert_eq!(statistics.lights[0].levels[2].cells, 0);
    assert_eq!(total(&maps.refracted), [0.0; 3]);
}

#[test]
fn misses_are_dropped_where_glass_fills_little_of_the_view() {
    let (_, statistics) = bake(
        &bundled("ring").unwrap(),
        32,
        &Settings { emission: Some(Emission::Adaptive { levels: 6 }), ..aligned(256) },
    );
    let light = &statistics.lights[0];
    let looked_at: u32 = light.levels.iter().map(|l| l.cells).sum();
    let ledger = &light.ledgers[0];
    println!(
        "{} photons of {}, {} miss, {looked_at} cells",
        ledger.aimed.photons,
        256 * 256,
        ledger.missed.photons
    );
    // The ring leaves a part of its view empty, inside and out; tiles on its rims still hold misses.
    assert!(ledger.aimed.photons < 256 * 256 * 3 / 4, "{ledger:?}");
    assert!(ledger.missed.photons < ledger.aimed.photons / 3, "{ledger:?}");
    assert!(looked_at < 2 * ledger.aimed.photons / 64, "{looked_at} cells for {ledger:?}");
}
