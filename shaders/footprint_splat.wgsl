// Footprints of cells into the map: where all paths of a cell belong together, its light is laid down as a continuous function of place
// and wavelength; where they do not, the cell or its part of the spectrum is split for the next round, and in the last one
// every path is put down for itself. Host side: `passes/footprint_splat.rs`; terms in `shared/footprint.wgsl`.

struct FootprintSplat {
    emission_view: u32,
    landing_view: u32,
    map_view: u32,     // first of the map's, one per landing view
    first_band: u32,   // row of this light, in `bands`
    nodes: u32,
    orders: u32,
    materials: u32,    // row length of `optics`; rows of `bands` have one more, the light itself
    first_optics: u32, // row of this light
    bins: u32,         // of the whole spectrum
    most_level: u32,   // no cell is split in x and y more often
    queue: u32,        // first word in `queues`; NO_QUEUE: cells lie between the texel centres of the emission view
    next: u32,         // first word of the queue that splits go to; NO_QUEUE: none are made
    capacity: u32,     // of that queue, cells
    first_ledger: u32, // row of this light and path
    max_groups: u32,   // of the device, per dimension
    spot_scale: f32,   // squared clamp(cosine * scale + offset) is the cone's falloff
    spot_axis: vec3<f32>,
    spot_offset: f32,
    silhouette_view: u32, // of `silhouette`
    first_caster: u32,    // casters are in a row among triangles
    end_caster: u32,
    most_edge_level: u32, // no cell is split more often, where that is across an edge along its other side
    task: u32,            // TASK_*
    reserved0: u32,
    reserved1: u32,
    reserved2: u32,
}

const TASK_COUNT: u32 = 0u; // count the cells that are to be split
const TASK_LAY: u32 = 1u;   // split the most urgent, as many as the next queue holds, and lay down the others

const NO_QUEUE: u32 = 0xffffffffu;

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
@group(0) @binding(9) var silhouette: texture_2d<u32>; // first surface from the light, finer than cells
@group(0) @binding(6) var<storage, read_write> map: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> ledger: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> queues: array<atomic<u32>>;

const MOST_NODES: u32 = 4u;

// A cell, its first path and its light.
struct Emitted {
    cell: FootprintCell,
    place: u32, // of the cell's first corner
    row: u32,   // from its lower to its upper corners, places
    flux: u32,
}

fn path_of(emitted: Emitted, corner: u32, node: u32) -> u32 {
    return (emitted.place + (corner & 1u) + emitted.row * (corner >> 1u)) * params.nodes + node;
}

fn landing_of(emitted: Emitted, corner: u32, node: u32, order: u32) -> PathLanding {
    return landings[path_of(emitted, corner, node) * params.orders + order];
}

// Flux at a texel's centre.
fn texel_flux(texel: vec2<u32>) -> f32 {
    let view = views[params.emission_view];
    let direction = view_ray(view, vec2<f32>(texel) + 0.5).direction;
    let falloff = spot_falloff(direction, params.spot_axis, params.spot_scale, params.spot_offset);
    return QUANTUM * view_texel_measure(view, texel) * falloff;
}

// All wavelengths of a cell; the flux of cells that one is split into adds up to its own.
fn cell_flux(cell: FootprintCell) -> u32 {
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

// How paths of a cell go apart: sums of these.
const TOGETHER: u32 = 0u;
const APART_IN_X: u32 = 1u;   // corners to the left and to the right
const APART_IN_Y: u32 = 2u;   // above and below
const BANDS_APART: u32 = 4u;  // wavelengths

fn same_way(a: PathLanding, b: PathLanding) -> bool {
    return a.way == b.way && a.end == b.end && ((a.place ^ b.place) & 0xffu) == 0u;
}

fn belonging(emitted: Emitted, order: u32) -> u32 {
    let first = landing_of(emitted, 0u, 0u, order);
    var apart = TOGETHER;
    for (var node = 0u; node < params.nodes; node++) {
        let upper_left = landing_of(emitted, 0u, node, order);
        let upper_right = landing_of(emitted, 1u, node, order);
        let lower_left = landing_of(emitted, 2u, node, order);
        let lower_right = landing_of(emitted, 3u, node, order);
        apart |= select(APART_IN_X, 0u, same_way(upper_left, upper_right) && same_way(lower_left, lower_right));
        apart |= select(APART_IN_Y, 0u, same_way(upper_left, lower_left) && same_way(upper_right, lower_right));
        apart |= select(BANDS_APART, 0u, same_way(first, upper_left));
    }
    return apart;
}

fn shows_caster(texel: vec2<u32>) -> bool {
    let visible = textureLoad(silhouette, vec2<i32>(texel), 0).r;
    return visible > params.first_caster && visible <= params.end_caster;
}

// All corners of the cell agree, but what the light sees between them does not: something narrower than a cell is there.
fn hides_detail(emitted: Emitted) -> bool {
    let meets = ends[path_of(emitted, 0u, 0u)].end != END_MISSED && ends[path_of(emitted, 0u, 0u)].end != END_BLOCKED;
    let view = views[params.silhouette_view];
    let emission = views[params.emission_view];
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

// Paths that carry less than this part of a whole cell's flux are not worth a split.
const NEGLIGIBLE: u32 = 0x1000000u; // WHOLE / 128

// The most that a path of this order carries to where it lands, as a part of a whole cell's flux.
fn stake(emitted: Emitted, order: u32) -> u32 {
    let splits = emitted.cell.level.x + emitted.cell.level.y;
    var most = 0u;
    for (var path = 0u; path < 4u * params.nodes; path++) {
        let landing = landing_of(emitted, path / params.nodes, path % params.nodes, order);
        most = max(most, select(0u, landing.part >> splits, landing.end == END_LANDED));
    }
    return most;
}

// A place of the landing view on the map.
fn map_texel(face: u32, texel: vec2<f32>) -> vec2<f32> {
    let shown = views[params.map_view + face];
    let slope = view_slope(views[params.landing_view + face], texel);
    let offset = (slope - shown.slope_center) / shown.texel_slope;
    return 0.5 * vec2<f32>(shown.size) + vec2<f32>(offset.x, -offset.y);
}

// Where a cell lands, of one order: by corner and node.
var<private> places: array<vec2<f32>, 16>; // texels of the map
var<private> parts: array<f32, 16>;
var<private> lengths: array<f32, 16>;
var<private> nodes_at: vec4<f32>; // see `abscissa`

fn index_at(bin: f32, material: u32) -> f32 {
    let lower = min(u32(bin), params.bins - 1u);
    let row = (params.first_optics + lower) * params.materials + material;
    return mix(optics[row].index, optics[row + params.materials].index, bin - f32(lower));
}

// What landings are interpolated along from one wavelength to another, 0 to 1 within a range: the index of refraction, on which they
// depend nearly linearly whatever the glass; without dispersion place in the spectrum.
fn abscissa(cell: FootprintCell, material: u32, bin: f32) -> f32 {
    let start = index_at(f32(cell.first), material);
    let span = index_at(f32(cell.first + cell.bins), material) - start;
    if abs(span) < 1e-6 {
        return (bin - f32(cell.first)) / f32(cell.bins);
    }
    return (index_at(bin, material) - start) / span;
}

fn gather(emitted: Emitted, order: u32, face: u32) {
    let medium = landing_of(emitted, 0u, 0u, order).medium;
    for (var node = 0u; node < params.nodes; node++) {
        nodes_at[node] = abscissa(emitted.cell, medium, f32(node_bin(params.nodes, node, emitted.cell)));
    }
    for (var path = 0u; path < 4u * params.nodes; path++) {
        let corner = path / params.nodes;
        let node = path % params.nodes;
        let landing = landing_of(emitted, corner, node, order);
        places[corner * MOST_NODES + node] = map_texel(face, landing.texel);
        parts[corner * MOST_NODES + node] = f32(landing.part) / 2147483648.0;
        lengths[corner * MOST_NODES + node] = landing.length;
    }
}

fn longest(d: vec2<f32>) -> f32 {
    return max(abs(d.x), abs(d.y));
}

fn place_at(corner: u32, x: f32) -> vec2<f32> {
    let w = node_weights(params.nodes, nodes_at, x);
    let first = corner * MOST_NODES;
    return w.x * places[first] + w.y * places[first + 1u] + w.z * places[first + 2u] + w.w * places[first + 3u];
}

// The triangles of a cell, by their corners.
const TRIANGLES = array<vec3<u32>, 2>(vec3<u32>(0u, 1u, 3u), vec3<u32>(0u, 3u, 2u));

fn perp_dot(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

// Texels gather light from triangles that cover at least twice as many.
const LEAST_AREA: f32 = 4.0;

// Both triangles are large and neither is turned over, at any node: texels can gather their light.
fn is_wide() -> bool {
    var turned = 0.0;
    for (var node = 0u; node < params.nodes; node++) {
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

// Share of the flux that comes through at a corner, of a medium with this absorption.
fn passes_at(corner: u32, x: f32, absorption: f32) -> f32 {
    let w = node_weights(params.nodes, nodes_at, x);
    let first = corner * MOST_NODES;
    let part = dot(w, vec4<f32>(parts[first], parts[first + 1u], parts[first + 2u], parts[first + 3u]));
    let inside = dot(w, vec4<f32>(lengths[first], lengths[first + 1u], lengths[first + 2u], lengths[first + 3u]));
    return clamp(part, 0.0, 1.0) * exp(-absorption * max(inside, 0.0));
}

// Texels from one end of a cell to the other, and from one end of its range to the other.
struct Extent {
    across: f32,
    down: f32,
    along: f32,
}

fn extent_of() -> Extent {
    var extent = Extent(0.0, 0.0, 0.0);
    for (var node = 0u; node < params.nodes; node++) {
        let upper = longest(places[MOST_NODES + node] - places[node]);
        let lower = longest(places[3u * MOST_NODES + node] - places[2u * MOST_NODES + node]);
        let left = longest(places[2u * MOST_NODES + node] - places[node]);
        let right = longest(places[3u * MOST_NODES + node] - places[MOST_NODES + node]);
        extent.across = max(extent.across, max(upper, lower));
        extent.down = max(extent.down, max(left, right));
    }
    for (var corner = 0u; corner < 4u; corner++) {
        let middle = place_at(corner, 0.5);
        extent.along = max(extent.along, longest(place_at(corner, 0.0) - middle) + longest(place_at(corner, 1.0) - middle));
    }
    return extent;
}

// Steps that a cell's light is laid down in.
struct Steps {
    across: u32,
    down: u32,
    bands: u32,
}

// A cell's light is laid down in about so many steps at most: beyond, they are longer than a texel.
const MOST_STEPS: f32 = 128.0;

// Such that none is longer than a texel, unless there were too many.
fn steps_of(extent: Extent, bins: u32) -> Steps {
    let across = max(extent.across, 1.0);
    let down = max(extent.down, 1.0);
    let along = max(extent.along, 1.0);
    let step = max(pow(across * down * along / MOST_STEPS, 1.0 / 3.0), 1.0);
    var bands = 1u;
    while bands < bins && f32(bands) * step < along {
        bands *= 2u;
    }
    return Steps(u32(clamp(ceil(across / step), 1.0, MOST_STEPS)), u32(clamp(ceil(down / step), 1.0, MOST_STEPS)), bands);
}

// A cell that lands on more texels along a side is split while that is allowed.
const MOST_TEXELS: f32 = 32.0;

// Bands where what the glass absorbs depends on the wavelength.
const ABSORBING_BANDS: u32 = 8u;

fn running_band(bin: u32, material: u32) -> RunningBand {
    return bands[(params.first_band + bin) * (params.materials + 1u) + material];
}

fn band_weight(bin: u32, material: u32) -> vec3<u32> {
    return running_band(bin, material).weight;
}

// Where the light of some bins lies on the whole, as a bin, channel by channel.
fn centroids(start: RunningBand, end: RunningBand, bin: u32, bins: u32) -> vec3<f32> {
    let weight = vec3<f32>(end.weight - start.weight);
    let moment = vec3<f32>(end.moment - start.moment);
    let place = select(vec3<f32>(f32(bin) + 0.5 * f32(bins)), f32(params.bins) * moment / max(weight, vec3<f32>(1.0)), weight > vec3<f32>(0.0));
    return clamp(place, vec3<f32>(f32(bin)), vec3<f32>(f32(bin + bins)));
}

fn absorption_at(bin: u32, material: u32) -> f32 {
    return optics[(params.first_optics + min(bin, params.bins)) * params.materials + material].absorption;
}

fn put_down(face: u32, middle: vec2<f32>, width: vec2<f32>, channel: u32, flux: u32) {
    splat_tent(views[params.map_view + face].size, face, middle, width, channel, flux);
}

// A step of Newton's towards the bin of an abscissa.
fn nearer_bin(cell: FootprintCell, material: u32, start: f32, span: f32, x: f32, bin: f32) -> f32 {
    let last = f32(cell.first + cell.bins - 1u);
    let own = index_at(bin, material);
    let slope = index_at(min(bin, last) + 1.0, material) - index_at(min(bin, last), material);
    return clamp(bin + (start + x * span - own) / slope, f32(cell.first), last + 1.0);
}

// The place in the spectrum, as a bin, of an abscissa of a cell's range. Four steps: the index is nearly linear.
fn bin_at(cell: FootprintCell, material: u32, x: f32) -> f32 {
    let start = index_at(f32(cell.first), material);
    let span = index_at(f32(cell.first + cell.bins), material) - start;
    let bin = f32(cell.first) + x * f32(cell.bins);
    if abs(span) < 1e-6 {
        return bin;
    }
    let second = nearer_bin(cell, material, start, span, x, nearer_bin(cell, material, start, span, x, bin));
    return nearer_bin(cell, material, start, span, x, nearer_bin(cell, material, start, span, x, second));
}

// XYZ of all light before a place in the spectrum, as parts.
fn weight_before(bin: f32, material: u32) -> vec3<f32> {
    let lower = min(u32(bin), params.bins - 1u);
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
fn lay_wide(emitted: Emitted, first: PathLanding) {
    let face = first.place & 0xffu;
    let lit = first.place >> 8u;
    let cell = emitted.cell;
    let size = vec2<i32>(views[params.map_view + face].size);
    let pieces = select(PIECES, 1u, params.nodes == 1u);
    for (var piece = 0u; piece < pieces; piece++) {
        let from_x = f32(piece) / f32(pieces);
        let middle_x = (f32(piece) + 0.5) / f32(pieces);
        let to_x = (f32(piece) + 1.0) / f32(pieces);
        let absorption = absorption_at(u32(bin_at(cell, first.medium, middle_x)), first.medium);
        for (var i = 0u; i < 2u; i++) {
            let t = TRIANGLES[i];
            let a = place_at(t.x, middle_x);
            let side_b = place_at(t.y, middle_x) - a;
            let side_c = place_at(t.z, middle_x) - a;
            let pass_a = passes_at(t.x, middle_x, absorption);
            let pass_b = passes_at(t.y, middle_x, absorption) - pass_a;
            let pass_c = passes_at(t.z, middle_x, absorption) - pass_a;
            var along = vec2<f32>(0.0);
            for (var corner = 0u; corner < 3u; corner++) {
                along += (place_at(t[corner], to_x) - place_at(t[corner], from_x)) / 3.0;
            }
            let area = perp_dot(side_b, side_c);
            let per_texel = f32(emitted.flux) / abs(area);
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
                    let passed = clamp(pass_a + there.x * pass_b + there.y * pass_c, 0.0, 1.0);
                    let before = weight_before(bin_at(cell, first.medium, middle_x + start * (to_x - from_x)), lit);
                    let until = weight_before(bin_at(cell, first.medium, middle_x + end * (to_x - from_x)), lit);
                    let flux = per_texel * passed * (until - before) / 2147483648.0;
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
fn lay_footprint(emitted: Emitted, order: u32) {
    let first = landing_of(emitted, 0u, 0u, order);
    let face = first.place & 0xffu;
    let lit = first.place >> 8u;
    let cell = emitted.cell;
    gather(emitted, order, face);
    if is_wide() {
        lay_wide(emitted, first);
        return;
    }
    var steps = steps_of(extent_of(), cell.bins);
    if absorption_at(cell.first + cell.bins / 2u, first.medium) > 0.0 {
        steps.bands = min(max(steps.bands, ABSORBING_BANDS), cell.bins);
    }
    let across = steps.across;
    let down = steps.down;
    let bins = cell.bins / steps.bands;
    for (var band = 0u; band < steps.bands; band++) {
        let bin = cell.first + band * bins;
        let start = running_band(bin, lit);
        let end = running_band(bin + bins, lit);
        let absorption = absorption_at(bin + bins / 2u, first.medium);
        let from_x = abscissa(cell, first.medium, f32(bin));
        let to_x = abscissa(cell, first.medium, f32(bin + bins));
        let centroid = centroids(start, end, bin, bins);
        let centers = vec3<f32>(
            abscissa(cell, first.medium, centroid.x),
            abscissa(cell, first.medium, centroid.y),
            abscissa(cell, first.medium, centroid.z),
        );
        var at: array<array<vec2<f32>, 4>, 3>; // by channel and corner
        var passes: array<f32, 4>;
        var along = vec2<f32>(0.0);
        for (var corner = 0u; corner < 4u; corner++) {
            for (var c = 0u; c < 3u; c++) {
                at[c][corner] = place_at(corner, centers[c]);
            }
            along += 0.25 * (place_at(corner, to_x) - place_at(corner, from_x));
            passes[corner] = passes_at(corner, centers.y, absorption);
        }
        for (var step = 0u; step < across * down; step++) {
            let x = (f32(step % across) + 0.5) / f32(across);
            let y = (f32(step / across) + 0.5) / f32(down);
            let passed = mix(mix(passes[0], passes[1], x), mix(passes[2], passes[3], x), y);
            let flux = flux_part((emitted.flux + step) / (across * down), part_from(passed));
            for (var c = 0u; c < 3u; c++) {
                let upper = mix(at[c][0], at[c][1], x);
                let lower = mix(at[c][2], at[c][3], x);
                let step_x = mix(at[c][1] - at[c][0], at[c][3] - at[c][2], y) / f32(across);
                let step_y = (lower - upper) / f32(down);
                let width = sqrt(step_x * step_x + step_y * step_y + along * along);
                put_down(face, mix(upper, lower, y), width, c, flux_part(flux, end.weight[c] - start.weight[c]));
            }
        }
    }
}

fn absorbed_by_medium(landing: PathLanding, bin: u32) -> u32 {
    return part_from(exp(-absorption_at(bin, landing.medium) * landing.length));
}

// A corner's share of the bins of a node, as XYZ.
fn share_weight(cell: FootprintCell, node: u32, material: u32) -> vec3<u32> {
    let start = cell.first + share_start(params.nodes, node, cell.bins);
    let end = cell.first + share_start(params.nodes, node + 1u, cell.bins);
    return band_weight(end, material) - band_weight(start, material);
}

// Paths go apart, and the cell is not split further: every path is put down where it lands.
fn lay_points(emitted: Emitted, order: u32) {
    for (var path = 0u; path < 4u * params.nodes; path++) {
        let corner = path / params.nodes;
        let node = path % params.nodes;
        let landing = landing_of(emitted, corner, node, order);
        if landing.end == END_LANDED {
            let face = landing.place & 0xffu;
            let passed = flux_part((emitted.flux + corner) / 4u, landing.part);
            let flux = flux_part(passed, absorbed_by_medium(landing, node_bin(params.nodes, node, emitted.cell)));
            let weight = share_weight(emitted.cell, node, landing.place >> 8u);
            let at = map_texel(face, landing.texel);
            for (var c = 0u; c < 3u; c++) {
                put_down(face, at, vec2<f32>(1.0), c, flux_part(flux, weight[c]));
            }
        }
    }
}

const LEDGER_SUMS: u32 = 180u; // MOST_NODES * LEDGER_ROWS * LEDGER_WORDS

var<workgroup> sums: array<atomic<u32>, LEDGER_SUMS>;

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
fn keep_books(emitted: Emitted) {
    for (var path = 0u; path < 4u * params.nodes; path++) {
        let corner = path / params.nodes;
        let node = path % params.nodes;
        let start = cell_share(emitted, node);
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
        for (var order = 0u; order < params.orders; order++) {
            let landing = landing_of(emitted, corner, node, order);
            running += landing.part;
            let own = flux_part(flux, running) - booked;
            booked += own;
            if landing.end == END_LANDED {
                let bin = node_bin(params.nodes, node, emitted.cell);
                let lands = flux_part(own, absorbed_by_medium(landing, bin));
                book(node, LEDGER_ABSORBED, own - lands, corner);
                book(node, LEDGER_FIRST_END + END_LANDED, lands, corner);
            } else {
                book(node, LEDGER_FIRST_END + landing.end, own, corner);
            }
        }
    }
}

// Luminous flux of the bins of a node.
fn cell_share(emitted: Emitted, node: u32) -> u32 {
    let cell = emitted.cell;
    let start = band_weight(cell.first + share_start(params.nodes, node, cell.bins), params.materials).y;
    let end = band_weight(cell.first + share_start(params.nodes, node + 1u, cell.bins), params.materials).y;
    return flux_part(emitted.flux, end) - flux_part(emitted.flux, start);
}

// Room for so many cells in the next queue.
fn claim(cells: u32) -> u32 {
    let slot = atomicAdd(&queues[params.next + QUEUE_COUNT], cells);
    let groups = ((slot + cells) * 4u * params.nodes + CELLS - 1u) / CELLS;
    atomicMax(&queues[params.next + QUEUE_GROUPS], min(groups, params.max_groups));
    atomicMax(&queues[params.next + QUEUE_GROUPS + 1u], (groups + params.max_groups - 1u) / params.max_groups);
    atomicMax(&queues[params.next + QUEUE_GROUPS + 2u], 1u);
    return slot;
}

fn queue_cell_at(slot: u32, cell: FootprintCell) {
    let words = cell_words(cell);
    let word = params.next + CELLS_HEAD + CELL_WORDS * slot;
    atomicStore(&queues[word], words.x);
    atomicStore(&queues[word + 1u], words.y);
}

// What a cell is split into.
struct Split {
    parts: vec2<u32>, // in x and y
    ranges: u32,      // of bins
    stake: u32,
}

fn split_of(emitted: Emitted) -> Split {
    let cell = emitted.cell;
    var apart = TOGETHER;
    var at_stake = 0u;
    for (var order = 0u; order < params.orders; order++) {
        let part = stake(emitted, order);
        if part < NEGLIGIBLE {
            continue;
        }
        var own = belonging(emitted, order);
        if own == TOGETHER {
            gather(emitted, order, landing_of(emitted, 0u, 0u, order).place & 0xffu);
            let extent = extent_of();
            own = select(0u, APART_IN_X, extent.across > MOST_TEXELS) | select(0u, APART_IN_Y, extent.down > MOST_TEXELS);
        }
        if own != TOGETHER {
            apart |= own;
            at_stake = max(at_stake, part);
        }
    }
    if (apart & (APART_IN_X | APART_IN_Y)) == 0u && hides_detail(emitted) {
        apart |= APART_IN_X | APART_IN_Y;
        at_stake = max(at_stake, WHOLE >> (cell.level.x + cell.level.y));
    }
    // An edge along one side is worth more splits: they do not become more with every one.
    let along_side = (apart & (APART_IN_X | APART_IN_Y)) != (APART_IN_X | APART_IN_Y);
    let most = select(params.most_level, params.most_edge_level, along_side);
    let in_x = (apart & APART_IN_X) != 0u && cell.level.x < most;
    let in_y = (apart & APART_IN_Y) != 0u && cell.level.y < most;
    let in_bands = !in_x && !in_y && (apart & BANDS_APART) != 0u && cell.bins > LEAST_BINS;
    return Split(vec2<u32>(select(1u, 2u, in_x), select(1u, 2u, in_y)), select(1u, 2u, in_bands), at_stake);
}

// Two bits behind the first of a stake, and which bit that is.
fn class_of(at_stake: u32) -> u32 {
    let bit = firstLeadingBit(max(at_stake, NEGLIGIBLE));
    return min(4u * (bit - 24u) + ((max(at_stake, NEGLIGIBLE) >> (bit - 2u)) & 3u), CLASSES - 1u);
}

// No class below this one goes into the next queue: all from it on together do.
fn least_class() -> u32 {
    var cells = 0u;
    for (var above = 0u; above < CLASSES; above++) {
        cells += atomicLoad(&queues[params.next + QUEUE_HEAD + CLASSES - 1u - above]);
        if cells > params.capacity {
            return CLASSES - above;
        }
    }
    return 0u;
}

// True where the cell goes on in the next queue, in parts. Which cells do hangs on numbers of cells alone, not on their order.
fn splits(emitted: Emitted) -> bool {
    if params.next == NO_QUEUE {
        return false;
    }
    let split = split_of(emitted);
    let cells = split.parts.x * split.parts.y * split.ranges;
    if cells == 1u {
        return false;
    }
    let class_ = class_of(split.stake);
    if params.task == TASK_COUNT {
        atomicAdd(&queues[params.next + QUEUE_HEAD + class_], cells);
        return true;
    }
    if class_ < least_class() {
        return false;
    }
    let cell = emitted.cell;
    let slot = claim(cells);
    let bins = cell.bins / split.ranges;
    for (var part = 0u; part < cells; part++) {
        let at = split.parts * cell.at + vec2<u32>(part % split.parts.x, part / split.parts.x % split.parts.y);
        let first = cell.first + bins * select(0u, part, split.ranges == 2u);
        queue_cell_at(slot + part, FootprintCell(at, cell.level + split.parts - 1u, first, bins));
    }
    return true;
}

const CELLS: u32 = 64u; // per workgroup

@compute @workgroup_size(64, 1, 1)
fn footprint_splat(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    for (var i = local; i < LEDGER_SUMS; i += CELLS) {
        atomicStore(&sums[i], 0u);
    }
    workgroupBarrier();
    let i = CELLS * queue_row(group, params.max_groups) + local;
    var exists = false;
    var emitted = Emitted(FootprintCell(vec2<u32>(0u), vec2<u32>(0u), 0u, params.bins), 0u, 0u, 0u);
    if params.queue == NO_QUEUE {
        let size = views[params.emission_view].size;
        let cells = size - 1u;
        exists = i < cells.x * cells.y;
        let at = vec2<u32>(i % cells.x, i / cells.x);
        emitted.cell.at = at;
        emitted.place = at.y * size.x + at.x;
        emitted.row = size.x;
    } else {
        exists = i < atomicLoad(&queues[params.queue + QUEUE_COUNT]);
        if exists {
            let word = params.queue + CELLS_HEAD + CELL_WORDS * i;
            emitted.cell = cell_from_words(vec2<u32>(atomicLoad(&queues[word]), atomicLoad(&queues[word + 1u])));
            emitted.place = 4u * i;
            emitted.row = 2u;
        }
    }
    if exists && !splits(emitted) && params.task == TASK_LAY {
        emitted.flux = cell_flux(emitted.cell);
        keep_books(emitted);
        for (var order = 0u; order < params.orders; order++) {
            if belonging(emitted, order) != TOGETHER {
                lay_points(emitted, order);
            } else if landing_of(emitted, 0u, 0u, order).end == END_LANDED {
                lay_footprint(emitted, order);
            }
        }
    }
    workgroupBarrier();
    for (var word = local; word < LEDGER_SUMS; word += CELLS) {
        let value = atomicLoad(&sums[word]);
        let kind = word % LEDGER_WORDS;
        if value == 0u || word / (LEDGER_WORDS * LEDGER_ROWS) >= params.nodes {
            continue;
        }
        let to = LEDGER_WORDS * LEDGER_ROWS * params.first_ledger + word;
        let before = atomicAdd(&ledger[to], value);
        if kind == 0u && before + value < before {
            atomicAdd(&ledger[to + 1u], 1u);
        }
    }
}
