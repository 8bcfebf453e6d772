// Where the paths of a cell land. Host side: asm-core's `shared/footprint_landings.rs`.
//
// Expects the globals `params.cells`, `landings`, `views` and `optics`.

fn path_of(emitted: Emitted, corner: u32, node: u32) -> u32 {
    return (emitted.place + (corner & 1u) + emitted.row * (corner >> 1u)) * params.cells.nodes + node;
}

fn landing_of(emitted: Emitted, corner: u32, node: u32, order: u32) -> PathLanding {
    return landings[path_of(emitted, corner, node) * params.cells.orders + order];
}

fn belonging(emitted: Emitted, order: u32) -> u32 {
    let first = landing_of(emitted, 0u, 0u, order);
    var apart = TOGETHER;
    for (var node = 0u; node < params.cells.nodes; node++) {
        let upper_left = landing_of(emitted, 0u, node, order);
        let upper_right = landing_of(emitted, 1u, node, order);
        let lower_left = landing_of(emitted, 2u, node, order);
        let lower_right = landing_of(emitted, 3u, node, order);
        apart |= select(APART_IN_X, 0u, go_together(upper_left, upper_right) && go_together(lower_left, lower_right));
        apart |= select(APART_IN_Y, 0u, go_together(upper_left, lower_left) && go_together(upper_right, lower_right));
        apart |= select(BANDS_APART, 0u, go_together(first, upper_left));
    }
    return apart;
}

// A place of the landing view on the map.
fn map_texel(face: u32, texel: vec2<f32>) -> vec2<f32> {
    let shown = views[params.cells.map_view + face];
    let slope = view_slope(views[params.cells.landing_view + face], texel);
    let offset = (slope - shown.slope_center) / shown.texel_slope;
    return 0.5 * vec2<f32>(shown.size) + vec2<f32>(offset.x, -offset.y);
}

const MOST_NODES: u32 = 4u;

// Where a cell lands, of one order: by corner and node.
var<private> places: array<vec2<f32>, 16>; // texels of the map
var<private> parts: array<f32, 16>;
var<private> lengths: array<f32, 16>;
var<private> nodes_at: vec4<f32>; // see `abscissa`
var<private> surfaces: vec4<f32>; // what the first surface's material lets through or throws back, of nodes

// Surfaces that leave less count as this.
const LEAST_SURFACE: f32 = 1e-3;

// Of a material at a place in the spectrum, as a bin.
fn optics_at(bin: f32, material: u32) -> Optics {
    let lower = min(u32(bin), params.cells.bins - 1u);
    let row = (params.cells.first_optics + lower) * params.cells.materials + material;
    let a = optics[row];
    let b = optics[row + params.cells.materials];
    let share = bin - f32(lower);
    return Optics(mix(a.index, b.index, share), mix(a.absorption, b.absorption, share), mix(a.surface, b.surface, share), 0.0);
}

fn index_at(bin: f32, material: u32) -> f32 {
    return optics_at(bin, material).index;
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

// A step of Newton's towards the bin of an abscissa.
fn nearer_bin(cell: FootprintCell, material: u32, start: f32, span: f32, x: f32, bin: f32) -> f32 {
    let last = f32(cell.first + cell.bins - 1u);
    let own = index_at(bin, material);
    let slope = index_at(min(bin, last) + 1.0, material) - index_at(min(bin, last), material);
    let step = select((start + x * span - own) / slope, 0.0, slope == 0.0);
    return clamp(bin + step, f32(cell.first), last + 1.0);
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

fn gather(emitted: Emitted, order: u32, face: u32) {
    let medium = landing_of(emitted, 0u, 0u, order).medium;
    for (var node = 0u; node < params.cells.nodes; node++) {
        let bin = f32(node_bin(params.cells.nodes, node, emitted.cell));
        nodes_at[node] = abscissa(emitted.cell, medium, bin);
        surfaces[node] = max(optics_at(bin, medium).surface, LEAST_SURFACE);
    }
    for (var path = 0u; path < 4u * params.cells.nodes; path++) {
        let corner = path / params.cells.nodes;
        let node = path % params.cells.nodes;
        let landing = landing_of(emitted, corner, node, order);
        places[corner * MOST_NODES + node] = map_texel(face, landing.texel);
        parts[corner * MOST_NODES + node] = share_of_flux(landing);
        lengths[corner * MOST_NODES + node] = landing.length;
    }
}

fn longest(d: vec2<f32>) -> f32 {
    return max(abs(d.x), abs(d.y));
}

fn place_at(corner: u32, x: f32) -> vec2<f32> {
    let w = node_weights(params.cells.nodes, nodes_at, x);
    let first = corner * MOST_NODES;
    return w.x * places[first] + w.y * places[first + 1u] + w.z * places[first + 2u] + w.w * places[first + 3u];
}

// Texels from one end of a cell to the other, and from one end of its range to the other.
struct Extent {
    across: f32,
    down: f32,
    along: f32,
}

fn extent_of() -> Extent {
    var extent = Extent(0.0, 0.0, 0.0);
    for (var node = 0u; node < params.cells.nodes; node++) {
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

// How a side of a cell lands beyond the straight line, at the middle node.
struct Curve {
    second: vec2<f32>, // difference, texels
    third: f32,        // how much that changes along the side, the larger part
    fades: f32,        // second difference of the share of the flux that a path leaves here
}

// All sides of a cell. Neighbours have the side between them in common.
struct Curves {
    upper: Curve,
    lower: Curve,
    left: Curve,
    right: Curve,
}

// Cells whose sides land further off than they are interpolated, texels, are split.
const MOST_BEND: f32 = 0.1;

// Where only one second difference is known it may change by so much of itself.
const ONE_SIDED: f32 = 2.0;

// Of a third difference, half of which is left out at either end, so much lies between the side and what it is taken for; with room for
// a fourth difference.
const LEFT_OUT: f32 = 1.0 / 64.0;

struct Difference {
    known: bool,
    second: vec2<f32>, // texels
    fades: f32,        // of the share of the flux
}

// Of three landings in a row; not known where they do not belong together.
fn second_difference(first: u32, step: u32, order: u32) -> Difference {
    let cells = params.cells;
    let a = landings[(first * cells.nodes + middle_node(cells.nodes)) * cells.orders + order];
    let b = landings[((first + step) * cells.nodes + middle_node(cells.nodes)) * cells.orders + order];
    let c = landings[((first + 2u * step) * cells.nodes + middle_node(cells.nodes)) * cells.orders + order];
    if !go_together(a, b) || !go_together(b, c) {
        return Difference(false, vec2<f32>(0.0), 0.0);
    }
    let face = a.place & 0xffu;
    let second = map_texel(face, a.texel) - 2.0 * map_texel(face, b.texel) + map_texel(face, c.texel);
    return Difference(true, second, abs(share_of_flux(a) - 2.0 * share_of_flux(b) + share_of_flux(c)));
}

// Of the side of a cell between two corners, as the ones before and behind them tell.
fn curve_of(first: u32, step: u32, before: u32, behind: u32, order: u32) -> Curve {
    var a = Difference(false, vec2<f32>(0.0), 0.0);
    var b = a;
    if before > 0u {
        a = second_difference(first - step, step, order);
    }
    if behind > 0u {
        b = second_difference(first, step, order);
    }
    if a.known && b.known {
        return Curve(0.5 * (a.second + b.second), longest(b.second - a.second), max(a.fades, b.fades));
    }
    let one = a.second + b.second;
    return Curve(one, ONE_SIDED * longest(one), a.fades + b.fades);
}

fn curves_of(emitted: Emitted, order: u32) -> Curves {
    let place = emitted.place;
    let row = emitted.row;
    return Curves(
        curve_of(place, 1u, emitted.before.x, emitted.behind.x, order),
        curve_of(place + row, 1u, emitted.before.x, emitted.behind.x, order),
        curve_of(place, row, emitted.before.y, emitted.behind.y, order),
        curve_of(place + 1u, row, emitted.before.y, emitted.behind.y, order),
    );
}

// How far the sides lie from straight lines, texels.
fn bend_of(curves: Curves) -> vec2<f32> {
    let across = max(longest(curves.upper.second), longest(curves.lower.second));
    let down = max(longest(curves.left.second), longest(curves.right.second));
    return vec2<f32>(across, down) / 8.0;
}

// How far they may lie from the curves that they are taken for, texels.
fn unevenness_of(curves: Curves) -> vec2<f32> {
    return LEFT_OUT * vec2<f32>(max(curves.upper.third, curves.lower.third), max(curves.left.third, curves.right.third));
}

// How much flux, as a share of the path's, may be more or less than is interpolated.
fn fading_of(curves: Curves) -> vec2<f32> {
    return vec2<f32>(max(curves.upper.fades, curves.lower.fades), max(curves.left.fades, curves.right.fades)) / 8.0;
}

// As fading_of, from one node to the next, beside what the first surface's material does.
fn fading_along() -> f32 {
    let nodes = params.cells.nodes;
    var most = 0.0;
    if nodes >= 3u {
        for (var corner = 0u; corner < 4u; corner++) {
            let first = corner * MOST_NODES;
            let a = parts[first] / surfaces.x;
            let b = parts[first + middle_node(nodes)] / surfaces[middle_node(nodes)];
            let c = parts[first + nodes - 1u] / surfaces[nodes - 1u];
            most = max(most, abs(a - 2.0 * b + c));
        }
    }
    return most / 8.0;
}

// Beyond the plane through the corners.
struct Beyond {
    place: vec2<f32>,
    to_right: vec2<f32>, // how that changes
    to_below: vec2<f32>,
}

fn beyond_plane(curves: Curves, x: f32, y: f32) -> Beyond {
    let across = mix(curves.upper.second, curves.lower.second, y);
    let down = mix(curves.left.second, curves.right.second, x);
    return Beyond(-0.5 * (x * (1.0 - x) * across + y * (1.0 - y) * down), (x - 0.5) * across, (y - 0.5) * down);
}
