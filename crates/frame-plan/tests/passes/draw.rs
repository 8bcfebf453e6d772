//! Draw passes: clip-space corners from a buffer.

use frame_plan::cpu::{Fragment, MirrorArgs, VertexOutput};
use frame_plan::{Binding, BindingKind, Cull, DepthTest, PassInfo, PassKind, TextureFormat};

const POSITIONS: &[Binding] = &[Binding { name: "positions", kind: BindingKind::Read }];

pub const VISIBILITY: PassInfo = PassInfo {
    name: "visibility",
    wgsl: &["@group(0) @binding(0) var<storage, read> positions: array<vec4<f32>>;
        struct Corner { @builtin(position) position: vec4<f32>, @location(0) @interpolate(flat) id: u32 }
        @vertex fn visibility_vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) instance: u32) -> Corner {
            let p = positions[vertex];
            let shift = vec4(0.25, 0.125, -0.125, 0.0) * f32(instance);
            return Corner(p + shift * p.w, instance * 1000u + vertex / 3u + 1u);
        }
        @fragment fn visibility_fragment(corner: Corner) -> @location(0) u32 { return corner.id; }"],
    params_struct: "",
    params_bytes: 0,
    bindings: POSITIONS,
    kind: PassKind::Draw {
        targets: &[TextureFormat::R32Uint],
        depth: Some(DepthTest::Less),
        cull: Cull::Back,
        additive: false,
        vertex: visibility_vertex,
        fragment: |_, fragment| Some([[fragment.flat[0] as f32, 0.0, 0.0, 0.0]; 4]),
    },
};

fn visibility_vertex(args: &MirrorArgs<'_>, vertex: u32, instance: u32) -> VertexOutput {
    let p = args.read::<[f32; 4]>("positions")[vertex as usize];
    let shift = [0.25, 0.125, -0.125, 0.0].map(|s| s * instance as f32);
    VertexOutput {
        position: std::array::from_fn(|i| p[i] + shift[i] * p[3]),
        flat: [instance * 1000 + vertex / 3 + 1, 0, 0, 0],
        ..VertexOutput::default()
    }
}

/// Interpolates the corner's number in its triangle and its w, with perspective; drops the texels left of x = 3.
pub const SHADED: PassInfo = PassInfo {
    name: "shaded",
    wgsl: &["@group(0) @binding(0) var<storage, read> positions: array<vec4<f32>>;
        struct Corner { @builtin(position) position: vec4<f32>, @location(0) barycentric: vec3<f32> }
        @vertex fn shaded_vertex(@builtin(vertex_index) vertex: u32) -> Corner {
            var barycentric = vec3(0.0);
            barycentric[vertex % 3u] = 1.0;
            return Corner(positions[vertex], barycentric);
        }
        @fragment fn shaded_fragment(corner: Corner, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
            if corner.position.x < 3.0 { discard; }
            return vec4(corner.barycentric.xy, corner.position.w, select(-1.0, 1.0, front));
        }"],
    params_struct: "",
    params_bytes: 0,
    bindings: POSITIONS,
    kind: PassKind::Draw {
        targets: &[TextureFormat::Rgba32Float],
        depth: None,
        cull: Cull::None,
        additive: false,
        vertex: shaded_vertex,
        fragment: shaded_fragment,
    },
};

fn shaded_vertex(args: &MirrorArgs<'_>, vertex: u32, _: u32) -> VertexOutput {
    let mut varyings = [[0.0; 4]; 2];
    varyings[0][vertex as usize % 3] = 1.0;
    VertexOutput {
        position: args.read::<[f32; 4]>("positions")[vertex as usize],
        varyings,
        ..VertexOutput::default()
    }
}

fn shaded_fragment(_: &MirrorArgs<'_>, fragment: &Fragment) -> Option<[[f32; 4]; 4]> {
    let [x, y, ..] = fragment.varyings[0];
    let facing = if fragment.front_facing { 1.0 } else { -1.0 };
    (fragment.position[0] >= 3.0).then_some([[x, y, fragment.position[3], facing]; 4])
}

/// Adds up what covers a texel.
pub const GLOW: PassInfo = PassInfo {
    name: "glow",
    wgsl: &["@group(0) @binding(0) var<storage, read> positions: array<vec4<f32>>;
        @vertex fn glow_vertex(@builtin(vertex_index) vertex: u32) -> @builtin(position) vec4<f32> {
            return positions[vertex];
        }
        @fragment fn glow_fragment() -> @location(0) vec4<f32> { return vec4(1.0, 0.5, 0.25, 1.0); }"],
    params_struct: "",
    params_bytes: 0,
    bindings: POSITIONS,
    kind: PassKind::Draw {
        targets: &[TextureFormat::Rgba16Float],
        depth: None,
        cull: Cull::None,
        additive: true,
        vertex: shaded_vertex,
        fragment: |_, _| Some([[1.0, 0.5, 0.25, 1.0]; 4]),
    },
};
