// Which triangle of the receiver covers each sample of its UV square; row 0 is v = 0. Host side:
// `passes/uv_visibility.rs`.

struct UvVisibility {
    first_triangle: u32, // of the receiver; vertex 0 of the draw is its first corner
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: UvVisibility;
@group(0) @binding(1) var<storage, read> corner_uvs: array<vec2<f32>>; // three per triangle of the receiver

@vertex
fn uv_visibility_vertex(@builtin(vertex_index) index: u32) -> VisibilityVertex {
    let uv = corner_uvs[index];
    return VisibilityVertex(vec4<f32>(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.5, 1.0), params.first_triangle + index / 3u + 1u);
}

@fragment
fn uv_visibility_fragment(in: VisibilityVertex) -> @location(0) u32 {
    return in.visible;
}
