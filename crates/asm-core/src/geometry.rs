//! A scene's triangles in working units, as passes read them.

use std::ops::Range;

use glam::{DVec3, Vec2, Vec3};
use spectral_scene::{Scene, Topology};

use crate::shared::triangle::{TRIANGLE_MIRROR, TRIANGLE_OPEN, TRIANGLE_REFRACTS, Triangle};
use crate::{PlanError, WorkingSpace};

/// Most triangles in a plan: CPU mirrors see visibility buffers as f32.
pub(crate) const MAX_TRIANGLES: usize = 1 << 24;

/// All triangles of a scene: matt objects first, then mirrors, then refractors.
pub(crate) struct Geometry {
    pub(crate) triangles: Vec<Triangle>,
    /// Triangles of each object of the scene.
    pub(crate) objects: Vec<Range<u32>>,
    /// Number of triangles that light lands on.
    pub(crate) matt: u32,
    /// Number of triangles that block light, mirrors among them.
    pub(crate) opaque: u32,
    /// Texture coordinates of the receiver's triangles, three each.
    pub(crate) corner_uvs: Vec<Vec2>,
    /// Closed refractors whose triangles faced inwards and were turned.
    pub(crate) turned: Vec<usize>,
    /// Refractors with an edge.
    pub(crate) open: Vec<usize>,
}

impl Geometry {
    pub(crate) fn new(
        scene: &Scene,
        space: &WorkingSpace,
        receiver: Option<usize>,
        topology: &mut dyn FnMut(usize) -> Topology,
    ) -> Result<Self, PlanError> {
        let mut geometry = Self {
            triangles: Vec::new(),
            objects: vec![0..0; scene.objects.len()],
            matt: 0,
            opaque: 0,
            corner_uvs: Vec::new(),
            turned: Vec::new(),
            open: Vec::new(),
        };
        for object in scene.matt() {
            geometry.add(scene, space, object, receiver == Some(object), None);
        }
        geometry.matt = geometry.triangles.len() as u32;
        for object in scene.mirrors() {
            geometry.add(scene, space, object, false, None);
        }
        geometry.opaque = geometry.triangles.len() as u32;
        for object in scene.refractors() {
            geometry.add(scene, space, object, false, Some(topology(object)));
        }
        let got = geometry.triangles.len();
        if got >= MAX_TRIANGLES {
            return Err(PlanError::TooManyTriangles { got, max: MAX_TRIANGLES - 1 });
        }
        Ok(geometry)
    }

    /// Refractors come with their topology.
    fn add(
        &mut self,
        scene: &Scene,
        space: &WorkingSpace,
        object: usize,
        with_uvs: bool,
        topology: Option<Topology>,
    ) {
        let first = self.triangles.len() as u32;
        let mesh = &scene.meshes[scene.objects[object].mesh];
        let world = scene.world_mesh(object);
        let positions: Vec<Vec3> = world.positions.iter().map(|&p| space.point(p)).collect();
        let mut flags = if scene.material_of(object).is_mirror() { TRIANGLE_MIRROR } else { 0 };
        let mut inside_out = false;
        if let Some(topology) = topology {
            flags |= TRIANGLE_REFRACTS;
            inside_out = topology.inside_out;
            if inside_out {
                self.turned.push(object);
            }
            if !topology.closed && !mesh.triangles.is_empty() {
                flags |= TRIANGLE_OPEN;
                self.open.push(object);
            }
        }
        // Whoever turned the triangles may or may not have turned the normals with them.
        let normal_sign = if inside_out && normals_face_inwards(&world.normals, &world) { -1.0 } else { 1.0 };
        for corners in world.triangles {
            let corners = if inside_out { [corners[0], corners[2], corners[1]] } else { *corners };
            let [p0, p1, p2] = corners.map(|v| positions[v as usize]);
            let Some(facet) = facet_normal(p0, p1, p2) else { continue };
            let [n0, n1, n2] = vertex_normals(corners, &world.normals, normal_sign, facet);
            self.triangles.push(Triangle {
                p0,
                material: scene.objects[object].material as u32,
                p1,
                object: object as u32,
                p2,
                flags,
                n0,
                n1,
                n2,
                ..Triangle::default()
            });
            if with_uvs {
                self.corner_uvs.extend(corners.map(|v| Vec2::from(world.uvs[v as usize])));
            }
        }
        self.objects[object] = first..self.triangles.len() as u32;
    }

    /// Corners of the refractors.
    pub(crate) fn refractor_corners(&self) -> impl Iterator<Item = DVec3> + Clone + '_ {
        corners(&self.triangles[self.opaque as usize..])
    }

    /// Corners of the triangles with any of these flags.
    pub(crate) fn flagged_corners(&self, flags: u32) -> impl Iterator<Item = DVec3> + Clone + '_ {
        let flagged = self.triangles[self.matt as usize..].iter().filter(move |t| t.flags & flags != 0);
        flagged.flat_map(|t| [t.p0, t.p1, t.p2]).map(|p| p.as_dvec3())
    }

    /// Corners of what light lands on.
    pub(crate) fn matt_corners(&self) -> impl Iterator<Item = DVec3> + Clone + '_ {
        corners(&self.triangles[..self.matt as usize])
    }

    /// Corners of one object.
    pub(crate) fn object_corners(&self, object: usize) -> impl Iterator<Item = DVec3> + Clone + '_ {
        let range = self.objects[object].clone();
        corners(&self.triangles[range.start as usize..range.end as usize])
    }
}

fn corners(triangles: &[Triangle]) -> impl Iterator<Item = DVec3> + Clone + '_ {
    triangles.iter().flat_map(|t| [t.p0, t.p1, t.p2]).map(|p| p.as_dvec3())
}

/// Smallest and largest coordinates.
pub(crate) fn bounds(points: impl Iterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.fold(None, |bounds, p| {
        Some(bounds.map_or((p, p), |(low, high): (DVec3, DVec3)| (low.min(p), high.max(p))))
    })
}

/// Sine of the smallest angle in a triangle whose plane f32 still resolves; thinner ones meet no ray.
const THINNEST: f64 = 1e-6;

/// Unit normal of a triangle, unless it has no area to speak of.
fn facet_normal(p0: Vec3, p1: Vec3, p2: Vec3) -> Option<Vec3> {
    let [e1, e2, e3] = [p1 - p0, p2 - p0, p2 - p1].map(|e| e.as_dvec3());
    let n = e1.cross(e2);
    let longest = e1.length_squared().max(e2.length_squared()).max(e3.length_squared());
    (n.length() > THINNEST * longest).then(|| n.normalize().as_vec3())
}

/// Normals at the corners; the facet's where there are none or where they point against each other so much that between
/// them lies none.
fn vertex_normals(corners: [u32; 3], normals: &[DVec3], sign: f64, facet: Vec3) -> [Vec3; 3] {
    if normals.is_empty() {
        return [facet; 3];
    }
    let [a, b, c] = corners.map(|v| (sign * normals[v as usize]).as_vec3());
    let sane = |n: Vec3| n.is_normalized();
    if sane(a) && sane(b) && sane(c) && a.dot(b).min(b.dot(c)).min(c.dot(a)) > -0.4 {
        [a, b, c]
    } else {
        [facet; 3]
    }
}

/// Most vertex normals point the way their inside-out triangles do.
fn normals_face_inwards(normals: &[DVec3], world: &spectral_scene::WorldMesh<'_>) -> bool {
    if normals.is_empty() {
        return false;
    }
    let agreement: f64 = world
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| world.positions[v as usize]);
            let mean: DVec3 = t.iter().map(|&v| normals[v as usize]).sum();
            (b - a).cross(c - a).dot(mean)
        })
        .sum();
    agreement > 0.0
}
