// Photons along exact paths, one per texel of the light's emission view and wavelength, in tiles of 8 x 8: each goes through every
// surface of the scene, and leaves the first glass after each number of reflections inside it, until it lands. Host side:
// `passes/photon_path.rs`; how paths go on stands in `shared/light_path.wgsl`, what photons leave in `shared/photons.wgsl`.

struct PhotonPath {
    photons: Photons,
    orders: u32, // arrivals of a path, at most MOST_ORDERS
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: PhotonPath;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> bvh: array<BvhNode>;
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var<storage, read> bands: array<Band>; // band * materials + material where it lands
@group(0) @binding(5) var<storage, read> optics: array<Optics>; // band * materials + material it goes through
@group(0) @binding(6) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(7) var<storage, read_write> map: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> ledger: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read> queue: array<u32>;

const MOST_ORDERS: u32 = 8u;

// What the photon leaves at each of its arrivals.
var<private> arrived: array<Traced, MOST_ORDERS>;

// Of each arrival, in the first glass.
var<private> absorbed: u32;

// Puts down what arrives; its `path` is the band.
fn path_arrives(path: u32, order: u32, arrival: Arrival, length: f32, medium: u32) {
    let glass = optics[(params.photons.first_band + path) * params.photons.materials + medium];
    var photon = absorb(Photon(arrival.end, 0u, arrival.part, 0u, 0u, 0u, false, false), exp(-glass.absorption * length));
    absorbed += photon.absorbed;
    photon.absorbed = 0u;
    var left = leaves_nothing(photon);
    if arrival.end == END_LANDED {
        let at = locate_arrival(arrival.ray, arrival.met);
        left.photon.end = END_OUTSIDE_MAP;
        if at.found {
            let point = arrival.ray.origin + arrival.met.hit.distance * arrival.ray.direction;
            left = put_down(photon, at, point, arrival.met.visible, path);
        }
    } else if arrival.end == END_ESCAPED && params.photons.guard_texels > 0.0 {
        let near = find_landing(arrival.ray);
        if near.beside {
            photon.end = END_OUTSIDE_MAP;
            photon.beside = true;
            left = put_down(photon, near.at, arrival.ray.origin + near.distance * arrival.ray.direction, near.visible, path);
        }
    }
    arrived[order] = left;
}

// All arrivals of a photon; the books of its way stand with the first.
fn trace(texel: vec2<u32>, band: u32) {
    let view = views[params.photons.emission_view];
    let light_ray = view_ray(view, vec2<f32>(texel) + 0.5);
    let photon = emitted(view, texel, light_ray);
    light_paths = LightPaths(
        params.photons.landing_view,
        params.photons.landing_faces,
        params.photons.materials,
        params.photons.first_band,
        params.orders,
        0u,
        params.photons.path,
        params.photons.casters,
        params.photons.rule,
        params.photons.range,
    );
    absorbed = 0u;
    let left = trace_path(band, light_ray, band, photon.aimed);
    if left.end != END_LANDED {
        arrived[0].photon.end = left.end;
        arrived[0].photon.flux = photon.aimed;
    }
    arrived[0].photon.aimed = photon.aimed;
    arrived[0].photon.reflected = left.reflected;
    arrived[0].photon.kept_inside = left.kept_inside;
    arrived[0].photon.absorbed = left.absorbed + absorbed;
}

@compute @workgroup_size(8, 8, 1)
fn photon_path(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) in_tile: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    for (var order = 0u; order < params.orders; order++) {
        arrived[order] = leaves_nothing(Photon(NO_END, 0u, 0u, 0u, 0u, 0u, false, false));
    }
    let start = photon_start(group, in_tile.xy);
    if start.exists {
        trace(start.texel, group.z);
    }
    if params.photons.emission == EMISSION_SAMPLE {
        for (var order = 0u; order < params.orders; order++) {
            if arrived[order].deposits {
                landing_bounds_add(arrived[order].at);
            }
        }
        return;
    }
    var sum = RowSum(0u, 0u, 0u);
    for (var order = 0u; order < params.orders; order++) {
        let left = arrived[order];
        show(local, start.exists, left);
        workgroupBarrier();
        lay_down(local, left);
        if local < LEDGER_ROWS {
            sum = count_row(local, order == 0u, sum);
        }
        workgroupBarrier();
    }
    if local < LEDGER_ROWS {
        book_row(local, group.z, sum);
    }
}
