// Which cells are split for the next round, and how urgently: those whose paths do not belong together, those that hide something
// narrower than they are, and those that land bent or on many texels. Host side: `passes/footprint_split.rs`; terms in
// `shared/footprint.rs`.

struct FootprintSplit {
    cells: FootprintCells,
    most_level: u32,      // no cell is split in x and y more often
    most_edge_level: u32, // no cell is split more often, where that is across an edge along its other side
    silhouette_view: u32, // of `silhouette`
    first_caster: u32,    // casters are in a row among triangles
    end_caster: u32,
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

@group(0) @binding(0) var<uniform> params: FootprintSplit;
@group(0) @binding(1) var<storage, read> landings: array<PathLanding>; // path * orders + order
@group(0) @binding(2) var<storage, read> ends: array<PathEnds>;        // path
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var<storage, read> optics: array<Optics>;        // bin * materials + material it goes through
@group(0) @binding(5) var<storage, read_write> queues: array<atomic<u32>>;
@group(0) @binding(6) var silhouette: texture_2d<u32>; // first surface from the light, finer than cells

// A cell that lands on more texels along a side is split while that is allowed.
const MOST_TEXELS: f32 = 32.0;

// Sides of cells that land on more texels are straight.
const MOST_CURVED: f32 = 4.0;

// Cells whose flux is further off than it is interpolated, as a share of what was emitted, are split.
const MOST_FADING: f32 = 1.0 / 128.0;

// Spectra that are longer, texels, are split in two: more nodes lie along them then.
const MOST_ALONG: f32 = 24.0;

fn shows_caster(texel: vec2<u32>) -> bool {
    let visible = textureLoad(silhouette, vec2<i32>(texel), 0).r;
    return visible > params.first_caster && visible <= params.end_caster;
}

// All corners of the cell agree, but what the light sees between them does not: something narrower than a cell is there.
fn hides_detail(emitted: Emitted) -> bool {
    let meets = ends[path_of(emitted, 0u, 0u)].end != END_MISSED && ends[path_of(emitted, 0u, 0u)].end != END_BLOCKED;
    let view = views[params.silhouette_view];
    let emission = views[params.cells.emission_view];
    let low = (view_slope(emission, cell_corner(emitted.cell, 2u)) - view.slope_center) / view.texel_slope;
    let high = (view_slope(emission, cell_corner(emitted.cell, 1u)) - view.slope_center) / view.texel_slope;
    let half = 0.5 * vec2<f32>(view.size);
    // Texels whose centres lie in the cell.
    let first = max(vec2<i32>(ceil(vec2<f32>(half.x + low.x, half.y - high.y) - 0.5)), vec2<i32>(0));
    let last = min(vec2<i32>(ceil(vec2<f32>(half.x + high.x, half.y - low.y) - 0.5)), vec2<i32>(view.size));
    for (var y = first.y; y < last.y; y++) {
        for (var x = first.x; x < last.x; x++) {
            if shows_caster(vec2<u32>(vec2<i32>(x, y))) != meets {
                return true;
            }
        }
    }
    return false;
}

// Light that lands, of all orders, in units of the queues' LANDED.
fn landed_of(emitted: Emitted) -> u32 {
    var landed = 0u;
    for (var order = 0u; order < params.cells.orders; order++) {
        let landing = landing_of(emitted, 0u, middle_node(params.cells.nodes), order);
        landed += select(0u, landing.part >> LANDED_SHIFT, landing.end == END_LANDED);
    }
    return landed;
}

// Halvings of a cell of the emission view, in space and along the spectrum.
fn splits_of(cell: FootprintCell) -> u32 {
    return cell.level.x + cell.level.y + firstLeadingBit(params.cells.bins / cell.bins);
}

// The most that a path of this order carries, as a part of a whole cell's flux: of those that land, and of all.
fn stakes(emitted: Emitted, order: u32) -> vec2<u32> {
    let splits = splits_of(emitted.cell);
    var most = vec2<u32>(0u);
    for (var path = 0u; path < 4u * params.cells.nodes; path++) {
        let landing = landing_of(emitted, path / params.cells.nodes, path % params.cells.nodes, order);
        let part = landing.part >> splits;
        most = max(most, vec2<u32>(select(0u, part, landing.end == END_LANDED), part));
    }
    return most;
}

// What a cell is split along, sums of APART_*, and how much light is at stake.
struct Split {
    along: u32,
    stake: u32,
}

fn split_of_cell(emitted: Emitted) -> Split {
    let cell = emitted.cell;
    var apart = TOGETHER;
    var at_stake = 0u;
    for (var order = 0u; order < params.cells.orders; order++) {
        let carried = stakes(emitted, order);
        if carried.y < NEGLIGIBLE {
            continue;
        }
        var part = carried.x;
        var own = belonging(emitted, order);
        if part == 0u {
            // None of them lands, but wavelengths between them may.
            own &= BANDS_APART;
            part = carried.y / 4u;
        } else if own == TOGETHER {
            gather(emitted, order, landing_of(emitted, 0u, 0u, order).place & 0xffu);
            let extent = extent_of();
            let curves = curves_of(emitted, order);
            let bent = select(unevenness_of(curves), bend_of(curves), max(extent.across, extent.down) > MOST_CURVED);
            let fading = fading_of(curves);
            let fading_too = fading_along();
            if max(extent.across, extent.down) <= MOST_TEXELS && extent.along <= MOST_ALONG {
                let fades = f32(WHOLE) * max(max(fading.x, fading.y), fading_too);
                let displaced = f32(part) * min(max(bent.x, bent.y), 1.0);
                part = u32(max(displaced, fades / f32(1u << splits_of(cell))));
            }
            own = select(0u, APART_IN_X, extent.across > MOST_TEXELS || bent.x > MOST_BEND || fading.x > MOST_FADING)
                | select(0u, APART_IN_Y, extent.down > MOST_TEXELS || bent.y > MOST_BEND || fading.y > MOST_FADING)
                | select(0u, BANDS_APART, extent.along > MOST_ALONG || fading_too > MOST_FADING);
        }
        if own != TOGETHER && part >= NEGLIGIBLE {
            apart |= own;
            at_stake = max(at_stake, part);
        }
    }
    let in_space = APART_IN_X | APART_IN_Y;
    if (apart & in_space) == 0u && hides_detail(emitted) {
        apart |= in_space;
        at_stake = max(at_stake, WHOLE >> splits_of(cell));
    }
    // An edge along one side is worth more splits: they do not become more with every one.
    let most = select(params.most_edge_level, params.most_level, (apart & in_space) == in_space);
    let in_x = select(0u, APART_IN_X, (apart & APART_IN_X) != 0u && cell.level.x < most);
    let in_y = select(0u, APART_IN_Y, (apart & APART_IN_Y) != 0u && cell.level.y < most);
    let in_bands = select(0u, BANDS_APART, (apart & BANDS_APART) != 0u && cell.bins > LEAST_BINS);
    return Split(select(in_bands, in_x | in_y, (in_x | in_y) != 0u), at_stake);
}

@compute @workgroup_size(64, 1, 1)
fn footprint_split(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    if taken_order(group) > 0u {
        return;
    }
    let i = taken_cell(group, local);
    let emitted = emitted_cell(i);
    if !emitted.exists {
        return;
    }
    if params.cells.next == NO_QUEUE {
        atomicAdd(&queues[LANDED], landed_of(emitted));
        return;
    }
    let split = split_of_cell(emitted);
    let class_ = urgency(split.stake, emitted.cell);
    atomicStore(&queues[params.cells.splits + i], select(split.along | (class_ << SPLIT_CLASS), 0u, split.along == TOGETHER));
    if split.along != TOGETHER {
        atomicAdd(&queues[params.cells.next + QUEUE_HEAD + class_], select(1u, 2u, split.along == BANDS_APART));
    }
}
