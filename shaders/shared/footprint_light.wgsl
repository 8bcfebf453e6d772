// How much light a cell has, of which wavelengths, and what the first surface's material takes of it. Host side: asm-core's
// `shared/footprint_light.rs`.
//
// Expects the globals `params.cells`, `params.light`, `views`, `bands` and those of `footprint_landings.wgsl`.

// A light whose cells are laid down.
struct FootprintLight {
    spot_axis: vec3<f32>,
    spot_scale: f32,   // squared clamp(cosine * scale + offset) is the cone's falloff
    spot_offset: f32,
    first_band: u32,   // row of this light, in `bands`
    first_ledger: u32, // row of this light and path
    reserved0: u32,
}

// All light of the bins before one, where it lands on one material.
struct RunningBand {
    weight: vec3<u32>, // XYZ as parts, see flux.wgsl
    reserved0: u32,
    moment: vec3<u32>, // integral of place in the spectrum, 0 to 1, times XYZ, as parts
    reserved1: u32,
}

// Flux at a texel's centre.
fn texel_flux(texel: vec2<u32>) -> f32 {
    let view = views[params.cells.emission_view];
    let direction = view_ray(view, vec2<f32>(texel) + 0.5).direction;
    let falloff = spot_falloff(direction, params.light.spot_axis, params.light.spot_scale, params.light.spot_offset);
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

fn running_band(bin: u32, material: u32) -> RunningBand {
    return bands[(params.light.first_band + bin) * (params.cells.materials + 1u) + material];
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

// XYZ of all light before a place in the spectrum, as parts.
fn weight_before(bin: f32, material: u32) -> vec3<f32> {
    let lower = min(u32(bin), params.cells.bins - 1u);
    let a = vec3<f32>(band_weight(lower, material));
    let b = vec3<f32>(band_weight(lower + 1u, material));
    return mix(a, b, bin - f32(lower));
}

// What glass absorbs of a range is averaged over so many parts of it.
const ABSORBING_BANDS: u32 = 8u;

// What a surface takes, which may be steeper.
const SURFACE_BANDS: u32 = 32u;

// What a first surface's material does to each channel.
struct Colour {
    absorptions: vec3<f32>, // per working unit
    surfaces: vec3<f32>,    // what its surface lets through or throws back
}

// Share of the flux of each channel that comes through at a corner, each at its own abscissa. What depends on the wavelength through the
// first surface's material is not interpolated between nodes: that is taken off there, and put back here.
fn passes_at(corner: u32, x: vec3<f32>, colour: Colour) -> vec3<f32> {
    let first = corner * MOST_NODES;
    let shares = vec4<f32>(parts[first], parts[first + 1u], parts[first + 2u], parts[first + 3u]) / max(surfaces, vec4<f32>(LEAST_SURFACE));
    let ways = vec4<f32>(lengths[first], lengths[first + 1u], lengths[first + 2u], lengths[first + 3u]);
    let w_x = node_weights(params.cells.nodes, nodes_at, x.x);
    let w_y = node_weights(params.cells.nodes, nodes_at, x.y);
    let w_z = node_weights(params.cells.nodes, nodes_at, x.z);
    let part = vec3<f32>(dot(w_x, shares), dot(w_y, shares), dot(w_z, shares));
    let inside = vec3<f32>(dot(w_x, ways), dot(w_y, ways), dot(w_z, ways));
    return clamp(part * colour.surfaces, vec3<f32>(0.0), vec3<f32>(1.0)) * exp(-colour.absorptions * max(inside, vec3<f32>(0.0)));
}

// At a place in the spectrum of each channel's own, as a bin.
fn colour_at(at: vec3<f32>, material: u32) -> Colour {
    let x = optics_at(at.x, material);
    let y = optics_at(at.y, material);
    let z = optics_at(at.z, material);
    return Colour(vec3<f32>(x.absorption, y.absorption, z.absorption), vec3<f32>(x.surface, y.surface, z.surface));
}

// Share of the flux of each channel of some bins that comes through, by corner, where all of the cell lands as one.
fn passes_of(cell: FootprintCell, bin: u32, bins: u32, first: PathLanding) -> array<vec3<f32>, 4> {
    let lit = first.place >> 8u;
    let middle = optics_at(f32(cell.first + cell.bins / 2u), first.medium);
    let parts_of_range = select(select(1u, ABSORBING_BANDS, middle.absorption > 0.0), SURFACE_BANDS, middle.surface < 1.0);
    let all_parts = clamp(parts_of_range * bins / cell.bins, 1u, bins);
    let all = band_weight(bin + bins, lit) - band_weight(bin, lit);
    var passes: array<vec3<f32>, 4>;
    for (var i = 0u; i < all_parts; i++) {
        let start = bin + i * bins / all_parts;
        let end = bin + (i + 1u) * bins / all_parts;
        let weight = band_weight(end, lit) - band_weight(start, lit);
        let centroid = centroids(start, end - start, lit);
        let colour = colour_at(centroid, first.medium);
        let x = vec3<f32>(
            abscissa(cell, first.medium, centroid.x),
            abscissa(cell, first.medium, centroid.y),
            abscissa(cell, first.medium, centroid.z),
        );
        let share = select(vec3<f32>(weight) / vec3<f32>(max(all, vec3<u32>(1u))), vec3<f32>(0.0), all == vec3<u32>(0u));
        for (var corner = 0u; corner < 4u; corner++) {
            passes[corner] += share * passes_at(corner, x, colour);
        }
    }
    return passes;
}

// Bins of a node where nothing can be interpolated.
fn share_of(cell: FootprintCell, node: u32) -> vec2<u32> {
    let nodes = params.cells.nodes;
    return cell.first + vec2<u32>(share_start(nodes, node, cell.bins), share_start(nodes, node + 1u, cell.bins));
}

// What the first glass lets through of the light of some bins, channel by channel, that falls on a material.
fn comes_through(landing: PathLanding, share: vec2<u32>, material: u32) -> vec3<u32> {
    let absorptions = colour_at(centroids(share.x, share.y - share.x, material), landing.medium).absorptions;
    let through = exp(-absorptions * landing.length);
    return vec3<u32>(part_from(through.x), part_from(through.y), part_from(through.z));
}
