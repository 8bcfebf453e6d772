// What passes the surface: normals, Gamma N, L_s cos T, direction and power (passes 1 to 4 of the paper). Host side:
// `passes/pond_surface.rs`.
//
// cos_i   cosine of the light's angle to the facet's normal
// beams   L_t, unit, and in w the flux that has passed; straight down and 0 where there is none

struct PondSurface {
    grid: PondGrid,
    light: vec3<f32>,    // L_i, unit; its z is negative
    eta: f32,            // n_t / n_i
    step: vec2<f32>,     // samples in x and y per step of a ray towards the light
    rise_m: f32,         // of that ray, per step
    depth_m: f32,        // how deep a shadow must be
    tangent: f32,        // rise over run of that ray
    most_steps: u32,     // 0: the surface does not shade itself
    one_sided: u32,      // 1: normals are the paper's; 0: central differences
    periodic: u32,       // 1: the pond goes on outside of its grid
    facets_are_larger: u32, // 1: facets have 1 / N_z times the area of a sample
    table_entries: u32,  // of `refraction_table`; 0: Gamma and T are evaluated
    mapped: u32,         // 1: `illumination` has a value per sample; 0: one for all
    units_per_flux: f32, // of the report
    floor_m: f32,        // how far the floor is below the water at rest
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: PondSurface;
@group(0) @binding(1) var<storage, read> heights: array<f32>;
@group(0) @binding(2) var<storage, read> illumination: array<f32>;
@group(0) @binding(3) var<storage, read> refraction_table: array<vec2<f32>>; // (Gamma, T) by cos_i
@group(0) @binding(4) var<storage, read> relief: array<u32>;
@group(0) @binding(5) var<storage, read_write> beams: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> report: array<atomic<u32>>;

// The most units of one sample: those of a workgroup stay below 2^32.
const MOST_UNITS: f32 = 33554432.0;

var<workgroup> counted: array<atomic<u32>, REPORT_WORDS>;

// The two samples whose difference is the slope along an axis, and how many steps they are apart.
fn ends(i: i32, side: i32) -> vec3<i32> {
    if params.periodic == 1u {
        if params.one_sided == 1u {
            return vec3<i32>(i, (i + 1) % side, 1);
        }
        return vec3<i32>((i + side - 1) % side, (i + 1) % side, 2);
    }
    if params.one_sided == 1u {
        let low = min(i, max(side - 2, 0));
        return vec3<i32>(low, min(low + 1, side - 1), 1);
    }
    let low = max(i - 1, 0);
    let high = min(i + 1, side - 1);
    return vec3<i32>(low, high, max(high - low, 1));
}

fn height_at(x: i32, y: i32) -> f32 {
    return heights[pond_index(params.grid, vec2<u32>(vec2<i32>(x, y)))];
}

// The bilinear surface at a place in samples; `z` is 0 outside of a pond that ends.
struct Interpolated {
    height_m: f32,
    inside: bool,
}

fn wrapped(i: vec2<i32>, size: vec2<i32>) -> vec2<i32> {
    return ((i % size) + size) % size;
}

fn interpolated(at: vec2<f32>) -> Interpolated {
    let size = vec2<i32>(params.grid.size);
    let low = vec2<i32>(floor(at));
    let share = at - floor(at);
    var near = low;
    var far = low + 1;
    if params.periodic == 1u {
        near = wrapped(near, size);
        far = wrapped(far, size);
    } else {
        let past = (low > size - 1) | ((low == size - 1) & (share > vec2<f32>(0.0)));
        if any(low < vec2<i32>(0)) || any(past) {
            return Interpolated(0.0, false);
        }
        far = min(far, size - 1);
    }
    let south = height_at(near.x, near.y) * (1.0 - share.x) + height_at(far.x, near.y) * share.x;
    let north = height_at(near.x, far.y) * (1.0 - share.x) + height_at(far.x, far.y) * share.x;
    return Interpolated(south * (1.0 - share.y) + north * share.y, true);
}

// Whether the surface is between a sample and the light.
fn shadowed(at: vec2<u32>) -> bool {
    let bits = relief[0];
    let highest_m = bitcast<f32>(select(~bits, bits & 0x7fffffffu, bits >= 0x80000000u));
    if params.most_steps == 0u || !(bitcast<f32>(relief[1]) * 1.4142135623730951 > params.tangent) {
        return false;
    }
    let start_m = heights[pond_index(params.grid, at)];
    for (var i = 1u; i <= params.most_steps; i++) {
        let n = f32(i);
        let ray_m = start_m + n * params.rise_m;
        if ray_m > highest_m {
            return false;
        }
        let met = interpolated(vec2<f32>(at) + n * params.step);
        if !met.inside {
            return false;
        }
        if met.height_m > ray_m + params.depth_m {
            return true;
        }
    }
    return false;
}

// L_t, and in w the share T that passes; 0 where all is reflected.
fn refracted(normal: vec3<f32>, cos_i: f32) -> vec4<f32> {
    if params.table_entries == 0u {
        let refraction = refract_light(params.light, normal, params.eta);
        if refraction.total {
            return vec4<f32>(0.0);
        }
        return vec4<f32>(refraction.direction, 1.0 - refraction.reflectance);
    }
    let cells = params.table_entries - 1u;
    let at = min(cos_i, 1.0) * f32(cells);
    let low = min(u32(at), cells - 1u);
    let entry = mix(refraction_table[low], refraction_table[low + 1u], at - f32(low));
    if entry.y <= 0.0 {
        return vec4<f32>(0.0);
    }
    // Between entries the rule gives a direction that is a little too short.
    return vec4<f32>(normalize(params.light / params.eta + entry.x * normal), entry.y);
}

fn units(flux: f32) -> u32 {
    return u32(min(flux * params.units_per_flux, MOST_UNITS) + 0.5);
}

// The sum of a workgroup, in two words; the first says when it carries.
fn add_units(word: u32) {
    let sum = atomicLoad(&counted[word]);
    if sum > 0u {
        let before = atomicAdd(&report[word], sum);
        if before + sum < before {
            atomicAdd(&report[word + 1u], 1u);
        }
    }
}

@compute @workgroup_size(8, 8, 1)
fn pond_surface(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    if pond_contains(params.grid, id.xy) {
        light_sample(id.xy);
    }
    workgroupBarrier();
    if local < STEEPEST {
        let count = atomicLoad(&counted[local]);
        if count > 0u {
            atomicAdd(&report[local], count);
        }
    } else if local == STEEPEST {
        atomicMax(&report[STEEPEST], atomicLoad(&counted[STEEPEST]));
    } else if local == INCIDENT || local == TRANSMITTED {
        add_units(local);
    }
}

fn light_sample(at: vec2<u32>) {
    let index = pond_index(params.grid, at);
    if params.floor_m + heights[index] <= 0.0 {
        atomicAdd(&counted[GROUNDED], 1u);
    }
    let across = ends(i32(at.x), i32(params.grid.size.x));
    let up = ends(i32(at.y), i32(params.grid.size.y));
    let rise = vec2<f32>(
        height_at(across.y, i32(at.y)) - height_at(across.x, i32(at.y)),
        height_at(i32(at.x), up.y) - height_at(i32(at.x), up.x),
    );
    let slopes = rise / (vec2<f32>(f32(across.z), f32(up.z)) * params.grid.pitch_m);
    let steepness = length(slopes);
    atomicMax(&counted[STEEPEST], bitcast<u32>(steepness));
    if steepness > 1.0 {
        atomicAdd(&counted[PAST_45_DEGREES], 1u);
    }
    let scale = sqrt(1.0 + dot(slopes, slopes));
    let normal = vec3<f32>(-slopes, 1.0) / scale;
    let cos_i = -dot(params.light, normal);
    beams[index] = vec4<f32>(0.0, 0.0, -1.0, 0.0);
    if cos_i <= 0.0 {
        atomicAdd(&counted[TURNED_AWAY], 1u);
        return;
    }
    if shadowed(at) {
        atomicAdd(&counted[SELF_SHADOWED], 1u);
        return;
    }
    let facet = select(1.0, scale, params.facets_are_larger == 1u);
    let cell_m2 = params.grid.pitch_m.x * params.grid.pitch_m.y;
    let incident = illumination[select(0u, index, params.mapped == 1u)] * cos_i * (cell_m2 * facet);
    atomicAdd(&counted[INCIDENT], units(incident));
    let passed = refracted(normal, cos_i);
    if passed.w <= 0.0 {
        atomicAdd(&counted[TOTALLY_REFLECTED], 1u);
        return;
    }
    let flux = incident * passed.w;
    atomicAdd(&counted[TRANSMITTED], units(flux));
    beams[index] = vec4<f32>(passed.xyz, flux);
}
