// Flux as integers: nothing is lost to rounding but what is counted. Host side: asm-core's `shared/flux.rs`.
//
// part      a number in 0..1 as an integer, 2^31 meaning 1
// QUANTUM   flux of the strongest texel of an emission view at one wavelength

const QUANTUM: f32 = 1073741824.0; // 2^30
const WHOLE: u32 = 0x80000000u;    // part that means 1

fn part_from(value: f32) -> u32 {
    return u32(clamp(value, 0.0, 1.0) * 2147483648.0);
}

// flux * part / 2^31, rounded to nearest; exact at part = 0 and at part = WHOLE. Needs flux <= 2^31, part <= 2^31.
fn flux_part(flux: u32, part: u32) -> u32 {
    let flux_low = flux & 0xffffu;
    let flux_high = flux >> 16u;
    let part_low = part & 0xffffu;
    let part_high = part >> 16u;
    // The 64-bit product as high * 2^32 + low.
    let low_low = flux_low * part_low;
    let middle = flux_high * part_low + (low_low >> 16u); // below 2^31 + 2^16
    let middle_2 = flux_low * part_high + (middle & 0xffffu);
    var high = flux_high * part_high + (middle >> 16u) + (middle_2 >> 16u);
    let low = (middle_2 << 16u) | (low_low & 0xffffu);
    let rounded = low + 0x40000000u;
    if rounded < low {
        high += 1u;
    }
    return (high << 1u) | (rounded >> 31u);
}
