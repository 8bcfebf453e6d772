//! Which texels of a map hold light, and which dark ones lie between them. Twin of `shaders/gap_mask.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{IVec2, UVec2, Vec2};
use rayon::prelude::*;

use super::{GAP_WGSL, TRIANGLE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE_ARRAY, binding};
use crate::shared::gap::{GAP_DISC, MASK_DARK, MASK_GAP, MASK_LIT, texel_at};
use crate::shared::triangle::{NOTHING, visible_in_layer};
use crate::shared::view::View;

/// Uniform of the pass; mirrors `GapMask` in `shaders/gap_mask.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct GapMask {
    /// Of one face of the map.
    pub size: UVec2,
    /// Of all faces together.
    pub rows: u32,
    /// `GAP_*`: only [`GAP_DISC`] looks for gaps.
    pub rule: u32,
    /// Lit texels that face each other across a gap.
    pub threshold: u32,
    /// Number of offsets.
    pub offsets: u32,
    /// First of the views that show surfaces.
    pub landing_view: u32,
    /// First of the map's.
    pub map_view: u32,
}

/// All that an executor needs to build and run `gap_mask`.
pub const GAP_MASK: PassInfo = PassInfo {
    name: "gap_mask",
    wgsl: &[VIEW_WGSL, TRIANGLE_WGSL, GAP_WGSL, include_str!("../../../../shaders/gap_mask.wgsl")],
    params_struct: "GapMask",
    params_bytes: size_of::<GapMask>() as u32,
    bindings: &[
        binding("map", BindingKind::ReadAtomic),
        binding("offsets", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("landing_visibility", VISIBILITY_TEXTURE_ARRAY),
        binding("mask", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            gap_mask(
                &args.params(),
                args.atomics("map"),
                args.read("offsets"),
                args.read("views"),
                &args.texture("landing_visibility"),
                args.write("mask"),
            );
        },
    },
};

/// A texel of the map shows a surface.
fn shows_surface(
    params: &GapMask,
    views: &[View],
    landing_visibility: &TextureView<'_>,
    at: UVec2,
    face: u32,
) -> bool {
    let mut seen = at.as_ivec2();
    if params.map_view != params.landing_view {
        let landing = &views[(params.landing_view + face) as usize];
        let map = &views[(params.map_view + face) as usize];
        let offset = (map.slope(at.as_vec2() + 0.5) - landing.slope_center) / landing.texel_slope;
        seen = (0.5 * landing.size.as_vec2() + Vec2::new(offset.x, -offset.y)).floor().as_ivec2();
        if seen.cmplt(IVec2::ZERO).any() || seen.cmpge(landing.size.as_ivec2()).any() {
            return false;
        }
    }
    visible_in_layer(landing_visibility, seen.as_uvec2(), face) != NOTHING
}

/// CPU mirror.
pub fn gap_mask(
    params: &GapMask,
    map: &[AtomicU32],
    offsets: &[IVec2],
    views: &[View],
    landing_visibility: &TextureView<'_>,
    mask: &mut [u32],
) {
    let lit = |index: usize| map[6 * index..6 * index + 6].iter().any(|w| w.load(Ordering::Relaxed) != 0);
    let lit_at = |texel: UVec2, offset: IVec2| texel_at(params.size, texel, offset).is_some_and(lit);
    let is_gap = |texel: UVec2| {
        let at = UVec2::new(texel.x, texel.y % params.size.y);
        if !shows_surface(params, views, landing_visibility, at, texel.y / params.size.y) {
            return false;
        }
        let last = params.offsets as usize - 1;
        let mut facing = 0;
        for i in 0..params.offsets as usize / 2 {
            if facing >= params.threshold {
                break;
            }
            if lit_at(texel, offsets[i]) && lit_at(texel, offsets[last - i]) {
                facing += 2;
            }
        }
        facing >= params.threshold
    };
    let width = params.size.x as usize;
    mask.par_chunks_mut(width).take(params.rows as usize).enumerate().for_each(|(y, row)| {
        for (x, texel) in row.iter_mut().enumerate() {
            *texel = if lit(y * width + x) {
                MASK_LIT
            } else if params.rule == GAP_DISC && is_gap(UVec2::new(x as u32, y as u32)) {
                MASK_GAP
            } else {
                MASK_DARK
            };
        }
    });
}
