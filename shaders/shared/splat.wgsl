// Adding flux to a map of 64-bit fixed point, XYZ per texel, two words per channel with the low one first. Host side:
// asm-core's `shared/splat.rs`.
//
// Expects the globals `map` and `views`.

fn map_add(index: u32, value: u32) {
    if value == 0u {
        return;
    }
    let before = atomicAdd(&map[2u * index], value);
    if before + value < value {
        atomicAdd(&map[2u * index + 1u], 1u);
    }
}

const MAX_TAPS: u32 = 17u; // along one axis: reach is at most 8

var<private> shares_x: array<u32, MAX_TAPS>;
var<private> shares_y: array<u32, MAX_TAPS>;

fn tap(i: u32, reach: u32, sigma: f32, inside: f32) -> f32 {
    let d = f32(i) - f32(reach) - inside;
    return exp(-0.5 / (sigma * sigma) * d * d);
}

// Adds `deposit` to the map round `at`, over `reach` texels to each side in x and y; 0 is a point. The taps of a Gaussian
// of standard deviation `sigma` texels are differences of rounded cumulative shares, so they sum to the deposit. Taps
// beyond the map's edge fall on its last texel.
fn splat(at: Located, deposit: vec3<u32>, reach: vec2<u32>, sigma: vec2<f32>) {
    let size = vec2<i32>(views[at.view].size);
    let center = vec2<i32>(at.texel);
    let face = i32(at.face) * size.x * size.y;
    let taps = 2u * reach + 1u;
    let inside = at.texel - floor(at.texel) - 0.5;
    var sum = vec2<f32>(0.0);
    for (var i = 0u; i < taps.x; i++) {
        sum.x += tap(i, reach.x, sigma.x, inside.x);
    }
    for (var i = 0u; i < taps.y; i++) {
        sum.y += tap(i, reach.y, sigma.y, inside.y);
    }
    var running = vec2<f32>(0.0);
    for (var i = 0u; i < taps.x; i++) {
        running.x += tap(i, reach.x, sigma.x, inside.x);
        shares_x[i] = select(part_from(running.x / sum.x), WHOLE, i + 1u == taps.x);
    }
    for (var i = 0u; i < taps.y; i++) {
        running.y += tap(i, reach.y, sigma.y, inside.y);
        shares_y[i] = select(part_from(running.y / sum.y), WHOLE, i + 1u == taps.y);
    }
    for (var c = 0u; c < 3u; c++) {
        var before_y = 0u;
        for (var j = 0u; j < taps.y; j++) {
            let until_y = flux_part(deposit[c], shares_y[j]);
            let row = until_y - before_y;
            before_y = until_y;
            let y = clamp(center.y + i32(j) - i32(reach.y), 0, size.y - 1);
            var before_x = 0u;
            for (var i = 0u; i < taps.x; i++) {
                let until_x = flux_part(row, shares_x[i]);
                let x = clamp(center.x + i32(i) - i32(reach.x), 0, size.x - 1);
                map_add(3u * u32(face + y * size.x + x) + c, until_x - before_x);
                before_x = until_x;
            }
        }
    }
}
