//! Which refractors a point is in.

use glam::DVec3;

use crate::{Scene, WorldMesh};

impl Scene {
    /// The refractors around a point in world space (metres), the innermost first: those whose first crossing on a way out is
    /// their back. What is before the back of an open surface, as under water, counts as inside too.
    pub fn refractors_around(&self, point_m: DVec3) -> Vec<usize> {
        let way_out = |i: usize| Some((way_out_m(point_m, &self.world_mesh(i))?, i));
        let mut around: Vec<(f64, usize)> = self.refractors().filter_map(way_out).collect();
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
        around.into_iter().map(|(_, object)| object).collect()
    }
}

/// How far a ray steeply upwards from `point_m` runs to the mesh, if it first meets its back.
fn way_out_m(point_m: DVec3, mesh: &WorldMesh<'_>) -> Option<f64> {
    // Parallel to nothing people build.
    let ray = DVec3::new(0.352, 0.801, 0.484).normalize();
    let mut nearest = (f64::INFINITY, false);
    for triangle in mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize] - point_m);
        // The ray passes inside if it sees all three edges turn the same way.
        let turns = [a.cross(b).dot(ray), b.cross(c).dot(ray), c.cross(a).dot(ray)];
        let normal = (b - a).cross(c - a);
        let along = normal.dot(ray);
        let inside = turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0);
        let distance = a.dot(normal) / along;
        if inside && distance > 0.0 && distance < nearest.0 {
            nearest = (distance, along > 0.0);
        }
    }
    nearest.1.then_some(nearest.0)
}
