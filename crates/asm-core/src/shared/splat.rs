//! Host side of `shaders/shared/splat.wgsl`: adding flux to a map of 64-bit fixed point, XYZ per texel, two words per channel
//! with the low one first.

use std::sync::atomic::AtomicU32;

use glam::{IVec2, UVec2, Vec2};

use super::flux::{WHOLE, add_64, flux_part, part_from};
use super::light_views::Located;
use super::view::View;

/// Taps along one axis; reach is at most 8.
const MAX_TAPS: usize = 17;

/// Adds `deposit` to the map round `at`, over `reach` texels to each side in x and y, at most 8; 0 is a point. The taps of a
/// Gaussian of standard deviation `sigma` texels are differences of rounded cumulative shares, so they sum to the deposit.
/// Taps beyond the map's edge fall on its last texel.
pub fn splat(views: &[View], at: &Located, deposit: [u32; 3], reach: UVec2, sigma: Vec2, map: &[AtomicU32]) {
    let size = views[at.view as usize].size.as_ivec2();
    let center = at.texel.as_ivec2();
    let face = at.face as i32 * size.x * size.y;
    let inside = at.texel - at.texel.floor() - 0.5;
    let (shares_x, shares_y) = (shares(reach.x, sigma.x, inside.x), shares(reach.y, sigma.y, inside.y));
    let first = center - reach.as_ivec2();
    for (c, value) in deposit.into_iter().enumerate() {
        let mut before_y = 0;
        for (j, share_y) in shares_y.iter().enumerate().take(2 * reach.y as usize + 1) {
            let until_y = flux_part(value, *share_y);
            let row = until_y - before_y;
            before_y = until_y;
            let mut before_x = 0;
            for (i, share_x) in shares_x.iter().enumerate().take(2 * reach.x as usize + 1) {
                let until_x = flux_part(row, *share_x);
                let texel = (first + IVec2::new(i as i32, j as i32)).clamp(IVec2::ZERO, size - 1);
                let word = 2 * (3 * (face + texel.y * size.x + texel.x) as usize + c);
                add_64(&map[word..word + 2], u64::from(until_x - before_x));
                before_x = until_x;
            }
        }
    }
}

/// Cumulative shares of the taps along one axis, `inside` being the place in the middle texel from its centre.
fn shares(reach: u32, sigma: f32, inside: f32) -> [u32; MAX_TAPS] {
    let taps = 2 * reach as usize + 1;
    let sharpness = -0.5 / (sigma * sigma);
    let tap = |i: usize| {
        let d = i as f32 - reach as f32 - inside;
        (sharpness * d * d).exp()
    };
    let sum: f32 = (0..taps).map(tap).sum();
    let mut shares = [WHOLE; MAX_TAPS];
    let mut running = 0.0;
    for (i, share) in shares.iter_mut().enumerate().take(taps - 1) {
        running += tap(i);
        *share = part_from(running / sum);
    }
    shares
}
