//! A closed shape with a bunny's lobes in a Cornell box; 137,780 faces (Table 2 of the ASM paper: 138,902).

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;

use super::catalogue;
use super::stage::{Stage, clear};
use super::surfaces::{SphereGrid, star_shaped};
use crate::Scene;

/// 20 * 83^2 faces.
const FREQUENCY: u32 = 83;
const RADIUS_M: f64 = 0.04;

/// Lobes: where each points, how far it stands out (radii) and how narrow it is.
const LOBES: [([f64; 3], f64, f64); 8] = [
    ([0.62, 0.75, 0.0], 0.42, 7.0),    // head
    ([0.35, 0.92, 0.24], 0.50, 40.0),  // ears
    ([0.35, 0.92, -0.24], 0.50, 40.0), //
    ([-0.95, 0.05, 0.0], 0.16, 30.0),  // tail
    ([0.70, -0.62, 0.36], 0.22, 18.0), // fore paws
    ([0.70, -0.62, -0.36], 0.22, 18.0),
    ([-0.35, -0.62, 0.70], 0.30, 9.0), // haunches
    ([-0.35, -0.62, -0.70], 0.30, 9.0),
];
/// Waves over the whole body: wave vector and height (radii).
const WAVES: [([f64; 3], f64); 3] =
    [([9.0, 4.0, -3.0], 0.012), ([-3.0, 8.0, 7.0], 0.010), ([4.0, -7.0, 10.0], 0.008)];

pub(super) fn scene() -> Scene {
    let mut stage = Stage::new("organic");
    stage.cornell_box(0.16, 0.16);
    let shape = SphereGrid::geodesic(FREQUENCY).surface("organic", |d| {
        let (point, normal) = shape_at(d);
        (point * RADIUS_M, normal)
    });
    let material = clear("N-F2", catalogue("N-F2"), 2.0 * RADIUS_M).attenuating([0.80, 0.93, 0.86], 0.1);
    stage.place(shape, material, DMat4::from_translation(DVec3::new(-0.02, 0.055, 0.0)));
    stage.sun(DVec3::new(0.35, -1.0, -0.2), 1000.0, LightSpectrum::default());
    stage.camera(DVec3::new(0.065, 0.18, 0.21), DVec3::new(0.005, 0.042, 0.0));
    stage.0
}

/// The point in direction `d`, in radii, and the normal there.
fn shape_at(d: DVec3) -> (DVec3, DVec3) {
    let (mut radius, mut gradient) = (1.0, DVec3::ZERO);
    for (axis, height, narrowness) in LOBES {
        let axis = DVec3::from(axis).normalize();
        let lobe = height * (narrowness * (axis.dot(d) - 1.0)).exp();
        radius += lobe;
        gradient += axis * narrowness * lobe;
    }
    for (wave, height) in WAVES {
        let wave = DVec3::from(wave);
        let (sin, cos) = wave.dot(d).sin_cos();
        radius += height * sin;
        gradient += wave * height * cos;
    }
    star_shaped(d, radius, gradient)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The normal is derived by hand; finite differences of the surface must lie in its plane.
    #[test]
    fn normal_is_perpendicular_to_the_surface() {
        for d in [DVec3::new(0.3, 0.9, 0.2), DVec3::new(-0.5, -0.6, 0.7), DVec3::new(0.6, 0.7, 0.1)] {
            let d = d.normalize();
            let point = |d: DVec3| shape_at(d.normalize()).0;
            let normal = shape_at(d).1.normalize();
            for along in [d.any_orthonormal_vector(), d.cross(d.any_orthonormal_vector())] {
                let step = 1e-6;
                let tangent = (point(d + along * step) - point(d - along * step)) / (2.0 * step);
                assert!(tangent.normalize().dot(normal).abs() < 1e-8, "{d} {along}");
            }
        }
    }
}
