// The light of this frame: a stored sky, turned. Host side: `passes/prt_light.rs`.
//
// sky, light   L_jk (Schwenk et al. 2010, eq. 5): spectral coefficient j = 4 block + component, harmonic k; block after block
// rotation     of each degree l a matrix of 2 l + 1 rows, row-major, degree after degree

struct PrtLight {
    bands: u32,
    blocks: u32, // of four spectral coefficients
    reserved0: u32,
    reserved1: u32,
}

@group(0) @binding(0) var<uniform> params: PrtLight;
@group(0) @binding(1) var<storage, read> sky: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> rotation: array<f32>;
@group(0) @binding(3) var<storage, read_write> light: array<vec4<f32>>;

@compute @workgroup_size(64, 1, 1)
fn prt_light(@builtin(global_invocation_id) id: vec3<u32>) {
    let harmonics = params.bands * params.bands;
    if id.x >= harmonics * params.blocks {
        return;
    }
    let k = id.x % harmonics;
    var l = 0u;
    while (l + 1u) * (l + 1u) <= k {
        l++;
    }
    let orders = 2u * l + 1u;
    // Entries of the degrees below: 1 + 9 + 25 + ...
    let row = l * (4u * l * l - 1u) / 3u + (k - l * l) * orders;
    let degree = id.x - k + l * l;
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < orders; i++) {
        sum += rotation[row + i] * sky[degree + i];
    }
    light[id.x] = sum;
}
