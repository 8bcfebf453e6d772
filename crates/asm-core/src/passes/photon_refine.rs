//! One level of adaptive photon emission (Wyman & Nichols 2009). Twin of `shaders/photon_refine.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::UVec2;
use rayon::prelude::*;

use super::{PHOTON_QUEUE_WGSL, VISIBILITY_TEXTURE, binding};
use crate::shared::photon_queue::*;

/// Uniform of the pass; mirrors `PhotonRefine` in `shaders/photon_refine.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct PhotonRefine {
    /// Cells of this level.
    pub cells: UVec2,
    /// 1: every cell is looked at, 0: those of `queue`.
    pub whole_level: u32,
    /// 1: cells are tiles.
    pub finest: u32,
    /// z of the dispatch over `next`.
    pub next_depth: u32,
    /// Cells that its workgroups take.
    pub next_per_group: u32,
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// Padding.
    pub reserved0: u32,
}

/// Cells that a workgroup takes.
pub const REFINE_CELLS_PER_GROUP: u32 = 64;

/// All that an executor needs to build and run `photon_refine`.
pub const PHOTON_REFINE: PassInfo = PassInfo {
    name: "photon_refine",
    wgsl: &[PHOTON_QUEUE_WGSL, include_str!("../../../../shaders/photon_refine.wgsl")],
    params_struct: "PhotonRefine",
    params_bytes: size_of::<PhotonRefine>() as u32,
    bindings: &[
        binding("coverage", VISIBILITY_TEXTURE),
        binding("queue", BindingKind::ReadAtomic),
        binding("next", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [REFINE_CELLS_PER_GROUP, 1, 1],
        mirror: |args| {
            photon_refine(
                &args.params(),
                &args.texture("coverage"),
                args.atomics("queue"),
                args.atomics("next"),
            );
        },
    },
};

/// CPU mirror. The order within `next` depends on threads, as it does on GPUs; nothing that follows does.
pub fn photon_refine(
    params: &PhotonRefine,
    coverage: &TextureView<'_>,
    queue: &[AtomicU32],
    next: &[AtomicU32],
) {
    let load = |word: usize| queue[word].load(Ordering::Relaxed);
    let cells = if params.whole_level == 1 { params.cells.x * params.cells.y } else { load(QUEUE_COUNT) };
    (0..cells.div_ceil(REFINE_CELLS_PER_GROUP)).into_par_iter().for_each(|group| {
        let mut appended = Vec::with_capacity(4 * REFINE_CELLS_PER_GROUP as usize);
        let mut dropped = 0;
        let positions = group * REFINE_CELLS_PER_GROUP..cells.min((group + 1) * REFINE_CELLS_PER_GROUP);
        for i in positions {
            let cell = if params.whole_level == 1 {
                UVec2::new(i % params.cells.x, i / params.cells.x)
            } else {
                queue_cell(load(QUEUE_HEAD + i as usize))
            };
            if coverage.load_uint(cell.x, cell.y) == 0 {
                dropped += 1;
            } else if params.finest == 1 {
                appended.push(cell);
            } else {
                appended.extend((0..4).map(|child| 2 * cell + UVec2::new(child & 1, child >> 1)));
            }
        }
        let count = appended.len() as u32;
        let first = next[QUEUE_COUNT].fetch_add(count, Ordering::Relaxed);
        next[QUEUE_DROPPED].fetch_add(dropped, Ordering::Relaxed);
        if count != 0 {
            let groups =
                queue_groups(first + count, params.next_per_group, params.next_depth, params.max_groups);
            for (i, groups) in groups.into_iter().enumerate() {
                next[QUEUE_GROUPS + i].fetch_max(groups, Ordering::Relaxed);
            }
        }
        for (slot, cell) in next[QUEUE_HEAD + first as usize..].iter().zip(appended) {
            slot.store(cell.x | cell.y << 16, Ordering::Relaxed);
        }
    });
}
