//! The 24-face gem of the outside reference.

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;

use super::facets::gem;
use super::sphere::reference_sun;
use super::stage::{Stage, clear};
use crate::Scene;

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("gem");
    stage.floor(0.024, 0.016, 0.2);
    let cauchy = Dispersion::Cauchy { a: 2.3818, b_um2: 0.0121, c_um4: 0.0 };
    stage.place(gem(), clear("glass", cauchy, 0.042), DMat4::IDENTITY);
    reference_sun(&mut stage);
    stage.camera(DVec3::new(0.08, 0.25, 0.23), DVec3::new(0.02, 0.02, 0.02));
    stage.0
}
