//! Light that meets nothing before it arrives, computed from the receiver's side.

use glam::DVec3;

use crate::lamp::Lamp;
use crate::medium::Nesting;
use crate::tree::{Pending, Ray};
use crate::world::{Start, StartKind, World};

/// XYZ irradiance (Y in lux) that reaches a surface point unblocked. Glass blocks too: what comes through it is not
/// direct. `normal` is the side that is lit.
pub(crate) fn irradiance(
    world: &World,
    lamps: &[Lamp],
    point: DVec3,
    normal: DVec3,
    triangle: u32,
    pending: &mut Pending,
) -> [f64; 3] {
    let mut xyz = [0.0; 3];
    for lamp in lamps {
        let lux = illuminance(world, lamp, point, normal, triangle, pending);
        for (sum, unit) in xyz.iter_mut().zip(lamp.unit_xyz) {
            *sum += lux * unit;
        }
    }
    xyz
}

/// Illuminance in lux by one lamp, shadows and obliqueness included.
pub(crate) fn illuminance(
    world: &World,
    lamp: &Lamp,
    point: DVec3,
    normal: DVec3,
    triangle: u32,
    pending: &mut Pending,
) -> f64 {
    let Some(incident) = lamp.incident(point) else { return 0.0 };
    let cosine = normal.dot(incident.towards);
    if cosine <= 0.0 {
        return 0.0;
    }
    let start = Start { triangle, kind: StartKind::Opaque, nesting: Nesting::default() };
    let ray = Ray::new(point, incident.towards);
    if world.blocked(&ray, &start, incident.distance_m, pending) { 0.0 } else { cosine * incident.lux }
}
