//! A glass ring in a Cornell box; 65,536 faces as in Table 2 of the ASM paper.

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::stage::{Stage, clear};
use super::surfaces::torus;
use crate::Scene;

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("ring");
    stage.cornell_box(0.2, 0.2);
    let ring = torus("ring", 0.055, 0.014, 256, 128);
    // Leaning to one side, so that its caustic differs round the ring.
    let world_from_ring =
        DMat4::from_translation(DVec3::new(-0.02, 0.055, 0.0)) * DMat4::from_rotation_z(-0.5);
    stage.place(ring, clear("N-SF66", catalogue("N-SF66"), 0.028), world_from_ring);
    stage.sun(DVec3::new(0.3, -1.0, -0.15), 1000.0, LightSpectrum::default());
    stage.camera(DVec3::new(0.04, 0.21, 0.21), DVec3::new(0.005, 0.03, 0.0));
    stage.0
}
