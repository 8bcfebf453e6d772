//! Surfaces that lie in each other, and features of a millionth of the scene.

use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_scene::{Material, Scene};

use crate::answer::{Answer, Layer, Most, footprints, light_of};
use crate::solids::{drawn_out, floor_at};
use crate::stage::*;

fn crown() -> Material {
    Material::glass("crown", Dispersion::from_khr(1.5, 20.0 / 30.0).unwrap())
}

/// Boxes of these extents in x and y, drawn out along z, over a floor.
fn boxes(extents: &[[[f64; 2]; 2]], direction: DVec3) -> Scene {
    let mut scene = floor_at("boxes", 1.0, DVec3::ZERO);
    for [[left, right], [low, high]] in extents {
        let mesh = drawn_out(&[[*left, *low], [*right, *low], [*right, *high], [*left, *high]], 0.4);
        place(&mut scene, "box", mesh, crown(), DVec3::ZERO);
    }
    scene.lights.push(sun(direction));
    scene
}

const MOST: Most = Most { rms: 0.02, delta_e: 1.0, total_y: 0.003 };

fn check(case: &str, scene: &Scene, control: &Scene, most: Most) -> Layer {
    let settings = footprints(96);
    let own = light_of(scene, &settings);
    Answer::of(scene, 1 << 20).tells(case, &own, &light_of(control, &settings), most);
    own
}

#[test]
fn exit_faces_in_one_plane_are_one_face() {
    // Light slants along their common side, which nothing crosses.
    let direction = DVec3::new(0.0, -1.0, 0.3);
    let whole = boxes(&[[[-0.2, 0.2], [0.2, 0.3]]], direction);
    let halves = boxes(&[[[-0.2, 0.0], [0.2, 0.3]], [[0.0, 0.2], [0.2, 0.3]]], direction);
    let other = boxes(&[[[-0.2, 0.0], [0.2, 0.3]], [[0.01, 0.2], [0.2, 0.3]]], direction);
    check("halves", &halves, &other, MOST);
    // Cells on the seam are split, those of the whole are not.
    let [a, b] = [&whole, &halves].map(|scene| light_of(scene, &footprints(96)));
    assert!(relative_rms(&a, &b, 64) < 0.01);
}

#[test]
fn glass_that_stands_on_the_floor_is_left_before_light_lands() {
    let direction = DVec3::new(0.1, -1.0, 0.3);
    let of = |gap: f64| boxes(&[[[-0.2, 0.2], [gap, 0.1 + gap]]], direction);
    check("on the floor", &of(0.0), &of(0.02), MOST);
}

#[test]
fn a_film_of_a_millionth_passes_what_fresnel_leaves() {
    let of = |thickness: f64| boxes(&[[[-0.2, 0.2], [0.2, 0.2 + thickness]]], DVec3::new(0.1, -1.0, 0.3));
    check("film", &of(1e-6), &of(0.02), MOST);
}

#[test]
fn a_gap_of_a_millionth_is_a_gap() {
    let of = |gap: f64| {
        boxes(&[[[-0.2, 0.2], [0.2, 0.25]], [[-0.2, 0.2], [0.25 + gap, 0.3]]], DVec3::new(0.1, -1.0, 0.3))
    };
    // What goes to and fro between the two is not followed: two surfaces of either, each with 4 % reflected. Its colour is missing
    // from the dark beside.
    let most = Most { rms: 0.03, total_y: 4.0 * 0.05_f64.powi(2), delta_e: 1.1 };
    let one = boxes(&[[[-0.2, 0.2], [0.2, 0.3]]], DVec3::new(0.1, -1.0, 0.3));
    check("gap", &of(1e-6), &one, most);
}

#[test]
fn bevels_of_a_millionth_change_nothing() {
    let [w, h, b] = [0.2, 0.05, 1e-6];
    let sharp = [[-w, -h], [w, -h], [w, h], [-w, h]];
    let bevelled = [
        [-w + b, -h],
        [w - b, -h],
        [w, -h + b],
        [w, h - b],
        [w - b, h],
        [-w + b, h],
        [-w, h - b],
        [-w, -h + b],
    ];
    let of = |polygon: &[[f64; 2]]| {
        let mut scene = floor_at("bevel", 1.0, DVec3::ZERO);
        place(&mut scene, "block", drawn_out(polygon, 0.4), crown(), DVec3::Y * 0.3);
        scene.lights.push(sun(DVec3::new(0.2, -1.0, 0.3)));
        scene
    };
    let shifted = sharp.map(|[x, y]| [x + 0.005, y]);
    let own = check("bevel", &of(&bevelled), &of(&shifted), MOST);
    let apart = relative_rms(&own, &light_of(&of(&sharp), &footprints(96)), 64);
    assert!(apart < 5e-3, "{apart}");
}
