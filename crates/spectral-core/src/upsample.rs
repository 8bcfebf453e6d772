//! Smooth spectra from colours.
//!
//! A reflectance is the sigmoid of a quadratic in the wavelength (Jakob & Hanika 2019, "A Low-Dimensional Function
//! Space for Efficient Spectral Upsampling"), so it lies between 0 and 1 everywhere and has one hump or one notch.
//! The paper tabulates coefficients; here they are solved for each colour, by Newton's method with backtracking on
//! linear sRGB under D65 and the CIE 1931 observer, 380 to 780 nm by 1 nm, normalised so that reflectance 1 is
//! D65's white exactly. Greys are constants and are not solved at all.
//!
//! Every colour of the sRGB cube lies inside the solid of object colours, so a spectrum exists for it; colours near
//! saturated corners only need steep flanks. [`SmoothSpectrum::linear_srgb`] says what colour a spectrum really has;
//! the tests hold the difference below 1e-12 over the cube, corners included, and below 1e-6 within 1e-3 of black or
//! white, where a saturated colour is a needle or a notch too narrow for the 1 nm steps.

use alloc::vec::Vec;

use num_traits::Float;
use serde::{Deserialize, Serialize};

use crate::illuminant::Illuminant;
use crate::mat3::{self, Mat3};
use crate::observer::{Observer, VISIBLE_NM};
use crate::rgb::{D65_WHITE_XYZ, RgbSpace, luminance};

/// A smooth spectrum between 0 and 1, from 380 to 780 nm and beyond.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SmoothSpectrum(Shape);

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Shape {
    Constant(f64),
    /// Coefficients of t^2, t and 1; see [`unit_wavelength`].
    Sigmoid([f64; 3]),
}

/// Colours whose components all lie within this of 0 or of 1 are taken for black or white: their flanks would need
/// coefficients beyond 1e6, where the search direction is lost in rounding.
const NEAR_BLACK_OR_WHITE: f64 = 1e-12;

/// Newton steps before the search gives up; colours inside the cube take about ten.
const MAX_STEPS: usize = 64;
/// The shortest share of a Newton step that backtracking tries.
const SHORTEST_STEP: f64 = 1e-4;

impl SmoothSpectrum {
    /// The constant 1: white, or no change at all.
    pub const ONE: Self = Self(Shape::Constant(1.0));

    /// The reflectance that has the colour `linear_srgb` under D65 and CIE 1931. Components are clamped to 0..1
    /// first, NaN to 0: for a light's colour divide by the largest component and keep the scale yourself.
    ///
    /// White gives exactly 1, black exactly 0 and any grey exactly itself, at every wavelength.
    pub fn reflectance(linear_srgb: [f64; 3]) -> Self {
        let target = linear_srgb.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) });
        let [r, g, b] = target;
        if r == g && g == b {
            return Self(Shape::Constant(r));
        }
        if target.iter().all(|c| *c < NEAR_BLACK_OR_WHITE) {
            return Self(Shape::Constant(0.0));
        }
        if target.iter().all(|c| 1.0 - *c < NEAR_BLACK_OR_WHITE) {
            return Self::ONE;
        }
        Self(Shape::Sigmoid(Solver::new().solve(target)))
    }

    /// Value at a wavelength in nm, 0 to 1. Outside 380 to 780 nm the formula simply goes on.
    pub fn at(&self, lambda_nm: f64) -> f64 {
        match self.0 {
            Shape::Constant(value) => value,
            Shape::Sigmoid(c) => sigmoid(quadratic(c, unit_wavelength(lambda_nm))),
        }
    }

    /// Its colour as a reflectance under D65 and CIE 1931: what [`SmoothSpectrum::reflectance`] was asked for, up to
    /// the residual of the solution.
    pub fn linear_srgb(&self) -> [f64; 3] {
        match self.0 {
            Shape::Constant(value) => [value; 3],
            Shape::Sigmoid(c) => Solver::new().linear_srgb(c),
        }
    }
}

/// -1 at 380 nm, 1 at 780 nm.
fn unit_wavelength(lambda_nm: f64) -> f64 {
    (lambda_nm - 0.5 * (VISIBLE_NM.0 + VISIBLE_NM.1)) / (0.5 * (VISIBLE_NM.1 - VISIBLE_NM.0))
}

fn quadratic(c: [f64; 3], t: f64) -> f64 {
    (c[0] * t + c[1]) * t + c[2]
}

/// 1/2 + x / (2 sqrt(1 + x^2)), eq. 4 of the paper, written so that neither tail cancels.
fn sigmoid(x: f64) -> f64 {
    let h = Float::sqrt(1.0 + x * x);
    let tail = 0.5 / (h * (h + x.abs()));
    if x < 0.0 { tail } else { 1.0 - tail }
}

/// Inverse of [`sigmoid`] for 0 < s < 1.
fn inverse_sigmoid(s: f64) -> f64 {
    (s - 0.5) / Float::sqrt(s * (1.0 - s))
}

/// One quadrature node: linear sRGB of unit reflectance in a 1 nm band.
struct Band {
    t: f64,
    linear_srgb: [f64; 3],
}

struct Solver {
    bands: Vec<Band>,
}

/// Where the search stands: coefficients and what is missing to the target.
#[derive(Clone, Copy)]
struct Candidate {
    c: [f64; 3],
    missing: [f64; 3],
    error: f64,
}

impl Solver {
    fn new() -> Self {
        let bands_nm = (0..=400).map(|i| VISIBLE_NM.0 + f64::from(i));
        let xyz: Vec<(f64, [f64; 3])> = bands_nm
            .map(|nm| {
                let end = nm == VISIBLE_NM.0 || nm == VISIBLE_NM.1;
                let power = Illuminant::D65.relative_power(nm) * if end { 0.5 } else { 1.0 };
                (nm, Observer::Cie1931.xyz_bar(nm).map(|bar| bar * power))
            })
            .collect();
        let mut gains = D65_WHITE_XYZ;
        for (channel, gain) in gains.iter_mut().enumerate() {
            *gain /= xyz.iter().map(|(_, xyz)| xyz[channel]).sum::<f64>();
        }
        let srgb_from_band = mat3::multiply(&RgbSpace::SRGB.rgb_from_xyz(), &mat3::diagonal(gains));
        let bands = xyz
            .into_iter()
            .map(|(nm, xyz)| Band { t: unit_wavelength(nm), linear_srgb: mat3::apply(&srgb_from_band, xyz) })
            .collect();
        Self { bands }
    }

    fn linear_srgb(&self, c: [f64; 3]) -> [f64; 3] {
        let mut srgb = [0.0; 3];
        for band in &self.bands {
            let s = sigmoid(quadratic(c, band.t));
            for (sum, weight) in srgb.iter_mut().zip(band.linear_srgb) {
                *sum += s * weight;
            }
        }
        srgb
    }

    /// d(linear sRGB) / d(coefficients).
    fn jacobian(&self, c: [f64; 3]) -> Mat3 {
        let mut j = [[0.0; 3]; 3];
        for band in &self.bands {
            let x = quadratic(c, band.t);
            let h2 = 1.0 + x * x;
            let slope = 0.5 / (h2 * Float::sqrt(h2));
            for (row, weight) in j.iter_mut().zip(band.linear_srgb) {
                let by_x = weight * slope;
                row[0] += by_x * band.t * band.t;
                row[1] += by_x * band.t;
                row[2] += by_x;
            }
        }
        j
    }

    fn candidate(&self, c: [f64; 3], target: [f64; 3]) -> Candidate {
        let srgb = self.linear_srgb(c);
        let missing = [target[0] - srgb[0], target[1] - srgb[1], target[2] - srgb[2]];
        Candidate { c, missing, error: missing.iter().map(|m| m * m).sum() }
    }

    /// Coefficients for a colour that is neither grey, black nor white: from the grey of its luminance downhill until
    /// nothing improves.
    fn solve(&self, target: [f64; 3]) -> [f64; 3] {
        let mut best = self.candidate([0.0, 0.0, inverse_sigmoid(luminance(target))], target);
        for _ in 0..MAX_STEPS {
            let step = mat3::apply(&mat3::inverse(&self.jacobian(best.c)), best.missing);
            let mut length = 1.0;
            let shorter = loop {
                let c = [0, 1, 2].map(|i| best.c[i] + length * step[i]);
                let tried = self.candidate(c, target);
                // False for NaN, so a singular Jacobian ends the search.
                if tried.error < best.error {
                    break Some(tried);
                }
                length *= 0.5;
                if length < SHORTEST_STEP {
                    break None;
                }
            };
            match shorter {
                Some(tried) => best = tried,
                None => break,
            }
        }
        best.c
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;

    fn residual(linear_srgb: [f64; 3]) -> f64 {
        let back = SmoothSpectrum::reflectance(linear_srgb).linear_srgb();
        (0..3).map(|i| (back[i] - linear_srgb[i]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn white_black_and_greys_are_exact() {
        for value in [0.0, 1e-9, 0.18, 0.5, 0.9999, 1.0] {
            let spectrum = SmoothSpectrum::reflectance([value; 3]);
            assert!((360..=830).all(|nm| spectrum.at(f64::from(nm)) == value));
            assert_eq!(spectrum.linear_srgb(), [value; 3]);
        }
        assert_eq!(SmoothSpectrum::reflectance([1.0; 3]), SmoothSpectrum::ONE);
    }

    #[test]
    fn the_whole_cube_comes_back() {
        let n = 10;
        for i in 0..=n {
            for j in 0..=n {
                for k in 0..=n {
                    let c = [i, j, k].map(|v| f64::from(v) / f64::from(n));
                    // Corners included: they lie inside the solid of object colours.
                    assert!(residual(c) < 1e-12, "{c:?}: {}", residual(c));
                }
            }
        }
    }

    /// Single hues on the way to black and to white, where the spectra become needles and notches.
    #[test]
    fn nearly_black_and_nearly_white_colours_come_back() {
        for k in (0..48).map(|i| Float::powi(10.0, -(i / 4)) * [1.0, 0.56, 0.32, 0.18][(i % 4) as usize]) {
            for hue in [
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, 1.0],
                [1.0, 1.0, 0.0],
                [1.0, 0.0, 1.0],
                [0.0, 1.0, 1.0],
            ] {
                for c in [hue.map(|h| k * h), hue.map(|h| 1.0 - k * h)] {
                    let bound = if k > 1e-3 { 1e-12 } else { 1e-6 };
                    assert!(residual(c) < bound, "{c:?}: {}", residual(c));
                }
            }
        }
    }

    #[test]
    fn a_red_reflects_red() {
        let red = SmoothSpectrum::reflectance([0.8, 0.1, 0.1]);
        assert!(red.at(650.0) > 0.7 && red.at(520.0) < 0.2, "{red:?}");
        let blue = SmoothSpectrum::reflectance([0.05, 0.1, 0.7]);
        assert!(blue.at(450.0) > 0.6 && blue.at(620.0) < 0.15, "{blue:?}");
    }

    #[test]
    fn hostile_components_are_clamped() {
        assert_eq!(SmoothSpectrum::reflectance([f64::NAN, -1.0, f64::NEG_INFINITY]).at(500.0), 0.0);
        assert_eq!(SmoothSpectrum::reflectance([f64::INFINITY, 2.0, 1.0]), SmoothSpectrum::ONE);
        assert_eq!(
            SmoothSpectrum::reflectance([3.0, 0.5, -2.0]),
            SmoothSpectrum::reflectance([1.0, 0.5, 0.0])
        );
    }

    #[test]
    fn sigmoid_and_its_inverse_hold_in_both_tails() {
        for s in [1e-12, 1e-6, 0.2, 0.5, 0.9, 1.0 - 1e-6] {
            let back = sigmoid(inverse_sigmoid(s));
            assert!((back - s).abs() <= 4.0 * f64::EPSILON * s / (1.0 - s), "{s} {back}");
        }
        assert_eq!(sigmoid(-1e200), 0.0);
        assert_eq!(sigmoid(1e200), 1.0);
    }

    proptest! {
        #[test]
        fn interior_colours_come_back(r in 0.001..0.999, g in 0.001..0.999, b in 0.001..0.999) {
            prop_assert!(residual([r, g, b]) < 1e-10, "{}", residual([r, g, b]));
        }

        #[test]
        fn every_colour_gives_a_spectrum_between_0_and_1(c in prop::array::uniform3(prop::num::f64::ANY)) {
            let spectrum = SmoothSpectrum::reflectance(c);
            for nm in (360..=830).step_by(10) {
                let value = spectrum.at(f64::from(nm));
                prop_assert!((0.0..=1.0).contains(&value), "{:?} {} nm: {}", spectrum, nm, value);
            }
        }

        /// Steps in colour give comparable steps in the spectrum: no jumps between neighbouring solutions.
        #[test]
        fn spectra_change_continuously(r in 0.05..0.95, g in 0.05..0.95, b in 0.05..0.95) {
            let (a, b) = (SmoothSpectrum::reflectance([r, g, b]), SmoothSpectrum::reflectance([r, g, b + 1e-6]));
            for nm in (380..=780).step_by(20) {
                let nm = f64::from(nm);
                prop_assert!((a.at(nm) - b.at(nm)).abs() < 1e-4, "{} nm: {} {}", nm, a.at(nm), b.at(nm));
            }
        }
    }
}
