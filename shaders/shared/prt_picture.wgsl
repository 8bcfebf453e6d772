// Relit surfaces as a camera sees them: pixel means over a grid of samples. A pass that shades has these bindings and says
// what albedo is; host side: spectral-prt's `shared/prt_picture.rs`.
//
// blocks   of four terms: for each function q of transfer, and then of gloss, the coefficients j of the spectral basis, padded to fours

struct PrtPicture {
    shown_from_x: vec3<f32>, // columns of the matrix from XYZ of radiance times pi to the picture: exposure, white balance
    blocks: u32,             // of four terms
    shown_from_y: vec3<f32>,
    samples: u32,            // per pixel and axis
    shown_from_z: vec3<f32>,
    camera_view: u32,        // its texels are samples
    size: vec2<u32>,         // pixels
    reserved: vec2<u32>,
}

// A triangle's corners.
struct PrtCorners {
    vertices: vec3<u32>,
    albedo: u32, // index in `albedos`
    uv0: vec2<f32>,
    uv1: vec2<f32>,
    uv2: vec2<f32>,
    reserved: vec2<f32>,
}

// What a surface reflects, as a map over its texture coordinates.
struct PrtAlbedo {
    map_size: vec2<u32>, // texels; row 0 is v = 0
    first: u32,          // its first texel in `index_maps`, or its first layer in `spectral_maps`
    spectral: u32,       // 1: its map is one of `spectral_maps`
}

@group(0) @binding(0) var<uniform> params: PrtPicture;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var visibility: texture_2d<u32>;
@group(0) @binding(4) var<storage, read> corners: array<PrtCorners>;     // of each triangle
@group(0) @binding(5) var<storage, read> irradiance: array<vec4<f32>>;   // vertex, block
@group(0) @binding(6) var<storage, read> albedos: array<PrtAlbedo>;
@group(0) @binding(7) var<storage, read> index_maps: array<u32>;         // entries of the palette
@group(0) @binding(8) var<storage, read> palette: array<vec4<f32>>;      // entry, block, colour-matching function
@group(0) @binding(9) var<storage, read_write> picture: array<vec4<f32>>; // XYZ, share without a surface

// What is seen at a sample.
struct Seen {
    first_blocks: vec3<u32>, // of the corners' irradiance
    weights: vec3<f32>,      // of the corners
    uv: vec2<f32>,
}

fn irradiance_at(seen: Seen, block: u32) -> vec4<f32> {
    return seen.weights.x * irradiance[seen.first_blocks.x + block]
        + seen.weights.y * irradiance[seen.first_blocks.y + block]
        + seen.weights.z * irradiance[seen.first_blocks.z + block];
}

// Inner product with the palette's entry at the nearest texel of the albedo's index map.
fn reflected_by_palette(seen: Seen, albedo: PrtAlbedo) -> vec3<f32> {
    let size = vec2<f32>(albedo.map_size);
    // Rounding may take a fraction to 1.
    let texel = min(vec2<u32>(fract(seen.uv) * size), albedo.map_size - 1u);
    let entry = index_maps[albedo.first + texel.y * albedo.map_size.x + texel.x];
    var xyz = vec3<f32>(0.0);
    for (var block = 0u; block < params.blocks; block++) {
        let e = irradiance_at(seen, block);
        let at = 3u * (entry * params.blocks + block);
        xyz += vec3<f32>(dot(palette[at], e), dot(palette[at + 1u], e), dot(palette[at + 2u], e));
    }
    return xyz;
}

// XYZ of radiance times pi, and 1 where no surface is.
fn radiance_at(sample: vec2<u32>) -> vec4<f32> {
    let visible = textureLoad(visibility, vec2<i32>(sample), 0).r;
    if visible == NOTHING {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let hit = plane_hit(triangles[visible - 1u], view_ray(views[params.camera_view], vec2<f32>(sample) + 0.5));
    if !hit.crosses || hit.facing >= 0.0 {
        return vec4<f32>(0.0); // from behind it is black
    }
    // A rasteriser's idea of a triangle is coarser than this one: just outside is on the edge.
    var weights = max(vec3<f32>(1.0 - hit.u - hit.v, hit.u, hit.v), vec3<f32>(0.0));
    weights /= weights.x + weights.y + weights.z;
    let triangle = corners[visible - 1u];
    let uv = weights.x * triangle.uv0 + weights.y * triangle.uv1 + weights.z * triangle.uv2;
    let seen = Seen(triangle.vertices * params.blocks, weights, uv);
    return vec4<f32>(reflected(seen, albedos[triangle.albedo]), 0.0);
}

fn shaded(pixel: vec2<u32>) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    for (var j = 0u; j < params.samples; j++) {
        for (var i = 0u; i < params.samples; i++) {
            sum += radiance_at(pixel * params.samples + vec2<u32>(i, j));
        }
    }
    let mean = sum / f32(params.samples * params.samples);
    let xyz = mean.x * params.shown_from_x + mean.y * params.shown_from_y + mean.z * params.shown_from_z;
    return vec4<f32>(xyz, mean.w);
}
