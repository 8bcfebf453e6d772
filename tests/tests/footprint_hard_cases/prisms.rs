//! Prisms: wide spreads, undone spreads, and a part of the band that is totally reflected.

use asm_core::{Method, Settings};
use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_scene::{LightShape, Material, Scene};

use crate::answer::{Answer, Most, footprints, light_of, same_on_every_executor};
use crate::solids::*;
use crate::stage::*;

/// Of n_d = 1.6.
fn flint(abbe: f64) -> Material {
    Material::glass("flint", Dispersion::from_khr(1.6, 20.0 / abbe).unwrap())
}

fn plain() -> Material {
    glass(1.6)
}

/// A wedge of 30 degrees under a slit, and its spectrum on a floor.
fn spectrum(glass: Material) -> Scene {
    let mut scene = floor_at("spectrum", 0.24, DVec3::new(0.14, 0.0, 0.0));
    place(&mut scene, "wedge", wedge(30.0, 0.1), glass, DVec3::Y * 0.3);
    place_slit(&mut scene, DVec3::Y * 0.31, 0.01, 0.4);
    scene.lights.push(sun(DVec3::NEG_Y));
    scene
}

fn four_wavelengths(cells: u32) -> Settings {
    Settings { wavelengths: Some(4), ..footprints(cells) }
}

#[test]
fn a_spectrum_four_times_as_wide_is_as_right_and_asm_s_is_not() {
    let settings = four_wavelengths(96);
    let most = Most { rms: 0.01, delta_e: 1.0, total_y: 0.003 };
    let errors = [20.0, 5.0].map(|abbe| {
        let scene = spectrum(flint(abbe));
        let answer = Answer::of(&scene, 1 << 21);
        let own = light_of(&scene, &settings);
        answer.tells(&format!("V_d {abbe}"), &own, &light_of(&spectrum(plain()), &settings), most);
        let asm = light_of(&scene, &Settings::of(Method::Asm));
        [own, asm].map(|layer| answer.distance(&layer).rms.error)
    });
    println!("RMS of footprints and asm: {errors:?}");
    same_on_every_executor("V_d 5", &spectrum(flint(5.0)), &settings);
    let [[_, narrow_asm], [wide_own, wide_asm]] = errors;
    assert!(wide_asm > 5.0 * narrow_asm && wide_asm > 5.0 * wide_own, "{errors:?}");
}

/// A wedge of 30 degrees, and another one that turns its light back.
fn undone(glass: Material, second: Material) -> Scene {
    let mut scene = floor_at("undone", 0.16, DVec3::X * 0.04);
    place(&mut scene, "first", wedge(30.0, 0.1), glass, DVec3::Y * 0.4);
    let thick = 0.02 + 0.2 * 30_f64.to_radians().tan();
    place(&mut scene, "second", wedge_back(30.0, 0.1), second, DVec3::Y * (0.4 - thick - 0.04));
    place_slit(&mut scene, DVec3::Y * 0.41, 0.06, 0.4);
    scene.lights.push(sun(DVec3::NEG_Y));
    scene
}

#[test]
fn two_prisms_that_undo_each_other_give_white_again() {
    let scene = undone(flint(20.0), flint(20.0));
    let answer = Answer::of(&scene, 1 << 21);
    let settings = footprints(96);
    let own = light_of(&scene, &settings);
    // What goes to and fro between the two is not followed: half a per cent of all light, and the colour of the dark beside.
    let most = Most { rms: 0.02, delta_e: 3.0, total_y: 0.007 };
    // The second one does not disperse.
    answer.tells("undone", &own, &light_of(&undone(flint(20.0), plain()), &settings), most);
    // Between the edges, which the way between the two has coloured: white, but for what Fresnel takes more of from blue.
    let middle = |layer: &[[f32; 3]]| {
        let rows = (24..40).flat_map(|y| layer[64 * y + 18..64 * y + 35].iter().copied());
        total(&rows.collect::<Vec<_>>())
    };
    let (own, wanted) = (middle(&own), middle(&answer.mean));
    for c in 0..3 {
        assert!((own[c] / wanted[c] - 1.0).abs() < 5e-3, "{own:?}, {wanted:?}");
        assert!((own[c] / own[1] / (wanted[c] / wanted[1]) - 1.0).abs() < 3e-3, "{own:?}, {wanted:?}");
        assert!((own[c] / own[1] / D65[c] - 1.0).abs() < 0.03, "{own:?}");
    }
}

/// Incidence on the upper face, between the critical angles of 400 and 700 nm.
const CRITICAL_DEG: f64 = 33.6;

/// Light of a near lamp meets the upper face of a prism at about its critical angle. What is thrown back goes straight down, to the
/// middle of the floor; what passes grazes that face and comes down far beside it.
fn critical(glass: Material, side: f32, middle: f64) -> Scene {
    let mut scene = floor_at("critical", side, DVec3::X * middle);
    // Isosceles: light along the axis comes through one leg and leaves by the other, which is level, both at right angles.
    let (sin, cos) = (2.0 * CRITICAL_DEG.to_radians()).sin_cos();
    let [right, left] = [DVec3::X * 0.12, DVec3::new(-cos, sin, 0.0) * 0.12];
    let corners = [DVec3::ZERO, right, left].map(|corner| [corner.x, corner.y]);
    let at = DVec3::Y * 0.16;
    place(&mut scene, "prism", drawn_out(&corners, 0.1), glass, at);
    let position_m = at + 0.5 * (left + right) - 0.4 * DVec3::new(sin, cos, 0.0);
    scene.lights.push(light(LightShape::Point { position_m, range_m: None }, 1.0));
    scene
}

fn dense_flint() -> Material {
    Material::glass("N-SF11", Dispersion::from_khr(1.7847, 20.0 / 25.7).unwrap())
}

#[test]
fn the_edge_of_total_reflection_has_the_oracle_s_colours() {
    let of = |glass| critical(glass, 0.14, 0.04);
    let scene = of(dense_flint());
    let answer = Answer::of(&scene, 3 << 21);
    let settings = footprints(64);
    let most = Most { rms: 0.025, delta_e: 1.6, total_y: 0.003 };
    let without = light_of(&of(crate::stage::glass(1.7847)), &settings);
    answer.tells("critical", &light_of(&scene, &settings), &without, most);
    same_on_every_executor("critical", &scene, &footprints(48));
}

#[test]
fn what_grazes_the_face_of_total_reflection_is_all_there() {
    let of = |glass| critical(glass, 0.5, 0.2);
    let scene = of(dense_flint());
    let answer = Answer::of(&scene, 1 << 21);
    let settings = footprints(64);
    // It is a hundredth of the light, spread wide, and lands in lumps: that is where the colours are off.
    let most = Most { rms: 0.02, delta_e: 4.5, total_y: 0.005 };
    let without = light_of(&of(crate::stage::glass(1.7847)), &settings);
    answer.tells("grazing", &light_of(&scene, &settings), &without, most);
}
