//! A brilliant-cut diamond in a Cornell box.

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::facets::brilliant;
use super::stage::{Stage, clear};
use crate::Scene;

const GIRDLE_RADIUS_M: f64 = 0.04;

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("diamond");
    stage.cornell_box(0.2, 0.25);
    // Propped up on the edge of its table: light enters by the pavilion and half of it reaches the floor. With
    // the table up a brilliant sends nearly everything back, which is what it is cut for.
    let world_from_diamond = DMat4::from_translation(DVec3::new(0.0, 0.06, 0.0))
        * DMat4::from_rotation_z(1.95)
        * DMat4::from_rotation_y(0.2)
        * DMat4::from_scale(DVec3::splat(GIRDLE_RADIUS_M));
    let material = clear("diamond", catalogue("diamond"), 0.04);
    stage.place(brilliant(), material, world_from_diamond);
    stage.sun(DVec3::new(0.15, -1.0, -0.1), 1000.0, LightSpectrum::default());
    stage.camera(DVec3::new(0.06, 0.16, 0.19), DVec3::new(0.015, 0.03, 0.0));
    stage.0
}
