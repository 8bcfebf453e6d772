// What glossy surfaces send to the camera of each light coefficient: sum_i G_qi L_ij of `gloss.rs`, times pi as irradiance is a
// matt surface's radiance times pi. A function q of the wavelength for each group in z. Host side: `passes/prt_gloss.rs`.
//
// points       position and normal of every vertex of the scene
// matrices     function q, row i, column j, vertex that shines; neighbours in memory are vertices
// lobes        of each lobe a factor per degree of harmonics, times pi
// light        L_jk in blocks of four spectral coefficients j: block, harmonic k
// irradiance   vertex, block; of every vertex the last blocks are these, function after function

struct PrtGloss {
    vertices: u32,
    groups_per_row: u32, // workgroups in x
    rows: u32,           // vertices that shine
    camera_view: u32,
    bands: u32,          // of light
    blocks: u32,         // of four spectral coefficients
    vertex_blocks: u32,  // all blocks of a vertex
    reserved: u32,
}

struct PrtGlossPoint {
    position: vec3<f32>, // working units
    row: u32,            // in `matrices`, or MATT
    normal: vec3<f32>,   // unit
    lobe: u32,           // its first factor in `lobes`
}

const MATT: u32 = 0xffffffffu;

@group(0) @binding(0) var<uniform> params: PrtGloss;
@group(0) @binding(1) var<storage, read> points: array<PrtGlossPoint>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<storage, read> matrices: array<f32>;
@group(0) @binding(4) var<storage, read> lobes: array<f32>;
@group(0) @binding(5) var<storage, read> light: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> irradiance: array<vec4<f32>>;

@compute @workgroup_size(64, 1, 1)
fn prt_gloss(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let vertex = id.y * params.groups_per_row * 64u + id.x;
    if vertex >= params.vertices {
        return;
    }
    let count = params.bands * params.bands;
    let function_blocks = params.vertex_blocks - (groups.z - id.z) * params.blocks;
    var transfer: array<f32, 25>;
    let at = points[vertex];
    let view = views[params.camera_view];
    // Who looks from the vertex itself looks in no direction.
    if at.row != MATT && any(at.position != view.eye) {
        let ray = view_ray_through(view, at.position);
        var lobe = harmonics(params.bands, reflect(ray.direction, at.normal));
        for (var l = 0u; l < params.bands; l++) {
            let factor = lobes[at.lobe + l];
            for (var k = l * l; k < (l + 1u) * (l + 1u); k++) {
                lobe[k] *= factor;
            }
        }
        var entry = id.z * count * count * params.rows + at.row;
        for (var i = 0u; i < count; i++) {
            var sum = 0.0;
            for (var j = 0u; j < count; j++) {
                sum += matrices[entry] * lobe[j];
                entry += params.rows;
            }
            transfer[i] = sum;
        }
    }
    let target_block = vertex * params.vertex_blocks + function_blocks;
    for (var block = 0u; block < params.blocks; block++) {
        var sum = vec4<f32>(0.0);
        for (var k = 0u; k < count; k++) {
            sum += transfer[k] * light[block * count + k];
        }
        irradiance[target_block + block] = sum;
    }
}
