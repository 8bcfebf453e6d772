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

fn part_of(flux: vec3<u32>, part: u32) -> vec3<u32> {
    return vec3<u32>(flux_part(flux.x, part), flux_part(flux.y, part), flux_part(flux.z, part));
}

// Spreads flux, XYZ, under a tent that falls to nothing `half` texels from its middle; shares are differences of rounded running ones,
// so they add up to it. What lies beyond the map's edge falls on its last texel. Side by side, tents as wide as two of their distances
// are even, and nearly so however the lattice of their middles is turned, which boxes are not.
fn splat_tent(map_size: vec2<u32>, face: u32, middle: vec2<f32>, half: vec2<f32>, flux: vec3<u32>) {
    let size = vec2<i32>(map_size);
    let reach = clamp(half, vec2<f32>(1e-3), vec2<f32>(0.5 * (MOST_TAPS - 1.0)));
    let held = clamp(middle, vec2<f32>(0.0), vec2<f32>(size));
    let first = vec2<i32>(floor(held - reach));
    let last = vec2<i32>(floor(held + reach));
    var before_y = vec3<u32>(0u);
    for (var y = first.y; y <= last.y; y++) {
        let until_y = part_of(flux, select(part_from(tent_before((f32(y + 1) - held.y) / reach.y)), WHOLE, y == last.y));
        let row = until_y - before_y;
        before_y = until_y;
        let line = i32(face) * size.y + clamp(y, 0, size.y - 1);
        var before_x = vec3<u32>(0u);
        for (var x = first.x; x <= last.x; x++) {
            let until_x = part_of(row, select(part_from(tent_before((f32(x + 1) - held.x) / reach.x)), WHOLE, x == last.x));
            let own = until_x - before_x;
            before_x = until_x;
            let word = 6u * u32(line * size.x + clamp(x, 0, size.x - 1));
            if any(own > vec3<u32>(0u)) {
                add_64(word, own.x);
                add_64(word + 2u, own.y);
                add_64(word + 4u, own.z);
            }
        }
    }
}
