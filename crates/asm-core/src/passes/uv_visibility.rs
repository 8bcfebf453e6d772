//! Which triangle of the receiver covers each sample of its UV square. Twin of `shaders/uv_visibility.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::VertexOutput;
use frame_plan::{BindingKind, Cull, PassInfo, PassKind, TextureFormat};
use glam::Vec2;

use super::visibility::visible_color;
use super::{TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_WGSL, binding};

/// Uniform of the pass; mirrors `UvVisibility` in `shaders/uv_visibility.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct UvVisibility {
    /// First triangle of the receiver.
    pub first_triangle: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// All that an executor needs to build and run `uv_visibility`.
pub const UV_VISIBILITY: PassInfo = PassInfo {
    name: "uv_visibility",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        VISIBILITY_WGSL,
        include_str!("../../../../shaders/uv_visibility.wgsl"),
    ],
    params_struct: "UvVisibility",
    params_bytes: size_of::<UvVisibility>() as u32,
    bindings: &[binding("corner_uvs", BindingKind::Read)],
    kind: PassKind::Draw {
        targets: &[TextureFormat::R32Uint],
        depth: None,
        cull: Cull::None,
        additive: false,
        vertex: |args, index, _| vertex(&args.params(), args.read("corner_uvs"), index),
        fragment: |_, fragment| Some(visible_color(fragment.flat[0])),
    },
};

fn vertex(params: &UvVisibility, corner_uvs: &[Vec2], index: u32) -> VertexOutput {
    let uv = corner_uvs[index as usize];
    VertexOutput {
        position: [2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y, 0.5, 1.0],
        flat: [params.first_triangle + index / 3 + 1, 0, 0, 0],
        ..VertexOutput::default()
    }
}
