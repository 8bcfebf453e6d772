// Queues of cells of an emission view's mip chain. Host side: asm-core's `shared/photon_queue.rs`.
//
// tile      8 x 8 texels of the emission view: a workgroup of photons
// cell      of one level; level 0 has tiles, a cell of level m covers 2^m x 2^m of them
// queue     QUEUE_HEAD words, then cells as x | y << 16; the head is also the arguments of an indirect dispatch over the
//           queue. No cell is queued twice: a queue as long as its level holds them all.

const QUEUE_COUNT: u32 = 0u;    // number of cells
const QUEUE_GROUPS: u32 = 1u;   // workgroups in x, y and z
const QUEUE_DROPPED: u32 = 4u;  // cells of the level before that showed no glass
const QUEUE_HEAD: u32 = 8u;

// Which workgroup of a dispatch over a queue this is; rows are as long as the device allows before there is a second one.
fn queue_row(group: vec3<u32>, max_groups: u32) -> u32 {
    return group.y * max_groups + group.x;
}

fn queue_cell(word: u32) -> vec2<u32> {
    return vec2<u32>(word & 0xffffu, word >> 16u);
}
