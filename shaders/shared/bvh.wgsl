// A tree of boxes over all triangles, and the nearest surface on a ray. Host side: asm-core's `shared/bvh.rs`.
//
// Expects the globals `bvh` and `triangles`.

struct BvhNode {
    low: vec3<f32>,
    first: u32, // of two children, or the triangle
    high: vec3<f32>,
    count: u32, // 0: a node with two children; 1: a leaf
}

// Nodes waiting on a way down; host code refuses deeper trees.
const BVH_STACK: u32 = 64u;

const NO_OBJECT: u32 = 0xffffffffu;

// Which surfaces a ray meets.
struct Sought {
    object: u32, // the refractor that the ray is in, or NO_OBJECT
    start: u32,  // the triangle that it starts on, as visibility buffers count; NOTHING for none
    only: u32,   // TRIANGLE_*, any of these; 0 takes all
}

struct SurfaceHit {
    visible: u32, // NOTHING where the ray meets nothing
    hit: PlaneHit,
}

// A ray may pass so far beside a triangle and still meet it, working units: what f32 rounds where a ray goes between two.
const BESIDE: f32 = 1e-6;

fn meets_within(t: Triangle, hit: PlaneHit) -> bool {
    let beside = max(max(-hit.u, -hit.v), hit.u + hit.v - 1.0); // of a height
    if !hit.crosses || beside <= 0.0 {
        return hit.crosses;
    }
    let e1 = t.p1 - t.p0;
    let e2 = t.p2 - t.p0;
    let e3 = t.p2 - t.p1;
    let longest = max(max(dot(e1, e1), dot(e2, e2)), dot(e3, e3));
    let n = cross(e1, e2);
    return beside * beside * dot(n, n) <= BESIDE * BESIDE * longest;
}

// Surfaces of a ray's own object are met beyond this distance. Of closed glass only faces are sought that the start does not lie
// on: no tolerance is needed, and films of a millionth have two sides. Other objects may touch the start, and are met there.
fn least_distance(t: Triangle, start_object: u32) -> f32 {
    if start_object != NO_OBJECT && t.object != start_object {
        return -SAME_SURFACE;
    }
    return select(SAME_SURFACE, 0.0, (t.flags & (TRIANGLE_REFRACTS | TRIANGLE_OPEN)) == TRIANGLE_REFRACTS);
}

// In a refractor light leaves by its own faces only; outside it enters closed ones by faces turned towards it. Open ones are met
// from both sides, and so is what is opaque.
fn meets(t: Triangle, visible: u32, hit: PlaneHit, sought: Sought) -> bool {
    if visible == sought.start || !meets_within(t, hit) {
        return false;
    }
    if sought.only != 0u && (t.flags & sought.only) == 0u {
        return false;
    }
    if (t.flags & TRIANGLE_REFRACTS) == 0u {
        return true;
    }
    if sought.object != NO_OBJECT {
        return t.object == sought.object && hit.facing > 0.0;
    }
    return hit.facing < 0.0 || (t.flags & TRIANGLE_OPEN) != 0u;
}

// Distance along the ray to a box, 0 from within it, `farthest` or more where it is missed or lies beyond.
fn box_distance(node: BvhNode, origin: vec3<f32>, inverse: vec3<f32>, farthest: f32) -> f32 {
    let a = (node.low - origin) * inverse;
    let b = (node.high - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enters = max(max(near.x, near.y), max(near.z, 0.0));
    let leaves = min(far.x, min(far.y, far.z)) * 1.000001 + SAME_SURFACE;
    return select(farthest, enters, enters <= leaves);
}

// Components of directions below this count as this: no box distance is infinite or no number.
const LEAST_COMPONENT: f32 = 1e-12;

const FARTHEST: f32 = 1e30;

// Glass that touches what is opaque is left before that is met.
fn nearest_surface(ray: Ray, sought: Sought) -> SurfaceHit {
    let away = select(vec3<f32>(-LEAST_COMPONENT), vec3<f32>(LEAST_COMPONENT), ray.direction >= vec3<f32>(0.0));
    let inverse = 1.0 / select(ray.direction, away, abs(ray.direction) < vec3<f32>(LEAST_COMPONENT));
    var best = SurfaceHit(NOTHING, PlaneHit(false, 0.0, FARTHEST, 0.0, 0.0));
    var best_rank = FARTHEST;
    var start_object = NO_OBJECT;
    if sought.start != NOTHING {
        start_object = triangles[sought.start - 1u].object;
    }
    var stack: array<u32, BVH_STACK>;
    var waiting = 0u;
    var at = 0u;
    loop {
        let node = bvh[at];
        if node.count == 1u {
            let t = triangles[node.first];
            var hit = plane_hit(t, ray);
            let beyond = hit.distance > least_distance(t, start_object);
            hit.distance = max(hit.distance, 0.0);
            let visible = node.first + 1u;
            let last = sought.object != NO_OBJECT && (t.flags & TRIANGLE_REFRACTS) == 0u;
            let rank = hit.distance + select(0.0, SAME_SURFACE, last);
            let nearer = rank < best_rank || (rank == best_rank && visible < best.visible);
            if beyond && nearer && meets(t, visible, hit, sought) {
                best = SurfaceHit(visible, hit);
                best_rank = rank;
            }
        } else {
            let a = box_distance(bvh[node.first], ray.origin, inverse, FARTHEST);
            let b = box_distance(bvh[node.first + 1u], ray.origin, inverse, FARTHEST);
            let second = u32(b < a);
            if max(a, b) <= best_rank && max(a, b) < FARTHEST {
                stack[waiting] = node.first + 1u - second;
                waiting += 1u;
            }
            if min(a, b) <= best_rank && min(a, b) < FARTHEST {
                at = node.first + second;
                continue;
            }
        }
        if waiting == 0u {
            break;
        }
        waiting -= 1u;
        at = stack[waiting];
    }
    return best;
}
