//! The clamped cosine, max(n . omega, 0), in spherical harmonics: the transfer of a vertex that sees the whole sky.

use std::f64::consts::PI;

use glam::DVec3;

use crate::bands::Bands;
use crate::sh;

/// What each degree of the harmonics is multiplied with, A_l of Ramamoorthi & Hanrahan 2001, "An efficient representation for
/// irradiance environment maps", eq. 8: pi, 2 pi / 3, pi / 4, 0, -pi / 24, ...
pub fn degree_factors(bands: Bands) -> Vec<f64> {
    (0..bands.count())
        .map(|l| match l {
            1 => 2.0 * PI / 3.0,
            _ if l % 2 == 1 => 0.0,
            _ => {
                // l! / (2^l (l/2)!^2), factor by factor.
                let share: f64 = (1..=l / 2).map(|k| (2 * k - 1) as f64 / (2 * k) as f64).product();
                let sign = if l % 4 == 0 { -1.0 } else { 1.0 };
                2.0 * PI * sign * share / ((l + 2) as f64 * (l as f64 - 1.0))
            }
        })
        .collect()
}

/// The coefficients of max(n . omega, 0) for the unit normal n, into `out`: A_l Y_lm(n).
///
/// # Panics
/// If `out` has not [`Bands::coefficients`] entries.
pub fn evaluate(bands: Bands, normal: DVec3, out: &mut [f64]) {
    sh::evaluate(bands, normal, out);
    for (l, factor) in degree_factors(bands).into_iter().enumerate() {
        out[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= factor);
    }
}
