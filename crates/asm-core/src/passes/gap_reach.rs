//! Which lit texels of a map have a gap within twice the radius. Twin of `shaders/gap_reach.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{IVec2, UVec2};
use rayon::prelude::*;

use super::{GAP_WGSL, binding};
use crate::shared::gap::{MASK_BESIDE, MASK_GAP, MASK_LIT, texel_at};

/// Uniform of the pass; mirrors `GapReach` in `shaders/gap_reach.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct GapReach {
    /// Of one face of the map.
    pub size: UVec2,
    /// Of all faces together.
    pub rows: u32,
    /// Number of offsets.
    pub offsets: u32,
}

/// All that an executor needs to build and run `gap_reach`.
pub const GAP_REACH: PassInfo = PassInfo {
    name: "gap_reach",
    wgsl: &[GAP_WGSL, include_str!("../../../../shaders/gap_reach.wgsl")],
    params_struct: "GapReach",
    params_bytes: size_of::<GapReach>() as u32,
    bindings: &[
        binding("offsets", BindingKind::Read),
        binding("gaps", BindingKind::Read),
        binding("mask", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            gap_reach(&args.params(), args.read("offsets"), args.read("gaps"), args.write("mask"));
        },
    },
};

/// CPU mirror.
pub fn gap_reach(params: &GapReach, offsets: &[IVec2], gaps: &[u32], mask: &mut [u32]) {
    let width = params.size.x as usize;
    mask.par_chunks_mut(width).take(params.rows as usize).enumerate().for_each(|(y, row)| {
        for (x, kind) in row.iter_mut().enumerate() {
            let texel = UVec2::new(x as u32, y as u32);
            let at_gap = |d: IVec2| texel_at(params.size, texel, d).is_some_and(|at| gaps[at] == MASK_GAP);
            let is_gap = |&d: &IVec2| at_gap(d) || at_gap(2 * d);
            *kind = match gaps[y * width + x] {
                MASK_LIT if offsets.iter().any(is_gap) => MASK_BESIDE,
                kind => kind,
            };
        }
    });
}
