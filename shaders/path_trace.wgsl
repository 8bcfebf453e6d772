// Paths of light from the corners of cells of the emission view to where they land. Host side: `passes/path_trace.rs`; how they go on
// stands in `shared/light_path.wgsl`.

struct PathTrace {
    emission_view: u32,
    landing_view: u32,
    landing_faces: u32,
    nodes: u32,        // wavelengths of a path's corner
    orders: u32,       // landings of a path, those of what went aside last
    bins: u32,         // of the whole spectrum
    materials: u32,    // row length of `optics`
    first_optics: u32, // row of this light
    queue: u32,        // first word in `queues`; NO_QUEUE: corners are the texel centres of the emission view
    first_place: u32,  // of the queued patches' corners
    parent_row: u32,   // places from one row of their parents' corners to the next
    max_groups: u32,   // of the device, per dimension
    path: u32,         // PATH_*
    casters: u32,      // TRIANGLE_* of the surfaces that paths begin at
    rule: u32,         // RULE_*
    range: f32,        // light beyond this distance is dark; 0 has no end
    keeps_bounds: u32, // 1: `bounds` gets where paths land
    asides: u32,       // of its landings
    lattice: u32,      // spacing of corners of the emission view that tell, when all their nodes are known, how those halfway between them go
    tolerance: f32,    // of what is told, texels of the landing view; 0: nothing yet, all nodes of that lattice are traced, and all middle ones
}

@group(0) @binding(0) var<uniform> params: PathTrace;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> bvh: array<BvhNode>;
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var<storage, read> optics: array<Optics>; // bin * materials + material
@group(0) @binding(5) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(6) var<storage, read_write> queues: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> landings: array<PathLanding>; // path * orders + order
@group(0) @binding(8) var<storage, read_write> ends: array<PathEnds>;        // path
@group(0) @binding(9) var<storage, read_write> bounds: array<atomic<u32>>;

const WAY_LANDS: u32 = 3u;
const WAY_BEYOND: u32 = 4u;

// Along a ray, to where it leaves the box of all surfaces.
fn leaves_at(ray: Ray) -> f32 {
    let ahead = select(bvh[0].low, bvh[0].high, ray.direction > vec3<f32>(0.0));
    let run = select(vec3<f32>(-1.0), vec3<f32>(1.0), ray.direction > vec3<f32>(0.0)) * max(abs(ray.direction), vec3<f32>(1e-12));
    let along = (ahead - ray.origin) / run;
    return min(along.x, min(along.y, along.z));
}

// Texels along the map's edges that are beside it for light that goes by: walls stand on its border, where rounding would choose a side.
const BORDER: f32 = 0.37;

// Paths that go by the map on different sides of it do not belong together: those between them may land.
fn way_beyond(way: u32, ray: Ray, distance: f32) -> u32 {
    let view = views[params.landing_view];
    let at = view_project(view, ray.origin + distance * ray.direction);
    let before = vec2<u32>(at.texel < vec2<f32>(BORDER));
    let behind = vec2<u32>(at.texel >= vec2<f32>(view.size) - BORDER);
    let sides = before.x + 2u * before.y + 4u * behind.x + 8u * behind.y + select(0u, 16u, at.z <= 0.0);
    return (way ^ (8u * select(0u, sides, params.landing_faces == 1u) + WAY_BEYOND)) * 16777619u;
}

// Keeps an arrival, as the landing that footprints are made of.
fn path_arrives(path: u32, order: u32, arrival: Arrival, length: f32, medium: u32) {
    var landing = PathLanding(vec2<f32>(0.0), length, arrival.part, arrival.way, arrival.end, 0u, medium);
    if arrival.end == END_ESCAPED {
        landing.way = way_beyond(arrival.way, arrival.ray, leaves_at(arrival.ray));
    } else if arrival.end == END_LANDED {
        landing.end = END_OUTSIDE_MAP;
        let at = locate_arrival(arrival.ray, arrival.met);
        if at.found {
            let t = triangles[arrival.met.visible - 1u];
            let side = select(0u, 4u, arrival.met.hit.facing > 0.0);
            landing.texel = at.texel;
            landing.way = (arrival.way ^ (8u * t.object + WAY_LANDS + side)) * 16777619u;
            landing.end = END_LANDED;
            landing.place = at.face | (t.material << 8u);
        } else {
            landing.way = way_beyond(arrival.way, arrival.ray, arrival.met.hit.distance);
        }
    }
    landings[path * params.orders + order] = landing;
}

// Most of how far the landings lie from the right, the left, the bottom and the top of a face, in whole texels.
fn landing_bounds_add(landing: PathLanding) {
    let face = landing.place & 0xffu;
    let size = views[params.landing_view + face].size;
    let texel = min(vec2<u32>(max(landing.texel, vec2<f32>(0.0))), size - 1u);
    let reach = vec4<u32>(size.x - texel.x, texel.x + 1u, size.y - texel.y, texel.y + 1u);
    for (var i = 0u; i < 4u; i++) {
        let word = 4u * face + i;
        // Nearly always false, and cheaper than to fight for the word.
        if reach[i] > atomicLoad(&bounds[word]) {
            atomicMax(&bounds[word], reach[i]);
        }
    }
}

var<workgroup> work: array<atomic<u32>, 2>; // corners and rays

// The first corner of a cell, at one of its nodes: with all of them an invocation would go round too often for some drivers.
fn trace_corner(cell: FootprintCell, place: u32, node: u32) {
    light_paths = LightPaths(params.landing_view, params.landing_faces, params.materials, params.first_optics, params.orders - params.asides, params.asides, params.path, params.casters, params.rule, params.range);
    let light_ray = view_ray(views[params.emission_view], cell_corner(cell, 0u));
    let path = place * params.nodes + node;
    for (var order = 0u; order < params.orders; order++) {
        path_arrives(path, order, nowhere(END_MISSED, 0u, 0u), 0.0, 0u);
    }
    ends[path] = trace_path(path, light_ray, node_bin(params.nodes, node, cell), WHOLE);
    atomicAdd(&work[1], 1u);
}

fn keep_bounds(path: u32) {
    for (var order = 0u; order < params.orders; order++) {
        let landing = landings[path * params.orders + order];
        if landing.end == END_LANDED {
            landing_bounds_add(landing);
        }
    }
}

// An outer corner of a patch is its parent's.
fn take_over(place: u32, parents: u32, node: u32) {
    let own = place * params.nodes + node;
    let parents_own = parents * params.nodes + node;
    ends[own] = ends[parents_own];
    for (var order = 0u; order < params.orders; order++) {
        landings[own * params.orders + order] = landings[parents_own * params.orders + order];
    }
}

// Every so many corners in x and y, and the last ones.
fn on_lattice(at: vec2<u32>, size: vec2<u32>, step: u32) -> bool {
    return all((at % step == vec2<u32>(0u)) | (at == size - 1u));
}

// Corners of a lattice around one.
fn lattice_around(at: vec2<u32>, size: vec2<u32>, step: u32) -> Around {
    let low = select(at / step * step, at, at == size - 1u);
    let high = select(min(low + step, size - 1u), at, at == low);
    let places = vec4<u32>(low.x, high.x, low.x, high.x) + size.x * vec4<u32>(low.y, low.y, high.y, high.y);
    return Around(places, vec2<f32>(at - low) / vec2<f32>(max(high - low, vec2<u32>(1u))));
}

// A corner that an invocation takes, at a node.
struct Corner {
    exists: bool,
    traced: bool,
    cell: FootprintCell, // whose first it is
    place: u32,
    node: u32,
}

fn takes_texel(at: vec2<u32>, size: vec2<u32>, node: u32) -> bool {
    let middle = node == middle_node(params.nodes);
    if params.tolerance == 0.0 {
        return middle || on_lattice(at, size, params.lattice);
    }
    return !middle && on_lattice(at, size, params.lattice / 2u) && !on_lattice(at, size, params.lattice);
}

// Of the emission view. Paths that corners of the lattice tell are told, the others are traced.
fn texel_corner(i: u32, node: u32) -> Corner {
    let size = views[params.emission_view].size;
    let at = vec2<u32>(i % size.x, i / size.x);
    let exists = i < size.x * size.y && takes_texel(at, size, node);
    let told = exists && params.tolerance > 0.0 && tell_path(i, lattice_around(at, size, params.lattice), node);
    return Corner(exists, exists && !told, FootprintCell(at, vec2<u32>(0u), 0u, params.bins), i, node);
}

// New ones of a patch are traced, and those that it has from its parent are taken over; halves of a range have none from it.
fn patch_corner(slot: u32, corner: u32, node: u32) -> Corner {
    let word = params.queue + PATCHES_HEAD + PATCH_WORDS * slot;
    let patch_ = patch_from_words(vec3<u32>(atomicLoad(&queues[word]), atomicLoad(&queues[word + 1u]), atomicLoad(&queues[word + 2u])));
    let first_place = params.first_place + PATCH_PLACES * slot;
    if corner < 4u && any(patch_.parts > vec2<u32>(1u)) {
        let outer = vec2<u32>(corner & 1u, corner >> 1u);
        let own = outer * patch_.parts;
        take_over(first_place + own.x + PATCH_ROW * own.y, patch_.parent + outer.x + params.parent_row * outer.y, node);
    }
    let new_corner = patch_new_corner(patch_, corner);
    let exists = all(new_corner <= patch_.parts);
    return Corner(exists, exists, patch_cell(patch_, new_corner), first_place + new_corner.x + PATCH_ROW * new_corner.y, node);
}

fn taken_corner(row: u32, local: u32) -> Corner {
    if params.queue == NO_QUEUE {
        return texel_corner(CELLS * (row / params.nodes) + local, row % params.nodes);
    }
    let share = patch_share(params.nodes, params.orders);
    let slot = CELLS * (row / share) + local;
    let node = row % share / PATCH_NEW;
    if node < params.nodes && slot < atomicLoad(&queues[params.queue + QUEUE_COUNT]) {
        return patch_corner(slot, row % share % PATCH_NEW, node);
    }
    return Corner(false, false, FootprintCell(vec2<u32>(0u), vec2<u32>(0u), 0u, params.bins), 0u, 0u);
}

@compute @workgroup_size(64, 1, 1)
fn path_trace(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    if local < 2u {
        atomicStore(&work[local], 0u);
    }
    workgroupBarrier();
    let taken = taken_corner(queue_row(group, params.max_groups), local);
    // Drivers inline it: one call only.
    if taken.traced {
        trace_corner(taken.cell, taken.place, taken.node);
    }
    if taken.exists && taken.node == middle_node(params.nodes) {
        atomicAdd(&work[0], 1u);
    }
    if taken.exists && params.keeps_bounds == 1u {
        keep_bounds(taken.place * params.nodes + taken.node);
    }
    workgroupBarrier();
    if local < 2u {
        let count = atomicLoad(&work[local]);
        if count > 0u {
            let word = 2u * (WORK_CORNERS + local);
            let before = atomicAdd(&queues[word], count);
            if before + count < before {
                atomicAdd(&queues[word + 1u], 1u);
            }
        }
    }
}
