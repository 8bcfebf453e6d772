// What low-rank terms convolve: flux times the coefficients of the beam's state, looked up. Host side:
// `passes/pond_coefficients.rs`.
//
// state   L_x / |L_z|, L_y / |L_z| and the height above the floor, metres

struct PondCoefficients {
    low: vec3<f32>,         // the table's first state
    depth_m: f32,           // of the floor below the water at rest
    high: vec3<f32>,        // its last
    flat_tolerance: f32,    // share by which a state may differ where the table has one only
    table_size: vec3<u32>,
    terms: u32,
    samples: u32,
    groups_per_row: u32,    // workgroups in x
    reserved0: u32,
    reserved1: u32,
}

@group(0) @binding(0) var<uniform> params: PondCoefficients;
@group(0) @binding(1) var<storage, read> heights: array<f32>;
@group(0) @binding(2) var<storage, read> beams: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> coefficients: array<f32>; // terms fastest, then states
@group(0) @binding(4) var<storage, read_write> terms: array<f32>; // one image after the other
@group(0) @binding(5) var<storage, read_write> report: array<atomic<u32>>;

// Beams flatter than this have no state.
const LEAST_DOWN: f32 = 1e-3;

@compute @workgroup_size(64, 1, 1)
fn pond_coefficients(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.y * params.groups_per_row * 64u + id.x;
    if index >= params.samples {
        return;
    }
    let beam = beams[index];
    if beam.z >= -LEAST_DOWN {
        atomicAdd(&report[UPWARDS], 1u);
        for (var term = 0u; term < params.terms; term++) {
            terms[term * params.samples + index] = 0.0;
        }
        return;
    }
    let state = vec3<f32>(beam.xy / -beam.z, params.depth_m + heights[index]);
    var corner = vec3<u32>(0u);
    var share = vec3<f32>(0.0);
    var inside = true;
    for (var k = 0u; k < 3u; k++) {
        if params.table_size[k] == 1u {
            let tolerance = params.flat_tolerance * max(abs(params.low[k]), 1e-3);
            inside = inside && abs(state[k] - params.low[k]) <= tolerance;
        } else {
            let cells = f32(params.table_size[k] - 1u);
            let at = (state[k] - params.low[k]) / (params.high[k] - params.low[k]) * cells;
            inside = inside && at >= 0.0 && at <= cells;
            let clamped = clamp(at, 0.0, cells);
            corner[k] = min(u32(clamped), params.table_size[k] - 2u);
            share[k] = clamped - f32(corner[k]);
        }
    }
    if !inside && beam.w > 0.0 {
        atomicAdd(&report[OUTSIDE_STATES], 1u);
    }
    var entries: array<u32, 8>;
    var weights: array<f32, 8>;
    for (var c = 0u; c < 8u; c++) {
        let bit = vec3<u32>(c & 1u, (c >> 1u) & 1u, c >> 2u);
        // The far states of a coordinate with one have no weight.
        let along = select(1.0 - share, share, bit == vec3<u32>(1u));
        let at = min(corner + bit, params.table_size - 1u);
        entries[c] = ((at.z * params.table_size.y + at.y) * params.table_size.x + at.x) * params.terms;
        weights[c] = along.x * along.y * along.z * beam.w;
    }
    for (var term = 0u; term < params.terms; term++) {
        var sum = 0.0;
        for (var c = 0u; c < 8u; c++) {
            sum += weights[c] * coefficients[entries[c] + term];
        }
        terms[term * params.samples + index] = sum;
    }
}
