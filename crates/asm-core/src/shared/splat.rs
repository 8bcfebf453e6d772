//! Host side of `shaders/shared/splat.wgsl`: adding flux to a map of 64-bit fixed point, XYZ per texel, two words per channel
//! with the low one first.

use std::sync::atomic::AtomicU32;

use glam::{IVec2, Vec2};

use super::flux::{WHOLE, add_64, flux_part, part_from};
use super::light_views::Located;
use super::view::View;

/// Taps along one axis; reach is at most 8.
const MAX_TAPS: usize = 17;

/// Adds `deposit` to the map round `at`, over `reach` texels to each side, at most 8; 0 is a point. The taps of a Gaussian are differences of rounded cumulative shares, so they
/// sum to the deposit. Taps beyond the map's edge fall on its last texel.
pub fn splat(views: &[View], at: &Located, deposit: [u32; 3], reach: u32, sigma: f32, map: &[AtomicU32]) {
    let size = views[at.view as usize].size.as_ivec2();
    let center = at.texel.as_ivec2();
    let face = at.face as i32 * size.x * size.y;
    let add = |texel: IVec2, c: usize, value: u32| {
        let word = 2 * (3 * (face + texel.y * size.x + texel.x) as usize + c);
        add_64(&map[word..word + 2], u64::from(value));
    };
    if reach == 0 {
        for (c, value) in deposit.into_iter().enumerate() {
            add(center, c, value);
        }
        return;
    }
    let taps = 2 * reach as usize + 1;
    let offset = at.texel - at.texel.floor() - 0.5 + reach as f32;
    let sharpness = -0.5 / (sigma * sigma);
    let tap = |i: usize| {
        let d = Vec2::splat(i as f32) - offset;
        (sharpness * d * d).exp()
    };
    let mut sum = Vec2::ZERO;
    for i in 0..taps {
        sum += tap(i);
    }
    let mut shares = [[WHOLE; 2]; MAX_TAPS];
    let mut running = Vec2::ZERO;
    for (i, share) in shares.iter_mut().enumerate().take(taps - 1) {
        running += tap(i);
        *share = [part_from(running.x / sum.x), part_from(running.y / sum.y)];
    }
    let first = center - reach as i32;
    for (c, value) in deposit.into_iter().enumerate() {
        let mut before_y = 0;
        for j in 0..taps {
            let until_y = flux_part(value, shares[j][1]);
            let row = until_y - before_y;
            before_y = until_y;
            let mut before_x = 0;
            for (i, share) in shares.iter().enumerate().take(taps) {
                let until_x = flux_part(row, share[0]);
                let texel = (first + IVec2::new(i as i32, j as i32)).clamp(IVec2::ZERO, size - 1);
                add(texel, c, until_x - before_x);
                before_x = until_x;
            }
        }
    }
}
