// The sum of convolutions in space (pass 6 of the paper): a part of the window at a time. Host side: `passes/pond_convolve.rs`.

struct PondConvolve {
    grid: PondGrid,
    low: vec2<i32>,      // the window's first offset, in samples
    window: vec2<u32>,   // offsets that kernels cover
    first: vec2<u32>,    // the part's first offset, from `low`; from the second part on, light is added to what is there
    count: vec2<u32>,    // offsets of the part
    terms: u32,
    periodic: u32,       // 1: the pond goes on outside of its grid
    reserved0: u32,
    reserved1: u32,
}

@group(0) @binding(0) var<uniform> params: PondConvolve;
@group(0) @binding(1) var<storage, read> terms: array<f32>; // one image after the other
@group(0) @binding(2) var<storage, read> kernels: array<f32>; // likewise
@group(0) @binding(3) var<storage, read_write> irradiance: array<f32>;

@compute @workgroup_size(8, 8, 1)
fn pond_convolve(@builtin(global_invocation_id) id: vec3<u32>) {
    if !pond_contains(params.grid, id.xy) {
        return;
    }
    let index = pond_index(params.grid, id.xy);
    let size = vec2<i32>(params.grid.size);
    let samples = params.grid.size.x * params.grid.size.y;
    let offsets = params.window.x * params.window.y;
    var sum = 0.0;
    if any(params.first > vec2<u32>(0u)) {
        sum = irradiance[index];
    }
    for (var y = params.first.y; y < params.first.y + params.count.y; y++) {
        var lit_y = i32(id.y) - params.low.y - i32(y);
        if params.periodic == 1u {
            lit_y = ((lit_y % size.y) + size.y) % size.y;
        } else if lit_y < 0 || lit_y >= size.y {
            continue;
        }
        for (var x = params.first.x; x < params.first.x + params.count.x; x++) {
            var lit_x = i32(id.x) - params.low.x - i32(x);
            if params.periodic == 1u {
                lit_x = ((lit_x % size.x) + size.x) % size.x;
            } else if lit_x < 0 || lit_x >= size.x {
                continue;
            }
            let source = u32(lit_y) * params.grid.size.x + u32(lit_x);
            let offset = y * params.window.x + x;
            for (var term = 0u; term < params.terms; term++) {
                sum += kernels[term * offsets + offset] * terms[term * samples + source];
            }
        }
    }
    irradiance[index] = sum;
}
