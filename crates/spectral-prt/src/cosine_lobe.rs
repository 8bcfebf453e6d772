//! The clamped cosine, max(n . omega, 0), in spherical harmonics: the transfer of a vertex that sees the whole sky.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::bands::Bands;
use crate::cosine_power::legendre_integrals;
use crate::sh;

/// What each degree of the harmonics is multiplied with, A_l of Ramamoorthi & Hanrahan 2001, "An efficient representation for
/// irradiance environment maps", eq. 8: pi, 2 pi / 3, pi / 4, 0, -pi / 24, ...
pub fn degree_factors(bands: Bands) -> Vec<f64> {
    legendre_integrals(1.0, bands.count()).into_iter().map(|integral| TAU * integral).collect()
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
