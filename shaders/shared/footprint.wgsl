// Footprints: where a cell of the emission view lands, as a function of place in the cell and of wavelength. Host side: asm-core's
// `shared/footprint.rs`.
//
// cell      the square between four neighbouring texel centres of the emission view, or a part of one after splits in x and y
// bin       part of the light's spectrum; bins are even in 1 / wavelength^2, along which light moves evenly
// range     the bins that a cell stands for: all, or a part after splits in two
// node      a wavelength of a range that paths are followed at: the lower end of a bin
// order     number of reflections inside the glass
// path      one corner of one cell at one node

// Where a path leads after so many reflections inside.
struct PathLanding {
    texel: vec2<f32>, // of the landing view
    length: f32,      // inside `medium`, working units
    part: u32,        // of the path's flux, as in flux.wgsl; what `medium` absorbs is not yet taken off
    way: u32,         // of all surfaces on the way; equal for paths that belong together
    end: u32,         // END_*
    place: u32,       // face of the landing view | material of what is lit << 8
    medium: u32,      // material
}

// What a path leaves on its way, as parts of its flux; they and its landings' parts add up to a whole.
struct PathEnds {
    end: u32,         // END_LANDED where it has landings, otherwise how all of it ends
    reflected: u32,
    absorbed: u32,
    kept_inside: u32,
}

// Share of the path's flux.
fn share_of_flux(landing: PathLanding) -> f32 {
    return f32(landing.part) / 2147483648.0;
}

// Light between the two lies between their landings.
fn go_together(a: PathLanding, b: PathLanding) -> bool {
    return a.way == b.way && a.end == b.end && ((a.place ^ b.place) & 0xffu) == 0u;
}

struct FootprintCell {
    at: vec2<u32>, // at its level
    level: vec2<u32>, // splits in x and y
    first: u32,    // bin
    bins: u32,     // of its range
}

// There is no queue of patches.
const NO_QUEUE: u32 = 0xffffffffu;

// Of a workgroup: cells, corners of the emission view, or patches of which it takes one cell or one corner each.
const CELLS: u32 = 64u;

// The node whose paths tell how cells bend, and how those of the others go.
fn middle_node(nodes: u32) -> u32 {
    return nodes / 2u;
}

// No range is split into shorter ones.
const LEAST_BINS: u32 = 4u;

// Bins of a spectrum that is split into wavelengths.
const SPECTRUM_BINS: u32 = 256u;

// Nodes lie at these sixteenths of a range: of all the spectrum about Chebyshev's points of 400 to 700 nm, where nearly all light is
// seen; of a part of it from end to end, so that what changes between two parts does not go unseen.
fn node_sixteenth(nodes: u32, node: u32, bins: u32) -> u32 {
    if nodes > 1u && bins < SPECTRUM_BINS {
        return (16u * node + node / 2u) / (nodes - 1u);
    }
    switch nodes {
        case 1u: { return 5u; }
        case 2u: { return 3u + 8u * node; }
        case 3u: { return 2u + 5u * node; }
        default: { return 2u + 3u * node + select(0u, 1u, node > 1u); }
    }
}

fn node_bin(nodes: u32, node: u32, cell: FootprintCell) -> u32 {
    return cell.first + cell.bins * node_sixteenth(nodes, node, cell.bins) / 16u;
}

// Bins of a range before those that node `node` stands for where nothing can be interpolated.
fn share_start(nodes: u32, node: u32, bins: u32) -> u32 {
    if node == 0u {
        return 0u;
    }
    if node >= nodes {
        return bins;
    }
    return (bins * (node_sixteenth(nodes, node - 1u, bins) + node_sixteenth(nodes, node, bins)) + 16u) / 32u;
}

fn lagrange_factor(nodes: u32, at: vec4<f32>, own: u32, other: u32, x: f32) -> f32 {
    let apart = select(1.0, at[own] - at[other], other < nodes);
    return select(1.0, (x - at[other]) / apart, other < nodes);
}

// Lagrange's weights at `x` of nodes that lie at `at`; 0 beyond the last. Without loops: some drivers end long ones.
fn node_weights(nodes: u32, at: vec4<f32>, x: f32) -> vec4<f32> {
    let first = lagrange_factor(nodes, at, 0u, 1u, x) * lagrange_factor(nodes, at, 0u, 2u, x) * lagrange_factor(nodes, at, 0u, 3u, x);
    let second = lagrange_factor(nodes, at, 1u, 0u, x) * lagrange_factor(nodes, at, 1u, 2u, x) * lagrange_factor(nodes, at, 1u, 3u, x);
    let third = lagrange_factor(nodes, at, 2u, 0u, x) * lagrange_factor(nodes, at, 2u, 1u, x) * lagrange_factor(nodes, at, 2u, 3u, x);
    let fourth = lagrange_factor(nodes, at, 3u, 0u, x) * lagrange_factor(nodes, at, 3u, 1u, x) * lagrange_factor(nodes, at, 3u, 2u, x);
    return select(vec4<f32>(0.0), vec4<f32>(first, second, third, fourth), vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(nodes));
}

// What a cell is split into: cells in x and y, or the cell itself with a part of its range.
//
// place     of a corner, with all its nodes, among landings; the emission view's texels first, then 3 x 3 for each patch of a queue
// parent    the cell that is split: its corners are the patch's outer ones; halves of a range have none in common with it
struct Patch {
    cell: FootprintCell, // that is split; with its part of the range where that is
    parts: vec2<u32>,    // cells in x and y, 1 or 2; 1 x 1 where the range is split
    parent: u32,         // place of the split cell's first corner
}

const PATCH_PLACES: u32 = 9u;
const PATCH_ROW: u32 = 3u;   // from one row of them to the next
const PATCH_CELLS: u32 = 4u; // at most
const PATCH_NEW: u32 = 5u;   // most corners that its parent does not have

// Workgroups for each CELLS patches of a queue: enough for all corners at all nodes, and for all cells and orders. Those of a dispatch are
// dealt out alike, each CELLS neighbours in turn: some drivers cut the row of workgroups into one piece for each of their threads, and
// pieces of a row have the same work.
fn patch_share(nodes: u32, orders: u32) -> u32 {
    return PATCH_NEW * max(nodes, orders);
}

// Counts of what was done stand at the start of the queues, low and high word each.
const WORK_DEPOSITS: u32 = 0u; // tents put down, and texels that gathered light
const WORK_CELLS: u32 = 1u;    // laid down
const WORK_BINS: u32 = 2u;     // of these cells
const WORK_CORNERS: u32 = 3u;  // that paths begin at
const WORK_RAYS: u32 = 4u;     // traced from them
const WORK_COUNTS: u32 = 5u;

// A queue of patches: the head of photon_queue.wgsl, how many patches of each class of urgency there were to put into it, then
// patches of three words.
const CLASSES: u32 = 64u;      // four of each class of stakes
const PATCHES_HEAD: u32 = 72u; // QUEUE_HEAD + CLASSES
const PATCH_WORDS: u32 = 3u;

fn patch_words(patch_: Patch) -> vec3<u32> {
    let cell = patch_.cell;
    let range = (cell.first << 8u) | (firstLeadingBit(cell.bins) << 20u);
    let parts = ((patch_.parts.x - 1u) << 24u) | ((patch_.parts.y - 1u) << 25u);
    return vec3<u32>(cell.at.x | (cell.at.y << 16u), cell.level.x | (cell.level.y << 4u) | range | parts, patch_.parent);
}

fn patch_from_words(words: vec3<u32>) -> Patch {
    let at = vec2<u32>(words.x & 0xffffu, words.x >> 16u);
    let level = vec2<u32>(words.y & 0xfu, (words.y >> 4u) & 0xfu);
    let cell = FootprintCell(at, level, (words.y >> 8u) & 0xfffu, 1u << ((words.y >> 20u) & 0xfu));
    return Patch(cell, 1u + vec2<u32>((words.y >> 24u) & 1u, (words.y >> 25u) & 1u), words.z);
}

// One of its cells, by its place among them.
fn patch_cell(patch_: Patch, inner: vec2<u32>) -> FootprintCell {
    let cell = patch_.cell;
    return FootprintCell(patch_.parts * cell.at + inner, cell.level + patch_.parts - 1u, cell.first, cell.bins);
}

// The corners that are traced for it; beyond its own where there are fewer.
fn patch_new_corner(patch_: Patch, i: u32) -> vec2<u32> {
    if patch_.parts.x == 1u && patch_.parts.y == 1u {
        return vec2<u32>(i & 1u, i >> 1u);
    } else if patch_.parts.y == 1u {
        return vec2<u32>(1u, i);
    } else if patch_.parts.x == 1u {
        return vec2<u32>(i, 1u);
    }
    switch i {
        case 0u: { return vec2<u32>(1u, 0u); }
        case 1u: { return vec2<u32>(1u, 1u); }
        case 2u: { return vec2<u32>(0u, 1u); }
        case 3u: { return vec2<u32>(2u, 1u); }
        default: { return vec2<u32>(1u, 2u); }
    }
}

// A corner of a cell, texels of the emission view.
fn cell_corner(cell: FootprintCell, corner: u32) -> vec2<f32> {
    let at = cell.at + vec2<u32>(corner & 1u, corner >> 1u);
    return vec2<f32>(at) / vec2<f32>(vec2<u32>(1u) << cell.level) + 0.5;
}
