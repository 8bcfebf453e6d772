//! Host side of `shaders/shared/photon_queue.wgsl`: queues of cells of an emission view's mip chain.
//!
//! A queue is [`QUEUE_HEAD`] words and then cells, x | y << 16. Its head is also the arguments of an indirect dispatch over
//! it. No cell is queued twice, so a queue as long as its level cannot overflow.

use glam::UVec2;

/// Number of cells.
pub const QUEUE_COUNT: usize = 0;
/// Workgroups in x, y and z of a dispatch over the queue.
pub const QUEUE_GROUPS: usize = 1;
/// Cells of the level before that showed no glass.
pub const QUEUE_DROPPED: usize = 4;
/// Words before the cells.
pub const QUEUE_HEAD: usize = 8;
/// Texels along a side of the finest cells: a tile holds a workgroup of photons.
pub const TILE_TEXELS: u32 = 8;

/// A cell of a queue.
pub fn queue_cell(word: u32) -> UVec2 {
    UVec2::new(word & 0xffff, word >> 16)
}

/// Workgroups of a dispatch over `cells` cells, `per_group` each: rows are as long as the device allows before there is a
/// second one.
pub(crate) fn queue_groups(cells: u32, per_group: u32, depth: u32, max_groups: u32) -> [u32; 3] {
    let groups = cells.div_ceil(per_group);
    [groups.min(max_groups), groups.div_ceil(max_groups), depth]
}
