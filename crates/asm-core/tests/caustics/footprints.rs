//! Footprints against what is known of light.

use asm_core::{Method, PlanError, Settings, bake_plan};
use frame_plan::{Executor, Limits};
use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_core::observer::Observer;

use crate::stage::*;

fn footprints() -> Settings {
    Settings::of(Method::Footprint)
}

/// Mean Y of the texels of a square round the middle.
fn middle_y(layer: &[[f32; 3]], size: usize, half: usize) -> f64 {
    let range = size / 2 - half..size / 2 + half;
    let texels = range.clone().flat_map(|y| range.clone().map(move |x| f64::from(layer[y * size + x][1])));
    texels.sum::<f64>() / (4 * half * half) as f64
}

#[test]
fn a_plate_transmits_its_series_as_far_as_it_is_followed() {
    // At normal incidence, of R per interface: (1 - R)^2 after none, R^2 of that more after two reflections; odd ones go up.
    let n = 2.4;
    let r: f64 = ((n - 1.0) / (n + 1.0_f64)).powi(2);
    let scene = plate_over_floor(glass(n), 0.8, sun(DVec3::NEG_Y));
    for bounces in 0..=4 {
        let wanted: f64 = (0..=bounces / 2).map(|k| (1.0 - r).powi(2) * r.powi(2 * k as i32)).sum();
        let (maps, _) = bake(&scene, 64, &Settings { bounces, ..footprints() });
        let got = middle_y(&maps.refracted, 64, 16);
        assert!((got / wanted - 1.0).abs() < 1e-5, "{bounces} bounces: {got}, {wanted}");
    }
}

#[test]
fn slanting_light_through_a_plate_is_even_up_to_its_shadow_s_edge_and_all_there() {
    // Parallel to itself, shifted: a square of the plate's size, cut by no edge of the floor.
    let direction = DVec3::new(0.25, -1.0, -0.15);
    let scene = plate_over_floor(glass(1.5), 0.4, sun(direction));
    let (maps, statistics) = bake(&scene, 128, &Settings { bounces: 0, ..footprints() });
    let landed: f64 = statistics.lights[0]
        .ledgers
        .iter()
        .zip(&statistics.lights[0].lumens_per_unit)
        .map(|(ledger, lumens)| ledger.landed.flux as f64 * lumens)
        .sum();
    let mapped = total(&maps.refracted)[1] / (128.0 * 128.0);
    assert!((mapped / landed - 1.0).abs() < 1e-3, "{mapped} lumens on the map of {landed} that landed");
    let mut lit: Vec<f64> = maps.refracted.iter().map(|t| f64::from(t[1])).filter(|y| *y > 0.0).collect();
    lit.sort_by(f64::total_cmp);
    let median = lit[lit.len() / 2];
    let even = lit.iter().filter(|y| (*y / median - 1.0).abs() < 0.01).count();
    // 51 texels along a side, of which a few at its edges and behind the plate's own sides are not whole.
    assert!(even > 40 * 40, "{even} of {} texels are even", lit.len());
}

#[test]
fn what_does_not_disperse_stays_white_however_many_wavelengths_there_are() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let mut plain = scene.clone();
    for material in &mut plain.materials {
        if material.is_refractor() {
            material.dispersion = Dispersion::Constant { n: 1.5 };
        }
    }
    let of = |wavelengths| {
        let settings =
            Settings { wavelengths: Some(wavelengths), emission_size: 64, prune: false, ..footprints() };
        bake(&plain, 64, &settings).0.refracted
    };
    let white = plain.lights[0].spectrum.unit_xyz(Observer::default());
    let one = of(1);
    for wavelengths in [2, 3, 4] {
        let many = of(wavelengths);
        let rms = relative_rms(&many, &one, 64);
        assert!(rms < 1e-4, "{wavelengths} wavelengths: {rms}");
        for texel in many.iter().filter(|t| t[1] > 0.05) {
            for c in 0..3 {
                let ratio = f64::from(texel[c]) / f64::from(texel[1]);
                assert!((ratio / white[c] - 1.0).abs() < 1e-3, "{wavelengths} wavelengths: {texel:?}");
            }
        }
    }
}

#[test]
fn few_wavelengths_draw_what_many_lines_draw() {
    // The light of a prism as the sum of lamps of one wavelength each, of which every one is traced for itself.
    let scene = spectral_scene::bundled("prism").unwrap();
    let settings = Settings { emission_size: 64, map_size: Some(128), ..footprints() };
    let size = 64;
    let grid: Vec<f64> = (0..=80).map(|i| 380.0 + 5.0 * f64::from(i)).collect();
    let weights = scene.lights[0].spectrum.spectral_lux(Observer::default(), &grid, 5.0);
    let mut sum = vec![[0.0_f64; 3]; size * size];
    for (nm, weight) in grid.iter().zip(weights).filter(|(_, weight)| weight[1] > 1e-5) {
        let mut line = scene.clone();
        line.lights[0].spectrum = LightSpectrum::line(*nm).unwrap();
        let maps = bake(&line, size as u32, &settings).0;
        for (sum, texel) in sum.iter_mut().zip(&maps.refracted) {
            for c in 0..3 {
                sum[c] += weight[1] * f64::from(texel[c]);
            }
        }
    }
    let lines: Vec<[f32; 3]> = sum.into_iter().map(|t| t.map(|c| c as f32)).collect();
    let continuous = |wavelengths| {
        let settings = Settings { wavelengths: Some(wavelengths), ..settings.clone() };
        bake(&scene, size as u32, &settings).0.refracted
    };
    // Four wavelengths lie nearer to the truth than three, which lie nearer than two; every 5 nm is a texel at most.
    let [two, three, four] = [2, 3, 4].map(|n| relative_rms(&continuous(n), &lines, size));
    assert!(four < 0.03 && three < 0.05 && two > 2.0 * three, "{two} {three} {four}");
    for c in 0..3 {
        let (a, b) = (total(&continuous(4))[c], total(&lines)[c]);
        assert!((a / b - 1.0).abs() < 5e-3, "channel {c}: {a} of {b}");
    }
}

#[test]
fn splits_that_a_queue_cannot_hold_are_the_same_every_time() {
    // Nearly every cell of a diamond goes apart: the queues hold a part of those.
    let scene = spectral_scene::bundled("diamond").unwrap();
    let plan = plan(&scene, 64, &Settings { emission_size: 96, ..footprints() });
    let maps: Vec<_> = [1, 2, 5]
        .into_iter()
        .map(|threads| {
            let mut cpu = frame_plan::cpu::CpuExecutor::new(asm_core::PASSES, Some(threads)).unwrap();
            cpu.prepare(&plan.plan).unwrap();
            cpu.execute().unwrap();
            let (maps, statistics) = plan.read(&mut cpu).unwrap();
            (maps, statistics.lights)
        })
        .collect();
    assert!(maps.iter().all(|m| m == &maps[0]), "threads change the map");
    let cells: u32 = maps[0].1[0].ledgers.iter().map(|l| l.aimed.photons).sum();
    assert!(cells > 3 * 95 * 95, "{cells} cells: none was split");
}

#[test]
fn settings_out_of_range_are_refused() {
    let scene = plate_over_floor(glass(1.5), 1.0, sun(DVec3::NEG_Y));
    for (settings, wanted) in [
        (Settings { wavelengths: Some(5), ..footprints() }, "wavelengths"),
        (Settings { emission_size: 1, ..footprints() }, "emission_size"),
        (Settings { bounces: 8, ..footprints() }, "bounces"),
        (Settings { cell_splits: 9, ..footprints() }, "cell_splits"),
    ] {
        let refused = bake_plan(&scene, 0, [8; 2], &settings, &Limits::default());
        let Err(PlanError::Setting { setting, .. }) = refused else { panic!("{wanted}: {refused:?}") };
        assert_eq!(setting, wanted);
    }
}
