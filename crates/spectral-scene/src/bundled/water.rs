//! Waves over a floor: an open surface, one interface, light lands inside the water.

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::stage::{Stage, clear};
use super::surfaces::{height_field, waves};
use crate::Scene;

const DEPTH_M: f64 = 0.4;
/// Steep enough that the strongest crests focus on the floor: their radius of curvature is about a quarter of the
/// depth. Waves: wave vector along x and z (rad/m), height (m), phase.
const WAVES: [([f64; 2], f64, f64); 4] = [
    ([18.0, 9.0], 0.0060, 0.0),
    ([-11.0, 24.0], 0.0044, 1.0),
    ([31.0, -14.0], 0.0026, 2.3),
    ([6.0, 41.0], 0.0018, 4.1),
];

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("water");
    stage.floor(0.0, 0.0, 0.4);
    // Wider than the floor, so that no light passes beside it, however it slants.
    let surface = height_field("water", 0.8, 128, waves(DEPTH_M, &WAVES));
    let water = clear("water", catalogue("water"), DEPTH_M).attenuating([0.75, 0.96, 0.98], 2.0);
    stage.place(surface, water, DMat4::IDENTITY);
    stage.sun(DVec3::new(0.4, -1.0, 0.25), 1000.0, LightSpectrum::default());
    stage.camera(DVec3::new(0.05, 0.66, 0.27), DVec3::new(0.0, 0.0, -0.02));
    stage.0
}
