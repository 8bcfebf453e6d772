// A light or a camera looking onto a texel grid. Host side: `View` in asm-core's `shared/view.rs`.
//
// Lengths are working units: the scene moved to the origin and scaled to radius 1.
// texel     continuous grid coordinates, x right, y down; texel (i, j) has its centre at (i + 0.5, j + 0.5)
// slope     x and y on the view's plane: lengths for parallel rays, tangents for rays that leave an eye
// z         depth along `forward` from the eye

struct View {
    eye: vec3<f32>,         // where rays start, or the middle of the plane where parallel rays start
    perspective: u32,       // 1 where rays leave the eye, 0 where they are parallel
    right: vec3<f32>,
    near: f32,              // z that maps to depth 1
    up: vec3<f32>,
    far: f32,               // z that maps to depth 0: nearer is greater, which suits 32-bit float depth
    forward: vec3<f32>,
    reserved: f32,
    slope_center: vec2<f32>, // slope of the grid's middle
    slope_half: vec2<f32>,  // slope from the middle to the grid's edges
    size: vec2<u32>,        // texels
    texel_slope: vec2<f32>, // slope per texel
}

struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>, // unit
}

// Where a point falls on the grid; `z` <= 0 is behind the eye, and the texel then means nothing.
struct Projected {
    texel: vec2<f32>,
    z: f32,
}

fn view_clip(view: View, p: vec3<f32>) -> vec4<f32> {
    let local = p - view.eye;
    let z = dot(local, view.forward);
    let xy = vec2<f32>(dot(local, view.right), dot(local, view.up));
    if view.perspective == 1u {
        let ndc = (xy - view.slope_center * z) / view.slope_half;
        return vec4<f32>(ndc, view.near * (view.far - z) / (view.far - view.near), z);
    }
    let ndc = (xy - view.slope_center) / view.slope_half;
    return vec4<f32>(ndc, (view.far - z) / (view.far - view.near), 1.0);
}

fn view_project(view: View, p: vec3<f32>) -> Projected {
    let local = p - view.eye;
    let z = dot(local, view.forward);
    var slope = vec2<f32>(dot(local, view.right), dot(local, view.up));
    if view.perspective == 1u {
        slope /= max(z, 1e-12);
    }
    let offset = (slope - view.slope_center) / view.texel_slope;
    let middle = 0.5 * vec2<f32>(view.size);
    // Parallel rays come from infinitely far: nothing is behind them.
    return Projected(vec2<f32>(middle.x + offset.x, middle.y - offset.y), select(1.0, z, view.perspective == 1u));
}

// The texel that shows `p`, or of the grid's edge the nearest.
fn view_texel(view: View, p: vec3<f32>) -> vec2<i32> {
    return vec2<i32>(clamp(view_project(view, p).texel, vec2<f32>(0.0), vec2<f32>(view.size) - 1.0));
}

// One of the eight texels round another.
fn texel_beside(view: View, texel: vec2<i32>, side: i32) -> vec2<i32> {
    let place = side + side / 4; // of 3 x 3, without the middle
    return clamp(texel + vec2<i32>(place % 3, place / 3) - 1, vec2<i32>(0), vec2<i32>(view.size) - 1);
}

fn view_slope(view: View, texel: vec2<f32>) -> vec2<f32> {
    let offset = texel - 0.5 * vec2<f32>(view.size);
    return view.slope_center + vec2<f32>(offset.x, -offset.y) * view.texel_slope;
}

fn view_ray(view: View, texel: vec2<f32>) -> Ray {
    let slope = view_slope(view, texel);
    let across = slope.x * view.right + slope.y * view.up;
    if view.perspective == 1u {
        return Ray(view.eye, normalize(view.forward + across));
    }
    return Ray(view.eye + across, view.forward);
}

// The ray of this view that passes through `p`.
fn view_ray_through(view: View, p: vec3<f32>) -> Ray {
    let local = p - view.eye;
    if view.perspective == 1u {
        return Ray(view.eye, normalize(local));
    }
    return Ray(p - dot(local, view.forward) * view.forward, view.forward);
}

// Share of `texel_slope.x * texel_slope.y` that a texel measures: 1 for parallel rays, where that is its area across the
// light; for rays from an eye its solid angle, the integral of (1 + slope^2)^(-3/2) by 2 x 2 Gauss-Legendre points.
fn view_texel_measure(view: View, texel: vec2<u32>) -> f32 {
    if view.perspective == 0u {
        return 1.0;
    }
    let gauss = 0.28867513; // 1 / (2 sqrt 3)
    let center = view_slope(view, vec2<f32>(texel) + 0.5);
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let side = vec2<f32>(select(-gauss, gauss, (i & 1u) == 1u), select(-gauss, gauss, (i & 2u) == 2u));
        let slope = center + side * view.texel_slope;
        let cosine = inverseSqrt(1.0 + dot(slope, slope));
        sum += cosine * cosine * cosine;
    }
    return 0.25 * sum;
}

fn view_holds(view: View, at: Projected) -> bool {
    let size = vec2<f32>(view.size);
    return at.z > 0.0 && at.texel.x >= 0.0 && at.texel.y >= 0.0 && at.texel.x < size.x && at.texel.y < size.y;
}
