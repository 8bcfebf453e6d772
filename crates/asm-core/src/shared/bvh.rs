//! Host side of `shaders/shared/bvh.wgsl`: a tree of boxes over all triangles, and the nearest surface on a ray.
//!
//! Two surfaces at one distance are told apart by their index, so the order of the walk does not matter.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::triangle::{NOTHING, PlaneHit, SAME_SURFACE, TRIANGLE_OPEN, TRIANGLE_REFRACTS, Triangle};
use super::view::Ray;

/// A box of the tree; mirrors `BvhNode` in `shaders/shared/bvh.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct BvhNode {
    /// Lower corner.
    pub low: Vec3,
    /// The first of two children, or the triangle.
    pub first: u32,
    /// Upper corner.
    pub high: Vec3,
    /// 0: a node with two children; 1: a leaf.
    pub count: u32,
}

/// Nodes waiting on a way down the tree, at most.
pub const BVH_STACK: usize = 64;

/// The ray is in no refractor.
pub const NO_OBJECT: u32 = u32::MAX;

/// Which surfaces a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Sought {
    /// The refractor that the ray is in, or [`NO_OBJECT`].
    pub object: u32,
    /// The triangle that it starts on, as visibility buffers count; [`NOTHING`] for none.
    pub start: u32,
    /// `TRIANGLE_*`, any of these; 0 takes all.
    pub only: u32,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceHit {
    /// The triangle, as visibility buffers count; [`NOTHING`] where the ray meets nothing.
    pub visible: u32,
    /// Where.
    pub hit: PlaneHit,
}

/// The triangles of a plan and the tree over them.
#[derive(Clone, Copy)]
pub struct Surfaces<'a> {
    /// The tree, root first.
    pub bvh: &'a [BvhNode],
    /// All triangles.
    pub triangles: &'a [Triangle],
}

/// A ray may pass so far beside a triangle and still meet it, working units: what f32 rounds where a ray goes between two.
pub const BESIDE: f32 = 1e-6;

const LEAST_COMPONENT: f32 = 1e-12;
const FARTHEST: f32 = 1e30;

pub(crate) fn meets_within(t: &Triangle, hit: &PlaneHit) -> bool {
    let beside = (-hit.u).max(-hit.v).max(hit.u + hit.v - 1.0); // of a height
    if !hit.crosses || beside <= 0.0 {
        return hit.crosses;
    }
    let (e1, e2, e3) = (t.p1 - t.p0, t.p2 - t.p0, t.p2 - t.p1);
    let longest = e1.length_squared().max(e2.length_squared()).max(e3.length_squared());
    beside * beside * e1.cross(e2).length_squared() <= BESIDE * BESIDE * longest
}

/// Surfaces of a ray's own object are met beyond this distance. Of closed glass only faces are sought that the start does not lie
/// on: no tolerance is needed, and films of a millionth have two sides. Other objects may touch the start, and are met there.
fn least_distance(t: &Triangle, start_object: u32) -> f32 {
    if start_object != NO_OBJECT && t.object != start_object {
        -SAME_SURFACE
    } else if t.flags & (TRIANGLE_REFRACTS | TRIANGLE_OPEN) == TRIANGLE_REFRACTS {
        0.0
    } else {
        SAME_SURFACE
    }
}

fn meets(t: &Triangle, visible: u32, hit: &PlaneHit, sought: &Sought) -> bool {
    if visible == sought.start || !meets_within(t, hit) {
        return false;
    }
    if sought.only != 0 && t.flags & sought.only == 0 {
        return false;
    }
    if t.flags & TRIANGLE_REFRACTS == 0 {
        return true;
    }
    if sought.object != NO_OBJECT {
        return t.object == sought.object && hit.facing > 0.0;
    }
    hit.facing < 0.0 || t.flags & TRIANGLE_OPEN != 0
}

fn box_distance(node: &BvhNode, origin: Vec3, inverse: Vec3) -> f32 {
    let a = (node.low - origin) * inverse;
    let b = (node.high - origin) * inverse;
    let enters = a.min(b).max_element().max(0.0);
    let leaves = a.max(b).min_element() * 1.000_001 + SAME_SURFACE;
    if enters <= leaves { enters } else { FARTHEST }
}

impl Surfaces<'_> {
    /// The nearest of the sought surfaces on a ray. Glass that touches what is opaque is left before that is met.
    pub fn nearest(&self, ray: Ray, sought: &Sought) -> SurfaceHit {
        let component = |d: f32| {
            if d.abs() >= LEAST_COMPONENT {
                d
            } else if d >= 0.0 {
                LEAST_COMPONENT
            } else {
                -LEAST_COMPONENT
            }
        };
        let inverse = ray.direction.map(component).recip();
        let nothing = PlaneHit { distance: FARTHEST, ..PlaneHit::default() };
        let mut best = SurfaceHit { visible: NOTHING, hit: nothing };
        let mut best_rank = FARTHEST;
        let start_object = match sought.start {
            NOTHING => NO_OBJECT,
            start => self.triangles[start as usize - 1].object,
        };
        let mut stack = [0_u32; BVH_STACK];
        let (mut waiting, mut at) = (0, 0_u32);
        loop {
            let node = &self.bvh[at as usize];
            if node.count == 1 {
                let t = &self.triangles[node.first as usize];
                let mut hit = t.plane_hit(ray);
                let beyond = hit.distance > least_distance(t, start_object);
                hit.distance = hit.distance.max(0.0);
                let visible = node.first + 1;
                let last = sought.object != NO_OBJECT && t.flags & TRIANGLE_REFRACTS == 0;
                let rank = hit.distance + if last { SAME_SURFACE } else { 0.0 };
                let nearer = rank < best_rank || (rank == best_rank && visible < best.visible);
                if beyond && nearer && meets(t, visible, &hit, sought) {
                    best = SurfaceHit { visible, hit };
                    best_rank = rank;
                }
            } else {
                let [a, b] = [node.first, node.first + 1]
                    .map(|child| box_distance(&self.bvh[child as usize], ray.origin, inverse));
                let second = u32::from(b < a);
                if a.max(b) <= best_rank && a.max(b) < FARTHEST {
                    stack[waiting] = node.first + 1 - second;
                    waiting += 1;
                }
                if a.min(b) <= best_rank && a.min(b) < FARTHEST {
                    at = node.first + second;
                    continue;
                }
            }
            if waiting == 0 {
                return best;
            }
            waiting -= 1;
            at = stack[waiting];
        }
    }
}
