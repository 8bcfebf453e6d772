//! The matrices K_n: what each wavelength carries of an RGB colour.
//!
//! K_n = M(XYZ -> RGB) Diag(W_n) M(RGB -> XYZ), so sum K_n = I where the XYZ weights sum to 1 (SPECGEN, sections 2 and
//! 3). The formula is evaluated in f64; the f32 matrices are then made to sum to the identity *exactly*, in any order:
//!
//! * Per matrix element, all K_n are rounded to multiples of one power of two g, with sum |K_n| <= 2^24 g. Every partial
//!   sum, in whatever order, is then a multiple of g below 2^24 g: a number that f32 holds, so f32 addition never rounds.
//! * What the rounded elements miss of the sum is a whole number of g. It goes to the largest of them, at most so much that
//!   none is further from the formula than 4 ulps of 1 (4 x 2^-23); what is left goes to the next largest.

use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::light::LightSpectrum;
use crate::mat3::{self, Mat3};
use crate::rgb::{D65_WHITE_XYZ, RgbSpace};
use crate::wavelengths::WavelengthSet;

/// Furthest that an element may be from the formula: 4 ulps of 1 in f32. Under a light whose matrix has elements above
/// 1, that many times more.
pub const MAX_DEVIATION: f64 = 4.0 * f32::EPSILON as f64;

/// The matrices K_n of a set of wavelengths, and the weights that they are made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectralMatrices {
    /// Name of the RGB space.
    pub rgb_space: String,
    /// K_n, row-major: rows are outputs, columns inputs.
    pub matrices: Vec<[[f32; 3]; 3]>,
    /// What they sum to in f32, in any order: the identity, or a light's colour relative to white.
    pub sum: [[f32; 3]; 3],
    /// XYZ weights behind the matrices: each channel sums to 1, or to the light's XYZ. `None` for diagonal RGB weights.
    pub weights_xyz: Option<Vec<[f64; 3]>>,
    /// What the formula makes of RGB (1, 1, 1) at each wavelength; sums to white, or to the light's RGB.
    pub weights_rgb: Vec<[f64; 3]>,
}

/// Why there are no matrices that sum exactly.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MatrixError {
    /// The RGB space has no invertible matrix, or the weights are not finite.
    #[error("matrix element ({row}, {column}) is not finite: the primaries of {rgb_space} may be collinear")]
    NotFinite {
        /// Name of the RGB space.
        rgb_space: &'static str,
        /// Row of the element.
        row: usize,
        /// Column of the element.
        column: usize,
    },
    /// No f32 matrices within the bound sum exactly: elements of both signs are too large, or the set's weights, changed
    /// by hand, do not sum to 1.
    #[error(
        "element ({row}, {column}) must sum to {target}: magnitudes adding up to {magnitude} cannot do that \
         exactly in f32 within {max_deviation:e} of the formula, which sums to {formula_sum}"
    )]
    NoExactSum {
        /// Row of the element.
        row: usize,
        /// Column of the element.
        column: usize,
        /// What it must sum to.
        target: f64,
        /// What it sums to by the formula.
        formula_sum: f64,
        /// Sum of absolute values over the wavelengths.
        magnitude: f64,
        /// The bound on the distance of each element from the formula.
        max_deviation: f64,
    },
}

impl SpectralMatrices {
    /// The matrices of a set under equal-energy light: they sum to the identity.
    ///
    /// A set with RGB weights only (`asm2013`) gives diagonal matrices of those, in any RGB space.
    ///
    /// # Errors
    /// If the RGB space is degenerate.
    pub fn new(set: &WavelengthSet, rgb: &RgbSpace) -> Result<Self, MatrixError> {
        Self::close(rgb, &formula(set, rgb), mat3::IDENTITY, set.weights_xyz.clone())
    }

    /// The matrices of a set under a light of luminance 1: white comes out as the light's colour.
    ///
    /// The weights are [`WavelengthSet::light_weights`], whose channels sum to the light's XYZ; K_n is made of these
    /// divided by the white's XYZ, so that D65 gives the identity again. A set with RGB weights only gives diagonal
    /// matrices of the RGB that the light has at each wavelength.
    ///
    /// # Errors
    /// If the RGB space is degenerate.
    pub fn for_light(
        set: &WavelengthSet,
        rgb: &RgbSpace,
        light: &LightSpectrum,
    ) -> Result<Self, MatrixError> {
        let weights_xyz = set.light_weights(light);
        let unit_xyz = light.unit_xyz(set.observer);
        let matrix = |xyz: [f64; 3]| match &set.weights_xyz {
            Some(_) => matrix_from_weight(rgb, core::array::from_fn(|c| xyz[c] / D65_WHITE_XYZ[c])),
            None => mat3::diagonal(mat3::apply(&rgb.rgb_from_xyz(), xyz)),
        };
        let formula: Vec<Mat3> = weights_xyz.iter().map(|&xyz| matrix(xyz)).collect();
        Self::close(rgb, &formula, matrix(unit_xyz), set.weights_xyz.is_some().then_some(weights_xyz))
    }

    /// Number of wavelengths.
    pub fn len(&self) -> usize {
        self.matrices.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.matrices.is_empty()
    }

    /// Largest difference, over the elements, between the f32 sum in ascending order and [`SpectralMatrices::sum`].
    pub fn sum_residual(&self) -> f32 {
        let mut sum = [[0.0_f32; 3]; 3];
        for k in &self.matrices {
            for i in 0..3 {
                for j in 0..3 {
                    sum[i][j] += k[i][j];
                }
            }
        }
        let differences = sum.iter().flatten().zip(self.sum.iter().flatten()).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f32::max)
    }

    fn close(
        rgb: &RgbSpace,
        formula: &[Mat3],
        target: Mat3,
        weights_xyz: Option<Vec<[f64; 3]>>,
    ) -> Result<Self, MatrixError> {
        let max_deviation = MAX_DEVIATION * target.iter().flatten().fold(1.0, |max: f64, v| max.max(v.abs()));
        let mut matrices = vec![[[0.0_f32; 3]; 3]; formula.len()];
        let mut sum = [[0.0_f32; 3]; 3];
        for row in 0..3 {
            for column in 0..3 {
                let target = target[row][column];
                let elements: Vec<f64> = formula.iter().map(|k| k[row][column]).collect();
                if elements.iter().chain([&target]).any(|v| !v.is_finite()) {
                    return Err(MatrixError::NotFinite { rgb_space: rgb.name, row, column });
                }
                let (closed, closed_sum) =
                    close_sum(&elements, target, max_deviation).ok_or_else(|| MatrixError::NoExactSum {
                        row,
                        column,
                        target,
                        formula_sum: elements.iter().sum(),
                        magnitude: elements.iter().map(|v| v.abs()).sum(),
                        max_deviation,
                    })?;
                for (k, element) in matrices.iter_mut().zip(closed) {
                    k[row][column] = element;
                }
                sum[row][column] = closed_sum;
            }
        }
        let weights_rgb = formula.iter().map(|k| mat3::apply(k, [1.0; 3])).collect();
        Ok(Self { rgb_space: rgb.name.into(), matrices, sum, weights_xyz, weights_rgb })
    }
}

/// K_n by the formula, in f64 and before anything is rounded.
pub fn formula(set: &WavelengthSet, rgb: &RgbSpace) -> Vec<Mat3> {
    match &set.weights_xyz {
        Some(weights) => weights.iter().map(|&w| matrix_from_weight(rgb, w)).collect(),
        None => set.weights_rgb.iter().map(|&w| mat3::diagonal(w)).collect(),
    }
}

fn matrix_from_weight(rgb: &RgbSpace, weight_xyz: [f64; 3]) -> Mat3 {
    mat3::multiply(&rgb.rgb_from_xyz(), &mat3::multiply(&mat3::diagonal(weight_xyz), &rgb.xyz_from_rgb()))
}

/// Rounds finite numbers to f32 so that they add up without rounding, in any order, to `target` as rounded with them.
/// Returns them and their sum, or `None` if that takes one of them further than `max_deviation` from what it was.
fn close_sum(exact: &[f64], target: f64, max_deviation: f64) -> Option<(Vec<f32>, f32)> {
    /// Integers up to here are exact in f32.
    const MANTISSA: f64 = 16_777_216.0;
    /// Finest step. Elements that are zero but for rounding in f64 become zero.
    const FINEST: f64 = 1.0 / (1_u64 << 40) as f64;

    let mut largest_first: Vec<usize> = (0..exact.len()).collect();
    largest_first.sort_by(|&a, &b| exact[b].abs().total_cmp(&exact[a].abs()));
    let mut step = FINEST;
    loop {
        // Whole steps beyond the half that rounding may already have taken.
        let spare = libm::floor(max_deviation / step - 0.5);
        if spare < 1.0 {
            return None;
        }
        let target_steps = libm::rint(target / step);
        let mut steps: Vec<f64> = exact.iter().map(|v| libm::rint(v / step)).collect();
        let mut missing = target_steps - steps.iter().sum::<f64>();
        for &i in &largest_first {
            let given = missing.clamp(-spare, spare);
            steps[i] += given;
            missing -= given;
        }
        let magnitude = steps.iter().map(|s| s.abs()).sum::<f64>();
        if missing == 0.0 && magnitude <= MANTISSA {
            // Adding zero turns -0 into 0.
            let closed = steps.iter().map(|s| (s * step) as f32 + 0.0).collect();
            return Some((closed, (target_steps * step) as f32 + 0.0));
        }
        step *= 2.0;
    }
}
