//! Host side of `shaders/shared/triangle.wgsl`: triangles in working units and rays against them.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use glam::{UVec2, Vec3};

use super::view::Ray;

/// A triangle in working units; mirrors `Triangle` in `shaders/shared/triangle.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Triangle {
    /// First corner.
    pub p0: Vec3,
    /// Index of its material in the scene.
    pub material: u32,
    /// Second corner.
    pub p1: Vec3,
    /// Index of its object in the scene.
    pub object: u32,
    /// Third corner.
    pub p2: Vec3,
    /// `TRIANGLE_*`.
    pub flags: u32,
    /// Unit vertex normals; equal on flat facets.
    pub n0: Vec3,
    /// Surfaces that light goes through alike: triangles with a common edge across which normals go on.
    pub face: u32,
    /// At the second corner.
    pub n1: Vec3,
    /// Padding.
    pub reserved1: u32,
    /// At the third corner.
    pub n2: Vec3,
    /// Padding.
    pub reserved2: u32,
}

/// The triangle belongs to a refractor.
pub const TRIANGLE_REFRACTS: u32 = 1;
/// The triangle belongs to a refractor whose surface has an edge.
pub const TRIANGLE_OPEN: u32 = 2;
/// The triangle belongs to a mirror.
pub const TRIANGLE_MIRROR: u32 = 4;

/// A visibility buffer's value where it shows no triangle.
pub const NOTHING: u32 = 0;

/// Texel of one layer of a visibility buffer. Mirrors load texels as floats, which hold integers to 2^24 exactly;
/// plans have fewer triangles.
pub fn visible_in_layer(visibility: &TextureView<'_>, texel: UVec2, layer: u32) -> u32 {
    visibility.load_layer(texel.x, texel.y, layer)[0] as u32
}

/// A ray against the plane of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlaneHit {
    /// False where the ray runs along the plane; the rest then means nothing.
    pub crosses: bool,
    /// direction . N: below 0 on the outside.
    pub facing: f32,
    /// Along the ray, negative behind its origin.
    pub distance: f32,
    /// Weight of p1.
    pub u: f32,
    /// Weight of p2.
    pub v: f32,
}

/// Distance under which two points are on the same surface, working units.
pub const SAME_SURFACE: f32 = 2e-5;

/// Sine of the smallest angle between a ray and a plane that f32 still resolves.
pub const GRAZING: f32 = 1e-6;

/// A weight may be this far outside the triangle and still count as on its edge.
pub const EDGE: f32 = 1e-4;

/// Two triangles that a ray meets on their common edge, within [`EDGE`] of it, are met no farther apart, working units.
pub const SAME_EDGE: f32 = 1e-3;

impl Triangle {
    /// (p1 - p0) x (p2 - p0), pointing out of the surface; its length is twice the area.
    pub fn scaled_normal(&self) -> Vec3 {
        (self.p1 - self.p0).cross(self.p2 - self.p0)
    }

    /// Moeller & Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection", without the test for the inside.
    pub fn plane_hit(&self, ray: Ray) -> PlaneHit {
        let e1 = self.p1 - self.p0;
        let e2 = self.p2 - self.p0;
        let n = e1.cross(e2);
        let facing = ray.direction.dot(n);
        if facing.abs() <= GRAZING * n.length() {
            return PlaneHit { facing, ..PlaneHit::default() };
        }
        let s = ray.origin - self.p0;
        let q = ray.direction.cross(s);
        let inverse = 1.0 / facing;
        PlaneHit {
            crosses: true,
            facing,
            distance: -s.dot(n) * inverse,
            u: q.dot(e2) * inverse,
            v: -q.dot(e1) * inverse,
        }
    }

    /// Unit normal between the corners' at a hit.
    pub fn interpolated_normal(&self, hit: &PlaneHit) -> Vec3 {
        ((1.0 - hit.u - hit.v) * self.n0 + hit.u * self.n1 + hit.v * self.n2).normalize()
    }
}

impl PlaneHit {
    /// The hit is in the triangle, not only in its plane.
    ///
    /// Kept out of line: inlined into a search for the triangle at an edge, rustc 1.95 at opt-level 3 has been seen to lose the
    /// tolerance, which moved one photon in a thousand to the other triangle and no GPU's with it.
    #[inline(never)]
    pub fn inside(&self) -> bool {
        self.crosses && self.u >= -EDGE && self.v >= -EDGE && self.u + self.v <= 1.0 + EDGE
    }

    /// No rounding makes the hit another triangle's. Out of line as [`PlaneHit::inside`] is.
    #[inline(never)]
    pub fn well_inside(&self) -> bool {
        self.crosses && self.u >= EDGE && self.v >= EDGE && self.u + self.v <= 1.0 - EDGE
    }

    /// This hit of triangle `index` rather than `other` of triangle `other_index`: the one inside its triangle, else the nearer,
    /// but of the triangles round an edge always the same one, whatever rounding made of the distances.
    pub fn is_preferred(&self, index: u32, other: &Self, other_index: u32) -> bool {
        if !self.inside() || !other.inside() {
            return self.inside();
        }
        if (self.distance - other.distance).abs() > SAME_EDGE {
            return self.distance < other.distance;
        }
        index < other_index
    }
}
