//! A gold ring on a table in slanting light: the cardioid that everybody has seen in a cup, strictly a nephroid.

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::stage::Stage;
use super::surfaces::{ProfilePoint, revolve};
use crate::{Material, Scene};

const SEGMENTS: u32 = 256;
const INNER_RADIUS_M: f64 = 0.050;
const WALL_M: f64 = 0.003;
/// Light that slants by 30 degrees and is thrown back at the top of the wall lands beyond the cusp, half a radius from
/// the axis.
const HEIGHT_M: f64 = 0.024;
const GOLD: [f64; 3] = [1.0, 0.766, 0.336];

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("metal-ring");
    stage.floor(0.015, 0.0, 0.12);
    // Half a millimetre of air keeps ring and floor apart.
    let world_from_ring = DMat4::from_translation(DVec3::Y * 0.0005);
    stage.place(revolve("ring", &profile(), SEGMENTS), Material::mirror("gold", GOLD), world_from_ring);
    stage.sun(DVec3::new(0.85, -0.52, -0.2), 1000.0, LightSpectrum::default());
    stage.camera(DVec3::new(-0.01, 0.15, 0.11), DVec3::new(0.012, 0.0, 0.004));
    stage.0
}

/// The section of the wall: bottom, outside, top and inside, with creases between them.
fn profile() -> Vec<Vec<ProfilePoint>> {
    let corners = [
        [INNER_RADIUS_M, 0.0],
        [INNER_RADIUS_M + WALL_M, 0.0],
        [INNER_RADIUS_M + WALL_M, HEIGHT_M],
        [INNER_RADIUS_M, HEIGHT_M],
    ];
    let normals = [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
    let side = |k: usize| {
        [k, (k + 1) % 4]
            .map(|c| ProfilePoint { radius: corners[c][0], y: corners[c][1], normal: normals[k] })
            .to_vec()
    };
    (0..4).map(side).collect()
}
