// Paths of light through the whole scene, by its geometry: from the light through every surface, with reflections inside the first
// glass, to what each meets last. Host side: asm-core's `shared/light_path.rs`.
//
// Where light leaves the first glass after each number of reflections it goes on as an arrival of its own. Behind it, what goes
// on is chosen, not drawn: through glass what passes, at mirrors and at total reflection what is thrown back. The first few times
// that this leaves something behind, what is thrown back goes aside, and arrives for itself.
//
// Expects the globals `triangles`, `bvh`, `views`, `optics` and `landing_visibility`, that `light_paths` is set, and the function
// `path_arrives(path, order, arrival, length, medium)`, which takes each arrival.

struct LightPaths {
    landing_view: u32,
    landing_faces: u32,
    materials: u32,    // row length of `optics`
    first_optics: u32, // row of this light
    orders: u32,       // reflections inside the first glass after which light may leave it, and none
    asides: u32,       // what is thrown back behind the first glass and followed, at most so often; up to MOST_ASIDES
    path: u32,         // PATH_*
    casters: u32,      // TRIANGLE_* of the surfaces that paths begin at
    rule: u32,         // RULE_*
    range: f32,        // light beyond this distance is dark; 0 has no end
}

var<private> light_paths: LightPaths;

// Where a path, or what of it leaves the first glass after so many reflections, leads.
struct Arrival {
    end: u32,        // END_*; END_LANDED at an opaque surface, wherever that is
    ray: Ray,        // the last; END_LANDED and END_ESCAPED only
    met: SurfaceHit, // END_LANDED only
    part: u32,       // of its flux; what the first glass absorbs is not yet taken off
    way: u32,        // of all surfaces on the way
}

// Light on its way outside the first glass, at most so many surfaces.
const MOST_SURFACES: u32 = 12u;

// What is left inside glass is followed no longer when it is less than one in so many of all.
const LEAST_SHARE: u32 = 4096u;

fn medium_of(t: Triangle, bin: u32) -> Optics {
    return optics[(light_paths.first_optics + bin) * light_paths.materials + t.material];
}

fn way_through(way: u32, t: Triangle, what: u32) -> u32 {
    return (way ^ (8u * t.face + what)) * 16777619u;
}

const WAY_START: u32 = 2166136261u;
const WAY_THROUGH: u32 = 1u;
const WAY_BACK: u32 = 2u;

fn no_surface() -> SurfaceHit {
    return SurfaceHit(NOTHING, PlaneHit(false, 0.0, 0.0, 0.0, 0.0));
}

fn nowhere(end: u32, part: u32, way: u32) -> Arrival {
    return Arrival(end, Ray(vec3<f32>(0.0), vec3<f32>(0.0)), no_surface(), part, way);
}

// The view shows this surface at the place, or beside it.
fn shown_there(at: Located, visible: u32, point: vec3<f32>) -> bool {
    let view = views[at.view];
    let light_ray = view_ray_through(view, point);
    let distance = dot(point - light_ray.origin, light_ray.direction);
    let object = triangles[visible - 1u].object;
    let middle = vec2<i32>(at.texel);
    for (var i = -1; i < 8; i++) {
        var texel = middle;
        if i >= 0 {
            texel = texel_beside(view, middle, i);
        }
        let shown = textureLoad(landing_visibility, texel, i32(at.face), 0).r;
        if shown == visible {
            return true;
        }
        if shown != NOTHING && triangles[shown - 1u].object == object {
            let hit = plane_hit(triangles[shown - 1u], light_ray);
            if hit.crosses && abs(hit.distance - distance) <= 0.01 * abs(distance) + SAME_SURFACE {
                return true;
            }
        }
    }
    return false;
}

// Where a landing view shows the place and side that light arrives at, if one does.
fn locate_arrival(ray: Ray, met: SurfaceHit) -> Located {
    let point = ray.origin + met.hit.distance * ray.direction;
    var at = locate(light_paths.landing_view, light_paths.landing_faces, point);
    if at.found {
        let lit = plane_hit(triangles[met.visible - 1u], view_ray_through(views[at.view], point)).facing * met.hit.facing > 0.0;
        at.found = lit && shown_there(at, met.visible, point);
    }
    return at;
}

// A part of a path's light: on its way outside the first glass, or where it ended before.
struct Branch {
    order: u32,
    end: u32,        // ON_ITS_WAY, or as of an arrival
    ray: Ray,
    met: SurfaceHit, // as of an arrival
    start: u32,      // the triangle that the ray starts on, as visibility buffers count
    part: u32,
    way: u32,
    object: u32,     // the refractor that it is in, or NO_OBJECT
    absorption: f32, // around it, per working unit
    length: f32,     // inside the first glass
}

const ON_ITS_WAY: u32 = 0xffffffffu;

const MOST_ASIDES: u32 = 2u;

const MOST_BRANCHES: u32 = 10u; // of 7 reflections inside, and what went aside

// Those of a path; the first ones leave the first glass, the others went aside behind it.
var<private> branches: array<Branch, MOST_BRANCHES>;
var<private> branch_count: u32;
var<private> first_aside: u32;

fn add_branch(branch: Branch) {
    branches[branch_count] = branch;
    branch_count += 1u;
}

fn on_its_way(order: u32, ray: Ray, start: u32, part: u32, way: u32, length: f32) -> Branch {
    return Branch(order, ON_ITS_WAY, ray, no_surface(), start, part, way, NO_OBJECT, 0.0, length);
}

fn ended(order: u32, end: u32, ray: Ray, met: SurfaceHit, part: u32, way: u32, length: f32) -> Branch {
    return Branch(order, end, ray, met, NOTHING, part, way, NO_OBJECT, 0.0, length);
}

// A path outside its first glass, and what it has left so far.
struct Outside {
    arrival: Arrival,
    ends: PathEnds,
}

// From the first glass, or from the first mirror, or from where it went aside, to where it lands. What is thrown back goes aside
// up to `room` branches, where it is not below `least`.
fn follow(branch: Branch, first_ends: PathEnds, bin: u32, room: u32, least: u32) -> Outside {
    var ray = branch.ray;
    var part = branch.part;
    var way = branch.way;
    var ends = first_ends;
    var sought = Sought(branch.object, branch.start, 0u);
    var absorption = branch.absorption;
    for (var i = 0u; i < MOST_SURFACES; i++) {
        let met = nearest_surface(ray, sought);
        if met.visible == NOTHING {
            return Outside(Arrival(END_ESCAPED, ray, met, part, way), ends);
        }
        let t = triangles[met.visible - 1u];
        let medium = medium_of(t, bin);
        let reached = flux_part(part, part_from(exp(-absorption * met.hit.distance)));
        ends.absorbed += part - reached;
        part = reached;
        let normal = -sign(met.hit.facing) * interpolated_normal(t, met.hit);
        let origin = ray.origin + met.hit.distance * ray.direction;
        if (t.flags & TRIANGLE_MIRROR) != 0u {
            let back = reflect_at(ray.direction, normal, t, mirror_reflectance(ray.direction, normal, medium.surface));
            if back.end != END_LANDED {
                return Outside(nowhere(back.end, part, way), ends);
            }
            let left = flux_part(part, part_from(back.reflectance));
            ends.absorbed += part - left;
            part = left;
            way = way_through(way, t, WAY_BACK);
            ray = Ray(origin, back.direction);
        } else if (t.flags & TRIANGLE_REFRACTS) != 0u {
            let entering = met.hit.facing < 0.0;
            let eta = select(1.0 / medium.index, medium.index, entering);
            let crossing = cross_surface(ray.direction, normal, t, eta, light_paths.rule);
            if crossing.end == END_TOTAL {
                let back = reflect_at(ray.direction, normal, t, 1.0);
                if back.end != END_LANDED {
                    return Outside(nowhere(back.end, part, way), ends);
                }
                way = way_through(way, t, WAY_BACK);
                ray = Ray(origin, back.direction);
            } else if crossing.end != END_LANDED {
                return Outside(nowhere(crossing.end, part, way), ends);
            } else {
                let passed = flux_part(part, part_from(1.0 - crossing.reflectance));
                let rest = part - passed;
                let back = reflect_at(ray.direction, normal, t, 1.0);
                let goes = select(0u, rest, back.end == END_LANDED);
                if branch_count < room && goes >= least {
                    let way_back = way_through(way, t, WAY_BACK);
                    let order = light_paths.orders + branch_count - first_aside;
                    let back_ray = Ray(origin, back.direction);
                    add_branch(Branch(order, ON_ITS_WAY, back_ray, no_surface(), met.visible, goes, way_back, sought.object, absorption, branch.length));
                } else if sought.object == NO_OBJECT {
                    ends.reflected += rest;
                } else {
                    ends.kept_inside += rest;
                }
                part = flux_part(passed, part_from(medium.surface));
                ends.absorbed += passed - part;
                way = way_through(way, t, WAY_THROUGH);
                ray = Ray(origin, crossing.direction);
                sought.object = select(NO_OBJECT, t.object, entering);
                absorption = select(0.0, medium.absorption, entering);
            }
        } else {
            return Outside(Arrival(END_LANDED, ray, met, part, way), ends);
        }
        sought.start = met.visible;
    }
    return Outside(nowhere(END_NO_EXIT, part, way), ends);
}

// Inside the first glass: what leaves it after each number of reflections is a branch, what is left then stays inside.
fn trace_inside(first: Ray, front: Triangle, visible: u32, first_part: u32, first_ends: PathEnds, bin: u32, whole: u32) -> PathEnds {
    let medium = medium_of(front, bin);
    let open = (front.flags & TRIANGLE_OPEN) != 0u;
    var ray = first;
    var part = first_part;
    var way = way_through(WAY_START, front, WAY_THROUGH);
    var ends = first_ends;
    var start = visible;
    var length = 0.0;
    let least = whole / LEAST_SHARE;
    for (var order = 0u; order < light_paths.orders && part >= least; order++) {
        let met = nearest_surface(ray, Sought(front.object, start, 0u));
        if met.visible == NOTHING {
            add_branch(ended(order, select(END_NO_EXIT, END_ESCAPED, open), ray, met, part, way, length));
            return ends;
        }
        let t = triangles[met.visible - 1u];
        length += met.hit.distance;
        let normal = -sign(met.hit.facing) * interpolated_normal(t, met.hit);
        let origin = ray.origin + met.hit.distance * ray.direction;
        var back = Crossing(END_LANDED, ray.direction, 1.0);
        if (t.flags & (TRIANGLE_REFRACTS | TRIANGLE_MIRROR)) == 0u {
            add_branch(ended(order, END_LANDED, ray, met, part, way, length));
            return ends;
        } else if (t.flags & TRIANGLE_MIRROR) != 0u {
            back = reflect_at(ray.direction, normal, t, mirror_reflectance(ray.direction, normal, medium_of(t, bin).surface));
            let left = flux_part(part, part_from(back.reflectance));
            ends.absorbed += part - left;
            part = left;
        } else {
            let crossing = cross_surface(ray.direction, normal, t, 1.0 / medium.index, light_paths.rule);
            if crossing.end == END_LANDED {
                let leaves = flux_part(part, part_from(1.0 - crossing.reflectance));
                let passed = flux_part(leaves, part_from(medium.surface));
                part -= leaves;
                ends.absorbed += leaves - passed;
                add_branch(on_its_way(order, Ray(origin, crossing.direction), met.visible, passed, way_through(way, t, WAY_THROUGH), length));
            } else if crossing.end != END_TOTAL {
                add_branch(ended(order, crossing.end, ray, met, part, way, length));
                return ends;
            }
            back = reflect_at(ray.direction, normal, t, 1.0);
        }
        if back.end != END_LANDED {
            if order + 1u < light_paths.orders {
                add_branch(ended(order + 1u, back.end, ray, met, part, way, length));
                return ends;
            }
            break;
        }
        way = way_through(way, t, WAY_BACK);
        ray = Ray(origin, back.direction);
        start = met.visible;
    }
    ends.kept_inside += part;
    return ends;
}

// Back from the first surface; what goes into glass there stays, what a mirror does not throw back is absorbed.
fn trace_reflected(light_ray: Ray, met: SurfaceHit, bin: u32, whole: u32) -> PathEnds {
    let front = triangles[met.visible - 1u];
    let medium = medium_of(front, bin);
    let normal = -sign(met.hit.facing) * interpolated_normal(front, met.hit);
    let mirror = (front.flags & TRIANGLE_MIRROR) != 0u;
    var share = 0.0;
    if mirror {
        share = mirror_reflectance(light_ray.direction, normal, medium.surface);
    } else {
        let eta = select(1.0 / medium.index, medium.index, met.hit.facing < 0.0);
        share = interface_reflectance(light_ray.direction, normal, eta, light_paths.rule);
    }
    let back = reflect_at(light_ray.direction, normal, front, share);
    if back.end != END_LANDED {
        return PathEnds(back.end, 0u, 0u, 0u);
    }
    let part = flux_part(whole, part_from(back.reflectance));
    let rest = whole - part;
    let origin = light_ray.origin + met.hit.distance * light_ray.direction;
    add_branch(on_its_way(0u, Ray(origin, back.direction), met.visible, part, way_through(WAY_START, front, WAY_BACK), 0.0));
    return PathEnds(END_LANDED, 0u, select(0u, rest, mirror), select(rest, 0u, mirror));
}

// Through the first surface, into glass or out of it.
fn trace_refracted(light_ray: Ray, met: SurfaceHit, bin: u32, whole: u32) -> PathEnds {
    let front = triangles[met.visible - 1u];
    let medium = medium_of(front, bin);
    let normal = -sign(met.hit.facing) * interpolated_normal(front, met.hit);
    let entering = met.hit.facing < 0.0;
    let eta = select(1.0 / medium.index, medium.index, entering);
    let crossing = cross_surface(light_ray.direction, normal, front, eta, light_paths.rule);
    if crossing.end != END_LANDED {
        return PathEnds(crossing.end, 0u, 0u, 0u);
    }
    let entered = flux_part(whole, part_from(1.0 - crossing.reflectance));
    let part = flux_part(entered, part_from(medium.surface));
    let ends = PathEnds(END_LANDED, whole - entered, entered - part, 0u);
    let ray = Ray(light_ray.origin + met.hit.distance * light_ray.direction, crossing.direction);
    if entering {
        return trace_inside(ray, front, met.visible, part, ends, bin, whole);
    }
    add_branch(on_its_way(0u, ray, met.visible, part, way_through(WAY_START, front, WAY_THROUGH), 0.0));
    return ends;
}

// Where light meets what paths begin at, or how it ends.
struct FirstSurface {
    end: u32, // END_LANDED where it meets
    met: SurfaceHit,
}

fn first_surface(light_ray: Ray) -> FirstSurface {
    var first = no_surface();
    for (var only = 0u; ; only = light_paths.casters) {
        let met = nearest_surface(light_ray, Sought(NO_OBJECT, NOTHING, only));
        if only != 0u {
            return FirstSurface(select(END_MISSED, END_BLOCKED, met.visible != NOTHING), first);
        }
        if met.visible == NOTHING || (light_paths.range > 0.0 && met.hit.distance > light_paths.range) {
            return FirstSurface(END_MISSED, met);
        }
        let flags = triangles[met.visible - 1u].flags;
        if (flags & light_paths.casters) != 0u {
            return FirstSurface(END_LANDED, met);
        }
        if (flags & TRIANGLE_REFRACTS) != 0u {
            return FirstSurface(END_MISSED, met);
        }
        first = met;
    }
    return FirstSurface(END_MISSED, first);
}

// All of a path with the flux `whole`: what it leaves on its way, and its arrivals to `path_arrives`. Branches wait for each other,
// so that there is one place from which they are followed: drivers write a function out wherever it is called.
fn trace_path(path: u32, light_ray: Ray, bin: u32, whole: u32) -> PathEnds {
    let first = first_surface(light_ray);
    if first.end != END_LANDED {
        return PathEnds(first.end, 0u, 0u, 0u);
    }
    branch_count = 0u;
    var ends: PathEnds;
    var asides = 0u;
    if light_paths.path == PATH_REFLECTED {
        ends = trace_reflected(light_ray, first.met, bin, whole);
    } else {
        ends = trace_refracted(light_ray, first.met, bin, whole);
        asides = select(0u, light_paths.asides, first.met.hit.facing < 0.0);
    }
    first_aside = branch_count;
    let medium = triangles[first.met.visible - 1u].material;
    let least = max(whole / LEAST_SHARE, 1u);
    for (var i = 0u; i < branch_count; i++) {
        let branch = branches[i];
        var arrival = Arrival(branch.end, branch.ray, branch.met, branch.part, branch.way);
        if branch.end == ON_ITS_WAY {
            let room = select(0u, first_aside + asides, i < first_aside);
            let outside = follow(branch, ends, bin, room, least);
            arrival = outside.arrival;
            ends = outside.ends;
        }
        path_arrives(path, branch.order, arrival, branch.length, medium);
    }
    return ends;
}
