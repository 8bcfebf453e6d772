//! A receiver's texels: which of them a point lands in, how large they are in the world, and where on the mesh
//! they lie.
//!
//! Texel (i, j) covers u in [i, i + 1] / width and v in [j, j + 1] / height. Its area is the exact area of the
//! receiver's triangles clipped to it, so any layout works, distorted, partial or overlapping; where several
//! triangles share a texel it holds their mean. What lies outside the unit square, or on triangles that have no area
//! in the UV plane, is not in the map.
//!
//! Pictures need a place for every point of a surface. A mesh whose UVs give none, or one place to several points,
//! gets a chart per triangle instead ([`Texels::of_surface`]): a grid of texels that lies flat in the triangle.

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
    layout: Layout,
    /// World area of each texel, m^2; 0 where the mesh has no surface.
    pub(crate) areas: Vec<f64>,
    /// Sorted by texel.
    pub(crate) patches: Vec<Patch>,
}

/// Where the corners of triangles lie among the texels.
#[derive(Clone, Debug)]
enum Layout {
    /// One grid for all, by UVs.
    Uvs {
        /// UVs of the mesh's vertices.
        uvs: Vec<DVec2>,
        /// Vertices of the mesh's triangles.
        vertices: Vec<[u32; 3]>,
    },
    /// A grid each, by the mesh's triangle.
    Charts(Vec<Chart>),
}

/// The texels of one triangle, row by row.
#[derive(Clone, Copy, Debug, Default)]
struct Chart {
    grid: Grid,
    /// In texels from the grid's corner.
    corners: [DVec2; 3],
}

/// A rectangle of texels that follow each other row by row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Grid {
    /// The first texel.
    first: u32,
    width: u32,
    height: u32,
}

impl Grid {
    fn size(self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// The texel in this column and row, or the nearest one that there is.
    pub(crate) fn texel(self, column: f64, row: f64) -> u32 {
        let within = |at: f64, count: u32| (at.max(0.0) as u32).min(count - 1);
        self.first + within(row, self.height) * self.width + within(column, self.width)
    }
}

impl Texels {
    /// The texels of an object that has UVs.
    pub(crate) fn new(scene: &Scene, world: &World, object: usize, [width, height]: [u32; 2]) -> Self {
        let mesh = &scene.meshes[scene.objects[object].mesh];
        let layout = Layout::Uvs {
            uvs: mesh.uvs.iter().map(|uv| DVec2::from(uv.map(f64::from))).collect(),
            vertices: mesh.triangles.clone(),
        };
        Self::laid_out(world, object, [width, height], layout)
    }

    /// Texels for every point of an object: by its UVs where they keep all points apart, else a chart per triangle.
    /// Either way a texel has about the area that it would have if the object filled `size` texels evenly.
    pub(crate) fn of_surface(scene: &Scene, world: &World, object: usize, size: [u32; 2]) -> Self {
        let mesh = &scene.meshes[scene.objects[object].mesh];
        if !mesh.uvs.is_empty() {
            let texels = Self::new(scene, world, object, size);
            if texels.keeps_points_apart(world) {
                return texels;
            }
        }
        let (charts, count) = charts(world, object as u32, mesh.triangles.len(), size);
        Self::laid_out(world, object, [count, 1], Layout::Charts(charts))
    }

    fn laid_out(world: &World, object: usize, [width, height]: [u32; 2], layout: Layout) -> Self {
        let mut texels = Self {
            width,
            height,
            object: object as u32,
            layout,
            areas: vec![0.0; width as usize * height as usize],
            patches: Vec::new(),
        };
        for triangle in triangles_of(world, texels.object) {
            texels.add(world, triangle);
        }
        texels.patches.sort_by_key(|p| (p.texel, p.triangle));
        texels
    }

    fn add(&mut self, world: &World, triangle: usize) {
        let uv = self.corners(world, triangle);
        let grid = self.grid(world, triangle);
        let (uv_area, world_area) = (triangle_area(&uv), world_area(world, triangle));
        if uv_area == 0.0 || !uv_area.is_finite() {
            return;
        }
        let lo = uv[0].min(uv[1]).min(uv[2]).max(DVec2::ZERO);
        let hi = uv[0].max(uv[1]).max(uv[2]).min(grid.size());
        let first = lo.floor();
        for j in first.y as u32..hi.y.ceil().max(0.0) as u32 {
            for i in first.x as u32..hi.x.ceil().max(0.0) as u32 {
                let polygon = clipped(&uv, i, j);
                let area = polygon_area(&polygon) / uv_area * world_area;
                if area > 0.0 {
                    let texel = grid.first + j * grid.width + i;
                    self.areas[texel as usize] += area;
                    self.patches.push(Patch { texel, triangle: triangle as u32, area });
                }
            }
        }
    }

    /// No point lies outside the map, and no two share a place on it.
    fn keeps_points_apart(&self, world: &World) -> bool {
        let slack = 1e-6;
        let inside = |p: &DVec2| {
            let size = DVec2::new(f64::from(self.width), f64::from(self.height));
            p.cmpge(DVec2::splat(-slack)).all() && p.cmple(size + slack).all()
        };
        let on_the_map = |triangle| {
            let corners = self.corners(world, triangle);
            triangle_area(&corners) > 0.0 && corners.iter().all(inside)
        };
        let mut covered = vec![0.0; self.areas.len()];
        for patch in &self.patches {
            let triangle = patch.triangle as usize;
            covered[patch.texel as usize] +=
                patch.area * triangle_area(&self.corners(world, triangle)) / world_area(world, triangle);
        }
        triangles_of(world, self.object).all(on_the_map) && covered.iter().all(|&share| share <= 1.0 + slack)
    }

    /// The texels among which a triangle lies.
    pub(crate) fn grid(&self, world: &World, triangle: usize) -> Grid {
        match &self.layout {
            Layout::Uvs { .. } => Grid { first: 0, width: self.width, height: self.height },
            Layout::Charts(charts) => charts[world.faces[triangle].index as usize].grid,
        }
    }

    /// A triangle's corners in texels from its grid's corner.
    fn corners(&self, world: &World, triangle: usize) -> [DVec2; 3] {
        let index = world.faces[triangle].index as usize;
        match &self.layout {
            Layout::Uvs { uvs, vertices } => {
                let size = DVec2::new(f64::from(self.width), f64::from(self.height));
                vertices[index].map(|v| uvs[v as usize] * size)
            }
            Layout::Charts(charts) => charts[index].corners,
        }
    }

    /// The texel of a hit; `None` if it is on another object, on the back, or not in the map.
    pub(crate) fn texel(&self, world: &World, hit: &Hit) -> Option<u32> {
        if !hit.front || hit.triangle == NONE || world.faces[hit.triangle as usize].object != self.object {
            return None;
        }
        let position = self.texel_position(world, hit);
        let grid = self.grid(world, hit.triangle as usize);
        let size = grid.size();
        let inside = position.cmpge(DVec2::ZERO).all() && position.cmple(size).all();
        // On a chart only rounding can lead outside.
        if !inside && matches!(self.layout, Layout::Uvs { .. }) {
            return None;
        }
        let texel = grid.texel(position.x, position.y);
        // A sliver may round into a neighbour that holds none of it.
        (self.areas[texel as usize] > 0.0).then_some(texel)
    }

    /// Place of a hit in texels from its grid's corner.
    pub(crate) fn texel_position(&self, world: &World, hit: &Hit) -> DVec2 {
        let [a, b, c] = self.corners(world, hit.triangle as usize);
        a * hit.barycentric.x + b * hit.barycentric.y + c * hit.barycentric.z
    }

    /// World points spread evenly over a patch, one per pair of numbers in the unit square.
    pub(crate) fn spread<'a>(
        &self,
        world: &World,
        patch: &Patch,
        square: impl Iterator<Item = [f64; 2]> + 'a,
    ) -> impl Iterator<Item = DVec3> + 'a {
        let triangle = patch.triangle as usize;
        let uv = self.corners(world, triangle);
        let grid = self.grid(world, triangle);
        let at = patch.texel - grid.first;
        let polygon = clipped(&uv, at % grid.width, at / grid.width);
        let total = polygon_area(&polygon);
        let corners = world.corners[triangle];
        square.map(move |[s, t]| {
            let point = in_polygon(&polygon, total, s, t);
            barycentric_point(&uv, &corners, point)
        })
    }
}

fn triangles_of(world: &World, object: u32) -> impl Iterator<Item = usize> + '_ {
    (0..world.faces.len()).filter(move |&triangle| world.faces[triangle].object == object)
}

fn triangle_area([a, b, c]: &[DVec2; 3]) -> f64 {
    0.5 * (b - a).perp_dot(c - a).abs()
}

fn world_area(world: &World, triangle: usize) -> f64 {
    let [a, b, c] = world.corners[triangle];
    0.5 * (b - a).cross(c - a).length()
}

/// Charts of an object's triangles, by the mesh's triangle, and how many texels they have in all.
///
/// A texel is a square of the surface's area over the number of texels in `size`; a triangle lies with its longest
/// edge along its chart's first row. Needles, which would take many texels each, get coarser ones along their edge.
fn charts(world: &World, object: u32, triangles: usize, size: [u32; 2]) -> (Vec<Chart>, u32) {
    let surface: f64 = triangles_of(world, object).map(|t| world_area(world, t)).sum();
    let texel_m = (surface / (f64::from(size[0]) * f64::from(size[1]))).sqrt();
    // A triangle as large as the surface fits: half a square has a diagonal of 1.41 sides.
    let longest = 2.0 * f64::from(size[0].max(size[1]));
    let mut charts = vec![Chart::default(); triangles];
    let mut first = 0;
    for triangle in triangles_of(world, object) {
        let corners = world.corners[triangle];
        let length = |k: usize| (corners[(k + 1) % 3] - corners[k]).length();
        let k = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))).expect("three edges");
        let base_m = length(k);
        let along = (corners[(k + 1) % 3] - corners[k]) / base_m;
        let apex = corners[(k + 2) % 3] - corners[k];
        let texels = |length_m: f64| (length_m / texel_m).clamp(f64::MIN_POSITIVE, longest);
        let (base, height_m) = (texels(base_m), apex.cross(along).length());
        let height = texels(height_m);
        let mut placed = [DVec2::ZERO; 3];
        placed[(k + 1) % 3] = DVec2::new(base, 0.0);
        placed[(k + 2) % 3] = DVec2::new(base * (apex.dot(along) / base_m).clamp(0.0, 1.0), height);
        let grid = Grid { first, width: base.ceil() as u32, height: height.ceil() as u32 };
        first += grid.width * grid.height;
        charts[world.faces[triangle].index as usize] = Chart { grid, corners: placed };
    }
    (charts, first)
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
