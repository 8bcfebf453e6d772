//! A slit, a prism of N-SF11 and the spectrum on the floor.

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::facets::{equilateral_prism, slit_plate};
use super::stage::{Stage, clear, matte};
use crate::Scene;

const SIDE_M: f64 = 0.05;
/// Angle between the light and the vertical: minimum deviation of a 60 degree prism of N-SF11 at the d line,
/// so that this wavelength passes the prism straight down.
const TILT_DEG: f64 = 33.1;
const PRISM_HEIGHT_M: f64 = 0.2;

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("prism");
    let (sin, cos) = TILT_DEG.to_radians().sin_cos();
    let light = DVec3::new(sin, -cos, 0.0);
    let centre = DVec3::Y * PRISM_HEIGHT_M;

    stage.floor(-0.14, 0.0, 0.06);
    let prism = equilateral_prism(SIDE_M, 0.06);
    stage.place(prism, clear("N-SF11", catalogue("N-SF11"), 0.03), DMat4::from_translation(centre));
    // The middle of the face that looks towards the light, which lies in the direction of 60 degrees.
    let (face_sin, face_cos) = 60_f64.to_radians().sin_cos();
    let entry = centre + DVec3::new(face_cos, face_sin, 0.0) * (SIDE_M / 12_f64.sqrt());
    // The plate is wide enough to keep the rest of the light off the receiver.
    let plate = slit_plate([0.36, 0.13], [0.001, 0.02], 0.001);
    let world_from_plate =
        DMat4::from_translation(entry - light * 0.05) * DMat4::from_rotation_z(TILT_DEG.to_radians());
    stage.place(plate, matte("blackened", [0.02; 3]), world_from_plate);

    stage.sun(light, 1000.0, LightSpectrum::default());
    stage.camera(DVec3::new(-0.13, 0.17, 0.25), DVec3::new(-0.075, 0.09, 0.0));
    stage.0
}
