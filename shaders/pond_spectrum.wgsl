// The spectrum of the floor: sums of products of spectra of terms and kernels. Host side: `passes/pond_spectrum.rs`.
//
// Terms come in pairs, as the real and the imaginary part of one image: their spectra are the parts of its spectrum that are
// conjugate and anti-conjugate under reversal.

struct PondSpectrum {
    size: vec2<u32>,  // points in x and y
    pairs: u32,       // of terms
    add: u32,         // 1: to what is there
}

@group(0) @binding(0) var<uniform> params: PondSpectrum;
@group(0) @binding(1) var<storage, read> images: array<vec2<f32>>;  // one per pair
@group(0) @binding(2) var<storage, read> kernels: array<vec2<f32>>; // two per pair
@group(0) @binding(3) var<storage, read_write> floor_spectrum: array<vec2<f32>>;

fn times(a: vec2<f32>, b: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

@compute @workgroup_size(8, 8, 1)
fn pond_spectrum(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.size) {
        return;
    }
    let points = params.size.x * params.size.y;
    let here = id.y * params.size.x + id.x;
    let back = (params.size - id.xy) % params.size;
    let there = back.y * params.size.x + back.x;
    var sum = vec2<f32>(0.0);
    if params.add == 1u {
        sum = floor_spectrum[here];
    }
    for (var pair = 0u; pair < params.pairs; pair++) {
        let a = images[pair * points + here];
        let b = images[pair * points + there] * vec2<f32>(1.0, -1.0);
        let first = 0.5 * (a + b);
        let difference = 0.5 * (a - b);
        let second = vec2<f32>(difference.y, -difference.x);
        sum += times(first, kernels[2u * pair * points + here]);
        sum += times(second, kernels[(2u * pair + 1u) * points + here]);
    }
    floor_spectrum[here] = sum;
}
