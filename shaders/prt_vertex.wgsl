// Irradiance of vertices in the spectral basis, E_qj = sum_k T_qk L_jk (Schwenk et al. 2010, the inner sum of eq. 5). Host
// side: `passes/prt_vertex.rs`.
//
// transfer     T: function q, harmonic k, vertex; neighbours in memory are vertices
// light        L_jk in blocks of four spectral coefficients j: block, harmonic k
// irradiance   E: vertex, function q, block

struct PrtVertex {
    vertices: u32,
    groups_per_row: u32, // workgroups in x
    harmonics: u32,
    blocks: u32,         // of four spectral coefficients
    vertex_blocks: u32,  // all blocks of a vertex: those of its functions come first
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: PrtVertex;
@group(0) @binding(1) var<storage, read> transfer: array<f32>;
@group(0) @binding(2) var<storage, read> light: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> irradiance: array<vec4<f32>>;

@compute @workgroup_size(64, 1, 1)
fn prt_vertex(@builtin(global_invocation_id) id: vec3<u32>) {
    let vertex = id.y * params.groups_per_row * 64u + id.x;
    if vertex >= params.vertices {
        return;
    }
    let first = id.z * params.harmonics * params.vertices + vertex;
    let target_block = vertex * params.vertex_blocks + id.z * params.blocks;
    // Two blocks at a time: transfer, which is most of what is read, comes once for eight coefficients.
    for (var block = 0u; block < params.blocks; block += 2u) {
        let row = block * params.harmonics;
        var sum = vec4<f32>(0.0);
        if block + 1u == params.blocks {
            for (var k = 0u; k < params.harmonics; k++) {
                sum += transfer[first + k * params.vertices] * light[row + k];
            }
        } else {
            let next_row = row + params.harmonics;
            var next_sum = vec4<f32>(0.0);
            for (var k = 0u; k < params.harmonics; k++) {
                let t = transfer[first + k * params.vertices];
                sum += t * light[row + k];
                next_sum += t * light[next_row + k];
            }
            irradiance[target_block + block + 1u] = next_sum;
        }
        irradiance[target_block + block] = sum;
    }
}
