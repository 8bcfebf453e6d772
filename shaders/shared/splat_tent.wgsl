// Adding flux to a map of 64-bit fixed point under a tent over its texels: XYZ per texel, two words per channel with the low one first.
// Host side: asm-core's `shared/splat_tent.rs`. Expects the global `map`.

fn add_64(word: u32, value: u32) {
    let before = atomicAdd(&map[word], value);
    if before + value < before {
        atomicAdd(&map[word + 1u], 1u);
    }
}

const MOST_TAPS: f32 = 16.0; // along each side

// Share of a tent over -1 to 1 that lies before a place.
fn tent_before(place: f32) -> f32 {
    let u = clamp(place, -1.0, 1.0);
    let beside = 1.0 - abs(u);
    return select(1.0 - 0.5 * beside * beside, 0.5 * beside * beside, u < 0.0);
}

// Spreads flux of one channel under a tent that falls to nothing `half` texels from its middle; shares are differences of rounded
// running ones, so they add up to it. What lies beyond the map's edge falls on its last texel. Side by side, tents as wide as two
// of their distances are even, and nearly so however the lattice of their middles is turned, which boxes are not.
fn splat_tent(map_size: vec2<u32>, face: u32, middle: vec2<f32>, half: vec2<f32>, channel: u32, flux: u32) {
    let size = vec2<i32>(map_size);
    let reach = clamp(half, vec2<f32>(1e-3), vec2<f32>(0.5 * (MOST_TAPS - 1.0)));
    let held = clamp(middle, vec2<f32>(0.0), vec2<f32>(size));
    let first = vec2<i32>(floor(held - reach));
    let last = vec2<i32>(floor(held + reach));
    var before_y = 0u;
    for (var y = first.y; y <= last.y; y++) {
        let until_y = flux_part(flux, select(part_from(tent_before((f32(y + 1) - held.y) / reach.y)), WHOLE, y == last.y));
        let row = until_y - before_y;
        before_y = until_y;
        var before_x = 0u;
        for (var x = first.x; x <= last.x; x++) {
            let until_x = flux_part(row, select(part_from(tent_before((f32(x + 1) - held.x) / reach.x)), WHOLE, x == last.x));
            let texel = clamp(vec2<i32>(x, y), vec2<i32>(0), size - 1);
            let index = (i32(face) * size.y + texel.y) * size.x + texel.x;
            if until_x != before_x {
                add_64(2u * (3u * u32(index) + channel), until_x - before_x);
            }
            before_x = until_x;
        }
    }
}
