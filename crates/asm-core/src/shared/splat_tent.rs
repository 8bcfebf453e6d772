//! Host side of `shaders/shared/splat_tent.wgsl`: adding flux to a map of 64-bit fixed point under a tent over its texels.

use std::sync::atomic::AtomicU32;

use glam::{UVec2, Vec2};

use super::flux::{WHOLE, add_64, flux_part, part_from};

/// Taps along each side.
const MOST_TAPS: usize = 16;

/// Share of a tent over -1 to 1 that lies before a place.
fn tent_before(place: f32) -> f32 {
    let u = place.clamp(-1.0, 1.0);
    let beside = 1.0 - u.abs();
    if u < 0.0 { 0.5 * beside * beside } else { 1.0 - 0.5 * beside * beside }
}

/// Spreads flux, XYZ, under a tent that falls to nothing `half` texels from its middle; shares are differences of rounded
/// running ones, so they add up to it. What lies beyond the map's edge falls on its last texel. Side by side, tents as wide as two
/// of their distances are even, and nearly so however the lattice of their middles is turned, which boxes are not.
pub fn splat_tent(map_size: UVec2, face: u32, middle: Vec2, half: Vec2, flux: [u32; 3], map: &[AtomicU32]) {
    let size = map_size.as_ivec2();
    let reach = half.clamp(Vec2::splat(1e-3), Vec2::splat(0.5 * (MOST_TAPS as f32 - 1.0)));
    let held = middle.clamp(Vec2::ZERO, size.as_vec2());
    let first = (held - reach).floor().as_ivec2();
    let last = (held + reach).floor().as_ivec2();
    let share = |next: i32, last: bool, middle: f32, reach: f32| {
        if last { WHOLE } else { part_from(tent_before((next as f32 - middle) / reach)) }
    };
    let mut columns = [0; MOST_TAPS];
    for (part, x) in columns.iter_mut().zip(first.x..=last.x) {
        *part = share(x + 1, x == last.x, held.x, reach.x);
    }
    let mut before_y = [0; 3];
    for y in first.y..=last.y {
        let until_y = part_of(flux, share(y + 1, y == last.y, held.y, reach.y));
        let row = between(before_y, until_y);
        before_y = until_y;
        let line = face as i32 * size.y + y.clamp(0, size.y - 1);
        let mut before_x = [0; 3];
        for (x, &part) in (first.x..=last.x).zip(&columns) {
            let until_x = part_of(row, part);
            let word = 6 * (line * size.x + x.clamp(0, size.x - 1)) as usize;
            for (words, own) in map[word..word + 6].chunks_exact(2).zip(between(before_x, until_x)) {
                add_64(words, u64::from(own));
            }
            before_x = until_x;
        }
    }
}

fn part_of(flux: [u32; 3], part: u32) -> [u32; 3] {
    flux.map(|flux| flux_part(flux, part))
}

fn between(before: [u32; 3], until: [u32; 3]) -> [u32; 3] {
    std::array::from_fn(|c| until[c] - before[c])
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    fn spread(middle: Vec2, half: Vec2) -> Vec<u32> {
        let map: Vec<AtomicU32> = (0..6 * 64).map(|_| AtomicU32::new(0)).collect();
        splat_tent(UVec2::splat(8), 0, middle, half, [1_000_003, 0, 77], &map);
        let words: Vec<u32> = map.iter().map(|w| w.load(Ordering::Relaxed)).collect();
        for (c, sum) in [(0, 1_000_003), (1, 0), (2, 77)] {
            assert_eq!(words.chunks_exact(6).map(|texel| texel[2 * c]).sum::<u32>(), sum, "channel {c}");
        }
        words.chunks_exact(6).map(|texel| texel[0]).collect()
    }

    #[test]
    fn a_tent_covers_texels_by_their_share_of_it_and_nothing_is_lost() {
        let near = |got: u32, share: f64| {
            assert!((f64::from(got) - share * 1_000_003.0).abs() < 2.0, "{got}, {share}")
        };
        let even = spread(Vec2::new(3.0, 4.0), Vec2::splat(1.0));
        for (x, y) in [(2, 3), (3, 3), (2, 4), (3, 4)] {
            near(even[8 * y + x], 0.25);
        }
        // A quarter of the way from the left side to the middle lies before x = 3.
        let shifted = spread(Vec2::new(3.25, 4.5), Vec2::new(0.5, 0.25));
        near(shifted[8 * 4 + 2], 0.125);
        near(shifted[8 * 4 + 3], 0.875);
        // A point, and one beyond the edge.
        near(spread(Vec2::new(6.5, 1.5), Vec2::ZERO)[8 + 6], 1.0);
        near(spread(Vec2::new(-9.0, 20.0), Vec2::ZERO)[8 * 7], 1.0);
    }
}
