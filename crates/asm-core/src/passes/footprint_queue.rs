//! The most urgent splits of cells, as many as the next queue holds, become its patches. Twin of `shaders/footprint_queue.wgsl`;
//! terms in `shared/footprint.rs`.

use std::sync::atomic::Ordering;

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::UVec2;
use rayon::prelude::*;

use super::{FOOTPRINT_CELLS_WGSL, FOOTPRINT_WGSL, PHOTON_QUEUE_WGSL, VIEW_WGSL, binding};
use crate::shared::footprint::*;
use crate::shared::footprint_cells::*;
use crate::shared::photon_queue::{QUEUE_COUNT, QUEUE_GROUPS};

/// Uniform of the pass; mirrors `FootprintQueue` in `shaders/footprint_queue.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct FootprintQueue {
    /// The cells.
    pub cells: FootprintCells,
}

/// All that an executor needs to build and run `footprint_queue`.
pub const FOOTPRINT_QUEUE: PassInfo = PassInfo {
    name: "footprint_queue",
    wgsl: &[
        VIEW_WGSL,
        PHOTON_QUEUE_WGSL,
        FOOTPRINT_WGSL,
        FOOTPRINT_CELLS_WGSL,
        include_str!("../../../../shaders/footprint_queue.wgsl"),
    ],
    params_struct: "FootprintQueue",
    params_bytes: size_of::<FootprintQueue>() as u32,
    bindings: &[binding("views", BindingKind::Read), binding("queues", BindingKind::Atomic)],
    kind: PassKind::Compute {
        workgroup: [CELLS_PER_GROUP, 1, 1],
        mirror: |args| {
            let params: FootprintQueue = args.params();
            let (views, queues) = (args.read("views"), args.atomics("queues"));
            footprint_queue(&Cells { params: params.cells, views, queues });
        },
    },
};

/// CPU mirror: the cells of the emission view or of the queue.
pub fn footprint_queue(cells: &Cells<'_>) {
    let params = &cells.params;
    let queue = &cells.queues[params.next as usize..];
    (0..cells.count()).into_par_iter().with_min_len(CELLS_PER_GROUP as usize).for_each(|i| {
        let Some(Emitted { cell, place, .. }) = cells.emitted(i) else { return };
        let along = cells.split(i);
        if along == TOGETHER {
            return;
        }
        let halves = 1 + u32::from(along == BANDS_APART);
        let slot = queue[QUEUE_COUNT].fetch_add(halves, Ordering::Relaxed);
        let share = patch_share(params.nodes, params.orders);
        let groups = cell_groups(slot + halves, share, params.max_groups);
        for (i, groups) in groups.into_iter().enumerate() {
            queue[QUEUE_GROUPS + i].fetch_max(groups, Ordering::Relaxed);
        }
        let parts =
            UVec2::new(1 + u32::from(along & APART_IN_X != 0), 1 + u32::from(along & APART_IN_Y != 0));
        let bins = cell.bins / halves;
        for half in 0..halves {
            let cell = FootprintCell { first: cell.first + half * bins, bins, ..cell };
            let patch = Patch { cell, parts, parent: place };
            let word = PATCHES_HEAD + PATCH_WORDS * (slot + half) as usize;
            for (word, value) in queue[word..].iter().zip(patch.words()) {
                word.store(value, Ordering::Relaxed);
            }
        }
    });
}
