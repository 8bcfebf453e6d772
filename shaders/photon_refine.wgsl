// One level of adaptive photon emission (Wyman & Nichols 2009): cells that show no glass are dropped, the others hand on
// their four children, or at the finest level themselves: tiles of photons. Host side: `passes/photon_refine.rs`.

struct PhotonRefine {
    cells: vec2<u32>,   // of this level
    whole_level: u32,   // 1: every cell is looked at, 0: those of `queue`
    finest: u32,        // 1: cells are tiles
    next_depth: u32,    // z of the dispatch over `next`
    next_per_group: u32, // cells that its workgroups take
    max_groups: u32,    // of the device, per dimension
    reserved0: u32,
}

const CELLS: u32 = 64u; // per workgroup

@group(0) @binding(0) var<uniform> params: PhotonRefine;
@group(0) @binding(1) var coverage: texture_2d<u32>; // this level
@group(0) @binding(2) var<storage, read> queue: array<u32>;
@group(0) @binding(3) var<storage, read_write> next: array<atomic<u32>>;

var<workgroup> appended: atomic<u32>;
var<workgroup> dropped: atomic<u32>;
var<workgroup> first: u32;

@compute @workgroup_size(64, 1, 1)
fn photon_refine(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let i = CELLS * queue_row(group, params.max_groups) + local;
    var exists = i < params.cells.x * params.cells.y;
    var cell = vec2<u32>(i % params.cells.x, i / params.cells.x);
    if params.whole_level == 0u {
        exists = i < queue[QUEUE_COUNT];
        cell = vec2<u32>(0u);
        if exists {
            cell = queue_cell(queue[QUEUE_HEAD + i]);
        }
    }
    var children = 0u;
    var slot = 0u;
    if exists {
        if textureLoad(coverage, vec2<i32>(cell), 0).r == 0u {
            atomicAdd(&dropped, 1u);
        } else {
            children = select(4u, 1u, params.finest == 1u);
            slot = atomicAdd(&appended, children);
        }
    }
    workgroupBarrier();
    if local == 0u {
        let count = atomicLoad(&appended);
        first = atomicAdd(&next[QUEUE_COUNT], count);
        atomicAdd(&next[QUEUE_DROPPED], atomicLoad(&dropped));
        if count != 0u {
            let groups = (first + count + params.next_per_group - 1u) / params.next_per_group;
            atomicMax(&next[QUEUE_GROUPS], min(groups, params.max_groups));
            atomicMax(&next[QUEUE_GROUPS + 1u], (groups + params.max_groups - 1u) / params.max_groups);
            atomicMax(&next[QUEUE_GROUPS + 2u], params.next_depth);
        }
    }
    let start = workgroupUniformLoad(&first);
    for (var child = 0u; child < children; child++) {
        var at = cell;
        if params.finest == 0u {
            at = 2u * cell + vec2<u32>(child & 1u, child >> 1u);
        }
        atomicStore(&next[QUEUE_HEAD + start + slot + child], at.x | (at.y << 16u));
    }
}
