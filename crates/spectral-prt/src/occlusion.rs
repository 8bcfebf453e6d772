//! Whether and where a ray meets the scene: the library `obvhs` builds the tree and walks it, triangles are met in f64.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};

use crate::surface::Surface;

/// The tree's coordinates run from -0.5 to 0.5 about its centre; boxes are wider than their triangles by this, more than
/// what f32 rounds of boxes and of rays within them.
const SLACK: f32 = 4e-6;
/// How far beyond its edges a triangle is met, in barycentric coordinates, so that no ray slips between two.
const EDGE: f64 = 1e-11;

/// All triangles of the scene. A ray meets them from either side.
pub(crate) struct Occluders {
    tree: Bvh2,
    /// In the order of the tree's leaves.
    triangles: Vec<[DVec3; 3]>,
    /// Their corners as vertices of all surfaces, counted through, in the same order.
    vertices: Vec<[u32; 3]>,
    centre: DVec3,
    /// The tree's units per metre.
    per_m: f64,
}

impl Occluders {
    pub(crate) fn new(surfaces: &[Surface]) -> Self {
        let mut triangles: Vec<[DVec3; 3]> = surfaces
            .iter()
            .flat_map(|s| s.triangles().iter().map(|t| t.map(|v| s.positions()[v as usize])))
            .collect();
        let mut vertices = Vec::with_capacity(triangles.len());
        let mut first = 0;
        for surface in surfaces {
            vertices.extend(surface.triangles().iter().map(|t| t.map(|v| first + v)));
            first += surface.positions().len() as u32;
        }
        let corners = triangles.as_flattened();
        let (lower, upper) = corners
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lower, upper), &p| (lower.min(p), upper.max(p)));
        let centre = 0.5 * (lower + upper);
        let per_m = 1.0 / (upper - lower).max_element();
        let boxes: Vec<Aabb> = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|p| Vec3A::from(((p - centre) * per_m).as_vec3()));
                Aabb::new(a.min(b).min(c) - SLACK, a.max(b).max(c) + SLACK)
            })
            .collect();
        let tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            (0..boxes.len() as u32).collect(),
            SortPrecision::U64,
            1,
        );
        triangles = tree.primitive_indices.iter().map(|&t| triangles[t as usize]).collect();
        vertices = tree.primitive_indices.iter().map(|&t| vertices[t as usize]).collect();
        Self { tree, triangles, vertices, centre, per_m }
    }

    fn ray(&self, origin: DVec3, direction: DVec3) -> Ray {
        let local = ((origin - self.centre) * self.per_m).as_vec3();
        Ray::new_inf(Vec3A::from(local), Vec3A::from(direction.as_vec3()))
    }

    /// Whether anything lies in the direction. `origin` in metres, within the scene's bounds or next to them.
    pub(crate) fn blocks(&self, origin: DVec3, direction: DVec3) -> bool {
        !self.tree.ray_traverse_miss(self.ray(origin, direction), |_, triangle| {
            if meets(origin, direction, &self.triangles[triangle]).is_some() { 0.0 } else { f32::INFINITY }
        })
    }

    /// What lies in the direction, likewise.
    pub(crate) fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let mut nearest: Option<(f64, Hit)> = None;
        self.tree.ray_traverse(self.ray(origin, direction), &mut RayHit::none(), |_, triangle| {
            if let Some((distance, weights)) = meets(origin, direction, &self.triangles[triangle])
                && nearest.as_ref().is_none_or(|(d, _)| distance < *d)
            {
                nearest = Some((distance, Hit { vertices: self.vertices[triangle], weights }));
            }
            // Boxes behind the nearest triangle so far are left out, those within rounding of it are not.
            nearest.as_ref().map_or(f32::INFINITY, |(d, _)| (d * self.per_m) as f32 + 8.0 * SLACK)
        });
        nearest.map(|(_, hit)| hit)
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// Corners, as vertices of all surfaces, counted through.
    pub(crate) vertices: [u32; 3],
    /// Their barycentric weights.
    pub(crate) weights: [f64; 3],
}

/// The distance, metres, and the corners' weights, both sides, ahead of the origin only (Möller & Trumbore 1997, "Fast,
/// minimum storage ray/triangle intersection").
fn meets(origin: DVec3, direction: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<(f64, [f64; 3])> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let from_a = origin - a;
    let u = from_a.dot(p) / determinant;
    if !(-EDGE..=1.0 + EDGE).contains(&u) {
        return None;
    }
    let q = from_a.cross(ab);
    let v = direction.dot(q) / determinant;
    let distance = ac.dot(q) / determinant;
    (v >= -EDGE && u + v <= 1.0 + EDGE && distance > 0.0).then_some((distance, [1.0 - u - v, u, v]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hemisphere::Directions;

    fn cube(scale: f64, offset: DVec3) -> Surface {
        let positions: Vec<DVec3> = (0..8)
            .map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * scale + offset)
            .collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> =
            quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Surface::new(&positions, &[], &triangles).expect("a cube")
    }

    /// From inside a closed box everything is blocked, edges, corners and scales regardless; from outside, what is on the
    /// other side is free.
    #[test]
    fn a_closed_box_does_not_leak() {
        for (scale, offset) in [(1.0, DVec3::ZERO), (1e-4, DVec3::splat(3.0)), (1e5, DVec3::splat(-2e5))] {
            let box_ = cube(scale, offset);
            let occluders = Occluders::new(std::slice::from_ref(&box_));
            let inside = offset + DVec3::new(0.3, 0.5, 0.7) * scale;
            let aimed =
                box_.positions().iter().flat_map(|&p| box_.positions().iter().map(move |&q| 0.5 * (p + q)));
            for target in aimed {
                assert!(occluders.blocks(inside, (target - inside).normalize()), "{scale} {target}");
            }
            for normal in [DVec3::X, DVec3::NEG_Z] {
                for direction in Directions::new(500, 0).about(normal) {
                    assert!(occluders.blocks(inside, direction));
                    assert!(!occluders.blocks(inside + 2.0 * scale * normal, direction));
                }
            }
        }
    }

    /// Of several layers the first is found, in whatever order the tree has them.
    #[test]
    fn the_nearest_of_many_layers_is_found() {
        let layers: Vec<Surface> = (0..40)
            .map(|i| {
                let z = f64::from(i * 7 % 40);
                let corners = [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 12.0, z]].map(DVec3::from);
                Surface::new(&corners, &[DVec3::Z; 3], &[[0, 1, 2]]).expect("a triangle")
            })
            .collect();
        let occluders = Occluders::new(&layers);
        for above in [0.5, 17.5, 39.5] {
            for direction in [DVec3::NEG_Z, DVec3::new(0.1, -0.05, -1.0).normalize()] {
                let hit = occluders.nearest(DVec3::new(0.1, 0.2, above), direction).expect("a layer");
                assert_eq!(f64::from(hit.vertices[0] / 3 * 7 % 40), above.floor());
            }
        }
        assert_eq!(occluders.nearest(DVec3::new(0.0, 0.0, -0.5), DVec3::NEG_Z), None);
    }

    #[test]
    fn what_lies_behind_is_not_met() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let above = DVec3::new(0.2, 0.2, 1.0);
        let (distance, weights) = meets(above, DVec3::NEG_Z, &triangle).expect("below");
        assert_eq!(distance, 1.0);
        assert!(weights.iter().zip([0.6, 0.2, 0.2]).all(|(w, e)| (w - e).abs() < 1e-15), "{weights:?}");
        assert_eq!(meets(above, DVec3::Z, &triangle), None);
        assert!(meets(-above + DVec3::new(0.4, 0.4, 0.0), DVec3::Z, &triangle).is_some());
        assert_eq!(meets(DVec3::new(0.6, 0.6, 1.0), DVec3::NEG_Z, &triangle), None);
    }
}
