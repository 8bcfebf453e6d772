//! Meshes as transfer wants them.

use glam::DVec3;
use spectral_scene::{Scene, WorldMesh};

use crate::error::{PrtError, SurfaceError};

/// A triangle lower than this share of its longest edge has no area.
const LEAST_HEIGHT: f64 = 1e-12;

/// Rays start this share of a vertex's shortest edge from it, so that they do not meet its own triangles where these are
/// flat. Valleys block from there what they block from the vertex, to this angle.
const CLEARANCE: f64 = 1e-4;

/// A mesh in the world whose vertices receive light and whose triangles block it, from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    source_vertices: Vec<u32>,
    degenerate_triangles: usize,
    isolated_vertices: Vec<u32>,
}

impl Surface {
    /// A mesh with positions in metres, normals of any length and triangles.
    ///
    /// * Without normals it is flat: every triangle gets three vertices of its own with the facet's normal, see
    ///   [`Surface::source_vertices`].
    /// * Degenerate triangles, lower than 1e-12 of their longest edge, are left out and counted.
    /// * Vertices that no remaining triangle uses are isolated: nobody sees them and their transfer is 0. In a flat mesh
    ///   they are left out.
    ///
    /// # Errors
    /// [`SurfaceError`] for what cannot be lit.
    pub fn new(positions: &[DVec3], normals: &[DVec3], triangles: &[[u32; 3]]) -> Result<Self, SurfaceError> {
        let vertices = positions.len();
        if !(normals.is_empty() || normals.len() == vertices) {
            return Err(SurfaceError::NormalCount { normals: normals.len(), vertices });
        }
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(SurfaceError::Position { vertex, position: positions[vertex].to_array() });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= vertices) {
                return Err(SurfaceError::Index { triangle, vertex, vertices });
            }
        }
        let with_area: Vec<[u32; 3]> =
            triangles.iter().copied().filter(|t| has_area(t.map(|v| positions[v as usize]))).collect();
        if with_area.is_empty() {
            return Err(SurfaceError::NoArea { triangles: triangles.len() });
        }
        let degenerate_triangles = triangles.len() - with_area.len();
        if normals.is_empty() {
            Ok(Self::flat(positions, &with_area, degenerate_triangles))
        } else {
            Self::smooth(positions, normals, with_area, degenerate_triangles)
        }
    }

    /// An object of a scene.
    ///
    /// # Errors
    /// [`PrtError::Surface`], with the object's name.
    ///
    /// # Panics
    /// If an index is out of range; [`Scene::validate`] rules that out.
    pub fn of_object(scene: &Scene, object: usize) -> Result<Self, PrtError> {
        let WorldMesh { positions, normals, triangles, .. } = scene.world_mesh(object);
        Self::new(&positions, &normals, triangles)
            .map_err(|error| PrtError::Surface { name: scene.objects[object].name.clone(), error })
    }

    fn flat(positions: &[DVec3], triangles: &[[u32; 3]], degenerate_triangles: usize) -> Self {
        let source_vertices: Vec<u32> = triangles.as_flattened().to_vec();
        let own: Vec<DVec3> = source_vertices.iter().map(|&v| positions[v as usize]).collect();
        let normals = own
            .chunks_exact(3)
            .flat_map(|corners| [facet_normal([corners[0], corners[1], corners[2]]).normalize(); 3])
            .collect();
        Self {
            positions: own,
            normals,
            triangles: (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            source_vertices,
            degenerate_triangles,
            isolated_vertices: Vec::new(),
        }
    }

    fn smooth(
        positions: &[DVec3],
        normals: &[DVec3],
        triangles: Vec<[u32; 3]>,
        degenerate_triangles: usize,
    ) -> Result<Self, SurfaceError> {
        let mut used = vec![false; positions.len()];
        triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
        let unit = |(vertex, normal): (usize, &DVec3)| match normal.try_normalize() {
            Some(unit) => Ok(unit),
            None if used[vertex] => Err(SurfaceError::Normal { vertex, normal: normal.to_array() }),
            None => Ok(DVec3::ZERO),
        };
        Ok(Self {
            positions: positions.to_vec(),
            normals: normals.iter().enumerate().map(unit).collect::<Result<_, _>>()?,
            triangles,
            source_vertices: (0..positions.len() as u32).collect(),
            degenerate_triangles,
            isolated_vertices: (0..positions.len() as u32).filter(|&v| !used[v as usize]).collect(),
        })
    }

    /// Positions of its vertices, metres.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Unit normals of its vertices; 0 at isolated ones whose normal had no direction.
    pub fn normals(&self) -> &[DVec3] {
        &self.normals
    }

    /// Triangles that have an area.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// For each vertex the one of the given mesh that it comes from: itself, unless the mesh was flat.
    pub fn source_vertices(&self) -> &[u32] {
        &self.source_vertices
    }

    /// What the given mesh has at each of its vertices, such as texture coordinates, for the surface's.
    ///
    /// # Panics
    /// If there is not one for each vertex of the given mesh.
    pub fn gather<T: Copy>(&self, of_mesh: &[T]) -> Vec<T> {
        self.source_vertices.iter().map(|&v| of_mesh[v as usize]).collect()
    }

    /// How many triangles were left out.
    pub fn degenerate_triangles(&self) -> usize {
        self.degenerate_triangles
    }

    /// Vertices that no triangle uses, in ascending order.
    pub fn isolated_vertices(&self) -> &[u32] {
        &self.isolated_vertices
    }

    /// Where rays of each vertex start, metres; `None` at isolated ones: [`CLEARANCE`] above it and as far into its
    /// triangles, so that at the border of a wall they start on this side of the next one.
    pub(crate) fn ray_origins(&self) -> Vec<Option<DVec3>> {
        let mut shortest = vec![f64::INFINITY; self.positions.len()];
        let mut inwards = vec![DVec3::ZERO; self.positions.len()];
        for t in &self.triangles {
            let corners = t.map(|v| self.positions[v as usize]);
            for i in 0..3 {
                let [p, next, last] = [corners[i], corners[(i + 1) % 3], corners[(i + 2) % 3]];
                let v = t[i] as usize;
                shortest[v] = shortest[v].min(p.distance(next)).min(p.distance(last));
                inwards[v] += (next - p).normalize_or_zero() + (last - p).normalize_or_zero();
            }
        }
        (0..self.positions.len())
            .map(|v| {
                let (position, normal) = (self.positions[v], self.normals[v]);
                // The sum vanishes within a regular surface; what is left of it there is as short as rounding.
                let along = inwards[v].reject_from_normalized(normal).clamp_length_max(1.0);
                shortest[v].is_finite().then(|| position + (normal + along) * (CLEARANCE * shortest[v]))
            })
            .collect()
    }
}

/// Twice the area, along the normal.
fn facet_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

fn has_area(corners: [DVec3; 3]) -> bool {
    let [a, b, c] = corners;
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    facet_normal(corners).length() > LEAST_HEIGHT * longest
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(5.0, 5.0, 5.0)];

    #[test]
    fn a_mesh_without_normals_is_flat() {
        let surface = Surface::new(&CORNERS, &[], &[[0, 1, 2], [0, 2, 3]]).unwrap();
        assert_eq!(surface.source_vertices(), [0, 1, 2, 0, 2, 3]);
        assert_eq!(surface.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(surface.normals()[..3], [DVec3::Z; 3]);
        assert!((surface.normals()[4] - DVec3::new(1.0, 0.0, -1.0).normalize()).length() < 1e-15);
    }

    #[test]
    fn degenerate_triangles_are_left_out_and_isolated_vertices_found() {
        let normals = [DVec3::Z, DVec3::Z * 7.0, DVec3::Z, DVec3::ZERO];
        let surface = Surface::new(&CORNERS, &normals, &[[0, 1, 2], [0, 0, 3], [1, 3, 1]]).unwrap();
        assert_eq!(surface.triangles(), [[0, 1, 2]]);
        assert_eq!((surface.degenerate_triangles(), surface.isolated_vertices()), (2, &[3][..]));
        assert_eq!(surface.normals()[1], DVec3::Z);
    }

    #[test]
    fn area_is_judged_at_any_scale() {
        for scale in [1e-9, 1.0, 1e9] {
            let positions = CORNERS.map(|p| p * scale);
            assert_eq!(Surface::new(&positions, &[], &[[0, 1, 2]]).map(|s| s.degenerate_triangles()), Ok(0));
        }
    }

    #[test]
    fn what_cannot_be_lit_is_refused_with_its_place() {
        let up = [DVec3::Z; 4];
        let refused = |positions: &[DVec3], normals: &[DVec3], triangles: &[[u32; 3]]| {
            Surface::new(positions, normals, triangles).expect_err("a bad mesh").to_string()
        };
        assert_eq!(refused(&CORNERS, &up, &[[0, 1, 4]]), "triangle 0 uses vertex 4, the mesh has 4");
        assert_eq!(
            refused(&CORNERS, &up, &[[0, 1, 1]; 3]),
            "no triangle has an area: 3 triangles, all of them degenerate"
        );
        assert_eq!(
            refused(&CORNERS, &up[..2], &[[0, 1, 2]]),
            "2 normals for 4 vertices; there is one for each, or none at all"
        );
        let mut bad = CORNERS;
        bad[1].y = f64::NAN;
        assert_eq!(refused(&bad, &up, &[[0, 1, 2]]), "vertex 1 is at (1, NaN, 0); positions are finite");
        let mut no_direction = up;
        no_direction[2] = DVec3::ZERO;
        assert_eq!(
            refused(&CORNERS, &no_direction, &[[0, 1, 2]]),
            "the normal of vertex 2 is (0, 0, 0); it needs a direction"
        );
    }
}
