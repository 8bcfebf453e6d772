// The map's views, fitted to where light lands: snapped outwards to cells of the landing views, so that they stand still while
// light hardly moves and rounding does not choose. Host side: `passes/map_fit.rs`.

struct MapFit {
    landing_view: u32, // first of the views that light was sought in
    map_view: u32,     // first of the map's
    faces: u32,        // number of each
    cells: u32,        // along a side of a landing view
    least: vec2<u32>,  // cells that the map shows at least
    margin: u32,       // cells beyond the outermost that hold a landing
    spread: f32,       // the map's side over what its guard leaves of it
}

@group(0) @binding(0) var<uniform> params: MapFit;
@group(0) @binding(1) var<storage, read> bounds: array<u32>; // see `landing_bounds_add` of photon_trace.wgsl
@group(0) @binding(2) var<storage, read_write> views: array<View>;

// First cell and the one after the last along a side of `size` texels, where nothing lies nearer than `from_end` to its end
// and `from_start` to its start.
fn fitted_cells(from_end: u32, from_start: u32, size: u32, least: u32) -> vec2<u32> {
    let cells = params.cells;
    var first = (size - from_end) * cells / size;
    var last = (from_start * cells + size - 1u) / size;
    first -= min(first, params.margin);
    last = min(last + params.margin, cells);
    if last - first < least {
        first -= min(first, (least - (last - first)) / 2u);
        last = min(first + least, cells);
        first = last - least;
    }
    return vec2<u32>(first, last);
}

@compute @workgroup_size(8, 1, 1)
fn map_fit(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= params.faces {
        return;
    }
    var view = views[params.landing_view + id.x];
    let word = 4u * id.x;
    if bounds[word] != 0u {
        let x = fitted_cells(bounds[word], bounds[word + 1u], view.size.x, params.least.x);
        let y = fitted_cells(bounds[word + 2u], bounds[word + 3u], view.size.y, params.least.y);
        // Texels count rows downwards, slopes go up.
        let middle = vec2<f32>(f32(x.x + x.y), -f32(y.x + y.y)) / f32(params.cells) + vec2<f32>(-1.0, 1.0);
        let share = vec2<f32>(f32(x.y - x.x), f32(y.y - y.x)) / f32(params.cells) * params.spread;
        // What is not finer stays as it is.
        let finer = share < vec2<f32>(1.0);
        view.slope_center = select(view.slope_center, view.slope_center + middle * view.slope_half, finer);
        view.texel_slope = select(view.texel_slope, view.texel_slope * share, finer);
        view.slope_half = select(view.slope_half, view.slope_half * share, finer);
    }
    views[params.map_view + id.x] = view;
}
