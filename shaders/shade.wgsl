// What a camera sees by one light, added to what other lights left there: matt surfaces with shadow and caustic, glass as a
// tint on what is straight behind it. Pixel means over a grid of samples. Host side: `passes/shade.rs`.

struct Shade {
    light: Light,
    size: vec2<u32>,              // pixels
    samples: u32,                 // per pixel and axis
    camera_view: u32,             // its texels are samples
    linear_srgb_from_x: vec3<f32>, // columns of the matrix from XYZ
    first_surface: u32,           // of this light, in `surfaces`
    linear_srgb_from_y: vec3<f32>,
    reserved0: u32,
    linear_srgb_from_z: vec3<f32>,
    reserved1: u32,
    xyz_from_r: vec3<f32>,        // and of its inverse
    reserved2: u32,
    xyz_from_g: vec3<f32>,
    reserved3: u32,
    xyz_from_b: vec3<f32>,
    reserved4: u32,
}

// A material as a camera sees it by one light.
struct Surface {
    reflected: vec3<f32>,  // XYZ of the light, in its lux or candela, that a matt surface reflects
    index: f32,            // refractive index at the d line
    tint: vec3<f32>,       // linear sRGB that the surface of glass lets pass
    reserved0: u32,
    absorption: vec3<f32>, // of glass, linear sRGB, per working unit
    reserved1: u32,
}

const INVERSE_PI: f32 = 0.31830987;

@group(0) @binding(0) var<uniform> params: Shade;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<storage, read> surfaces: array<Surface>; // light * materials + material
@group(0) @binding(4) var<storage, read> caustic: array<vec4<f32>>;
@group(0) @binding(5) var camera_visibility: texture_2d<u32>; // opaque surfaces
@group(0) @binding(6) var glass_visibility: texture_2d<u32>;  // refractors
@group(0) @binding(7) var back_visibility: texture_2d<u32>;   // back faces of refractors
@group(0) @binding(8) var direct_visibility: texture_2d_array<u32>;
@group(0) @binding(9) var landing_visibility: texture_2d_array<u32>;
@group(0) @binding(10) var reflected_visibility: texture_2d_array<u32>;
@group(0) @binding(11) var entry_visibility: texture_2d<u32>;
@group(0) @binding(12) var<storage, read_write> picture: array<vec4<f32>>;

// Linear sRGB that glass lets pass straight through, at a sample where `depth` is the distance of the surface behind.
fn glass_tint(sample: vec2<i32>, ray: Ray, depth: f32) -> vec3<f32> {
    let visible = textureLoad(glass_visibility, sample, 0).r;
    if visible == NOTHING {
        return vec3<f32>(1.0);
    }
    let front = triangles[visible - 1u];
    let hit = plane_hit(front, ray);
    if !hit.crosses || hit.distance >= depth {
        return vec3<f32>(1.0);
    }
    let surface = surfaces[params.first_surface + front.material];
    let normal = -sign(hit.facing) * interpolated_normal(front, hit);
    let eta = select(1.0 / surface.index, surface.index, hit.facing < 0.0);
    let passes = surface.tint * (1.0 - refract_light(ray.direction, normal, eta).reflectance);
    if hit.facing > 0.0 {
        return passes;
    }
    if (front.flags & TRIANGLE_OPEN) != 0u {
        return passes * exp(-surface.absorption * (depth - hit.distance));
    }
    var thickness = 0.0;
    let behind = textureLoad(back_visibility, sample, 0).r;
    if behind != NOTHING && triangles[behind - 1u].object == front.object {
        let back = plane_hit(triangles[behind - 1u], ray);
        thickness = max(back.distance - hit.distance, 0.0);
    }
    return passes * passes * exp(-surface.absorption * thickness);
}

// XYZ radiance along a sample's ray.
fn radiance_at(sample: vec2<u32>) -> vec3<f32> {
    let texel = vec2<i32>(sample);
    let visible = textureLoad(camera_visibility, texel, 0).r;
    if visible == NOTHING {
        return vec3<f32>(0.0);
    }
    let ray = view_ray(views[params.camera_view], vec2<f32>(sample) + 0.5);
    let t = triangles[visible - 1u];
    let hit = plane_hit(t, ray);
    if !hit.crosses {
        return vec3<f32>(0.0);
    }
    if (t.flags & TRIANGLE_MIRROR) != 0u {
        return vec3<f32>(0.0); // it has no colour of its own
    }
    let normal = -sign(hit.facing) * interpolated_normal(t, hit); // of the side that is seen
    let light = irradiance_at(ray.origin + hit.distance * ray.direction, normal, visible);
    let reflected = surfaces[params.first_surface + t.material].reflected;
    let xyz = INVERSE_PI * (light.direct * reflected + light.refracted + light.reflected);
    return tinted(xyz, glass_tint(texel, ray, hit.distance));
}

// XYZ times a colour of linear sRGB. Spectral light lies outside sRGB: times a colour it may leave XYZ's positive octant,
// which no light does.
fn tinted(xyz: vec3<f32>, tint: vec3<f32>) -> vec3<f32> {
    if all(tint == tint.xxx) {
        return tint.x * xyz;
    }
    let linear_srgb_from_xyz =
        mat3x3<f32>(params.linear_srgb_from_x, params.linear_srgb_from_y, params.linear_srgb_from_z);
    let xyz_from_linear_srgb = mat3x3<f32>(params.xyz_from_r, params.xyz_from_g, params.xyz_from_b);
    return max(xyz_from_linear_srgb * (tint * (linear_srgb_from_xyz * xyz)), vec3<f32>(0.0));
}

@compute @workgroup_size(8, 8, 1)
fn shade(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= params.size.x || id.y >= params.size.y {
        return;
    }
    var sum = vec3<f32>(0.0);
    for (var j = 0u; j < params.samples; j++) {
        for (var i = 0u; i < params.samples; i++) {
            sum += radiance_at(id.xy * params.samples + vec2<u32>(i, j));
        }
    }
    let samples = f32(params.samples * params.samples);
    picture[id.y * params.size.x + id.x] += vec4<f32>(sum / samples, 0.0);
}
