// Footprints of cells into the map: where all paths of a cell belong together, its light is laid down as a continuous function of place
// and wavelength; where they do not and the cell is not split further, every path is put down for itself. Host side:
// `passes/footprint_splat.rs`; terms in `shared/footprint.rs`.

struct FootprintSplat {
    cells: FootprintCells,
    first_band: u32,   // row of this light, in `bands`
    first_ledger: u32, // row of this light and path
    spot_scale: f32,   // squared clamp(cosine * scale + offset) is the cone's falloff
    reserved0: u32,
    spot_axis: vec3<f32>,
    spot_offset: f32,
}

// All light of the bins before one, where it lands on one material.
struct RunningBand {
    weight: vec3<u32>, // XYZ as parts, see flux.wgsl
    reserved0: u32,
    moment: vec3<u32>, // integral of place in the spectrum, 0 to 1, times XYZ, as parts
    reserved1: u32,
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

// Flux at a texel's centre.
fn texel_flux(texel: vec2<u32>) -> f32 {
    let view = views[params.cells.emission_view];
    let direction = view_ray(view, vec2<f32>(texel) + 0.5).direction;
    let falloff = spot_falloff(direction, params.spot_axis, params.spot_scale, params.spot_offset);
    return QUANTUM * view_texel_measure(view, texel) * falloff;
}

// All wavelengths of a cell; the flux of cells that one is split into adds up to its own.
fn flux_of_cell(cell: FootprintCell) -> u32 {
    let whole = cell.at >> cell.level;
    let sum = texel_flux(whole) + texel_flux(whole + vec2<u32>(1u, 0u)) + texel_flux(whole + vec2<u32>(0u, 1u)) + texel_flux(whole + 1u);
    var flux = u32(0.25 * sum + 0.5);
    for (var axis = 0u; axis < 2u; axis++) {
        for (var level = 1u; level <= cell.level[axis]; level++) {
            flux = (flux + ((cell.at[axis] >> (cell.level[axis] - level)) & 1u)) / 2u;
        }
    }
    return flux;
}

// The triangles of a cell, by their corners.
const TRIANGLES = array<vec3<u32>, 2>(vec3<u32>(0u, 1u, 3u), vec3<u32>(0u, 3u, 2u));

fn perp_dot(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Texels gather light from triangles that cover at least twice as many.
const LEAST_AREA: f32 = 4.0;

// And that lie within so many along each side: no invocation goes round for ever.
const MOST_GATHERED: f32 = 40.0;

// Both triangles are large and neither is turned over, at any node: texels can gather their light.
fn is_wide(extent: Extent) -> bool {
    if max(extent.across, extent.down) + extent.along / f32(PIECES) > MOST_GATHERED {
        return false;
    }
    var turned = 0.0;
    for (var node = 0u; node < params.cells.nodes; node++) {
        for (var i = 0u; i < 2u; i++) {
            let t = MOST_NODES * TRIANGLES[i];
            let a = places[t.x + node];
            let area = perp_dot(places[t.y + node] - a, places[t.z + node] - a);
            if turned == 0.0 {
                turned = sign(area);
            }
            if turned * area < 2.0 * LEAST_AREA {
                return false;
            }
        }
    }
    return true;
}

// What a first surface's material does to each channel.
struct Colour {
    absorptions: vec3<f32>, // per working unit
    surfaces: vec3<f32>,    // what its surface lets through or throws back
}

// Share of the flux of each channel that comes through at a corner. What depends on the wavelength through the first surface's material
// is not interpolated between nodes: that is taken off there, and put back here.
fn passes_at(corner: u32, x: f32, colour: Colour) -> vec3<f32> {
    let w = node_weights(params.cells.nodes, nodes_at, x);
    let first = corner * MOST_NODES;
    let part = dot(w / max(surfaces, vec4<f32>(LEAST_SURFACE)), vec4<f32>(parts[first], parts[first + 1u], parts[first + 2u], parts[first + 3u]));
    let inside = dot(w, vec4<f32>(lengths[first], lengths[first + 1u], lengths[first + 2u], lengths[first + 3u]));
    return clamp(part * colour.surfaces, vec3<f32>(0.0), vec3<f32>(1.0)) * exp(-colour.absorptions * max(inside, 0.0));
}

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

// What glass absorbs is averaged over so many parts of a range.
const ABSORBING_BANDS: u32 = 8u;

fn running_band(bin: u32, material: u32) -> RunningBand {
    return bands[(params.first_band + bin) * (params.cells.materials + 1u) + material];
}

fn band_weight(bin: u32, material: u32) -> vec3<u32> {
    return running_band(bin, material).weight;
}

// Where the light of some bins lies on the whole, as a bin, channel by channel.
fn centroids(bin: u32, bins: u32, material: u32) -> vec3<f32> {
    let start = running_band(bin, material);
    let end = running_band(bin + bins, material);
    let weight = vec3<f32>(end.weight - start.weight);
    let moment = vec3<f32>(end.moment - start.moment);
    let place = select(vec3<f32>(f32(bin) + 0.5 * f32(bins)), f32(params.cells.bins) * moment / max(weight, vec3<f32>(1.0)), weight > vec3<f32>(0.0));
    return clamp(place, vec3<f32>(f32(bin)), vec3<f32>(f32(bin + bins)));
}

fn absorption_at(bin: u32, material: u32) -> f32 {
    return optics[(params.cells.first_optics + min(bin, params.cells.bins)) * params.cells.materials + material].absorption;
}

// At a place in the spectrum of each channel's own, as a bin.
fn absorptions_at(at: vec3<f32>, material: u32) -> vec3<f32> {
    let lower = min(vec3<u32>(at), vec3<u32>(params.cells.bins - 1u));
    let a = vec3<f32>(absorption_at(lower.x, material), absorption_at(lower.y, material), absorption_at(lower.z, material));
    let b = vec3<f32>(absorption_at(lower.x + 1u, material), absorption_at(lower.y + 1u, material), absorption_at(lower.z + 1u, material));
    return mix(a, b, at - vec3<f32>(lower));
}

// At a place in the spectrum of each channel's own, as a bin.
fn colour_at(at: vec3<f32>, material: u32) -> Colour {
    return Colour(absorptions_at(at, material), vec3<f32>(surface_at(at.x, material), surface_at(at.y, material), surface_at(at.z, material)));
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
    let middle = cell.first + cell.bins / 2u;
    let absorbs = absorption_at(middle, medium) > 0.0 || surface_at(f32(middle), medium) < 1.0;
    let parts_of_it = select(1u, clamp(ABSORBING_BANDS * bins / cell.bins, 1u, bins), absorbs);
    let own_bins = bins / parts_of_it;
    for (var i = 0u; i < parts_of_it; i++) {
        let own_bin = bin + i * own_bins;
        let weight = band_weight(own_bin + own_bins, lit) - band_weight(own_bin, lit);
        let centroid = centroids(own_bin, own_bins, lit);
        let colour = colour_at(centroid, medium);
        let x = abscissa(cell, medium, centroid.y);
        let share = select(vec3<f32>(weight) / vec3<f32>(max(landed.weight, vec3<u32>(1u))), vec3<f32>(0.0), landed.weight == vec3<u32>(0u));
        for (var corner = 0u; corner < 4u; corner++) {
            landed.passes[corner] += share * passes_at(corner, x, colour);
        }
    }
    return landed;
}

// A step of Newton's towards the bin of an abscissa.
fn nearer_bin(cell: FootprintCell, material: u32, start: f32, span: f32, x: f32, bin: f32) -> f32 {
    let last = f32(cell.first + cell.bins - 1u);
    let own = index_at(bin, material);
    let slope = index_at(min(bin, last) + 1.0, material) - index_at(min(bin, last), material);
    return clamp(bin + (start + x * span - own) / slope, f32(cell.first), last + 1.0);
}

// The place in the spectrum, as a bin, of an abscissa of a cell's range. Two steps: the index is nearly linear.
fn bin_at(cell: FootprintCell, material: u32, x: f32) -> f32 {
    let start = index_at(f32(cell.first), material);
    let span = index_at(f32(cell.first + cell.bins), material) - start;
    let bin = f32(cell.first) + x * f32(cell.bins);
    if abs(span) < 1e-6 {
        return bin;
    }
    return nearer_bin(cell, material, start, span, x, nearer_bin(cell, material, start, span, x, bin));
}

// XYZ of all light before a place in the spectrum, as parts.
fn weight_before(bin: f32, material: u32) -> vec3<f32> {
    let lower = min(u32(bin), params.cells.bins - 1u);
    let a = vec3<f32>(band_weight(lower, material));
    let b = vec3<f32>(band_weight(lower + 1u, material));
    return mix(a, b, bin - f32(lower));
}

// Pieces of a range within which triangles only move along a line.
const PIECES: u32 = 4u;

// Texels take their light just beside their centres: sides of footprints that run through centres are on one side of them.
const BESIDE_CENTRE: vec2<f32> = vec2<f32>(1.37e-3, 0.71e-3);

// What is left of a piece where a corner's weight, which falls so much over all of it, is not below 0.
fn seen_of(piece: vec2<f32>, weight: f32, falls: f32) -> vec2<f32> {
    if falls > 0.0 {
        return vec2<f32>(piece.x, min(piece.y, weight / falls));
    }
    if falls < 0.0 {
        return vec2<f32>(max(piece.x, weight / falls), piece.y);
    }
    return select(piece, piece.xx, weight < 0.0);
}

// As lay_footprint where the cell covers many texels: each gathers the part of the spectrum that its place sees of the cell's
// triangles, which move along with the wavelength. Neighbouring cells share corners, so none is seen twice.
fn lay_wide(emitted: Emitted, cell_flux: u32, first: PathLanding) {
    let face = first.place & 0xffu;
    let lit = first.place >> 8u;
    let cell = emitted.cell;
    let size = vec2<i32>(views[params.cells.map_view + face].size);
    let pieces = select(PIECES, 1u, params.cells.nodes == 1u);
    for (var piece = 0u; piece < pieces; piece++) {
        let from_x = f32(piece) / f32(pieces);
        let middle_x = (f32(piece) + 0.5) / f32(pieces);
        let to_x = (f32(piece) + 1.0) / f32(pieces);
        let first_bin = min(u32(round(bin_at(cell, first.medium, from_x))), cell.first + cell.bins - 1u);
        let end_bin = u32(round(bin_at(cell, first.medium, to_x)));
        let colour = colour_at(centroids(first_bin, max(end_bin - first_bin, 1u), lit), first.medium);
        for (var i = 0u; i < 2u; i++) {
            let t = TRIANGLES[i];
            let a = place_at(t.x, middle_x);
            let side_b = place_at(t.y, middle_x) - a;
            let side_c = place_at(t.z, middle_x) - a;
            let pass_a = passes_at(t.x, middle_x, colour);
            let pass_b = passes_at(t.y, middle_x, colour) - pass_a;
            let pass_c = passes_at(t.z, middle_x, colour) - pass_a;
            var along = vec2<f32>(0.0);
            for (var corner = 0u; corner < 3u; corner++) {
                along += (place_at(t[corner], to_x) - place_at(t[corner], from_x)) / 3.0;
            }
            let area = perp_dot(side_b, side_c);
            let per_texel = f32(cell_flux) / abs(area);
            // How the weights of b and c change along with the wavelength.
            let slope = vec2<f32>(perp_dot(along, side_c), perp_dot(side_b, along)) / area;
            let reach = 0.5 * abs(along);
            let low = max(vec2<i32>(floor(a + min(vec2<f32>(0.0), min(side_b, side_c)) - reach)), vec2<i32>(0));
            let high = min(vec2<i32>(ceil(a + max(vec2<f32>(0.0), max(side_b, side_c)) + reach)), size);
            for (var y = low.y; y < high.y; y++) {
                for (var x = low.x; x < high.x; x++) {
                    let place = vec2<f32>(vec2<i32>(x, y)) + 0.5 + BESIDE_CENTRE - a;
                    let w = vec2<f32>(perp_dot(place, side_c), perp_dot(side_b, place)) / area;
                    var seen = seen_of(vec2<f32>(-0.5, 0.5), w.x, slope.x);
                    seen = seen_of(seen, w.y, slope.y);
                    seen = seen_of(seen, 1.0 - w.x - w.y, -slope.x - slope.y);
                    let start = seen.x;
                    let end = seen.y;
                    if end <= start {
                        continue;
                    }
                    let there = w - 0.5 * (start + end) * slope;
                    let passed = clamp(pass_a + there.x * pass_b + there.y * pass_c, vec3<f32>(0.0), vec3<f32>(1.0));
                    let before = weight_before(bin_at(cell, first.medium, middle_x + start * (to_x - from_x)), lit);
                    let until = weight_before(bin_at(cell, first.medium, middle_x + end * (to_x - from_x)), lit);
                    let flux = per_texel * passed * (until - before) / 2147483648.0;
                    deposits += 1u;
                    let texel = u32((i32(face) * size.y + y) * size.x + x);
                    add_64(6u * texel, u32(max(flux.x, 0.0) + 0.5));
                    add_64(6u * texel + 2u, u32(max(flux.y, 0.0) + 0.5));
                    add_64(6u * texel + 4u, u32(max(flux.z, 0.0) + 0.5));
                }
            }
        }
    }
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
    let part_of_light = parts[0] / f32((texels.x * texels.y) << (cell.level.x + cell.level.y));
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

// Bins of a node where nothing can be interpolated.
fn share_of(cell: FootprintCell, node: u32) -> vec2<u32> {
    let nodes = params.cells.nodes;
    return cell.first + vec2<u32>(share_start(nodes, node, cell.bins), share_start(nodes, node + 1u, cell.bins));
}

// What the first glass lets through of the light of some bins, channel by channel, that falls on a material.
fn comes_through(landing: PathLanding, share: vec2<u32>, material: u32) -> vec3<u32> {
    let absorptions = absorptions_at(centroids(share.x, share.y - share.x, material), landing.medium);
    let through = exp(-absorptions * landing.length);
    return vec3<u32>(part_from(through.x), part_from(through.y), part_from(through.z));
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

const LEDGER_SUMS: u32 = 180u; // MOST_NODES * LEDGER_ROWS * LEDGER_WORDS

var<workgroup> sums: array<atomic<u32>, LEDGER_SUMS>;
var<workgroup> work: array<atomic<u32>, WORK_COUNTS>;

// Of this cell.
var<private> deposits: u32;

fn book(node: u32, row: u32, flux: u32, corner: u32) {
    if flux == 0u {
        return;
    }
    let word = LEDGER_WORDS * (LEDGER_ROWS * node + row);
    let before = atomicAdd(&sums[word], flux);
    if before + flux < before {
        atomicAdd(&sums[word + 1u], 1u);
    }
    if corner == 0u {
        atomicAdd(&sums[word + 2u], 1u);
    }
}

// What becomes of a cell's light; parts are taken off in turn, so that all of it is booked.
fn keep_books(emitted: Emitted, cell_flux: u32) {
    for (var path = 0u; path < 4u * params.cells.nodes; path++) {
        let corner = path / params.cells.nodes;
        let node = path % params.cells.nodes;
        let start = cell_share(emitted, cell_flux, node);
        let flux = (start + corner) / 4u;
        book(node, LEDGER_AIMED, flux, corner);
        let left = ends[path_of(emitted, corner, node)];
        if left.end == END_MISSED || left.end == END_BLOCKED {
            book(node, LEDGER_FIRST_END + left.end, flux, corner);
            continue;
        }
        book(node, LEDGER_EMITTED, flux, corner);
        if left.end != END_LANDED {
            book(node, LEDGER_FIRST_END + left.end, flux, corner);
            continue;
        }
        var running = left.reflected;
        var booked = flux_part(flux, running);
        book(node, LEDGER_REFLECTED, booked, corner);
        running += left.absorbed;
        book(node, LEDGER_ABSORBED, flux_part(flux, running) - booked, corner);
        booked = flux_part(flux, running);
        running += left.kept_inside;
        book(node, LEDGER_KEPT_INSIDE, flux_part(flux, running) - booked, corner);
        booked = flux_part(flux, running);
        for (var order = 0u; order < params.cells.orders; order++) {
            let landing = landing_of(emitted, corner, node, order);
            running += landing.part;
            let own = flux_part(flux, running) - booked;
            booked += own;
            if landing.end == END_LANDED {
                let lands = flux_part(own, comes_through(landing, share_of(emitted.cell, node), params.cells.materials).y);
                book(node, LEDGER_ABSORBED, own - lands, corner);
                book(node, LEDGER_FIRST_END + END_LANDED, lands, corner);
            } else {
                book(node, LEDGER_FIRST_END + landing.end, own, corner);
            }
        }
    }
}

// Luminous flux of the bins of a node.
fn cell_share(emitted: Emitted, cell_flux: u32, node: u32) -> u32 {
    let cell = emitted.cell;
    let start = band_weight(cell.first + share_start(params.cells.nodes, node, cell.bins), params.cells.materials).y;
    let end = band_weight(cell.first + share_start(params.cells.nodes, node + 1u, cell.bins), params.cells.materials).y;
    return flux_part(cell_flux, end) - flux_part(cell_flux, start);
}

@compute @workgroup_size(64, 1, 1)
fn footprint_splat(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let order = group.z; // one of them: with all an invocation would go round too often for some drivers
    if order >= params.cells.orders {
        return;
    }
    for (var i = local; i < LEDGER_SUMS; i += CELLS) {
        atomicStore(&sums[i], 0u);
    }
    if local < WORK_COUNTS {
        atomicStore(&work[local], 0u);
    }
    workgroupBarrier();
    let i = CELLS * queue_row(group, params.cells.max_groups) + local;
    let emitted = emitted_cell(i);
    if emitted.exists && order == 0u {
        atomicAdd(&work[WORK_CORNERS], emitted.traced);
    }
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
    if local < WORK_COUNTS {
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
        let to = LEDGER_WORDS * LEDGER_ROWS * params.first_ledger + word;
        let before = atomicAdd(&ledger[to], value);
        if kind == 0u && before + value < before {
            atomicAdd(&ledger[to + 1u], 1u);
        }
    }
}
