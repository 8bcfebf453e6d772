//! A drinking glass on a table in a Cornell box, under a spot light; about 12,137 faces as in Table 2 of
//! the ASM paper.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::stage::{Stage, clear};
use super::surfaces::{ProfilePoint, revolve};
use crate::{Light, LightShape, Scene};

const SEGMENTS: u32 = 64;
const FOOT_RADIUS_M: f64 = 0.030;
const HEIGHT_M: f64 = 0.110;
const WALL_M: f64 = 0.003;
const BOTTOM_M: f64 = 0.010;
const FILLET_M: f64 = 0.008;
/// The wall leans outwards by this angle.
const LEAN_RAD: f64 = 0.09;

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("glass");
    stage.cornell_box(0.25, 0.25);
    // Half a millimetre of air under the foot keeps glass and table apart.
    let world_from_glass = DMat4::from_translation(DVec3::new(-0.06, 0.0005, 0.02));
    let glass = revolve("glass", &profile(), SEGMENTS);
    stage.place(glass, clear("N-BK7", catalogue("N-BK7"), WALL_M), world_from_glass);

    let position_m = DVec3::new(-0.55, 0.75, 0.25);
    stage.0.lights.push(Light {
        name: "spot".into(),
        color: [1.0; 3],
        intensity: 1000.0,
        spectrum: LightSpectrum::default(),
        shape: LightShape::Spot {
            position_m,
            direction: (DVec3::new(0.0, 0.04, 0.0) - position_m).normalize(),
            inner_cone_rad: 0.25,
            outer_cone_rad: 0.35,
            range_m: None,
        },
    });
    stage.camera(DVec3::new(0.04, 0.20, 0.26), DVec3::new(0.0, 0.04, 0.0));
    stage.0
}

/// Half of the glass's section, from the middle of the foot out, up the outside, over the rounded rim, down
/// the inside and back to the axis; 95 rings between the two poles. The only crease is the edge of the foot.
fn profile() -> Vec<Vec<ProfilePoint>> {
    let (sin, cos) = LEAN_RAD.sin_cos();
    let (outward, inward, down, up) = ([cos, -sin], [-cos, sin], [0.0, -1.0], [0.0, 1.0]);
    let line = |from: [f64; 2], to: [f64; 2], normal: [f64; 2], intervals: u32| {
        (0..=intervals).map(move |i| {
            let t = f64::from(i) / f64::from(intervals);
            // The weights are exact at both ends, so that joined runs share their point exactly.
            ProfilePoint {
                radius: from[0] * (1.0 - t) + to[0] * t,
                y: from[1] * (1.0 - t) + to[1] * t,
                normal,
            }
        })
    };
    // `bulge` is +1 where the centre of the arc lies inside the glass, -1 where it lies outside.
    let arc = |centre: [f64; 2], radius: f64, bulge: f64, angles: [f64; 2], intervals: u32| {
        (0..=intervals).map(move |i| {
            let angle = angles[0] + (angles[1] - angles[0]) * f64::from(i) / f64::from(intervals);
            let normal = [angle.cos(), angle.sin()];
            ProfilePoint {
                radius: centre[0] + bulge * radius * normal[0],
                y: centre[1] + bulge * radius * normal[1],
                normal,
            }
        })
    };
    let foot_edge = [FOOT_RADIUS_M, 0.0];
    let wall_length = (HEIGHT_M - WALL_M) / cos;
    let outer_top = [FOOT_RADIUS_M + wall_length * sin, wall_length * cos];
    let rim = [outer_top[0] + inward[0] * WALL_M / 2.0, outer_top[1] + inward[1] * WALL_M / 2.0];
    let inner_top = [outer_top[0] + inward[0] * WALL_M, outer_top[1] + inward[1] * WALL_M];
    // The fillet's centre lies FILLET_M from the inner wall and from the bottom.
    let fillet_y = BOTTOM_M + FILLET_M;
    let fillet_radius = inner_top[0] - (FILLET_M + (inner_top[1] - fillet_y) * sin) / cos;
    let inner_foot = [fillet_radius - inward[0] * FILLET_M, fillet_y - inward[1] * FILLET_M];
    let bottom_edge = [fillet_radius, BOTTOM_M];

    let foot = line([0.0, 0.0], foot_edge, down, 7).collect();
    let body = line(foot_edge, outer_top, outward, 32)
        .chain(arc(rim, WALL_M / 2.0, 1.0, [-LEAN_RAD, PI - LEAN_RAD], 12).skip(1))
        .chain(line(inner_top, inner_foot, inward, 28).skip(1))
        .chain(arc([fillet_radius, fillet_y], FILLET_M, -1.0, [PI - LEAN_RAD, FRAC_PI_2], 8).skip(1))
        .chain(line(bottom_edge, [0.0, BOTTOM_M], up, 9).skip(1))
        .collect();
    vec![foot, body]
}
