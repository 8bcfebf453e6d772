// The most urgent splits of cells, as many as the next queue holds, become its patches. Host side: `passes/footprint_queue.rs`; terms in
// `shared/footprint.rs`.

struct FootprintQueue {
    cells: FootprintCells,
}

@group(0) @binding(0) var<uniform> params: FootprintQueue;
@group(0) @binding(1) var<storage, read> views: array<View>;
@group(0) @binding(2) var<storage, read_write> queues: array<atomic<u32>>;

// Room for so many patches in the next queue.
fn claim(patches: u32) -> u32 {
    let next = params.cells.next;
    let slot = atomicAdd(&queues[next + QUEUE_COUNT], patches);
    let groups = ((slot + patches + CELLS - 1u) / CELLS) * patch_share(params.cells.nodes, params.cells.orders);
    let most = params.cells.max_groups;
    atomicMax(&queues[next + QUEUE_GROUPS], min(groups, most));
    atomicMax(&queues[next + QUEUE_GROUPS + 1u], (groups + most - 1u) / most);
    atomicMax(&queues[next + QUEUE_GROUPS + 2u], 1u);
    return slot;
}

@compute @workgroup_size(64, 1, 1)
fn footprint_queue(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    if taken_order(group) > 0u {
        return;
    }
    let i = taken_cell(group, local);
    let emitted = emitted_cell(i);
    if !emitted.exists {
        return;
    }
    let along = split_of(i);
    if along == TOGETHER {
        return;
    }
    let halves = select(1u, 2u, along == BANDS_APART);
    let slot = claim(halves);
    let parts = 1u + vec2<u32>(along & 1u, (along >> 1u) & 1u);
    let cell = emitted.cell;
    let bins = cell.bins / halves;
    for (var half = 0u; half < halves; half++) {
        let own = FootprintCell(cell.at, cell.level, cell.first + half * bins, bins);
        let words = patch_words(Patch(own, parts, emitted.place));
        let word = params.cells.next + PATCHES_HEAD + PATCH_WORDS * (slot + half);
        atomicStore(&queues[word], words.x);
        atomicStore(&queues[word + 1u], words.y);
        atomicStore(&queues[word + 2u], words.z);
    }
}
