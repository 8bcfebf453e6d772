//! A receiver's texels: which of them a point lands in, how large they are in the world, and where on the mesh
//! they lie.
//!
//! Texel (i, j) covers u in [i, i + 1] / width and v in [j, j + 1] / height. Its area is the exact area of the
//! receiver's triangles clipped to it, so any layout works, distorted, partial or overlapping; where several
//! triangles share a texel it holds their mean. What lies outside the unit square, or on triangles that have no area
//! in the UV plane, is not in the map.

use glam::{DVec2, DVec3};
use spectral_scene::Scene;

use crate::world::{Hit, NONE, World};

/// The part of a triangle inside a texel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    pub(crate) texel: u32,
    /// Into the world's triangles.
    pub(crate) triangle: u32,
    /// World area, m^2.
    pub(crate) area: f64,
}

/// See the module's text.
#[derive(Clone, Debug)]
pub(crate) struct Texels {
    pub(crate) width: u32,
    pub(crate) height: u32,
    object: u32,
    /// UVs of the mesh's vertices.
    uvs: Vec<DVec2>,
    /// Vertices of the world's triangles, by the mesh's triangle.
    vertices: Vec<[u32; 3]>,
    /// World area of each texel, m^2; 0 where the mesh has no surface.
    pub(crate) areas: Vec<f64>,
    /// Sorted by texel.
    pub(crate) patches: Vec<Patch>,
}

impl Texels {
    /// The texels of an object that has UVs.
    pub(crate) fn new(scene: &Scene, world: &World, object: usize, [width, height]: [u32; 2]) -> Self {
        let mesh = &scene.meshes[scene.objects[object].mesh];
        let mut texels = Self {
            width,
            height,
            object: object as u32,
            uvs: mesh.uvs.iter().map(|uv| DVec2::from(uv.map(f64::from))).collect(),
            vertices: mesh.triangles.clone(),
            areas: vec![0.0; width as usize * height as usize],
            patches: Vec::new(),
        };
        for triangle in 0..world.faces.len() {
            if world.faces[triangle].object == texels.object {
                texels.add(world, triangle);
            }
        }
        texels.patches.sort_by_key(|p| (p.texel, p.triangle));
        texels
    }

    fn add(&mut self, world: &World, triangle: usize) {
        let uv = self.corner_uvs(world, triangle).map(|p| p * self.size());
        let [a, b, c] = world.corners[triangle];
        let uv_area = 0.5 * (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]).abs();
        let world_area = 0.5 * (b - a).cross(c - a).length();
        if uv_area == 0.0 || !uv_area.is_finite() {
            return;
        }
        let lo = uv[0].min(uv[1]).min(uv[2]).max(DVec2::ZERO);
        let hi = uv[0].max(uv[1]).max(uv[2]).min(self.size());
        let first = lo.floor();
        for j in first.y as u32..hi.y.ceil().max(0.0) as u32 {
            for i in first.x as u32..hi.x.ceil().max(0.0) as u32 {
                let polygon = clipped(&uv, i, j);
                let area = polygon_area(&polygon) / uv_area * world_area;
                if area > 0.0 {
                    let texel = j * self.width + i;
                    self.areas[texel as usize] += area;
                    self.patches.push(Patch { texel, triangle: triangle as u32, area });
                }
            }
        }
    }

    fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    fn corner_uvs(&self, world: &World, triangle: usize) -> [DVec2; 3] {
        self.vertices[world.faces[triangle].index as usize].map(|v| self.uvs[v as usize])
    }

    /// The texel of a hit; `None` if it is on another object, on the back, or not in the map.
    pub(crate) fn texel(&self, world: &World, hit: &Hit) -> Option<u32> {
        if !hit.front || hit.triangle == NONE || world.faces[hit.triangle as usize].object != self.object {
            return None;
        }
        let uv = self.texel_position(world, hit);
        let size = self.size();
        if !(uv.x >= 0.0 && uv.y >= 0.0 && uv.x <= size.x && uv.y <= size.y) {
            return None;
        }
        let (i, j) = ((uv.x as u32).min(self.width - 1), (uv.y as u32).min(self.height - 1));
        let texel = j * self.width + i;
        // A sliver may round into a neighbour that holds none of it.
        (self.areas[texel as usize] > 0.0).then_some(texel)
    }

    /// UV of a hit in units of texels.
    pub(crate) fn texel_position(&self, world: &World, hit: &Hit) -> DVec2 {
        let [a, b, c] = self.corner_uvs(world, hit.triangle as usize);
        (a * hit.barycentric.x + b * hit.barycentric.y + c * hit.barycentric.z) * self.size()
    }

    /// World points spread evenly over a patch, one per pair of numbers in the unit square.
    pub(crate) fn spread<'a>(
        &self,
        world: &World,
        patch: &Patch,
        square: impl Iterator<Item = [f64; 2]> + 'a,
    ) -> impl Iterator<Item = DVec3> + 'a {
        let triangle = patch.triangle as usize;
        let uv = self.corner_uvs(world, triangle).map(|p| p * self.size());
        let polygon = clipped(&uv, patch.texel % self.width, patch.texel / self.width);
        let total = polygon_area(&polygon);
        let corners = world.corners[triangle];
        square.map(move |[s, t]| {
            let point = in_polygon(&polygon, total, s, t);
            barycentric_point(&uv, &corners, point)
        })
    }
}

/// The point over `point` of the UV plane.
fn barycentric_point(uv: &[DVec2; 3], corners: &[DVec3; 3], point: DVec2) -> DVec3 {
    let (e1, e2) = (uv[1] - uv[0], uv[2] - uv[0]);
    let determinant = e1.perp_dot(e2);
    let q = point - uv[0];
    let (b, c) = (q.perp_dot(e2) / determinant, e1.perp_dot(q) / determinant);
    corners[0] * (1.0 - b - c) + corners[1] * b + corners[2] * c
}

/// A triangle clipped to texel (i, j), all in texel units (Sutherland & Hodgman).
fn clipped(uv: &[DVec2; 3], i: u32, j: u32) -> Vec<DVec2> {
    let (lo, hi) = (DVec2::new(f64::from(i), f64::from(j)), DVec2::new(f64::from(i + 1), f64::from(j + 1)));
    let mut polygon = uv.to_vec();
    let sides: [&dyn Fn(DVec2) -> f64; 4] =
        [&|p| p.x - lo.x, &|p| hi.x - p.x, &|p| p.y - lo.y, &|p| hi.y - p.y];
    for inside in sides {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, &b) in polygon.iter().enumerate() {
            let a = polygon[(k + polygon.len() - 1) % polygon.len()];
            let (da, db) = (inside(a), inside(b));
            if (da < 0.0) != (db < 0.0) {
                kept.push(a + (b - a) * (da / (da - db)));
            }
            if db >= 0.0 {
                kept.push(b);
            }
        }
        polygon = kept;
    }
    polygon
}

fn polygon_area(polygon: &[DVec2]) -> f64 {
    let Some(&a) = polygon.first() else { return 0.0 };
    let twice: f64 = polygon[1..].windows(2).map(|w| (w[0] - a).perp_dot(w[1] - a)).sum();
    0.5 * twice.abs()
}

/// Area-preserving map of the unit square onto a convex polygon: `s` picks a triangle of its fan and what is left of
/// it a place within.
fn in_polygon(polygon: &[DVec2], total: f64, s: f64, t: f64) -> DVec2 {
    let a = polygon[0];
    let mut rest = s * total;
    let mut chosen = (a, a, 0.0);
    for w in polygon[1..].windows(2) {
        let area = 0.5 * (w[0] - a).perp_dot(w[1] - a).abs();
        if area == 0.0 {
            continue;
        }
        chosen = (w[0], w[1], (rest / area).min(1.0));
        if rest <= area {
            break;
        }
        rest -= area;
    }
    let (b, c, s) = chosen;
    let root = s.sqrt();
    a + (b - a) * (root * (1.0 - t)) + (c - a) * (root * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [DVec2; 3] = [DVec2::new(0.2, 0.3), DVec2::new(2.7, 0.9), DVec2::new(1.1, 2.6)];

    #[test]
    fn clipped_parts_add_up_to_the_triangle() {
        let whole = polygon_area(&TRIANGLE);
        let parts: f64 =
            (0..3).flat_map(|j| (0..3).map(move |i| polygon_area(&clipped(&TRIANGLE, i, j)))).sum();
        assert!((parts / whole - 1.0).abs() < 1e-14, "{parts} {whole}");
    }

    #[test]
    fn spread_points_stay_in_the_polygon_and_have_its_centroid() {
        let polygon = clipped(&TRIANGLE, 1, 1);
        let total = polygon_area(&polygon);
        let mut centroid = DVec2::ZERO;
        for w in polygon[1..].windows(2) {
            let area = 0.5 * (w[0] - polygon[0]).perp_dot(w[1] - polygon[0]).abs();
            centroid += (polygon[0] + w[0] + w[1]) / 3.0 * area / total;
        }
        let n = 800;
        let mut mean = DVec2::ZERO;
        for a in 0..n {
            for b in 0..n {
                let p = in_polygon(
                    &polygon,
                    total,
                    (f64::from(a) + 0.5) / f64::from(n),
                    (f64::from(b) + 0.5) / f64::from(n),
                );
                assert!(p.cmpge(DVec2::ONE - 1e-12).all() && p.cmple(DVec2::splat(2.0 + 1e-12)).all(), "{p}");
                mean += p / f64::from(n * n);
            }
        }
        assert!((mean - centroid).length() < 1e-3, "{mean} {centroid}");
    }
}
