//! Which triangle is the first that a view sees at each texel centre. Twin of `shaders/visibility.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::{Fragment, MirrorArgs, VertexOutput};
use frame_plan::{BindingKind, Cull, DepthTest, PassInfo, PassKind, TextureFormat};
use glam::{Vec2, Vec3};

use super::{TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_WGSL, binding};
use crate::shared::triangle::Triangle;
use crate::shared::view::View;

/// Uniform of the pass; mirrors `Visibility` in `shaders/visibility.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Visibility {
    /// Index of the view.
    pub view: u32,
    /// Vertex 0 of the draw is this triangle's first corner.
    pub first_triangle: u32,
    /// [`VISIBILITY_ALL_FACES`] or [`VISIBILITY_BACK_FACES`].
    pub faces: u32,
    /// Surfaces nearer to the view's eye or plane are left out; 0 keeps all.
    pub from_distance: f32,
}

/// Draw every triangle.
pub const VISIBILITY_ALL_FACES: u32 = 0;
/// Draw only triangles that face away.
pub const VISIBILITY_BACK_FACES: u32 = 1;

/// All that an executor needs to build and run `visibility`.
pub const VISIBILITY: PassInfo = PassInfo {
    name: "visibility",
    wgsl: &[VIEW_WGSL, TRIANGLE_WGSL, VISIBILITY_WGSL, include_str!("../../../../shaders/visibility.wgsl")],
    params_struct: "Visibility",
    params_bytes: size_of::<Visibility>() as u32,
    bindings: &[binding("triangles", BindingKind::Read), binding("views", BindingKind::Read)],
    kind: PassKind::Draw {
        targets: &[TextureFormat::R32Uint],
        // Depth is 1 at the near plane: see `view_clip`.
        depth: Some(DepthTest::Greater),
        cull: Cull::None,
        additive: false,
        vertex: |args, index, _| vertex(&args.params(), args.read("triangles"), args.read("views"), index),
        fragment: |args, fragment| {
            self::fragment(&args.params(), args, fragment).then(|| visible_color(fragment.flat[0]))
        },
    },
};

/// A visibility buffer's texel as a colour.
pub(super) fn visible_color(visible: u32) -> [[f32; 4]; 4] {
    let mut color = [[0.0; 4]; 4];
    color[0][0] = visible as f32;
    color
}

/// One corner of a triangle.
pub(super) fn triangle_corner(t: &Triangle, corner: u32) -> Vec3 {
    match corner {
        0 => t.p0,
        1 => t.p1,
        _ => t.p2,
    }
}

fn vertex(params: &Visibility, triangles: &[Triangle], views: &[View], index: u32) -> VertexOutput {
    let triangle = params.first_triangle + index / 3;
    let corner = triangle_corner(&triangles[triangle as usize], index % 3);
    VertexOutput {
        position: views[params.view as usize].clip(corner).to_array(),
        flat: [triangle + 1, 0, 0, 0],
        ..VertexOutput::default()
    }
}

/// Whether the fragment is kept.
fn fragment(params: &Visibility, args: &MirrorArgs<'_>, fragment: &Fragment) -> bool {
    if params.faces == VISIBILITY_BACK_FACES && fragment.front_facing {
        return false;
    }
    if params.from_distance > 0.0 {
        let view = &args.read::<View>("views")[params.view as usize];
        let triangle = &args.read::<Triangle>("triangles")[fragment.flat[0] as usize - 1];
        let hit = triangle.plane_hit(view.ray(Vec2::new(fragment.position[0], fragment.position[1])));
        return hit.crosses && hit.distance >= params.from_distance;
    }
    true
}
