// Drawing triangles into a visibility buffer: no vertex buffers, three vertices per triangle by index. Host side:
// asm-core's `passes/visibility.rs` and `passes/uv_visibility.rs`.

struct VisibilityVertex {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) visible: u32, // index of the triangle + 1
}

fn triangle_corner(t: Triangle, corner: u32) -> vec3<f32> {
    if corner == 0u {
        return t.p0;
    }
    return select(t.p2, t.p1, corner == 1u);
}
