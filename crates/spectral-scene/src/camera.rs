//! Cameras that look at something.

use glam::{DMat4, DVec3};

use crate::{Camera, Scene};

/// Vertical field of view of cameras made here.
const YFOV_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;

impl Camera {
    /// An upright camera at `eye` looking at `target`, with a vertical field of view of 40 degrees.
    ///
    /// Its near plane lies at a thousandth of the distance between the two.
    pub fn look_at(eye: DVec3, target: DVec3) -> Self {
        let backward = (eye - target).try_normalize().unwrap_or(DVec3::Z);
        let right = DVec3::Y.cross(backward).try_normalize().unwrap_or(DVec3::X);
        let up = backward.cross(right);
        Self {
            name: "camera".into(),
            world_from_camera: DMat4::from_cols(
                right.extend(0.0),
                up.extend(0.0),
                backward.extend(0.0),
                eye.extend(1.0),
            ),
            yfov_rad: YFOV_RAD,
            znear_m: (eye.distance(target) * 1e-3).max(f64::MIN_POSITIVE),
        }
    }

    /// A camera that sees all of the scene from above in front; `None` if there is nothing to see.
    pub fn framing(scene: &Scene) -> Option<Self> {
        let (low, high) = scene.bounds(0..scene.objects.len())?;
        let (centre, radius) = ((low + high) / 2.0, low.distance(high) / 2.0);
        // Even a single point is looked at from somewhere.
        let distance = radius.max(f64::from(f32::MIN_POSITIVE)) / (YFOV_RAD / 2.0).sin();
        Some(Self::look_at(centre + DVec3::new(0.3, 0.6, 1.0).normalize() * distance, centre))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn target_is_straight_ahead_and_up_is_up() {
        let camera = Camera::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.5, -1.0));
        let seen = camera.world_from_camera.inverse().transform_point3(DVec3::new(0.0, 0.5, -1.0));
        assert!(seen.truncate().length() < 1e-12 && seen.z < 0.0, "{seen}");
        assert!(camera.world_from_camera.y_axis.y > 0.0);
        // Straight down there is no upright; any rigid frame will do.
        let down = Camera::look_at(DVec3::Y, DVec3::ZERO).world_from_camera;
        assert!((down.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn framing_sees_every_corner() {
        let scene = crate::bundled("gem").expect("bundled");
        let camera = Camera::framing(&scene).expect("not empty");
        for object in 0..scene.objects.len() {
            for p in scene.world_mesh(object).positions {
                let p = camera.world_from_camera.inverse().transform_point3(p);
                assert!(-p.z > camera.znear_m);
                let edge = (camera.yfov_rad / 2.0).tan() * -p.z;
                assert!(p.y.abs() < edge && p.x.abs() < edge, "{p}");
            }
        }
        assert_eq!(Camera::framing(&Scene::default()), None);
    }
}
