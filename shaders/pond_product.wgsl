// What the paper convolves: flux (-L_z)^(n - 1) times L_x, L_y and -L_z (passes 4 and 5). Host side: `passes/pond_product.rs`.

struct PondProduct {
    samples: u32,
    groups_per_row: u32, // workgroups in x
    exponent: f32,       // n - 1
    reserved: u32,
}

@group(0) @binding(0) var<uniform> params: PondProduct;
@group(0) @binding(1) var<storage, read> beams: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> terms: array<f32>; // one image after the other

// ln(1 - x) for x from 0 to 1/2; the series where the logarithm would cancel.
fn log_1_minus(x: f32) -> f32 {
    if x > 0.1 {
        return log(1.0 - x);
    }
    let tail = 1.0 / 3.0 + x * (0.25 + x * (0.2 + x * (1.0 / 6.0 + x * (1.0 / 7.0))));
    return -x * (1.0 + x * (0.5 + x * tail));
}

@compute @workgroup_size(64, 1, 1)
fn pond_product(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.y * params.groups_per_row * 64u + id.x;
    if index >= params.samples {
        return;
    }
    let beam = beams[index];
    var products = vec3<f32>(0.0);
    // Light that travels upwards meets no floor.
    if beam.z < 0.0 {
        let sin2 = dot(beam.xy, beam.xy);
        var log_cos = 0.0;
        if sin2 < 0.5 {
            log_cos = 0.5 * log_1_minus(sin2);
        } else {
            log_cos = log(-beam.z);
        }
        products = beam.w * exp(params.exponent * log_cos) * vec3<f32>(beam.xy, -beam.z);
    }
    for (var k = 0u; k < 3u; k++) {
        terms[k * params.samples + index] = products[k];
    }
}
