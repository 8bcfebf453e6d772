//! The scene's triangles in world space, and what a ray meets among them.
//!
//! # Leaving a surface
//!
//! No ray is pushed off its surface. The triangle just left is skipped, since a straight ray cannot meet it again.
//! Other triangles within [`World::contact_m`] of the start (neighbours at an edge, surfaces that touch) count only if
//! the crossing makes sense from where the path is: a refractor's front from outside it, its back from inside, an
//! opaque surface after the path has passed through glass but not after a reflection. The distance is a rounding bound, 2^-40 of the largest coordinate, so it has no effect on geometry at any scale.
//!
//! # Defined behaviour of bad meshes
//!
//! Triangles without area are left out, of triangles with the same three corners (in any order) one object keeps the
//! first, and a closed refractor whose volume is negative is turned outside in. All are counted in
//! [`GeometryCounts`].

use std::collections::{HashMap, HashSet};

use glam::DVec3;
use serde::{Deserialize, Serialize};
use spectral_scene::Scene;

use crate::medium::{Medium, Nesting};
use crate::mirror::Mirror;
use crate::tree::{Pending, Ray, Tree};
use crate::triangle;

/// What was found while the geometry was prepared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GeometryCounts {
    /// Triangles that light can meet.
    pub triangles: u64,
    /// Triangles without area, left out.
    pub zero_area: u64,
    /// Repeated triangles, left out.
    pub duplicates: u64,
    /// Closed refractors wound inside out, turned.
    pub inside_out_refractors: u64,
    /// Refractors with boundary edges: one interface each, such as a water surface.
    pub open_refractors: u64,
}

/// Marks the absence of a triangle.
pub(crate) const NONE: u32 = u32::MAX;

/// What belongs to a triangle besides its corners.
#[derive(Clone, Debug)]
pub(crate) struct Face {
    /// Into the scene's objects.
    pub(crate) object: u32,
    /// Into the mesh's triangles.
    pub(crate) index: u32,
    /// Unit geometric normal, on the front.
    pub(crate) normal: DVec3,
    /// Into [`World::corner_normals`]; [`NONE`] for a flat facet.
    smooth: u32,
}

/// Where a path starts its next straight piece.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// The triangle just left; [`NONE`] in free space.
    pub(crate) triangle: u32,
    pub(crate) kind: StartKind,
    /// The refractors around.
    pub(crate) nesting: Nesting,
}

/// How a path comes to its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StartKind {
    /// It starts in free space.
    Free,
    /// It has passed a refractor's surface.
    Refracted,
    /// It was thrown back by one, or by a mirror.
    Reflected,
    /// It leaves an opaque surface.
    Opaque,
}

impl Start {
    pub(crate) fn free(nesting: Nesting) -> Self {
        Self { triangle: NONE, kind: StartKind::Free, nesting }
    }
}

/// The first surface a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) triangle: u32,
    /// Metres along the ray.
    pub(crate) distance: f64,
    pub(crate) barycentric: DVec3,
    /// On the side of the geometric normal.
    pub(crate) front: bool,
}

/// See the module's text.
#[derive(Clone, Debug)]
pub(crate) struct World {
    /// In the tree's order, like `faces`.
    pub(crate) corners: Vec<[DVec3; 3]>,
    pub(crate) faces: Vec<Face>,
    corner_normals: Vec<[DVec3; 3]>,
    /// Per object of the scene; `None` is opaque.
    pub(crate) media: Vec<Option<Medium>>,
    /// Per object of the scene.
    pub(crate) mirrors: Vec<Option<Mirror>>,
    tree: Tree,
    /// Starts nearer than this to a surface are on it, metres.
    pub(crate) contact_m: f64,
    pub(crate) counts: GeometryCounts,
}

impl World {
    /// `scene` has passed [`Scene::validate`].
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut corners = Vec::new();
        let mut faces = Vec::new();
        let mut corner_normals = Vec::new();
        let mut counts = GeometryCounts::default();
        let media: Vec<Option<Medium>> = (0..scene.objects.len())
            .map(|i| scene.material_of(i))
            .map(|m| m.is_refractor().then(|| Medium::new(m)))
            .collect();
        let mirrors: Vec<Option<Mirror>> =
            (0..scene.objects.len()).map(|i| Mirror::new(scene.material_of(i))).collect();
        for (object, medium) in media.iter().enumerate() {
            let mesh = scene.world_mesh(object);
            let mut kept = distinct_triangles(&mesh.positions, mesh.triangles, &mut counts);
            if medium.is_some() {
                let topology = scene.topology(object);
                counts.open_refractors += u64::from(!topology.closed);
                if topology.inside_out {
                    counts.inside_out_refractors += 1;
                    kept.iter_mut().for_each(|t| t.flip());
                }
            }
            for triangle in kept {
                let [a, b, c] = triangle.corners;
                let smooth = match mesh.normals.is_empty() {
                    true => NONE,
                    false => {
                        corner_normals.push(triangle.vertices.map(|v| mesh.normals[v as usize]));
                        corner_normals.len() as u32 - 1
                    }
                };
                faces.push(Face {
                    object: object as u32,
                    index: triangle.index,
                    normal: (b - a).cross(c - a).normalize_or_zero(),
                    smooth,
                });
                corners.push(triangle.corners);
            }
        }
        counts.triangles = faces.len() as u64;
        let largest = corners.iter().flatten().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
        let contact_m = largest * 2_f64.powi(-40);
        // Most rays start at what throws caustics.
        let casts =
            |face: &Face| media[face.object as usize].is_some() || mirrors[face.object as usize].is_some();
        let any_casts = faces.iter().any(casts);
        let focus = faces
            .iter()
            .zip(&corners)
            .filter(|(face, _)| !any_casts || casts(face))
            .flat_map(|(_, corners)| corners)
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        let (tree, order) = Tree::build(&corners, focus, contact_m);
        Self {
            corners: order.iter().map(|&i| corners[i as usize]).collect(),
            faces: order.iter().map(|&i| faces[i as usize].clone()).collect(),
            corner_normals,
            media,
            mirrors,
            tree,
            contact_m,
            counts,
        }
    }

    pub(crate) fn medium(&self, object: Option<u32>) -> Option<&Medium> {
        self.media[object? as usize].as_ref()
    }

    /// The point of a hit; exact within its facet, unlike a point along the ray.
    pub(crate) fn position(&self, hit: &Hit) -> DVec3 {
        let [a, b, c] = self.corners[hit.triangle as usize];
        a * hit.barycentric.x + b * hit.barycentric.y + c * hit.barycentric.z
    }

    /// The unit normal to refract with, on the side of the geometric one.
    pub(crate) fn shading_normal(&self, hit: &Hit) -> DVec3 {
        let face = &self.faces[hit.triangle as usize];
        if face.smooth == NONE {
            return face.normal;
        }
        let [a, b, c] = self.corner_normals[face.smooth as usize];
        let n = (a * hit.barycentric.x + b * hit.barycentric.y + c * hit.barycentric.z).normalize_or_zero();
        match n.dot(face.normal) {
            0.0 => face.normal,
            along if along < 0.0 => -n,
            _ => n,
        }
    }

    /// A crossing near the start that rounding alone could have made.
    fn plausible(&self, triangle: usize, front: bool, start: &Start) -> bool {
        let object = self.faces[triangle].object;
        if self.media[object as usize].is_some() {
            front != start.nesting.contains(object)
        } else {
            // Whether there is glass on the other side or air, a reflected ray moves away from what it touches.
            match start.kind {
                StartKind::Free | StartKind::Refracted => true,
                StartKind::Reflected => false,
                StartKind::Opaque => front,
            }
        }
    }

    /// The first surface along a ray.
    ///
    /// Surfaces that coincide to rounding are met in a fixed order, whatever their computed distances say. Refractors
    /// are entered before others are left, so two that share a surface are in optical contact, like water in a glass;
    /// opaque surfaces come last, so light leaves a glass before it lands on the table that it stands on.
    pub(crate) fn closest(&self, ray: &Ray, start: &Start, pending: &mut Pending) -> Option<Hit> {
        let contact = self.contact_m;
        let rank = |triangle: usize, front: bool| {
            let object = self.faces[triangle].object;
            let opaque = self.media[object as usize].is_none();
            (opaque, !opaque && !front, object)
        };
        let mut best: Option<Hit> = None;
        self.tree.walk(ray, contact, f64::INFINITY, pending, |range, mut limit| {
            for triangle in range {
                if triangle as u32 == start.triangle {
                    continue;
                }
                let Some(crossing) = triangle::cross(ray, &self.corners[triangle]) else { continue };
                let distance = crossing.distance;
                // `limit` is a contact beyond the best hit.
                let reached = distance >= -contact && distance <= limit;
                if !reached || (distance <= contact && !self.plausible(triangle, crossing.front, start)) {
                    continue;
                }
                if let Some(best) = &best {
                    let apart = (distance - best.distance).abs() > contact;
                    let nearer = match apart {
                        true => distance < best.distance,
                        false => {
                            (rank(triangle, crossing.front), distance)
                                < (rank(best.triangle as usize, best.front), best.distance)
                        }
                    };
                    if !nearer {
                        continue;
                    }
                }
                best = Some(Hit {
                    triangle: triangle as u32,
                    distance,
                    barycentric: crossing.barycentric,
                    front: crossing.front,
                });
                limit = distance + contact;
            }
            limit
        });
        best
    }

    /// Whether anything, glass included, is on a ray nearer than `limit`.
    pub(crate) fn blocked(&self, ray: &Ray, start: &Start, limit: f64, pending: &mut Pending) -> bool {
        let contact = self.contact_m;
        let mut found = false;
        self.tree.walk(ray, contact, limit, pending, |range, limit| {
            for triangle in range {
                if triangle as u32 == start.triangle {
                    continue;
                }
                let Some(crossing) = triangle::cross(ray, &self.corners[triangle]) else { continue };
                let near = crossing.distance <= contact && !self.plausible(triangle, crossing.front, start);
                if crossing.distance >= -contact && crossing.distance < limit && !near {
                    found = true;
                    return f64::NEG_INFINITY;
                }
            }
            limit
        });
        found
    }

    /// The refractors around a point in free space: those whose first crossing on the way out is their back. A point
    /// in front of an open surface's back counts as inside too, as light that comes from there does.
    pub(crate) fn nesting_at(&self, point: DVec3, pending: &mut Pending) -> Nesting {
        // Any direction will do; this one is parallel to nothing people build.
        let ray = Ray::new(point, DVec3::new(0.352, 0.801, 0.484).normalize());
        let mut first: HashMap<u32, (f64, bool)> = HashMap::new();
        self.tree.walk(&ray, self.contact_m, f64::INFINITY, pending, |range, limit| {
            for triangle in range {
                let object = self.faces[triangle].object;
                if self.media[object as usize].is_none() {
                    continue;
                }
                if let Some(crossing) =
                    triangle::cross(&ray, &self.corners[triangle]).filter(|c| c.distance > 0.0)
                {
                    let entry = first.entry(object).or_insert((f64::INFINITY, true));
                    if crossing.distance < entry.0 {
                        *entry = (crossing.distance, crossing.front);
                    }
                }
            }
            limit
        });
        // The farthest way out was entered first.
        let mut around: Vec<(f64, u32)> =
            first.into_iter().filter(|(_, (_, front))| !front).map(|(object, (d, _))| (d, object)).collect();
        around.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        around.into_iter().fold(Nesting::default(), |n, (_, object)| n.entered(object).unwrap_or(n))
    }
}

/// A triangle on its way into the world.
struct Kept {
    corners: [DVec3; 3],
    vertices: [u32; 3],
    index: u32,
}

impl Kept {
    fn flip(&mut self) {
        self.corners.swap(1, 2);
        self.vertices.swap(1, 2);
    }
}

type Place = [u64; 3];

/// Equal for equal positions, 0 and -0 included.
fn place(p: DVec3) -> Place {
    p.to_array().map(|c| (c + 0.0).to_bits())
}

fn distinct_triangles(positions: &[DVec3], triangles: &[[u32; 3]], counts: &mut GeometryCounts) -> Vec<Kept> {
    let mut seen = HashSet::with_capacity(triangles.len());
    let mut kept = Vec::with_capacity(triangles.len());
    for (index, &vertices) in triangles.iter().enumerate() {
        let corners = vertices.map(|v| positions[v as usize]);
        let [a, b, c] = corners;
        if (b - a).cross(c - a).length_squared() == 0.0 {
            counts.zero_area += 1;
            continue;
        }
        let mut places = corners.map(place);
        places.sort_unstable();
        if !seen.insert(places) {
            counts.duplicates += 1;
            continue;
        }
        kept.push(Kept { corners, vertices, index: index as u32 });
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::reflect;
    use glam::DMat4;
    use spectral_scene::bundled;

    fn scaled(name: &str, scale: f64) -> (World, u32) {
        let mut scene = bundled(name).unwrap();
        for object in &mut scene.objects {
            object.world_from_mesh = DMat4::from_scale(DVec3::splat(scale)) * object.world_from_mesh;
        }
        let glass = scene.refractors().next().unwrap() as u32;
        (World::new(&scene), glass)
    }

    /// Follows mirror reflections inside a closed body: every hit must be its back, forever. The first target lies on
    /// a corner, the next on an edge, where neighbours are nearest.
    fn billiard(world: &World, glass: u32, inside: DVec3, target: DVec3) {
        let nesting = Nesting::default().entered(glass).unwrap();
        let mut start = Start::free(nesting);
        let (mut origin, mut direction) = (inside, (target - inside).normalize());
        let mut pending = Pending::default();
        for bounce in 0..200 {
            let hit = world.closest(&Ray::new(origin, direction), &start, &mut pending);
            let hit = hit.unwrap_or_else(|| panic!("escaped at bounce {bounce}"));
            let face = &world.faces[hit.triangle as usize];
            assert_eq!((face.object, hit.front), (glass, false), "bounce {bounce}");
            let n = -face.normal;
            origin = world.position(&hit);
            direction = reflect(direction, n, -direction.dot(n));
            start = Start { triangle: hit.triangle, kind: StartKind::Reflected, nesting };
        }
    }

    #[test]
    fn closed_bodies_do_not_leak_at_any_scale() {
        for name in ["gem", "sphere"] {
            for scale in [1e-3, 1.0, 1e4] {
                let (world, glass) = scaled(name, scale);
                let inside = DVec3::new(0.0011, 0.0803, -0.0007) * scale;
                let of_glass = |t: &usize| world.faces[*t].object == glass;
                for triangle in (0..world.faces.len()).filter(of_glass).step_by(7) {
                    let [a, b, c] = world.corners[triangle];
                    for target in [a, 0.5 * (a + b), 0.3 * b + 0.7 * c, (a + b + c) / 3.0] {
                        billiard(&world, glass, inside, target);
                    }
                }
            }
        }
    }

    #[test]
    fn a_point_knows_what_it_is_in() {
        let (world, glass) = scaled("sphere", 1.0);
        let mut pending = Pending::default();
        assert_eq!(world.nesting_at(DVec3::new(0.0, 0.08, 0.0), &mut pending).medium(), Some(glass));
        for outside in [DVec3::new(0.0, 0.5, 0.0), DVec3::new(-0.04, 0.02, -0.03), DVec3::new(0.0, 0.01, 0.0)]
        {
            assert_eq!(world.nesting_at(outside, &mut pending), Nesting::default(), "{outside}");
        }
    }

    /// The tree finds what going through all triangles finds.
    #[test]
    fn the_tree_leaves_nothing_out() {
        let (world, _) = scaled("ring", 1.0);
        let mut pending = Pending::default();
        let mut state = 7_u64;
        let mut uniform = || {
            state = crate::sobol::mix(state);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut hits = 0;
        for _ in 0..200 {
            let origin = DVec3::new(uniform(), uniform(), uniform());
            let target = DVec3::new(uniform(), 0.2 * uniform(), uniform()) * 0.3;
            let ray = Ray::new(origin, (target - origin).normalize());
            let found = world.closest(&ray, &Start::free(Nesting::default()), &mut pending);
            let expected = world
                .corners
                .iter()
                .filter_map(|c| triangle::cross(&ray, c).map(|c| c.distance))
                .filter(|d| *d > 0.0)
                .fold(f64::INFINITY, f64::min);
            let distance = found.map_or(f64::INFINITY, |h| h.distance);
            assert!(distance == expected || (distance - expected).abs() <= world.contact_m);
            let start = Start::free(Nesting::default());
            assert_eq!(world.blocked(&ray, &start, f64::INFINITY, &mut pending), expected.is_finite());
            hits += u32::from(expected.is_finite());
        }
        assert!(hits > 50, "{hits}");
    }
}
