// Footprints of cells into the map: where all paths of a cell belong together, its light is laid down as a continuous function of place
// and wavelength; where they do not and the cell is not split further, every path is put down for itself. Host side:
// `passes/footprint_splat.rs`; terms in `shared/footprint.rs`.

struct FootprintSplat {
    cells: FootprintCells,
    light: FootprintLight,
}

@group(0) @binding(0) var<uniform> params: FootprintSplat;
@group(0) @binding(1) var<storage, read> landings: array<PathLanding>; // path * orders + order
@group(0) @binding(2) var<storage, read> ends: array<PathEnds>;        // path
@group(0) @binding(3) var<storage, read> views: array<View>;
@group(0) @binding(4) var<storage, read> bands: array<RunningBand>;    // bin * (materials + 1) + material where it lands
@group(0) @binding(5) var<storage, read> optics: array<Optics>;        // bin * materials + material it goes through
@group(0) @binding(6) var<storage, read_write> map: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> ledger: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> queues: array<atomic<u32>>;

// Steps that a cell's light is laid down in.
struct Steps {
    across: u32,
    down: u32,
    bands: u32,
}

// Shortest step that a cell's light is laid down in, texels.
const STEP_TEXELS: f32 = 0.25;

// A cell's light is laid down in about so many steps at most: beyond, they are longer.
const MOST_STEPS: f32 = 128.0;

// Tents of up to so many steps may be so wide, texels to either side; those of more, so wide.
const FEW_STEPS: u32 = 32u;
const FEW_WIDEST: f32 = 7.5;
const MANY_WIDEST: f32 = 3.5;

// Fewer where it has less light, down to these.
const LEAST_STEPS: f32 = 4.0;

// Steps of all light of the emission view, were it evenly spread over its cells.
const ALL_STEPS: f32 = 2.5e6;

// Of a cell that has this part of all light: such that none is longer than a quarter of a texel, unless there were too many.
fn steps_of(extent: Extent, part_of_light: f32, bins: u32) -> Steps {
    let most = clamp(ALL_STEPS * part_of_light, LEAST_STEPS, MOST_STEPS);
    let across = max(extent.across, STEP_TEXELS);
    let down = max(extent.down, STEP_TEXELS);
    let along = max(extent.along, STEP_TEXELS);
    let step = max(pow(across * down * along / most, 1.0 / 3.0), STEP_TEXELS);
    var bands = 1u;
    while bands < bins && f32(bands) * step < along {
        bands *= 2u;
    }
    return Steps(u32(clamp(ceil(across / step), 1.0, MOST_STEPS)), u32(clamp(ceil(down / step), 1.0, MOST_STEPS)), bands);
}

// Some bins of a cell's light, by corner.
struct LandedBand {
    at: array<vec2<f32>, 4>,     // texels of the map
    along: vec2<f32>,            // from their first to their last
    weight: vec3<u32>,           // XYZ, as parts of all light
    passes: array<vec3<f32>, 4>, // share of the flux of each channel that comes through
}

// Some bins of a cell's light, where all of it lands as one.
fn landed_band(cell: FootprintCell, bin: u32, bins: u32, first: PathLanding) -> LandedBand {
    let lit = first.place >> 8u;
    let medium = first.medium;
    let from_x = abscissa(cell, medium, f32(bin));
    let to_x = abscissa(cell, medium, f32(bin + bins));
    let center = abscissa(cell, medium, centroids(bin, bins, lit).y);
    var landed: LandedBand;
    landed.weight = band_weight(bin + bins, lit) - band_weight(bin, lit);
    for (var corner = 0u; corner < 4u; corner++) {
        landed.at[corner] = place_at(corner, center);
        landed.along += 0.25 * (place_at(corner, to_x) - place_at(corner, from_x));
    }
    landed.passes = passes_of(cell, bin, bins, first);
    return landed;
}

// All paths belong together: light between them lies between their landings.
fn lay_footprint(emitted: Emitted, cell_flux: u32, order: u32) {
    let first = landing_of(emitted, 0u, 0u, order);
    let face = first.place & 0xffu;
    let cell = emitted.cell;
    gather(emitted, order, face);
    let extent = extent_of();
    let curves = curves_of(emitted, order);
    let bent = bend_of(curves);
    if is_wide(extent) && max(bent.x, bent.y) <= MOST_BEND {
        lay_wide(emitted, cell_flux, first);
        return;
    }
    let texels = views[params.cells.emission_view].size;
    let cells = f32(texels.x * texels.y) * f32(1u << cell.level.x) * f32(1u << cell.level.y); // as fine as this one
    let part_of_light = parts[0] / cells;
    let steps = steps_of(extent, part_of_light, cell.bins);
    let across = steps.across;
    let down = steps.down;
    let bins = cell.bins / steps.bands;
    let count = across * down * steps.bands;
    // Long steps are not made even where there are many of them: no invocation goes round for ever.
    let widest = select(FEW_WIDEST, MANY_WIDEST, count > FEW_STEPS);
    deposits += count;
    let size = views[params.cells.map_view + face].size;
    var landed: LandedBand;
    // One loop over bands and steps: where neighbours have other numbers of both, two would go round as often as their product.
    for (var i = 0u; i < count; i++) {
        let step = i % (across * down);
        if step == 0u {
            landed = landed_band(cell, cell.first + i / (across * down) * bins, bins, first);
        }
        let x = (f32(step % across) + 0.5) / f32(across);
        let y = (f32(step / across) + 0.5) / f32(down);
        let passed = mix(mix(landed.passes[0], landed.passes[1], x), mix(landed.passes[2], landed.passes[3], x), y);
        let flux = (cell_flux + step) / (across * down);
        let upper = mix(landed.at[0], landed.at[1], x);
        let lower = mix(landed.at[2], landed.at[3], x);
        let beyond = beyond_plane(curves, x, y);
        let step_x = (mix(landed.at[1] - landed.at[0], landed.at[3] - landed.at[2], y) + beyond.to_right) / f32(across);
        let step_y = (lower - upper + beyond.to_below) / f32(down);
        let width = min(sqrt(step_x * step_x + step_y * step_y + landed.along * landed.along), vec2<f32>(widest));
        var own: vec3<u32>;
        for (var c = 0u; c < 3u; c++) {
            own[c] = flux_part(flux_part(flux, part_from(passed[c])), landed.weight[c]);
        }
        splat_tent(size, face, mix(upper, lower, y) + beyond.place, width, own);
    }
}

// Paths go apart, and the cell is not split further: every path is put down where it lands.
fn lay_points(emitted: Emitted, cell_flux: u32, order: u32) {
    for (var path = 0u; path < 4u * params.cells.nodes; path++) {
        let corner = path / params.cells.nodes;
        let node = path % params.cells.nodes;
        let landing = landing_of(emitted, corner, node, order);
        if landing.end == END_LANDED {
            deposits += 1u;
            let face = landing.place & 0xffu;
            let passed = flux_part((cell_flux + corner) / 4u, landing.part);
            let share = share_of(emitted.cell, node);
            let weight = band_weight(share.y, landing.place >> 8u) - band_weight(share.x, landing.place >> 8u);
            let through = comes_through(landing, share, landing.place >> 8u);
            let at = map_texel(face, landing.texel);
            var own: vec3<u32>;
            for (var c = 0u; c < 3u; c++) {
                own[c] = flux_part(flux_part(passed, through[c]), weight[c]);
            }
            splat_tent(views[params.cells.map_view + face].size, face, at, vec2<f32>(1.0), own);
        }
    }
}

// Counts of cells, the first ones of all.
const CELL_COUNTS: u32 = 3u;

var<workgroup> work: array<atomic<u32>, CELL_COUNTS>;

// Of this cell.
var<private> deposits: u32;

@compute @workgroup_size(64, 1, 1)
fn footprint_splat(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let order = taken_order(group); // one of them: with all an invocation would go round too often for some drivers
    if order >= params.cells.orders {
        return;
    }
    for (var i = local; i < LEDGER_SUMS; i += CELLS) {
        atomicStore(&sums[i], 0u);
    }
    if local < CELL_COUNTS {
        atomicStore(&work[local], 0u);
    }
    workgroupBarrier();
    let i = taken_cell(group, local);
    let emitted = emitted_cell(i);
    if emitted.exists && split_of(i) == TOGETHER {
        deposits = 0u;
        let flux = flux_of_cell(emitted.cell);
        if belonging(emitted, order) != TOGETHER {
            lay_points(emitted, flux, order);
        } else if landing_of(emitted, 0u, 0u, order).end == END_LANDED {
            lay_footprint(emitted, flux, order);
        }
        if order == 0u {
            keep_books(emitted, flux);
            atomicAdd(&work[WORK_CELLS], 1u);
            atomicAdd(&work[WORK_BINS], emitted.cell.bins);
        }
        atomicAdd(&work[WORK_DEPOSITS], deposits);
    }
    workgroupBarrier();
    if local < CELL_COUNTS {
        let count = atomicLoad(&work[local]);
        let before = atomicAdd(&queues[2u * local], count);
        if before + count < before {
            atomicAdd(&queues[2u * local + 1u], 1u);
        }
    }
    for (var word = local; word < LEDGER_SUMS; word += CELLS) {
        let value = atomicLoad(&sums[word]);
        let kind = word % LEDGER_WORDS;
        if value == 0u || word / (LEDGER_WORDS * LEDGER_ROWS) >= params.cells.nodes {
            continue;
        }
        let to = LEDGER_WORDS * LEDGER_ROWS * params.light.first_ledger + word;
        let before = atomicAdd(&ledger[to], value);
        if kind == 0u && before + value < before {
            atomicAdd(&ledger[to + 1u], 1u);
        }
    }
}
