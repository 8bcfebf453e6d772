// Irradiance of one light on the receiver's UV square, added to what other lights left there: texel means over a grid of
// samples; what falls on the back of the receiver does not count. Host side: `passes/receiver_bake.rs`.

struct ReceiverBake {
    light: Light,
    size: vec2<u32>,       // texels
    samples: u32,          // per texel and axis
    first_triangle: u32,   // of the receiver
}

@group(0) @binding(0) var<uniform> params: ReceiverBake;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<storage, read> corner_uvs: array<vec2<f32>>; // three per triangle of the receiver
@group(0) @binding(4) var<storage, read> caustic: array<vec4<f32>>;
@group(0) @binding(5) var uv_visibility: texture_2d<u32>;
@group(0) @binding(6) var direct_visibility: texture_2d_array<u32>;
@group(0) @binding(7) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(8) var reflected_visibility: texture_2d_array<u32>;
@group(0) @binding(9) var entry_visibility: texture_2d<u32>;
@group(0) @binding(10) var<storage, read_write> irradiance: array<vec4<f32>>; // direct, refracted, reflected if there is any

// Weights of the second and third corner at `uv`.
fn uv_weights(triangle: u32, uv: vec2<f32>) -> vec2<f32> {
    let first = 3u * (triangle - params.first_triangle);
    let a = corner_uvs[first];
    let e1 = corner_uvs[first + 1u] - a;
    let e2 = corner_uvs[first + 2u] - a;
    let d = uv - a;
    let area = e1.x * e2.y - e1.y * e2.x;
    return vec2<f32>(d.x * e2.y - d.y * e2.x, e1.x * d.y - e1.y * d.x) / area;
}

@compute @workgroup_size(8, 8, 1)
fn receiver_bake(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    let grid = vec2<f32>(params.size * params.samples);
    var direct = vec3<f32>(0.0);
    var refracted = vec3<f32>(0.0);
    var reflected = vec3<f32>(0.0);
    var covered = 0.0;
    for (var j = 0u; j < params.samples; j++) {
        for (var i = 0u; i < params.samples; i++) {
            let sample = id.xy * params.samples + vec2<u32>(i, j);
            let visible = textureLoad(uv_visibility, vec2<i32>(sample), 0).r;
            if visible == NOTHING {
                continue;
            }
            let t = triangles[visible - 1u];
            let e1 = t.p1 - t.p0;
            let e2 = t.p2 - t.p0;
            let weights = uv_weights(visible - 1u, (vec2<f32>(sample) + 0.5) / grid);
            let point = t.p0 + weights.x * e1 + weights.y * e2;
            let light = irradiance_at(point, normalize(cross(e1, e2)), visible);
            direct += light.direct * params.light.xyz;
            refracted += light.refracted;
            reflected += light.reflected;
            covered += 1.0;
        }
    }
    if covered > 0.0 {
        let index = id.y * params.size.x + id.x;
        let layer = params.size.x * params.size.y;
        irradiance[index] += vec4<f32>(direct / covered, 0.0);
        irradiance[layer + index] += vec4<f32>(refracted / covered, 0.0);
        if params.light.reflected_faces > 0u {
            irradiance[2u * layer + index] += vec4<f32>(reflected / covered, 0.0);
        }
    }
}
