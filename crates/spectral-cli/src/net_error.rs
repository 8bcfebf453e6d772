//! A rung's own error: the distance from the oracle without the oracle's noise.
//!
//! Squares of independent errors add up, so what is left of a mean square when that of the noise is taken away is the rung's
//! own. One half of the oracle against the mean of both has the mean square of that mean's error; over the texels of a map both
//! are known to a few per cent.

use serde::Serialize;

use crate::metrics::Metrics;

/// Below this share of the noise nothing is known: what is left there counts as this share.
const KNOWN: f64 = 0.25;

/// A distance without the noise in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Net {
    /// Not below a quarter of the noise.
    pub error: f64,
    /// It is that quarter: the rung may be better.
    pub hidden: bool,
}

/// Without the noise, both as roots of mean squares.
fn root(distance: f64, noise: f64) -> Net {
    let (left, least) = (distance * distance - noise * noise, KNOWN * noise);
    if left > least * least {
        Net { error: left.sqrt(), hidden: false }
    } else {
        Net { error: least, hidden: noise > 0.0 }
    }
}

/// Relative RMS of Y.
#[must_use]
pub fn rms(distance: &Metrics, noise: &Metrics) -> Net {
    root(distance.rms, noise.rms)
}

/// Mean CIEDE2000: the mean, less the share that noise has in the RMS.
#[must_use]
pub fn delta_e_mean(distance: &Metrics, noise: &Metrics) -> Option<Net> {
    let (mean, own, noise) = (distance.delta_e_mean?, distance.delta_e_rms?, noise.delta_e_rms?);
    let net = root(own, noise);
    // Equal maps have neither.
    let share = if own > 0.0 { net.error / own } else { 0.0 };
    Some(Net { error: mean * share, ..net })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::{Map, compare, mean_of};

    #[test]
    fn what_is_known_is_what_noise_leaves() {
        assert_eq!(root(5.0, 4.0), Net { error: 3.0, hidden: false });
        assert_eq!(root(3.0, 0.0), Net { error: 3.0, hidden: false });
        assert_eq!(root(4.0, 4.0), Net { error: 1.0, hidden: true });
        assert_eq!(root(3.9, 4.0), Net { error: 1.0, hidden: true });
        assert_eq!(root(0.0, 0.0), Net { error: 0.0, hidden: false });
    }

    /// A number in -1..1 that looks random, from an integer.
    fn noise(i: usize) -> f32 {
        let x = (i as u64).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        ((x >> 40) as f32 / (1 << 23) as f32) - 1.0
    }

    #[test]
    fn a_noisy_oracle_gives_the_error_that_an_exact_one_would() {
        const WHITE: [f64; 3] = [0.95047, 1.0, 1.08883];
        const SIZE: usize = 128;
        let exact: Vec<[f32; 3]> =
            (0..SIZE * SIZE).map(|i| WHITE.map(|w| w as f32 * (1.5 + (i as f32 * 0.01).sin()))).collect();
        // Too much X: a fault in colour and none in Y; and a bright band.
        let rung: Vec<[f32; 3]> = exact
            .iter()
            .enumerate()
            .map(|(i, [x, y, z])| if i % 8 == 0 { [*x, y * 1.1, *z] } else { [x * 1.02, *y, *z] })
            .collect();
        let half = |seed: usize| -> Vec<[f32; 3]> {
            let texel = |(i, xyz): (usize, &[f32; 3])| {
                std::array::from_fn(|c| xyz[c] * (1.0 + 0.05 * noise(seed + 3 * i + c)))
            };
            exact.iter().enumerate().map(texel).collect()
        };
        let halves = [half(0), half(1 << 20)];
        let mean = mean_of(&halves[0], &halves[1]);
        let map = |xyz| Map { size: [SIZE, SIZE], xyz };
        let distance = |a: &[[f32; 3]], b: &[[f32; 3]]| {
            compare(&Map { xyz: a, ..map(&exact) }, &Map { xyz: b, ..map(&exact) }, WHITE).expect("maps")
        };
        let (truth, seen, own) =
            (distance(&rung, &exact), distance(&rung, &mean), distance(&halves[0], &mean));
        let net = rms(&seen, &own);
        assert!(seen.rms > 1.1 * truth.rms, "the noise shows: {} {}", seen.rms, truth.rms);
        assert!((net.error / truth.rms - 1.0).abs() < 0.03, "{} {}", net.error, truth.rms);
        let (net, truth) = (delta_e_mean(&seen, &own).expect("lit"), truth.delta_e_mean.expect("lit"));
        let seen = seen.delta_e_mean.expect("lit");
        assert!(seen > 1.1 * truth, "the noise shows: {seen} {truth}");
        assert!((net.error / truth - 1.0).abs() < 0.1, "{} {truth}", net.error);
    }
}
