//! Caustics: folds and the cusps they meet in; cells on silhouettes.

use asm_core::Settings;
use glam::{DQuat, DVec3, EulerRot};
use spectral_core::dispersion::Dispersion;
use spectral_scene::{Material, Mesh, Scene};

use crate::answer::{Answer, Most, footprints, light_of, same_on_every_executor};
use crate::solids::{drawn_out, floor_at, turn_last};
use crate::stage::*;

/// Waves of water, an egg box of two periods along each side of 1 m, with normals; so high that light of each crest crosses.
fn waves(side: u32) -> Mesh {
    let (amplitude, k) = (0.03, 2.0 * std::f64::consts::TAU);
    let at = |i: u32| {
        let place = |i: u32| f64::from(i) / f64::from(side) - 0.5;
        let [x, z] = [place(i % (side + 1)), place(i / (side + 1))];
        let ([sx, cx], [sz, cz]) = ([(k * x).sin(), (k * x).cos()], [(k * z).sin(), (k * z).cos()]);
        let normal = DVec3::new(-amplitude * k * cx * sz, 1.0, -amplitude * k * sx * cz).normalize();
        (DVec3::new(x, amplitude * sx * sz, z), normal, [x + 0.5, z + 0.5])
    };
    let points: Vec<_> = (0..(side + 1) * (side + 1)).map(at).collect();
    let squares = (0..side * side).map(|i| i / side * (side + 1) + i % side);
    let f32s = |v: DVec3| v.as_vec3().to_array();
    Mesh {
        name: "waves".into(),
        positions: points.iter().map(|p| f32s(p.0)).collect(),
        normals: points.iter().map(|p| f32s(p.1)).collect(),
        uvs: points.iter().map(|p| p.2.map(|c| c as f32)).collect(),
        triangles: squares
            .flat_map(|a| [[a, a + side + 1, a + side + 2], [a, a + side + 2, a + 1]])
            .collect(),
    }
}

fn water_over(depth: f64, dispersion: Dispersion) -> Scene {
    let mut scene = floor_at("waves", 1.0, DVec3::ZERO);
    place(&mut scene, "waves", waves(96), Material::glass("water", dispersion), DVec3::Y * depth);
    scene.lights.push(sun(DVec3::NEG_Y));
    scene
}

#[test]
fn folds_and_cusps_are_the_oracle_s() {
    // The crests' focus lies at n / (n - 1) / (amplitude k^2), 0.84 below them: the floor has a mesh of folds and cusps.
    let dispersion = Dispersion::from_khr(1.33, 20.0 / 20.0).unwrap();
    let scene = water_over(1.2, dispersion.clone());
    let answer = Answer::of(&scene, 1 << 22);
    let settings = footprints(256);
    let most = Most { rms: 0.05, delta_e: 2.0, total_y: 0.003 };
    // Another depth is another caustic.
    let other = light_of(&water_over(1.15, dispersion), &settings);
    answer.tells("folds", &light_of(&scene, &settings), &other, most);
    same_on_every_executor("folds", &scene, &footprints(48));
}

/// A block of glass that stands askew, above a floor.
fn askew(glass: Material, roll: f64) -> Scene {
    let mut scene = floor_at("askew", 1.0, DVec3::ZERO);
    let block = drawn_out(&[[-0.12, -0.1], [0.1, -0.12], [0.12, 0.08], [-0.08, 0.12]], 0.2);
    place(&mut scene, "block", block, glass, DVec3::Y * 0.35);
    turn_last(&mut scene, DQuat::from_euler(EulerRot::ZYX, 0.5 + roll, 0.7, 0.3));
    scene.lights.push(sun(DVec3::new(0.1, -1.0, 0.05)));
    scene
}

#[test]
fn cells_that_straddle_silhouettes_and_edges_lose_nothing() {
    let glass = Material::glass("crown", Dispersion::from_khr(1.52, 20.0 / 59.0).unwrap());
    let scene = askew(glass.clone(), 0.0);
    let answer = Answer::of(&scene, 1 << 20);
    // A dozen cells from edge to edge: few lie within one face.
    let settings = Settings { cell_splits: 4, ..footprints(24) };
    let own = light_of(&scene, &settings);
    let most = Most { rms: 0.03, delta_e: 1.5, total_y: 0.003 };
    answer.tells("askew", &own, &light_of(&askew(glass, 0.03), &settings), most);
}
