// Paths of light through the whole scene, by its geometry: from a corner of a cell of the emission view through every surface, with
// reflections inside the first glass, to where they land. Host side: `passes/path_trace.rs`.
//
// Where light leaves the first glass after each number of reflections it goes on as a landing of its own. Behind it, what goes on is
// chosen, not drawn: through glass what passes, at mirrors and at total reflection what is thrown back.

struct PathTrace {
    emission_view: u32,
    landing_view: u32,
    landing_faces: u32,
    nodes: u32,        // wavelengths of a path's corner
    orders: u32,       // landings of a path
    bins: u32,         // of the whole spectrum
    materials: u32,    // row length of `optics`
    first_optics: u32, // row of this light
    queue: u32,        // first word in `queues`; NO_QUEUE: corners are the texel centres of the emission view
    max_groups: u32,   // of the device, per dimension
    path: u32,         // PATH_*
    casters: u32,      // TRIANGLE_* of the surfaces that paths begin at
    rule: u32,         // RULE_*
    range: f32,        // light beyond this distance is dark; 0 has no end
    keeps_bounds: u32, // 1: `bounds` gets where paths land
    reserved0: u32,
}

const PATH_REFRACTED: u32 = 0u; // into glass
const PATH_REFLECTED: u32 = 1u; // back from the first surface

const NO_QUEUE: u32 = 0xffffffffu;

@group(0) @binding(0) var<uniform> params: PathTrace;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> bvh: array<BvhNode>;
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var<storage, read> optics: array<Optics>; // bin * materials + material
@group(0) @binding(5) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(6) var<storage, read> queues: array<u32>;
@group(0) @binding(7) var<storage, read_write> landings: array<PathLanding>; // path * orders + order
@group(0) @binding(8) var<storage, read_write> ends: array<PathEnds>;        // path
@group(0) @binding(9) var<storage, read_write> bounds: array<atomic<u32>>;

// Light on its way outside the first glass, at most so many surfaces.
const MOST_SURFACES: u32 = 12u;

// What is left inside glass is followed no longer when it is less.
const LEAST_PART: u32 = 0x80000u; // WHOLE / 4096

fn medium_of(t: Triangle, bin: u32) -> Optics {
    return optics[(params.first_optics + bin) * params.materials + t.material];
}

fn way_through(way: u32, t: Triangle, what: u32) -> u32 {
    return (way ^ (8u * t.face + what)) * 16777619u;
}

const WAY_START: u32 = 2166136261u;
const WAY_THROUGH: u32 = 1u;
const WAY_BACK: u32 = 2u;
const WAY_LANDS: u32 = 3u;

fn nowhere(end: u32, part: u32, way: u32) -> PathLanding {
    return PathLanding(vec2<f32>(0.0), 0.0, part, way, end, 0u, 0u);
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

fn land(ray: Ray, met: SurfaceHit, part: u32, way: u32) -> PathLanding {
    let point = ray.origin + met.hit.distance * ray.direction;
    let t = triangles[met.visible - 1u];
    let at = locate(params.landing_view, params.landing_faces, point);
    let lit = at.found && plane_hit(t, view_ray_through(views[at.view], point)).facing * met.hit.facing > 0.0;
    if !lit || !shown_there(at, met.visible, point) {
        return nowhere(END_OUTSIDE_MAP, part, way);
    }
    let side = select(0u, 4u, met.hit.facing > 0.0);
    let lands = (way ^ (8u * t.object + WAY_LANDS + side)) * 16777619u;
    return PathLanding(at.texel, 0.0, part, lands, END_LANDED, at.face | (t.material << 8u), 0u);
}

// A path outside its first glass, and what it has left so far.
struct Outside {
    landing: PathLanding,
    ends: PathEnds,
}

// From the first glass, or from the first mirror, to where it lands.
fn follow(first: Ray, start: u32, first_part: u32, first_way: u32, first_ends: PathEnds, bin: u32) -> Outside {
    var ray = first;
    var part = first_part;
    var way = first_way;
    var ends = first_ends;
    var sought = Sought(NO_OBJECT, start, 0u);
    var absorption = 0.0; // around the ray, per working unit
    for (var i = 0u; i < MOST_SURFACES; i++) {
        let met = nearest_surface(ray, sought);
        if met.visible == NOTHING {
            return Outside(nowhere(END_ESCAPED, part, way), ends);
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
            let crossing = cross_surface(ray.direction, normal, t, eta, params.rule);
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
                if sought.object == NO_OBJECT {
                    ends.reflected += part - passed;
                } else {
                    ends.kept_inside += part - passed;
                }
                part = flux_part(passed, part_from(medium.surface));
                ends.absorbed += passed - part;
                way = way_through(way, t, WAY_THROUGH);
                ray = Ray(origin, crossing.direction);
                sought.object = select(NO_OBJECT, t.object, entering);
                absorption = select(0.0, medium.absorption, entering);
            }
        } else {
            return Outside(land(ray, met, part, way), ends);
        }
        sought.start = met.visible;
    }
    return Outside(nowhere(END_NO_EXIT, part, way), ends);
}

fn stored(path: u32, order: u32, landing: PathLanding, length: f32, medium: u32) {
    var whole = landing;
    whole.length = length;
    whole.medium = medium;
    landings[path * params.orders + order] = whole;
}

// Inside the first glass: what leaves it after each number of reflections goes on, what is left then stays inside.
fn trace_inside(path: u32, first: Ray, front: Triangle, visible: u32, first_part: u32, first_ends: PathEnds, bin: u32) -> PathEnds {
    let medium = medium_of(front, bin);
    let open = (front.flags & TRIANGLE_OPEN) != 0u;
    var ray = first;
    var part = first_part;
    var way = way_through(WAY_START, front, WAY_THROUGH);
    var ends = first_ends;
    var start = visible;
    var length = 0.0;
    for (var order = 0u; order < params.orders && part >= LEAST_PART; order++) {
        let met = nearest_surface(ray, Sought(front.object, start, 0u));
        if met.visible == NOTHING {
            stored(path, order, nowhere(select(END_NO_EXIT, END_ESCAPED, open), part, way), length, front.material);
            return ends;
        }
        let t = triangles[met.visible - 1u];
        length += met.hit.distance;
        let normal = -sign(met.hit.facing) * interpolated_normal(t, met.hit);
        let origin = ray.origin + met.hit.distance * ray.direction;
        var back = Crossing(END_LANDED, ray.direction, 1.0);
        if (t.flags & (TRIANGLE_REFRACTS | TRIANGLE_MIRROR)) == 0u {
            stored(path, order, land(ray, met, part, way), length, front.material);
            return ends;
        } else if (t.flags & TRIANGLE_MIRROR) != 0u {
            back = reflect_at(ray.direction, normal, t, mirror_reflectance(ray.direction, normal, medium_of(t, bin).surface));
            let left = flux_part(part, part_from(back.reflectance));
            ends.absorbed += part - left;
            part = left;
        } else {
            let crossing = cross_surface(ray.direction, normal, t, 1.0 / medium.index, params.rule);
            if crossing.end == END_LANDED {
                let leaves = flux_part(part, part_from(1.0 - crossing.reflectance));
                let passed = flux_part(leaves, part_from(medium.surface));
                part -= leaves;
                ends.absorbed += leaves - passed;
                let outside = follow(Ray(origin, crossing.direction), met.visible, passed, way_through(way, t, WAY_THROUGH), ends, bin);
                ends = outside.ends;
                stored(path, order, outside.landing, length, front.material);
            } else if crossing.end != END_TOTAL {
                stored(path, order, nowhere(crossing.end, part, way), length, front.material);
                return ends;
            }
            back = reflect_at(ray.direction, normal, t, 1.0);
        }
        if back.end != END_LANDED {
            if order + 1u < params.orders {
                stored(path, order + 1u, nowhere(back.end, part, way), length, front.material);
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
fn trace_reflected(path: u32, light_ray: Ray, met: SurfaceHit, bin: u32) -> PathEnds {
    let front = triangles[met.visible - 1u];
    let medium = medium_of(front, bin);
    let normal = -sign(met.hit.facing) * interpolated_normal(front, met.hit);
    let mirror = (front.flags & TRIANGLE_MIRROR) != 0u;
    var share = 0.0;
    if mirror {
        share = mirror_reflectance(light_ray.direction, normal, medium.surface);
    } else {
        let eta = select(1.0 / medium.index, medium.index, met.hit.facing < 0.0);
        share = interface_reflectance(light_ray.direction, normal, eta, params.rule);
    }
    let back = reflect_at(light_ray.direction, normal, front, share);
    if back.end != END_LANDED {
        return PathEnds(back.end, 0u, 0u, 0u);
    }
    let part = flux_part(WHOLE, part_from(back.reflectance));
    let rest = WHOLE - part;
    let ends = PathEnds(END_LANDED, 0u, select(0u, rest, mirror), select(rest, 0u, mirror));
    let origin = light_ray.origin + met.hit.distance * light_ray.direction;
    let outside = follow(Ray(origin, back.direction), met.visible, part, way_through(WAY_START, front, WAY_BACK), ends, bin);
    stored(path, 0u, outside.landing, 0.0, front.material);
    return outside.ends;
}

fn trace(path: u32, light_ray: Ray, bin: u32) -> PathEnds {
    let everything = Sought(NO_OBJECT, NOTHING, 0u);
    let met = nearest_surface(light_ray, everything);
    if met.visible == NOTHING || (params.range > 0.0 && met.hit.distance > params.range) {
        return PathEnds(END_MISSED, 0u, 0u, 0u);
    }
    let front = triangles[met.visible - 1u];
    if (front.flags & params.casters) == 0u {
        let behind = nearest_surface(light_ray, Sought(NO_OBJECT, NOTHING, params.casters));
        let blocks = (front.flags & TRIANGLE_REFRACTS) == 0u && behind.visible != NOTHING;
        return PathEnds(select(END_MISSED, END_BLOCKED, blocks), 0u, 0u, 0u);
    }
    if params.path == PATH_REFLECTED {
        return trace_reflected(path, light_ray, met, bin);
    }
    let medium = medium_of(front, bin);
    let normal = -sign(met.hit.facing) * interpolated_normal(front, met.hit);
    let entering = met.hit.facing < 0.0;
    let eta = select(1.0 / medium.index, medium.index, entering);
    let crossing = cross_surface(light_ray.direction, normal, front, eta, params.rule);
    if crossing.end != END_LANDED {
        return PathEnds(crossing.end, 0u, 0u, 0u);
    }
    let entered = flux_part(WHOLE, part_from(1.0 - crossing.reflectance));
    let part = flux_part(entered, part_from(medium.surface));
    let ends = PathEnds(END_LANDED, WHOLE - entered, entered - part, 0u);
    let ray = Ray(light_ray.origin + met.hit.distance * light_ray.direction, crossing.direction);
    if entering {
        return trace_inside(path, ray, front, met.visible, part, ends, bin);
    }
    let outside = follow(ray, met.visible, part, way_through(WAY_START, front, WAY_THROUGH), ends, bin);
    stored(path, 0u, outside.landing, 0.0, front.material);
    return outside.ends;
}

// Most of how far the landings lie from the right, the left, the bottom and the top of a face, in whole texels.
fn landing_bounds_add(landing: PathLanding) {
    let face = landing.place & 0xffu;
    let size = views[params.landing_view + face].size;
    let texel = min(vec2<u32>(landing.texel), size - 1u);
    let reach = vec4<u32>(size.x - texel.x, texel.x + 1u, size.y - texel.y, texel.y + 1u);
    for (var i = 0u; i < 4u; i++) {
        let word = 4u * face + i;
        // Nearly always false, and cheaper than to fight for the word.
        if reach[i] > atomicLoad(&bounds[word]) {
            atomicMax(&bounds[word], reach[i]);
        }
    }
}

const PATHS: u32 = 64u; // per workgroup

@compute @workgroup_size(64, 1, 1)
fn path_trace(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let path = PATHS * queue_row(group, params.max_groups) + local;
    let view = views[params.emission_view];
    let node = path % params.nodes;
    let place = path / params.nodes;
    var cell = FootprintCell(vec2<u32>(place % view.size.x, place / view.size.x), vec2<u32>(0u), 0u, params.bins);
    var corner = 0u;
    if params.queue == NO_QUEUE {
        if place >= view.size.x * view.size.y {
            return;
        }
    } else {
        if place >= 4u * queues[params.queue + QUEUE_COUNT] {
            return;
        }
        let word = params.queue + CELLS_HEAD + CELL_WORDS * (place / 4u);
        cell = cell_from_words(vec2<u32>(queues[word], queues[word + 1u]));
        corner = place % 4u;
    }
    for (var order = 0u; order < params.orders; order++) {
        stored(path, order, nowhere(END_MISSED, 0u, 0u), 0.0, 0u);
    }
    ends[path] = trace(path, view_ray(view, cell_corner(cell, corner)), node_bin(params.nodes, node, cell));
    if params.keeps_bounds == 1u {
        for (var order = 0u; order < params.orders; order++) {
            let landing = landings[path * params.orders + order];
            if landing.end == END_LANDED {
                landing_bounds_add(landing);
            }
        }
    }
}
