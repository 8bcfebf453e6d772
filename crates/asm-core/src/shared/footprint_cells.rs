//! Host side of `shaders/shared/footprint_cells.wgsl`: the cells of the emission view or of a queue of patches.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use glam::UVec2;

use super::flux::WHOLE;
use super::footprint::*;
use super::photon_queue::{QUEUE_COUNT, QUEUE_HEAD, queue_groups};
use super::view::View;

/// Which cells a pass takes and what they are made of; mirrors `FootprintCells`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct FootprintCells {
    /// View fitted to the refractors.
    pub emission_view: u32,
    /// First view of where light may land.
    pub landing_view: u32,
    /// First of the map's, one per landing view.
    pub map_view: u32,
    /// Wavelengths of a cell.
    pub nodes: u32,
    /// Landings of a path.
    pub orders: u32,
    /// Row length of `optics`; rows of `bands` have one more, the light itself.
    pub materials: u32,
    /// Row of this light, in `optics`.
    pub first_optics: u32,
    /// Of the whole spectrum.
    pub bins: u32,
    /// First word in `queues`; [`NO_QUEUE`]: cells lie between the texel centres of the emission view, and a tile of them is meant.
    pub queue: u32,
    /// First place of the queued patches' corners.
    pub first_place: u32,
    /// First word of what the cells are split into, in `queues`.
    pub splits: u32,
    /// First word of the queue that splits go to; [`NO_QUEUE`]: none are made, and what lands is added up instead.
    pub next: u32,
    /// Of that queue, patches.
    pub capacity: u32,
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// First cell of the tile: x, y << 16.
    pub tile: u32,
    /// From a cell of the tile to the next one in x or y, cells of the emission view.
    pub tile_stride: u32,
}

/// Workgroups of a dispatch with `share` of them for each [`CELLS_PER_GROUP`] cells, corners or patches, which are dealt out alike, as many
/// neighbours in turn: some drivers cut the row of workgroups into one piece for each of their threads, and pieces of a row have the same
/// work.
pub(crate) fn cell_groups(cells: u32, share: u32, max_groups: u32) -> [u32; 3] {
    queue_groups(cells.div_ceil(CELLS_PER_GROUP) * share, 1, 1, max_groups)
}

/// A cell and its first corner.
#[derive(Clone, Copy, Debug)]
pub struct Emitted {
    /// With its part of the spectrum.
    pub cell: FootprintCell,
    /// Of the cell's first corner.
    pub place: u32,
    /// From its upper to its lower corners, places.
    pub row: u32,
    /// Corners before the first in x and y, in one row of places with it.
    pub before: UVec2,
    /// Corners behind the last.
    pub behind: UVec2,
}

/// How paths of a cell go apart: sums of these.
pub const TOGETHER: u32 = 0;
/// Corners to the left and to the right.
pub const APART_IN_X: u32 = 1;
/// Above and below.
pub const APART_IN_Y: u32 = 2;
/// Wavelengths.
pub const BANDS_APART: u32 = 4;

/// Word of the queues behind the counts of what was done: light that lands of the emission view's cells, in parts of a whole cell's flux.
pub const LANDED: usize = WORK_WORDS;

/// Bits of a part, see [`super::flux`], below those that are counted there.
pub const LANDED_SHIFT: u32 = 20;

/// Words of the queues before the first.
pub const QUEUES_HEAD: usize = LANDED + 1;

/// Stakes of a split, parts of a whole cell's flux, below this one are never worth it.
pub const NEGLIGIBLE: u32 = WHOLE / 512;

/// Nor are those below so many parts, over the texels across the emission view, for each one that lands: with 128 an 87381st of all
/// light that does. There are as many more cells along an edge as there are texels across.
const NEGLIGIBLE_OF_LANDED: u32 = 1536;

/// Half octaves of a stake, from [`NEGLIGIBLE`] on.
fn class_of(stake: u32) -> u32 {
    let stake = stake.max(NEGLIGIBLE);
    let bit = stake.ilog2();
    (2 * (bit - NEGLIGIBLE.ilog2()) + (stake >> (bit - 1) & 1)).min(CLASSES as u32 / 4 - 1)
}

/// Class of urgency of a split; of equal stakes every fourth cell of a tile comes before the others, so that queues are filled evenly. Along a
/// side that has not been halved the cells of a tile lie apart.
pub fn urgency(stake: u32, cell: &FootprintCell, tile_stride: u32) -> u32 {
    let apart = UVec2::select(cell.level.cmpeq(UVec2::ZERO), UVec2::splat(tile_stride), UVec2::ONE);
    let at = cell.at / apart;
    4 * class_of(stake) + 2 * ((at.x ^ at.y) & 1) + (at.y & 1)
}

/// Word of a cell's split: sums of `APART_*` that it is split along, and its class of urgency from this bit on; 0 is not to be split.
pub const SPLIT_CLASS: u32 = 8;

/// What passes over cells read.
#[derive(Clone, Copy)]
pub struct Cells<'a> {
    /// Which.
    pub params: FootprintCells,
    /// All views.
    pub views: &'a [View],
    /// All queues, and what cells are split into.
    pub queues: &'a [AtomicU32],
}

impl Cells<'_> {
    /// The first cell of the tile, and how many it has in x and y.
    fn tile(&self) -> (UVec2, UVec2) {
        let params = &self.params;
        let first = UVec2::new(params.tile & 0xffff, params.tile >> 16);
        let cells = self.views[params.emission_view as usize].size - 1;
        (first, (cells - first + params.tile_stride - 1) / params.tile_stride)
    }

    /// Cells of the tile, or all that the patches of the queue may have.
    pub fn count(&self) -> u32 {
        if self.params.queue == NO_QUEUE {
            return self.tile().1.element_product();
        }
        PATCH_CELLS * self.load(self.params.queue + QUEUE_COUNT as u32)
    }

    /// A word of the queues.
    pub fn load(&self, word: u32) -> u32 {
        self.queues[word as usize].load(Ordering::Relaxed)
    }

    /// Cell `i` of those that [`Cells::count`] counts; patches may have fewer.
    pub fn emitted(&self, i: u32) -> Option<Emitted> {
        let params = &self.params;
        if params.queue == NO_QUEUE {
            let size = self.views[params.emission_view as usize].size;
            let (first, cells) = self.tile();
            let at = first + params.tile_stride * UVec2::new(i % cells.x, i / cells.x);
            let cell = FootprintCell { at, level: UVec2::ZERO, first: 0, bins: params.bins };
            let place = at.y * size.x + at.x;
            return Some(Emitted { cell, place, row: size.x, before: at, behind: size - 2 - at });
        }
        let (slot, child) = (i / PATCH_CELLS, i % PATCH_CELLS);
        let patch = queued_patch(self.queues, params.queue, slot);
        if child >= patch.cells() {
            return None;
        }
        let inner = UVec2::new(child % patch.parts.x, child / patch.parts.x);
        Some(Emitted {
            cell: patch.cell(child),
            place: params.first_place + PATCH_PLACES * slot + inner.x + PATCH_ROW * inner.y,
            row: PATCH_ROW,
            before: inner,
            behind: patch.parts - 1 - inner,
        })
    }

    /// What cell `i` is split along in the next round, sums of `APART_*`: those of the most urgent classes that are worth it and that the
    /// queue holds together are. Which those are hangs on sums alone, not on their order.
    pub fn split(&self, i: u32) -> u32 {
        if self.params.next == NO_QUEUE {
            return TOGETHER;
        }
        let word = self.load(self.params.splits + i);
        let along = word & (APART_IN_X | APART_IN_Y | BANDS_APART);
        if along != TOGETHER && word >> SPLIT_CLASS >= self.least_class() { along } else { TOGETHER }
    }

    fn least_class(&self) -> u32 {
        let texels = self.views[self.params.emission_view as usize].size.x;
        let negligible = (NEGLIGIBLE_OF_LANDED / texels).max(1);
        let least = 4 * class_of(self.load(LANDED as u32).saturating_mul(negligible));
        let mut patches = 0;
        for class in (least..CLASSES as u32).rev() {
            patches += self.load(self.params.next + QUEUE_HEAD as u32 + class);
            if patches > self.params.capacity {
                return class + 1;
            }
        }
        least
    }
}

/// A patch of a queue.
pub fn queued_patch(queues: &[AtomicU32], queue: u32, slot: u32) -> Patch {
    let word = queue as usize + PATCHES_HEAD + PATCH_WORDS * slot as usize;
    Patch::from_words(std::array::from_fn(|i| queues[word + i].load(Ordering::Relaxed)))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use bytemuck::Zeroable;

    use super::*;

    const STRIDE: u32 = 4;

    fn cells_of_tile(tile: UVec2, size: UVec2) -> Vec<FootprintCell> {
        let view = View { size, ..View::zeroed() };
        let params = FootprintCells {
            queue: NO_QUEUE,
            bins: SPECTRUM_BINS,
            tile: tile.x | tile.y << 16,
            tile_stride: STRIDE,
            ..FootprintCells::zeroed()
        };
        let cells = Cells { params, views: &[view], queues: &[] };
        (0..cells.count()).filter_map(|i| cells.emitted(i)).map(|emitted| emitted.cell).collect()
    }

    #[test]
    fn tiles_have_every_cell_once() {
        for size in [UVec2::splat(128), UVec2::new(66, 35)] {
            let tiles = (0..STRIDE * STRIDE).map(|tile| UVec2::new(tile % STRIDE, tile / STRIDE));
            let mut all: Vec<_> = tiles.flat_map(|tile| cells_of_tile(tile, size)).collect();
            all.sort_by_key(|cell| (cell.at.y, cell.at.x));
            let cells = size - 1;
            let wanted = (0..cells.x * cells.y).map(|i| UVec2::new(i % cells.x, i / cells.x));
            assert!(all.iter().map(|cell| cell.at).eq(wanted), "{size}");
        }
    }

    #[test]
    fn of_equal_stakes_every_fourth_cell_of_a_tile_comes_first() {
        let of_tile = cells_of_tile(UVec2::new(3, 1), UVec2::splat(128));
        for parts in [UVec2::ONE, UVec2::new(2, 1), UVec2::new(1, 2), UVec2::splat(2)] {
            let patches = of_tile.iter().map(|cell| Patch { cell: *cell, parts, parent: 0 });
            let mut classes = BTreeMap::<u32, u32>::new();
            for cell in patches.flat_map(|patch| (0..patch.cells()).map(move |child| patch.cell(child))) {
                *classes.entry(urgency(WHOLE, &cell, STRIDE)).or_default() += 1;
            }
            let cells = of_tile.len() as u32 * parts.element_product();
            assert_eq!(classes.len(), 4, "{parts}");
            assert!(classes.values().all(|count| count.abs_diff(cells / 4) < cells / 16), "{classes:?}");
        }
    }
}
