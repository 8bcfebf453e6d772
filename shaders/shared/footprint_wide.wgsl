// Cells that cover many texels, each of which gathers its light. Host side: asm-core's `shared/footprint_wide.rs`.
//
// Expects the globals of `footprint_light.wgsl`, `map` and `deposits`.

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

// Where all of a cell lands as one and covers many texels: each gathers the part of the spectrum that its place sees of the cell's
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
        let first_bin = min(u32(bin_at(cell, first.medium, from_x) + 0.5), cell.first + cell.bins - 1u);
        let end_bin = u32(bin_at(cell, first.medium, to_x) + 0.5);
        let passes = passes_of(cell, first_bin, max(end_bin - first_bin, 1u), first);
        for (var i = 0u; i < 2u; i++) {
            let t = TRIANGLES[i];
            let a = place_at(t.x, middle_x);
            let side_b = place_at(t.y, middle_x) - a;
            let side_c = place_at(t.z, middle_x) - a;
            let pass_a = passes[t.x];
            let pass_b = passes[t.y] - pass_a;
            let pass_c = passes[t.z] - pass_a;
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
