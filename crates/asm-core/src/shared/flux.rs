//! Host side of `shaders/shared/flux.wgsl`: flux as integers, so nothing is lost to rounding but what is counted.

use std::sync::atomic::{AtomicU32, Ordering};

/// Flux of the strongest texel of an emission view at one wavelength, 2^30.
pub const QUANTUM: f32 = 1_073_741_824.0;

/// The part that means 1.
pub const WHOLE: u32 = 0x8000_0000;

/// A number in 0..1 as an integer, 2^31 meaning 1; rounds down to what f32 holds.
pub fn part_from(value: f32) -> u32 {
    (value.clamp(0.0, 1.0) * 2_147_483_648.0) as u32
}

/// flux * part / 2^31, rounded to nearest; exact at part = 0 and at part = [`WHOLE`].
pub fn flux_part(flux: u32, part: u32) -> u32 {
    ((u64::from(flux) * u64::from(part) + 0x4000_0000) >> 31) as u32
}

/// Adds to a 64-bit number held as two words, low first, as the shaders do: the carry comes from the value that the
/// addition to the low word replaced. The sum of many such additions does not depend on their order.
pub(crate) fn add_64(words: &[AtomicU32], value: u64) {
    let (low, mut high) = (value as u32, (value >> 32) as u32);
    if low != 0 && words[0].fetch_add(low, Ordering::Relaxed).checked_add(low).is_none() {
        high += 1;
    }
    if high != 0 {
        words[1].fetch_add(high, Ordering::Relaxed);
    }
}
