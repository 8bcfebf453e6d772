// A picture of XYZ radiance on its way to the screen: exposure, tone map, gamut map, encoding.
// Host side: `DisplayParams` in asm-core's display.rs; the same steps as spectral_core::display.

struct DisplayParams {
    picture_size: vec2<u32>,
    target_size: vec2<u32>,
    exposure: f32,
    // Luminance that Reinhard's tone map takes to white; 0 means another, or none but the cut at 1.
    reinhard_white: f32,
    // The target stores what it is given: encode here.
    encode: u32,
    // Of the sigmoid; 0 means another tone map.
    sigmoid_contrast: f32,
    // Columns of the matrix from XYZ to linear sRGB.
    linear_srgb_from_x: vec4<f32>,
    linear_srgb_from_y: vec4<f32>,
    linear_srgb_from_z: vec4<f32>,
    white_xyz: vec4<f32>,
}

@group(0) @binding(0) var<uniform> params: DisplayParams;
// XYZ per pixel, rows from the top.
@group(0) @binding(1) var<storage, read> picture: array<vec4<f32>>;

@vertex
fn display_vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
    // One triangle over everything.
    let corner = vec2(f32(vertex & 1u), f32(vertex >> 1u));
    return vec4(corner * 4.0 - 1.0, 0.0, 1.0);
}

const MIDDLE_GREY: f32 = 0.18;

fn sigmoid(y: f32) -> f32 {
    let rest = (1.0 - MIDDLE_GREY) / MIDDLE_GREY;
    // Powers below 1 on either side of grey, so that none is infinite.
    if y < MIDDLE_GREY {
        let share = pow(y / MIDDLE_GREY, params.sigmoid_contrast);
        return share / (share + rest);
    }
    return 1.0 / (1.0 + pow(MIDDLE_GREY / y, params.sigmoid_contrast) * rest);
}

fn tone_mapped(y: f32) -> f32 {
    if params.sigmoid_contrast > 0.0 {
        return sigmoid(y);
    }
    let white = params.reinhard_white;
    if white == 0.0 || y >= white {
        return min(y, 1.0);
    }
    return min(y * (1.0 + y / (white * white)) / (1.0 + y), 1.0);
}

// Mixed with the grey of its own luminance by as little as brings every component into 0..1.
fn gamut_mapped_srgb_from_xyz(xyz: vec3<f32>) -> vec3<f32> {
    let grey = xyz.y;
    let chromatic = params.linear_srgb_from_x.xyz * (xyz.x - grey * params.white_xyz.x)
        + params.linear_srgb_from_z.xyz * (xyz.z - grey * params.white_xyz.z);
    var share = 1.0;
    for (var i = 0; i < 3; i++) {
        let room = select(-grey, 1.0 - grey, chromatic[i] > 0.0);
        if abs(chromatic[i]) * share > abs(room) {
            share = room / chromatic[i];
        }
    }
    return clamp(grey + share * chromatic, vec3(0.0), vec3(1.0));
}

fn srgb_from_linear(linear: vec3<f32>) -> vec3<f32> {
    let curved = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
    return select(curved, 12.92 * linear, linear <= vec3(0.0031308));
}

@fragment
fn display_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let texel = vec2<u32>(position.xy);
    let pixel = min(texel * params.picture_size / params.target_size, params.picture_size - 1u);
    let exposed = picture[pixel.y * params.picture_size.x + pixel.x].xyz * params.exposure;
    if exposed.y <= 0.0 {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let y = tone_mapped(exposed.y);
    let scale = y / exposed.y;
    let linear = gamut_mapped_srgb_from_xyz(vec3(exposed.x * scale, y, exposed.z * scale));
    return vec4(select(linear, srgb_from_linear(linear), params.encode != 0u), 1.0);
}
