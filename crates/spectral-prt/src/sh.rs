//! Real spherical harmonics.
//!
//! Orthonormal on the unit sphere, without the Condon-Shortley phase: Y_1 is sqrt(3 / 4 pi) times y, z, x. The harmonic of
//! degree l and order m, -l to l, is coefficient l (l + 1) + m; z is the polar axis.

mod rotation;

use std::f64::consts::{PI, SQRT_2};

use glam::DVec3;

use crate::bands::Bands;

pub use rotation::{NotARotation, ShRotation};

/// All harmonics of a unit direction, into `out`.
///
/// They are polynomials in the direction's components (Sloan 2013, "Efficient spherical harmonic evaluation", section 2):
/// the associated Legendre functions without their power of sin(theta), normalised throughout the recurrence in the
/// degree, times the real and imaginary part of (x + i y)^m. So there is no singularity at the poles.
///
/// # Panics
/// If `out` has not [`Bands::coefficients`] entries.
pub fn evaluate(bands: Bands, direction: DVec3, out: &mut [f64]) {
    assert_eq!(out.len(), bands.coefficients(), "coefficients of another number of bands");
    let DVec3 { x, y, z } = direction;
    // sin(theta)^m times cos(m phi) and sin(m phi), and the sectoral Legendre function over sin(theta)^m.
    let (mut cos, mut sin) = (1.0, 0.0);
    let mut sectoral = (0.25 / PI).sqrt();
    for m in 0..bands.count() {
        if m > 0 {
            (cos, sin) = (x * cos - y * sin, x * sin + y * cos);
            sectoral *= ((2 * m + 1) as f64 / (2 * m) as f64).sqrt();
        }
        let scale = if m == 0 { 1.0 } else { SQRT_2 };
        let (mut before, mut legendre) = (0.0, sectoral);
        for l in m..bands.count() {
            if l > m {
                let squared = |k: usize| (k * k) as f64;
                let (l2, m2) = (squared(l), squared(m));
                let a = ((4.0 * l2 - 1.0) / (l2 - m2)).sqrt();
                let below = squared(l - 1);
                let b = ((below - m2) / (4.0 * below - 1.0)).sqrt();
                // At l = m + 1 nothing lies two degrees below: b is 0, or the square root of -0 at m = 0.
                (before, legendre) = (legendre, a * (z * legendre - b * before));
            }
            let at = l * l + l;
            out[at + m] = scale * legendre * cos;
            if m > 0 {
                out[at - m] = scale * legendre * sin;
            }
        }
    }
}

/// All harmonics of a unit direction; see [`evaluate`].
pub fn harmonics(bands: Bands, direction: DVec3) -> Vec<f64> {
    let mut out = vec![0.0; bands.coefficients()];
    evaluate(bands, direction, &mut out);
    out
}

/// The value at a unit direction of the function with these coefficients.
///
/// # Panics
/// If there are not [`Bands::coefficients`] of them.
pub fn value(bands: Bands, coefficients: &[f64], direction: DVec3) -> f64 {
    assert_eq!(coefficients.len(), bands.coefficients(), "coefficients of another number of bands");
    harmonics(bands, direction).iter().zip(coefficients).map(|(y, c)| y * c).sum()
}
