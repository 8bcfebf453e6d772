//! Every photon's flux is accounted for, and the map holds what landed.

use std::sync::atomic::{AtomicU32, Ordering};

use asm_core::shared::light_views::Located;
use asm_core::shared::splat::splat;
use asm_core::shared::view::View;
use asm_core::{Method, Reflections, Settings, Splat, Statistics};
use bytemuck::Zeroable;
use frame_plan::Executor;
use glam::{DVec3, UVec2, Vec2};

use crate::stage::*;

/// The map's sums per channel in units, and the statistics.
fn map_sums(scene: &spectral_scene::Scene, settings: &Settings) -> ([u128; 3], Statistics) {
    let mut plan = plan(scene, 16, settings);
    let map = plan.plan.resource("map").unwrap();
    plan.plan.resources[map.0 as usize].readable = true;
    let mut cpu = cpu();
    cpu.prepare(&plan.plan).unwrap();
    cpu.execute().unwrap();
    let words: Vec<u32> = cpu.read(map).unwrap().chunks_exact(4).map(bytemuck::pod_read_unaligned).collect();
    let mut sums = [0; 3];
    for texel in words.chunks_exact(6) {
        for c in 0..3 {
            sums[c] += u128::from(texel[2 * c]) | u128::from(texel[2 * c + 1]) << 32;
        }
    }
    (sums, plan.read(&mut cpu).unwrap().1)
}

/// The books against the map: each landed photon is rounded to half a unit per channel.
fn assert_map_holds_what_landed(scene: &spectral_scene::Scene, settings: &Settings) {
    let (sums, statistics) = map_sums(scene, settings);
    let light = &statistics.lights[0];
    assert!(light.ledgers.iter().chain(&light.reflected).all(|ledger| ledger.balances()), "{light:?}");
    // The map is cleared for each path of light: it holds the last one's.
    let ledgers = if light.reflected.is_empty() { &light.ledgers } else { &light.reflected };
    // Weights as the plan scales them: whole parts of the largest.
    let set = spectral_core::wavelengths::WavelengthSet::new(
        settings.scheme(),
        settings.wavelength_count() as usize,
        settings.range_nm(),
        settings.observer,
    )
    .unwrap();
    let shining = settings.lights.as_ref().map_or(0, |lights| lights[0]);
    let weights = set.light_weights(&scene.lights[shining].spectrum);
    let largest = weights.iter().flatten().copied().fold(0.0, f64::max);
    let put_down = |l: &asm_core::Ledger| l.landed.flux + l.beside.flux;
    let photons: u64 =
        ledgers.iter().map(|l| u64::from(l.landed.photons) + u64::from(l.beside.photons)).sum();
    assert!(photons > 0);
    for c in 0..3 {
        let part = |w: &[f64; 3]| (w[c] / largest * f64::from(1_u32 << 31)).round() as u128;
        let landed: u128 = weights.iter().zip(ledgers).map(|(w, l)| u128::from(put_down(l)) * part(w)).sum();
        let difference = sums[c].abs_diff(landed >> 31);
        assert!(difference <= u128::from(photons / 2 + 1), "{c}: {difference} units for {photons} photons");
    }
}

#[test]
fn books_balance_on_every_bundled_scene() {
    let scenes = spectral_scene::BUNDLED.iter().map(|name| spectral_scene::bundled(name).unwrap());
    for scene in scenes.filter(|scene| scene.name != "sphere-fine") {
        // One map is looked at: that of one light, and of one path of its light.
        for (light, reflections) in
            (0..scene.lights.len()).flat_map(|i| [(i, Reflections::None), (i, Reflections::Mirrors)])
        {
            let [glass, mirrors] = [scene.refractors().count() > 0, scene.mirrors().count() > 0];
            if if reflections == Reflections::None { glass } else { mirrors } {
                let settings = Settings {
                    emission_size: 96,
                    lights: Some(vec![light]),
                    reflections,
                    ..Settings::of(Method::CausticsMap)
                };
                assert_map_holds_what_landed(&scene, &settings);
            }
        }
    }
}

#[test]
fn one_texel_holds_every_photon() {
    let scene = plate_over_floor(glass(1.5), 0.5, sun(DVec3::NEG_Y));
    // Hundreds of thousands of photons of up to 2^30 units: the low words carry thousands of times.
    for (splat, emission_size) in [(Splat::Point, 256), (Splat::Gaussian { radius: 8 }, 32)] {
        let settings = Settings {
            emission_size,
            map_size: Some(1),
            wavelengths: Some(21),
            splat,
            prune: false,
            reflections: Reflections::None,
            ..Settings::of(Method::CausticsMap)
        };
        assert_map_holds_what_landed(&scene, &settings);
        let (sums, _) = map_sums(&scene, &settings);
        assert!(sums[1] > 1 << 38, "{sums:?}");
    }
}

#[test]
fn taps_sum_to_the_deposit() {
    let size = UVec2::new(9, 7);
    let views = [View { size, ..View::zeroed() }];
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state
    };
    for i in 0..2000 {
        let reach = UVec2::new(i % 9, i / 9 % 9);
        let sigma = Vec2::new(0.3 + (random() >> 8) as f32 * 3e-7, 0.3 + (random() >> 8) as f32 * 3e-7);
        let unit = |r: u32| (r >> 8) as f32 / (1 << 24) as f32;
        let texel = Vec2::new(unit(random()), unit(random())) * size.as_vec2();
        let at = Located { found: true, face: 0, view: 0, texel };
        let deposit = [random() >> 2, random() >> 20, [0, 1, 1 << 30][i as usize % 3]];
        let map: Vec<AtomicU32> = (0..6 * size.element_product()).map(|_| AtomicU32::new(0)).collect();
        splat(&views, &at, deposit, reach, sigma, &map);
        for c in 0..3 {
            let sum: u64 = map.chunks_exact(6).map(|t| u64::from(t[2 * c].load(Ordering::Relaxed))).sum();
            assert_eq!(sum, u64::from(deposit[c]), "channel {c}, reach {reach}, at {texel}");
        }
    }
}

#[test]
fn emitted_lumens_are_those_of_the_glass() {
    // 1 lux on a plate of 0.4 x 0.4 m seen from above, and 2 cd on a plate seen under a known solid angle.
    let lumens = |scene| {
        let (_, statistics) =
            bake(&scene, 16, &Settings { emission_size: 700, ..Settings::of(Method::CausticsMap) });
        let light = &statistics.lights[0];
        let total =
            light.ledgers.iter().zip(&light.lumens_per_unit).map(|(l, unit)| l.emitted.flux as f64 * unit);
        total.sum::<f64>()
    };
    let parallel = lumens(plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y)));
    assert!((parallel / 0.16 - 1.0).abs() < 3e-3, "{parallel}");
    let position_m = DVec3::Y * 0.75;
    let lamp = light(spectral_scene::LightShape::Point { position_m, range_m: None }, 2.0);
    let eye = lumens(plate_over_floor(glass(1.5), 0.4, lamp));
    // A square of half side a at distance d: 4 atan(a^2 / (d sqrt(d^2 + 2 a^2))).
    let (a, d) = (0.2_f64, 0.5_f64);
    let wanted = 2.0 * 4.0 * (a * a / (d * (d * d + 2.0 * a * a).sqrt())).atan();
    assert!((eye / wanted - 1.0).abs() < 3e-3, "{eye} {wanted}");
}

#[test]
fn the_same_plan_gives_the_same_bits_on_any_number_of_threads() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let plan = plan(&scene, 64, &Settings { emission_size: 128, ..Settings::of(Method::CausticsMap) });
    let on = |threads| {
        let mut cpu = frame_plan::cpu::CpuExecutor::new(asm_core::PASSES, Some(threads)).unwrap();
        cpu.prepare(&plan.plan).unwrap();
        cpu.execute().unwrap();
        let first = plan.read(&mut cpu).unwrap();
        cpu.execute().unwrap();
        let second = plan.read(&mut cpu).unwrap();
        assert_eq!(first.0, second.0);
        (first.0, first.1.lights)
    };
    assert_eq!(on(1), on(3));
}
