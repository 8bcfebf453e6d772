//! On the floor of a pool, among stones, under waves; after Figure 1 of Shah, Konttinen & Pattanaik (Caustics Mapping).

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::stage::{GREY, Stage, clear, matte};
use super::surfaces::{SphereGrid, height_field, star_shaped, torus, waves};
use crate::{Camera, Mesh, Scene};

const DEPTH_M: f64 = 0.7;
/// Half the side of the floor.
const HALF_M: f64 = 1.0;
/// Steep enough to focus on the floor, short enough for a net of many meshes. Waves: wave vector along x and z (rad/m),
/// height (m), phase.
const WAVES: [([f64; 2], f64, f64); 4] = [
    ([21.0, 10.0], 0.0032, 0.0),
    ([-13.0, 27.0], 0.0025, 1.0),
    ([36.0, -17.0], 0.0011, 2.3),
    ([8.0, 44.0], 0.0009, 4.1),
];
const SAND: [f64; 3] = [0.70, 0.58, 0.40];
const STONE: [f64; 3] = [0.48, 0.45, 0.41];

/// Stones: name, middle (m), half axes (m) and turn about y (rad).
const STONES: [(&str, [f64; 3], [f64; 3], f64); 4] = [
    ("stone-1", [-0.34, 0.06, 0.10], [0.17, 0.13, 0.13], 0.4),
    ("stone-2", [-0.12, 0.03, 0.30], [0.08, 0.06, 0.07], 1.9),
    ("stone-3", [0.42, 0.05, 0.16], [0.12, 0.10, 0.16], 2.6),
    ("stone-4", [-0.60, 0.10, -0.50], [0.24, 0.22, 0.20], 5.0),
];

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("underwater");
    stage.floor_of(0.0, 0.0, HALF_M, matte("sand", SAND));
    stage.walls(HALF_M, DEPTH_M - 0.05, [(); 3].map(|()| matte("tiles", GREY)));
    for (name, middle, half_axes, turn) in STONES {
        let world_from_stone = DMat4::from_translation(DVec3::from(middle))
            * DMat4::from_rotation_y(turn)
            * DMat4::from_scale(DVec3::from(half_axes));
        stage.place(stone(name), matte("stone", STONE), world_from_stone);
    }
    // An arch: half of it is under the sand.
    let world_from_arch = DMat4::from_translation(DVec3::new(0.16, 0.0, -0.30))
        * DMat4::from_rotation_y(0.5)
        * DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
    stage.place(torus("arch", 0.24, 0.05, 64, 32), matte("stone", STONE), world_from_arch);
    // Wider than the pool, so that no light passes beside it.
    let surface = height_field("water", 1.5 * HALF_M, 192, waves(DEPTH_M, &WAVES));
    let water = clear("water", catalogue("water"), DEPTH_M).attenuating([0.50, 0.88, 0.93], 2.5);
    stage.place(surface, water, DMat4::IDENTITY);
    stage.sun(DVec3::new(0.45, -1.0, -0.12), 1000.0, LightSpectrum::default());
    let camera = Camera::look_at(DVec3::new(0.05, 0.40, 0.75), DVec3::new(0.02, 0.10, -0.15));
    stage.0.cameras.push(Camera { yfov_rad: 0.9, ..camera });
    stage.0
}

/// A worn lump of radius about 1.
fn stone(name: &str) -> Mesh {
    SphereGrid::geodesic(10).surface(name, |d| {
        let bumps =
            [([2.1, 0.4, -1.3], 0.10, 0.3), ([-1.0, 2.9, 1.7], 0.06, 2.0), ([3.1, -2.2, 3.4], 0.03, 4.0)];
        let (mut radius, mut gradient) = (1.0, DVec3::ZERO);
        for (wave, height, phase) in bumps {
            let wave = DVec3::from(wave);
            let (sin, cos) = (wave.dot(d) + phase).sin_cos();
            radius += height * sin;
            gradient += wave * height * cos;
        }
        star_shaped(d, radius, gradient)
    })
}
