// Paths of light from the corners of cells of the emission view to where they land. Host side: `passes/path_trace.rs`; how they go on
// stands in `shared/light_path.wgsl`.

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

const WAY_LANDS: u32 = 3u;

// Keeps an arrival, as the landing that footprints are made of.
fn path_arrives(path: u32, order: u32, arrival: Arrival, length: f32, medium: u32) {
    var landing = PathLanding(vec2<f32>(0.0), length, arrival.part, arrival.way, arrival.end, 0u, medium);
    if arrival.end == END_LANDED {
        landing.end = END_OUTSIDE_MAP;
        let at = locate_arrival(arrival.ray, arrival.met);
        if at.found {
            let t = triangles[arrival.met.visible - 1u];
            let side = select(0u, 4u, arrival.met.hit.facing > 0.0);
            landing.texel = at.texel;
            landing.way = (arrival.way ^ (8u * t.object + WAY_LANDS + side)) * 16777619u;
            landing.end = END_LANDED;
            landing.place = at.face | (t.material << 8u);
        }
    }
    landings[path * params.orders + order] = landing;
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
        path_arrives(path, order, nowhere(END_MISSED, 0u, 0u), 0.0, 0u);
    }
    light_paths = LightPaths(params.landing_view, params.landing_faces, params.materials, params.first_optics, params.orders, params.path, params.casters, params.rule, params.range);
    ends[path] = trace_path(path, view_ray(view, cell_corner(cell, corner)), node_bin(params.nodes, node, cell), WHOLE);
    if params.keeps_bounds == 1u {
        for (var order = 0u; order < params.orders; order++) {
            let landing = landings[path * params.orders + order];
            if landing.end == END_LANDED {
                landing_bounds_add(landing);
            }
        }
    }
}
