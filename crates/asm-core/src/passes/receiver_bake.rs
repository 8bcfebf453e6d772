//! Irradiance of one light on the receiver's UV square. Twin of `shaders/receiver_bake.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{UVec2, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::{
    EMISSION_WGSL, IRRADIANCE_WGSL, LIGHT_VIEWS_WGSL, TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE,
    VISIBILITY_TEXTURE_ARRAY, binding,
};
use crate::shared::irradiance::{Light, Lookup};
use crate::shared::triangle::NOTHING;

/// Uniform of the pass; mirrors `ReceiverBake` in `shaders/receiver_bake.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ReceiverBake {
    /// The light.
    pub light: Light,
    /// Texels.
    pub size: UVec2,
    /// Samples per texel and axis.
    pub samples: u32,
    /// First triangle of the receiver.
    pub first_triangle: u32,
}

/// All that an executor needs to build and run `receiver_bake`.
pub const RECEIVER_BAKE: PassInfo = PassInfo {
    name: "receiver_bake",
    wgsl: &[
        VIEW_WGSL,
        TRIANGLE_WGSL,
        LIGHT_VIEWS_WGSL,
        EMISSION_WGSL,
        IRRADIANCE_WGSL,
        include_str!("../../../../shaders/receiver_bake.wgsl"),
    ],
    params_struct: "ReceiverBake",
    params_bytes: size_of::<ReceiverBake>() as u32,
    bindings: &[
        binding("triangles", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("corner_uvs", BindingKind::Read),
        binding("caustic", BindingKind::Read),
        binding("uv_visibility", VISIBILITY_TEXTURE),
        binding("direct_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("landing_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("reflected_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("entry_visibility", VISIBILITY_TEXTURE),
        binding("irradiance", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let params: ReceiverBake = args.params();
            receiver_bake(
                &params,
                &Lookup::bound(args, params.light),
                args.read("corner_uvs"),
                &args.texture("uv_visibility"),
                args.write("irradiance"),
            );
        },
    },
};

/// Weights of the second and third corner at `uv`.
fn uv_weights(params: &ReceiverBake, corner_uvs: &[Vec2], triangle: u32, uv: Vec2) -> Vec2 {
    let first = 3 * (triangle - params.first_triangle) as usize;
    let a = corner_uvs[first];
    let e1 = corner_uvs[first + 1] - a;
    let e2 = corner_uvs[first + 2] - a;
    let d = uv - a;
    let area = e1.x * e2.y - e1.y * e2.x;
    Vec2::new(d.x * e2.y - d.y * e2.x, e1.x * d.y - e1.y * d.x) / area
}

/// CPU mirror; `irradiance` holds the direct layer, the refracted one and, if there is any reflected light, its own.
pub fn receiver_bake(
    params: &ReceiverBake,
    lookup: &Lookup<'_>,
    corner_uvs: &[Vec2],
    uv_visibility: &TextureView<'_>,
    irradiance: &mut [Vec4],
) {
    let width = params.size.x as usize;
    let texels = width * params.size.y as usize;
    let (direct_layer, others) = irradiance.split_at_mut(texels);
    let (refracted_layer, reflected_layer) = others.split_at_mut(texels);
    // Without reflected light there is no such layer.
    let mut reflected_rows: Vec<&mut [Vec4]> = reflected_layer.chunks_mut(width).collect();
    reflected_rows.resize_with(params.size.y as usize, Default::default);
    let rows = direct_layer
        .par_chunks_mut(width)
        .zip(refracted_layer.par_chunks_mut(width))
        .zip(reflected_rows.into_par_iter());
    rows.enumerate().for_each(|(y, ((direct_row, refracted_row), reflected_row))| {
        for x in 0..width {
            let id = UVec2::new(x as u32, y as u32);
            let grid = (params.size * params.samples).as_vec2();
            let mut direct = Vec3::ZERO;
            let mut refracted = Vec3::ZERO;
            let mut reflected = Vec3::ZERO;
            let mut covered = 0.0;
            for j in 0..params.samples {
                for i in 0..params.samples {
                    let sample = id * params.samples + UVec2::new(i, j);
                    let visible = uv_visibility.load_uint(sample.x, sample.y);
                    if visible == NOTHING {
                        continue;
                    }
                    let t = &lookup.triangles[visible as usize - 1];
                    let e1 = t.p1 - t.p0;
                    let e2 = t.p2 - t.p0;
                    let weights =
                        uv_weights(params, corner_uvs, visible - 1, (sample.as_vec2() + 0.5) / grid);
                    let point = t.p0 + weights.x * e1 + weights.y * e2;
                    let light = lookup.irradiance_at(point, e1.cross(e2).normalize(), visible);
                    direct += light.direct * params.light.xyz;
                    refracted += light.refracted;
                    reflected += light.reflected;
                    covered += 1.0;
                }
            }
            if covered > 0.0 {
                direct_row[x] += (direct / covered).extend(0.0);
                refracted_row[x] += (refracted / covered).extend(0.0);
                if params.light.reflected_faces > 0 {
                    reflected_row[x] += (reflected / covered).extend(0.0);
                }
            }
        }
    });
}
