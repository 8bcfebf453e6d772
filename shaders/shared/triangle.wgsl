// Triangles in working units and rays against them. Host side: `Triangle` in asm-core's `shared/triangle.rs`.
//
// N         (p1 - p0) x (p2 - p0), pointing out of the surface; its length is twice the area
// visible   what visibility buffers hold: index of a triangle + 1, or 0 for nothing

struct Triangle {
    p0: vec3<f32>,
    material: u32,
    p1: vec3<f32>,
    object: u32,
    p2: vec3<f32>,
    flags: u32, // TRIANGLE_*
    n0: vec3<f32>, // unit vertex normals; equal on flat facets
    face: u32, // triangles across whose common edges normals go on
    n1: vec3<f32>,
    reserved1: u32,
    n2: vec3<f32>,
    reserved2: u32,
}

const TRIANGLE_REFRACTS: u32 = 1u;
const TRIANGLE_OPEN: u32 = 2u;         // of a refractor whose surface has an edge
const TRIANGLE_MIRROR: u32 = 4u;

const NOTHING: u32 = 0u;

struct PlaneHit {
    crosses: bool,   // false where the ray runs along the plane; the rest then means nothing
    facing: f32,     // direction . N: below 0 on the outside
    distance: f32,   // along the ray, negative behind its origin
    u: f32,          // weights of p1 and p2
    v: f32,
}

// Distance under which two points are on the same surface, working units.
const SAME_SURFACE: f32 = 2e-5;

// Sine of the smallest angle between a ray and a plane that f32 still resolves.
const GRAZING: f32 = 1e-6;

// Moeller & Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection", without the test for the inside.
fn plane_hit(t: Triangle, ray: Ray) -> PlaneHit {
    let e1 = t.p1 - t.p0;
    let e2 = t.p2 - t.p0;
    let n = cross(e1, e2);
    let facing = dot(ray.direction, n);
    if abs(facing) <= GRAZING * length(n) {
        return PlaneHit(false, facing, 0.0, 0.0, 0.0);
    }
    let s = ray.origin - t.p0;
    let q = cross(ray.direction, s);
    let inverse = 1.0 / facing;
    return PlaneHit(true, facing, -dot(s, n) * inverse, dot(q, e2) * inverse, -dot(q, e1) * inverse);
}

// A weight may be this far outside the triangle and still count as on its edge.
const EDGE: f32 = 1e-4;

fn inside(hit: PlaneHit) -> bool {
    return hit.crosses && hit.u >= -EDGE && hit.v >= -EDGE && hit.u + hit.v <= 1.0 + EDGE;
}

// No rounding makes the hit another triangle's.
fn well_inside(hit: PlaneHit) -> bool {
    return hit.crosses && hit.u >= EDGE && hit.v >= EDGE && hit.u + hit.v <= 1.0 - EDGE;
}

// Two triangles that a ray meets on their common edge, within EDGE of it, are met no farther apart, working units.
const SAME_EDGE: f32 = 1e-3;

// A hit of triangle `index` rather than `other`, a hit of triangle `other_index`: the one inside its triangle, else the nearer, but of
// the triangles round an edge always the same one, whatever rounding made of the distances.
fn preferred(hit: PlaneHit, index: u32, other: PlaneHit, other_index: u32) -> bool {
    if !inside(hit) || !inside(other) {
        return inside(hit);
    }
    if abs(hit.distance - other.distance) > SAME_EDGE {
        return hit.distance < other.distance;
    }
    return index < other_index;
}

fn interpolated_normal(t: Triangle, hit: PlaneHit) -> vec3<f32> {
    return normalize((1.0 - hit.u - hit.v) * t.n0 + hit.u * t.n1 + hit.v * t.n2);
}
