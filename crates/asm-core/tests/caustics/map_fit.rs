//! Maps fitted to where light lands: finer, with the same light in them.

use asm_core::shared::view::View;
use asm_core::{MapFit, Method, Settings, Splat, Statistics, render_plan};
use frame_plan::{Executor, Plan, ResourceId};
use glam::{DMat4, DVec2, DVec3, UVec2};
use spectral_scene::{BUNDLED, Camera, LightShape, Scene, bundled};

use crate::stage::*;

/// Words of a resource after a frame.
fn words(executor: &mut dyn Executor, id: ResourceId) -> Vec<u32> {
    executor.read(id).unwrap().chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect()
}

/// A frame of a picture of a scene with one light.
struct Frame {
    statistics: Statistics,
    /// Emission's first, the camera's last, if the buffer holds more than the plan was made with the map's were written.
    views: Vec<View>,
    /// Sums over the map, in its units.
    sums: [u128; 3],
}

fn readable(plan: &mut Plan, name: &str) -> ResourceId {
    let id = plan.resource(name).unwrap();
    plan.resources[id.0 as usize].readable = true;
    id
}

fn frame(scene: &Scene, settings: &Settings) -> Frame {
    let mut cpu = cpu();
    let mut plan = render_plan(scene, 0, [8; 2], settings, &cpu.limits()).unwrap();
    let [map, views] = ["map", "views"].map(|name| readable(&mut plan.plan, name));
    cpu.prepare(&plan.plan).unwrap();
    cpu.execute().unwrap();
    let statistics = plan.read(&mut cpu).unwrap().1;
    assert!(statistics.lights.iter().flat_map(|l| &l.ledgers).all(asm_core::Ledger::balances));
    let mut sums = [0; 3];
    for texel in words(&mut cpu, map).chunks_exact(6) {
        (0..3).for_each(|c| sums[c] += u128::from(texel[2 * c]) + (u128::from(texel[2 * c + 1]) << 32));
    }
    let views = cpu.read(views).unwrap();
    let views = views.chunks_exact(size_of::<View>()).map(bytemuck::pod_read_unaligned).collect();
    Frame { statistics, views, sums }
}

impl Frame {
    /// How much finer than the landing views each face of the map is, with its cells from the left and from the top.
    fn zooms(&self) -> Vec<(DVec2, DVec2)> {
        let faces = (self.views.len() - 2) / 2;
        let zoom = |face: usize| {
            let (landing, map) = (&self.views[1 + face], &self.views[1 + faces + face]);
            let zoom = landing.texel_slope.as_dvec2() / map.texel_slope.as_dvec2();
            let middle = (map.slope_center - landing.slope_center).as_dvec2() / landing.slope_half.as_dvec2();
            (zoom, 64.0 * middle)
        };
        (0..faces).map(zoom).collect()
    }

    fn outside(&self) -> u64 {
        self.statistics.lights.iter().flat_map(|l| &l.ledgers).map(|l| l.outside_map.flux).sum()
    }

    fn landed(&self) -> u64 {
        self.statistics.lights.iter().flat_map(|l| &l.ledgers).map(|l| l.landed.flux).sum()
    }
}

fn of(fit: MapFit) -> Settings {
    Settings {
        map_fit: Some(fit),
        emission_size: 256,
        map_size: Some(256),
        ..Settings::of(Method::CausticsMap)
    }
}

/// A small plate, and a camera to ask for a picture.
fn small_plate(light: spectral_scene::Light) -> Scene {
    let mut scene = plate_over_floor(glass(1.5), 0.06, light);
    scene.cameras.push(Camera::look_at(DVec3::ONE, DVec3::ZERO));
    scene
}

#[test]
fn a_small_caustic_on_a_large_floor_gets_a_fine_map_with_all_of_its_light() {
    let scene = small_plate(sun(DVec3::new(0.3, -1.0, 0.1)));
    for splat in [Splat::Auto, Splat::Gaussian { radius: 2 }] {
        let settings = |fit| Settings { splat, ..of(fit) };
        let (wide, fitted) =
            (frame(&scene, &settings(MapFit::Receivers)), frame(&scene, &settings(MapFit::Landings)));
        assert_eq!(wide.views.len(), 3);
        for (zoom, _) in fitted.zooms() {
            assert!(zoom.min_element() >= 4.0, "{splat:?}: {zoom}");
        }
        assert!(wide.landed() > 0);
        assert_eq!((fitted.landed(), fitted.outside()), (wide.landed(), wide.outside()));
        assert_eq!(fitted.sums, wide.sums, "{splat:?}: every unit is in the map");
    }
}

#[test]
fn a_fitted_map_shows_the_same_caustic_finer() {
    // A bake that takes as many samples as the fine map has texels.
    let scene = plate_over_floor(glass(1.5), 0.2, sun(DVec3::new(0.3, -1.0, 0.1)));
    let bake_of = |fit, map_size| {
        let settings = Settings { map_size: Some(map_size), bake_samples: 16, emission_size: 512, ..of(fit) };
        bake(&scene, 64, &settings).0.refracted
    };
    let (fine, coarse, fitted) =
        (bake_of(MapFit::Receivers, 1024), bake_of(MapFit::Receivers, 128), bake_of(MapFit::Landings, 128));
    for c in 0..3 {
        assert!(
            (total(&fitted)[c] / total(&fine)[c] - 1.0).abs() < 1e-3,
            "{:?} {:?}",
            total(&fitted),
            total(&fine)
        );
    }
    let [coarse, fitted] = [coarse, fitted].map(|map| relative_rms(&map, &fine, 64));
    assert!(fitted < 0.4 * coarse, "{fitted} fitted, {coarse} not");
}

#[test]
fn the_fitted_view_stands_still_while_the_light_hardly_moves() {
    let at = |x: f64| frame(&small_plate(sun(DVec3::new(0.3 + x, -1.0, 0.1))), &of(MapFit::Landings)).zooms();
    let first = at(0.0);
    let close = |a: DVec2, b: DVec2| a.distance(b) < 1e-4 * a.length();
    for x in [1e-5, 1e-4, 4e-4] {
        for ((zoom, cells), (zoom_0, cells_0)) in at(x).into_iter().zip(&first) {
            assert!(close(zoom, *zoom_0) && close(cells, *cells_0), "{x}: {zoom} {cells}, was {first:?}");
        }
    }
    // Farther, it follows.
    let (_, cells) = at(0.2)[0];
    assert!(cells.distance(first[0].1) > 1.0, "{cells} {first:?}");
}

#[test]
fn where_nothing_lands_the_map_shows_all_receivers() {
    let frame = frame(&small_plate(sun(DVec3::X)), &of(MapFit::Landings));
    assert_eq!((frame.landed(), frame.sums), (0, [0; 3]));
    assert_eq!(frame.views[2], frame.views[1]);
}

#[test]
fn faces_round_a_lamp_are_fitted_one_by_one() {
    let position_m = DVec3::new(0.02, 0.4, 0.01);
    let mut scene = small_plate(light(LightShape::Point { position_m, range_m: None }, 1.0));
    // A room round the lamp needs all six faces; light comes through the plate down to the floor only.
    scene.objects[0].world_from_mesh = DMat4::from_scale(DVec3::splat(8.0));
    let (wide, fitted) = (frame(&scene, &of(MapFit::Receivers)), frame(&scene, &of(MapFit::Landings)));
    assert_eq!((wide.views.len(), fitted.views.len()), (8, 14));
    let zooms = fitted.zooms();
    assert_eq!(zooms.iter().filter(|(zoom, _)| *zoom == DVec2::ONE).count(), 5, "{zooms:?}");
    assert!(zooms.iter().any(|(zoom, _)| zoom.min_element() > 2.0), "{zooms:?}");
    assert!(wide.landed() > 0);
    assert_eq!((fitted.landed(), fitted.sums), (wide.landed(), wide.sums));
}

#[test]
fn hardly_any_light_of_the_bundled_scenes_lands_outside_the_fitted_map() {
    let scenes = BUNDLED.iter().map(|name| (name, bundled(name).unwrap()));
    // Some scenes have mirrors only.
    for (name, scene) in scenes.filter(|(_, scene)| scene.refractors().next().is_some()) {
        // Only these have landings that few photons find.
        let stray = ["diamond", "glass"].contains(name);
        for (emission_size, wavelengths) in [(128, 1), if stray { (512, 4) } else { (320, 1) }] {
            let settings = |fit| Settings {
                emission_size,
                map_size: Some(128),
                wavelengths: Some(wavelengths),
                ..of(fit)
            };
            let (wide, fitted) =
                (frame(&scene, &settings(MapFit::Receivers)), frame(&scene, &settings(MapFit::Landings)));
            let lost = (fitted.outside() - wide.outside()) as f64 / wide.landed() as f64;
            // With every texel traced there is none.
            assert!(lost < if emission_size < 256 { 1e-12 } else { 1e-5 }, "{name}: {lost}");
        }
    }
}

#[test]
fn gaps_in_a_fitted_map_are_filled_where_surfaces_are() {
    let scene = bundled("prism").unwrap();
    let settings = |fit| Settings { method: Method::Asm, ..of(fit) };
    let (wide, fitted) =
        (frame(&scene, &settings(MapFit::Receivers)), frame(&scene, &settings(MapFit::Landings)));
    let energy = fitted.statistics.lights[0].gap_filling.unwrap();
    assert_eq!(energy.before_xyz, energy.after_xyz);
    assert!(energy.lit_after > energy.lit_before, "{energy:?}");
    let lit = |frame: &Frame| frame.statistics.lights[0].gap_filling.unwrap().lit_before;
    assert!(lit(&fitted) > 4 * lit(&wide), "finer");
    assert_eq!(fitted.sums, wide.sums);
}

#[test]
fn splats_that_would_not_overlap_limit_the_zoom() {
    let scene = small_plate(sun(DVec3::NEG_Y));
    let zoom = |splat, emission_size| {
        let settings = Settings { splat, emission_size, ..of(MapFit::Landings) };
        frame(&scene, &settings).zooms()[0].0.max_element()
    };
    // As many photons as fit into the plate's shadow on the wide map: a point each, with nothing between them.
    assert_eq!(zoom(Splat::Point, 15), 1.0);
    let (few, many) = (zoom(Splat::Auto, 15), zoom(Splat::Auto, 256));
    assert!(few > 1.0 && few <= 4.3 && many > 2.0 * few, "{few} {many}");
}

#[test]
fn intensity_per_texel_keeps_its_texels() {
    let settings = Settings { map_fit: Some(MapFit::Landings), ..Settings::shah() };
    assert_eq!(settings.map_fit(), MapFit::Receivers);
    let plan = render_plan(&bundled("prism").unwrap(), 0, [8; 2], &settings, &cpu().limits()).unwrap();
    assert!(!plan.plan.step_names().iter().any(|step| step.starts_with("map_fit")));
    assert_eq!(UVec2::splat(8), UVec2::from(plan.size));
}
