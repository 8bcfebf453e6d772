//! Ray against triangle in f64, watertight along shared edges.

use glam::DVec3;

use crate::tree::Ray;

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    /// Along the ray, metres; may be negative.
    pub(crate) distance: f64,
    /// Weights of the corners, each 0 to 1 up to [`EDGE`], that sum to 1.
    pub(crate) barycentric: DVec3,
    /// The ray comes from the side where the corners run counter-clockwise.
    pub(crate) front: bool,
}

/// How far beyond its edges a triangle is met, as a share of its size: the rounding of a triangle seen from a
/// thousand times its size, and far below anything that shows.
const EDGE: f64 = 1.0 / (1_u64 << 38) as f64;

/// The crossing of a line with a triangle; `None` beside it, and for a line in its plane.
///
/// An edge is passed on the side that the sign of the Pluecker product d . (q - p) x (q + p) tells, corners taken
/// relative to the origin. Its rounding is exactly antisymmetric in p and q, so the two triangles at an edge never
/// both miss a ray that passes there. Within [`EDGE`] of an edge both are met: a ray that starts on a corner has all
/// but one product at rounding size, and must not slip out between the neighbours.
#[inline]
pub(crate) fn cross(ray: &Ray, corners: &[DVec3; 3]) -> Option<Crossing> {
    let d = ray.direction;
    let [a, b, c] = corners.map(|p| p - ray.origin);
    let u = d.dot((c - b).cross(c + b));
    let v = d.dot((a - c).cross(a + c));
    let w = d.dot((b - a).cross(b + a));
    let (least, most) = (u.min(v).min(w), u.max(v).max(w));
    let slack = EDGE * most.max(-least);
    if least < -slack && most > slack {
        return None;
    }
    let sum = u + v + w;
    let normal = (b - a).cross(c - a);
    let slope = normal.dot(d);
    if sum == 0.0 || slope == 0.0 {
        return None;
    }
    Some(Crossing {
        distance: normal.dot(a) / slope,
        barycentric: DVec3::new(u, v, w) / sum,
        front: slope < 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn distance_side_and_weights() {
        let down = cross(&Ray::new(DVec3::new(0.25, 0.5, 2.0), DVec3::NEG_Z), &CORNERS).unwrap();
        assert_eq!(down.distance, 2.0);
        assert!(down.front);
        assert_eq!(down.barycentric, DVec3::new(0.25, 0.25, 0.5));
        let up = cross(&Ray::new(DVec3::new(0.25, 0.5, 2.0), DVec3::Z), &CORNERS).unwrap();
        assert_eq!(up.distance, -2.0);
        assert!(!up.front);
    }

    #[test]
    fn a_ray_in_the_plane_or_beside_misses() {
        assert_eq!(cross(&Ray::new(DVec3::new(-1.0, 0.2, 0.0), DVec3::X), &CORNERS), None);
        assert_eq!(cross(&Ray::new(DVec3::new(0.6, 0.6, 1.0), DVec3::NEG_Z), &CORNERS), None);
    }

    #[test]
    fn a_triangle_without_area_is_never_met() {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        for direction in [DVec3::NEG_Z, DVec3::new(0.3, 0.0, -1.0).normalize()] {
            assert_eq!(cross(&Ray::new(DVec3::new(0.5, 0.0, 1.0), direction), &flat), None);
        }
    }

    /// Rays aimed at points on the edge shared by two triangles never slip through, at any scale.
    #[test]
    fn shared_edges_do_not_leak() {
        for scale in [1e-3, 1.0, 1e4] {
            let p = [
                DVec3::new(0.1, 0.2, 0.3),
                DVec3::new(1.3, -0.4, 0.2),
                DVec3::new(0.5, 1.1, -0.2),
                DVec3::new(-0.9, 0.7, 0.6),
            ]
            .map(|p| p * scale + DVec3::splat(17.3 * scale));
            let (left, right) = ([p[0], p[1], p[2]], [p[0], p[2], p[3]]);
            for i in 1..2000 {
                let t = f64::from(i) / 2000.0;
                let target = p[0] + (p[2] - p[0]) * t;
                let origin = target + DVec3::new(t.sin(), 0.3 - t, 3.0) * scale;
                let ray = Ray::new(origin, (target - origin).normalize());
                assert!(cross(&ray, &left).is_some() || cross(&ray, &right).is_some(), "{scale} {i}");
            }
        }
    }
}
