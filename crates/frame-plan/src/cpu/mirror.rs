//! What a CPU mirror sees: its uniform, its resources by name, and for draws the vertex and fragment records.

/// Output of a vertex mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VertexOutput {
    /// Clip-space position, y up, depth 0..w.
    pub position: [f32; 4],
    /// Integers passed on without interpolation, taken from the triangle's first vertex.
    pub flat: [u32; 4],
    /// Values interpolated with perspective.
    pub varyings: [[f32; 4]; 2],
}

/// Input of a fragment mirror: one texel centre inside a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Texel centre in x and y (texels, y down), depth in z, 1/w in w: WGSL's `@builtin(position)`.
    pub position: [f32; 4],
    /// The triangle faces the viewer.
    pub front_facing: bool,
    /// From the triangle's first vertex.
    pub flat: [u32; 4],
    /// Interpolated with perspective.
    pub varyings: [[f32; 4]; 2],
}
