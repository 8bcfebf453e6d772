//! The glass sphere of the outside reference, as a mesh.

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::illuminant::Illuminant;
use spectral_core::light::LightSpectrum;

use super::stage::{Stage, clear};
use super::surfaces::SphereGrid;
use crate::Scene;

const RADIUS_M: f64 = 0.05;

/// Light of both outside references: equal energy, 1 lux perpendicular to the beam.
pub(super) fn reference_sun(stage: &mut Stage) {
    stage.sun(DVec3::new(0.3, -1.0, 0.2), 1.0, LightSpectrum::Illuminant(Illuminant::E));
}

pub(super) fn scene(name: &str, subdivisions: u32) -> Scene {
    let mut stage = Stage::new(name);
    stage.floor(0.024, 0.016, 0.08);
    let grid = (0..subdivisions).fold(SphereGrid::geodesic(1), |grid, _| grid.subdivided());
    let sphere = grid.surface("sphere", |d| (d * RADIUS_M, d));
    let cauchy = Dispersion::Cauchy { a: 1.5046, b_um2: 0.0042, c_um4: 0.0 };
    stage.place(sphere, clear("glass", cauchy, 2.0 * RADIUS_M), DMat4::from_translation(DVec3::Y * 0.08));
    reference_sun(&mut stage);
    stage.camera(DVec3::new(0.06, 0.27, 0.14), DVec3::new(0.014, 0.045, 0.008));
    stage.0
}
