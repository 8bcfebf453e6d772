// The cells of the emission view or of a queue of patches. Host side: asm-core's `shared/footprint_cells.rs`.
//
// Expects the globals `params.cells`, `views` and `queues`.

// Which cells a pass takes and what they are made of.
struct FootprintCells {
    emission_view: u32,
    landing_view: u32,
    map_view: u32,     // first of the map's, one per landing view
    nodes: u32,
    orders: u32,
    materials: u32,    // row length of `optics`; rows of `bands` have one more, the light itself
    first_optics: u32, // row of this light
    bins: u32,         // of the whole spectrum
    queue: u32,        // first word in `queues`; NO_QUEUE: cells lie between the texel centres of the emission view, and a tile of them is meant
    first_place: u32,  // of the queued patches
    splits: u32,       // first word of what the cells are split into, in `queues`
    next: u32,         // first word of the queue that splits go to; NO_QUEUE: none are made, and what lands is added up instead
    capacity: u32,     // of that queue, patches
    max_groups: u32,   // of the device, per dimension
    tile: u32,         // its first cell: x, y << 16
    tile_stride: u32,  // from a cell of the tile to the next one in x or y, cells of the emission view
}

// Workgroups for each CELLS cells of the tile or patches of the queue.
fn group_share() -> u32 {
    return select(patch_share(params.cells.nodes, params.cells.orders), params.cells.orders, params.cells.queue == NO_QUEUE);
}

// The order of landings that a workgroup takes; there may be none of that number.
fn taken_order(group: vec3<u32>) -> u32 {
    let part = queue_row(group, params.cells.max_groups) % group_share();
    return select(part / PATCH_CELLS, part, params.cells.queue == NO_QUEUE);
}

// The cell that an invocation takes; there may be none of that number.
fn taken_cell(group: vec3<u32>, local: u32) -> u32 {
    let row = queue_row(group, params.cells.max_groups);
    let first = CELLS * (row / group_share()) + local;
    return select(PATCH_CELLS * first + row % group_share() % PATCH_CELLS, first, params.cells.queue == NO_QUEUE);
}

// A cell and its first corner.
struct Emitted {
    exists: bool,
    cell: FootprintCell,
    place: u32,        // of the cell's first corner
    row: u32,          // from its upper to its lower corners, places
    before: vec2<u32>, // corners before the first in x and y, in one row of places with it
    behind: vec2<u32>, // corners behind the last
}

// How paths of a cell go apart: sums of these.
const TOGETHER: u32 = 0u;
const APART_IN_X: u32 = 1u;  // corners to the left and to the right
const APART_IN_Y: u32 = 2u;  // above and below
const BANDS_APART: u32 = 4u; // wavelengths

// Word of the queues behind the counts of what was done: light that lands of the emission view's cells, in parts of a whole cell's flux.
const LANDED: u32 = 2u * WORK_COUNTS;

// Bits of a part, see flux.wgsl, below those that are counted there.
const LANDED_SHIFT: u32 = 20u;

// Stakes of a split, parts of a whole cell's flux, below this one are never worth it.
const NEGLIGIBLE: u32 = 0x400000u; // WHOLE / 512

// Nor are those below so many parts, over the texels across the emission view, for each one that lands: with 128 an 87381st of all light
// that does. There are as many more cells along an edge as there are texels across.
const NEGLIGIBLE_OF_LANDED: u32 = 1536u;

// Half octaves of a stake, from NEGLIGIBLE on.
fn class_of(stake: u32) -> u32 {
    let bit = firstLeadingBit(max(stake, NEGLIGIBLE));
    return min(2u * (bit - 22u) + ((max(stake, NEGLIGIBLE) >> (bit - 1u)) & 1u), CLASSES / 4u - 1u);
}

// Class of urgency of a split; of equal stakes every fourth cell of a tile comes before the others, so that queues are filled evenly. Along a
// side that has not been halved the cells of a tile lie apart.
fn urgency(stake: u32, cell: FootprintCell) -> u32 {
    let at = cell.at / select(vec2<u32>(1u), vec2<u32>(params.cells.tile_stride), cell.level == vec2<u32>(0u));
    return 4u * class_of(stake) + 2u * ((at.x ^ at.y) & 1u) + (at.y & 1u);
}

// Word of a cell's split: sums of APART_* that it is split along, and its class of urgency from this bit on; 0 is not to be split.
const SPLIT_CLASS: u32 = 8u;

fn queued_patch(slot: u32) -> Patch {
    let word = params.cells.queue + PATCHES_HEAD + PATCH_WORDS * slot;
    return patch_from_words(vec3<u32>(atomicLoad(&queues[word]), atomicLoad(&queues[word + 1u]), atomicLoad(&queues[word + 2u])));
}

// Cell `i` of the tile, or of all that the patches of the queue may have.
fn emitted_cell(i: u32) -> Emitted {
    let cells = params.cells;
    let none = FootprintCell(vec2<u32>(0u), vec2<u32>(0u), 0u, cells.bins);
    if cells.queue == NO_QUEUE {
        let size = views[cells.emission_view].size;
        let first = vec2<u32>(cells.tile & 0xffffu, cells.tile >> 16u);
        let tile = (size - 1u - first + cells.tile_stride - 1u) / cells.tile_stride;
        let at = first + cells.tile_stride * vec2<u32>(i % tile.x, i / tile.x);
        let cell = FootprintCell(at, vec2<u32>(0u), 0u, cells.bins);
        return Emitted(at.y < size.y - 1u, cell, at.y * size.x + at.x, size.x, at, size - 2u - at);
    }
    let slot = i / PATCH_CELLS;
    let child = i % PATCH_CELLS;
    if slot < atomicLoad(&queues[cells.queue + QUEUE_COUNT]) {
        let patch_ = queued_patch(slot);
        if child < patch_.parts.x * patch_.parts.y {
            let inner = vec2<u32>(child % patch_.parts.x, child / patch_.parts.x);
            let place = cells.first_place + PATCH_PLACES * slot + inner.x + PATCH_ROW * inner.y;
            return Emitted(true, patch_cell(patch_, inner), place, PATCH_ROW, inner, patch_.parts - 1u - inner);
        }
    }
    return Emitted(false, none, 0u, 0u, vec2<u32>(0u), vec2<u32>(0u));
}

// No class below this one goes into the next queue: all from it on are worth it and fit together.
fn least_class() -> u32 {
    let negligible = max(NEGLIGIBLE_OF_LANDED / views[params.cells.emission_view].size.x, 1u);
    let least = 4u * class_of(min(atomicLoad(&queues[LANDED]), 0xffffffffu / negligible) * negligible);
    var patches = 0u;
    for (var end = CLASSES; end > least; end--) {
        patches += atomicLoad(&queues[params.cells.next + QUEUE_HEAD + end - 1u]);
        if patches > params.cells.capacity {
            return end;
        }
    }
    return least;
}

// What cell `i` is split along in the next round, sums of APART_*: those of the most urgent classes that are worth it and that the queue
// holds together are. Which those are hangs on sums alone, not on their order.
fn split_of(i: u32) -> u32 {
    if params.cells.next == NO_QUEUE {
        return TOGETHER;
    }
    let word = atomicLoad(&queues[params.cells.splits + i]);
    let along = word & (APART_IN_X | APART_IN_Y | BANDS_APART);
    if along != TOGETHER && (word >> SPLIT_CLASS) >= least_class() {
        return along;
    }
    return TOGETHER;
}
