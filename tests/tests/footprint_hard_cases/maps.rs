//! Footprints against the edges of the map.

use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_scene::{Material, Scene};

use crate::answer::{Answer, Most, SIZE, footprints, light_of, light_on};
use crate::solids::{floor_at, place_slit, wedge};
use crate::stage::*;

/// Of the floor, metres; the spectrum is 0.08 long, and 0.03 wide.
const SIDE: f32 = 0.05;

/// A wide spectrum, of which a short floor takes the middle; `around` is what the rest falls on.
pub(crate) fn short_floor(around: Option<f32>, offset: f64) -> Scene {
    let glass = Material::glass("flint", Dispersion::from_khr(1.6, 4.0).unwrap());
    let mut scene = floor_at("short", SIDE, DVec3::X * (0.15 + offset));
    if let Some(side) = around {
        place(&mut scene, "around", quad(side), opaque([1.0; 3]), DVec3::new(0.15, -0.001, 0.0));
    }
    place(&mut scene, "wedge", wedge(30.0, 0.1), glass, DVec3::Y * 0.3);
    place_slit(&mut scene, DVec3::Y * 0.31, 0.03, 0.4);
    scene.lights.push(sun(DVec3::NEG_Y));
    scene
}

#[test]
fn footprints_longer_than_the_map_leave_it_what_is_its_own() {
    // What lies below the floor takes nothing from it: the answer is one.
    let answer = Answer::of(&short_floor(Some(1.0), 0.0), 1 << 22);
    for around in [None, Some(1.0)] {
        let scene = short_floor(around, 0.0);
        let settings = footprints(96);
        let (own, statistics) = light_on(&mut cpu(), &scene, &settings);
        let most = Most { rms: 0.1, delta_e: 1.5, total_y: 0.04 };
        answer.tells("short", &own, &light_of(&short_floor(around, 0.002), &settings), most);
        // What landed, by the books, is on the map; the rest went by, and the books know how much.
        let light = &statistics.lights[0];
        let lumens = |flux: &dyn Fn(&asm_core::Ledger) -> u64| -> f64 {
            light.ledgers.iter().zip(&light.lumens_per_unit).map(|(l, per)| flux(l) as f64 * per).sum()
        };
        let landed = lumens(&|l| l.landed.flux);
        let beyond = lumens(&|l| l.outside_map.flux + l.escaped.flux);
        let texel = f64::from(SIDE / SIZE as f32).powi(2);
        let mapped = total(&own)[1] * texel;
        println!("{around:?}: {landed} landed, {beyond} beyond, {mapped} on the map");
        assert!((mapped / landed - 1.0).abs() < 5e-3, "{mapped} on the map, {landed} landed");
        assert!(beyond > landed, "{beyond} {landed}");
    }
}
