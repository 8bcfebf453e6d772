//! Photons along exact paths against what is known of plates.

use asm_core::{Method, Refraction, Settings, Splat};
use glam::DVec3;
use spectral_scene::{Material, Scene};

use crate::stage::*;

fn with(refraction: Refraction, bounces: u32) -> Settings {
    Settings { refraction: Some(refraction), bounces, emission_size: 64, ..Settings::of(Method::Acm) }
}

/// Share of what goes into glass that lands.
fn lands(scene: &Scene, settings: &Settings) -> f64 {
    let ledger = bake(scene, 16, settings).1.lights[0].ledgers[0];
    assert!(ledger.emitted.flux > 0, "{ledger:?}");
    ledger.landed.flux as f64 / ledger.emitted.flux as f64
}

const INDEX: f64 = 2.4;

/// Of one interface at normal incidence.
fn reflectance() -> f64 {
    ((INDEX - 1.0) / (INDEX + 1.0_f64)).powi(2)
}

fn plate(glass: Material) -> Scene {
    plate_over_floor(glass, 0.8, sun(DVec3::NEG_Y))
}

#[test]
fn a_plate_passes_its_series_as_far_as_it_is_followed() {
    // (1 - R)^2 after no reflection, R^2 of that more after two; odd ones go up.
    let (scene, r) = (plate(glass(INDEX)), reflectance());
    for bounces in 0..=4 {
        let wanted: f64 = (0..=bounces / 2).map(|k| (1.0 - r).powi(2) * r.powi(2 * k as i32)).sum();
        let got = lands(&scene, &with(Refraction::Traced, bounces));
        assert!((got / wanted - 1.0).abs() < 1e-5, "{bounces} bounces: {got}, {wanted}");
        let image_space = lands(&scene, &with(Refraction::ImageSpace, bounces));
        assert!((image_space / (1.0 - r).powi(2) - 1.0).abs() < 1e-5, "{image_space}");
    }
}

#[test]
fn what_a_plate_absorbs_is_taken_off_as_often_as_light_crosses_it() {
    // Half of the light per crossing: the plate is as thick as the distance.
    let (scene, r) = (plate(tinted(INDEX, [0.5; 3], 0.1)), reflectance());
    for (bounces, wanted) in
        [(0, 0.5 * (1.0 - r).powi(2)), (2, (1.0 - r).powi(2) * (0.5 + 0.125 * r.powi(2)))]
    {
        let got = lands(&scene, &with(Refraction::Traced, bounces));
        assert!((got / wanted - 1.0).abs() < 1e-4, "{bounces} bounces: {got}, {wanted}");
    }
}

#[test]
fn light_goes_through_one_plate_after_the_other_where_image_space_sees_the_first() {
    let (mut scene, r) = (plate(glass(INDEX)), reflectance());
    place(&mut scene, "second", cuboid([0.9, 0.1, 0.9]), glass(INDEX), DVec3::Y * 0.08);
    let [traced, image_space] =
        [Refraction::Traced, Refraction::ImageSpace].map(|refraction| lands(&scene, &with(refraction, 0)));
    // The second is wider: what passes beside the first goes through two interfaces as well.
    let (beside, both) = ((1.0 - r).powi(2), (1.0 - r).powi(4));
    let share = (0.8 / 0.9_f64).powi(2);
    let wanted = share * both + (1.0 - share) * beside;
    assert!((traced / wanted - 1.0).abs() < 0.02, "{traced}, {wanted}");
    assert!((image_space / beside - 1.0).abs() < 0.02, "{image_space}, {beside}");
}

#[test]
fn traced_light_is_where_image_space_has_it_too() {
    // Slanting light through a plate: one convex refractor is all that image space needs.
    let scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::new(0.25, -1.0, -0.15)));
    let of = |refraction| {
        let settings =
            Settings { splat: Splat::Point, emission_size: 128, map_size: Some(64), ..with(refraction, 0) };
        bake(&scene, 64, &settings).0.refracted
    };
    let (traced, image_space) = (of(Refraction::Traced), of(Refraction::ImageSpace));
    let rms = relative_rms(&traced, &image_space, 64);
    assert!(rms < 0.02, "{rms}");
    let bent = Settings { emission_size: 128, map_size: Some(64), ..with(Refraction::Traced, 0) };
    let other = plate_over_floor(glass(1.7), 0.4, sun(DVec3::new(0.25, -1.0, -0.15)));
    assert!(relative_rms(&bake(&other, 64, &bent).0.refracted, &image_space, 64) > 0.05);
}

#[test]
fn a_photon_has_the_same_paths_on_any_number_of_threads() {
    let scene = spectral_scene::bundled("gem").unwrap();
    let settings = Settings {
        refraction: Some(Refraction::Traced),
        emission_size: 96,
        ..Settings::of(Method::CausticsMap)
    };
    let plan = plan(&scene, 32, &settings);
    let on = |threads| {
        let mut cpu = frame_plan::cpu::CpuExecutor::new(asm_core::PASSES, Some(threads)).unwrap();
        frame_plan::Executor::prepare(&mut cpu, &plan.plan).unwrap();
        frame_plan::Executor::execute(&mut cpu).unwrap();
        let (maps, statistics) = plan.read(&mut cpu).unwrap();
        (maps, statistics.lights)
    };
    assert_eq!(on(1), on(3));
}
