//! Spectral bases: a few coefficients in place of a sampled spectrum.
//!
//! A light L and a reflectance R meet in R(lambda) L(lambda), weighted with a colour-matching function m. A basis has two
//! sets of functions with integral chi_i phi_j = delta_ij: the light's coefficients are integral chi_j L, the albedo's,
//! three each, are integral phi_j R m, and X, Y or Z of the product is about the inner product of the two (Schwenk et al.
//! 2010, eq. 5). That replaces L by its projection sum_j phi_j (integral chi_j L), or m R by the dual projection.
//!
//! * [`Training::peercy`]: chi = phi, orthonormal, the leading left singular vectors of the scene's reflectances and
//!   lights (Peercy 1993, section 3). It is the best for the spectra themselves, in the mean square.
//! * [`Training::optimal`]: the best for what is shown. With A the rows m R of all reflectances and B the columns L of
//!   all lights, the colours of all pairs are A B = U S V^T, and chi = A^T U, phi = B V S^(-1) give exactly
//!   its best approximation of rank m (Eckart & Young 1936). It need not represent what no pair of the training shows.
//!   With [`Optimal::exact_white`] chi spans the colour-matching functions first, so that constant reflectances, white
//!   and the greys, are right to rounding under any light whatever, and the rest is the best that then remains.
//!
//! Only the products of coefficients matter: each chi_j has the norm of its phi_j. Both kinds are exact for what they were trained on when m is the rank; more is refused.

mod optimal;
mod peercy;
mod report;

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVectorView};
use num_traits::Float;
use serde::{Deserialize, Serialize};

use crate::grid::SpectralGrid;
use crate::observer::Observer;
use crate::singular::SingularValues;

pub use report::{BasisReport, LightReport};

/// Singular values below this share of the largest are rounding; those above it make the rank.
const RANK_TOLERANCE: f64 = 1e-12;

/// How a basis was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BasisKind {
    /// The singular vectors of the spectra themselves.
    Peercy,
    /// The singular vectors of the colours shown.
    Optimal(Optimal),
}

/// How [`Training::optimal`] weighs an error in XYZ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weighting {
    /// X, Y and Z alike, every light at Y = 1.
    #[default]
    Uniform,
    /// For each reflectance by the mean, over the lights, of CIE94's metric at its colour after Bradford to D65.
    Perceptual,
}

/// What [`Training::optimal`] is best at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Optimal {
    /// How errors are weighed.
    pub weighting: Weighting,
    /// Constant reflectances are exact under any light. It takes three of the coefficients, or as many as there are
    /// independent colours of the lights.
    pub exact_white: bool,
}

impl Default for Optimal {
    /// Uniform weights, white exact.
    fn default() -> Self {
        Self { weighting: Weighting::Uniform, exact_white: true }
    }
}

/// The spectra that a basis is made for, on one grid.
#[derive(Clone, Copy, Debug)]
pub struct Training<'a> {
    /// The wavelengths.
    pub grid: SpectralGrid,
    /// Whose eyes.
    pub observer: Observer,
    /// Reflectances, one value per wavelength each, not negative.
    pub reflectances: &'a [Vec<f64>],
    /// Spectral powers in any unit, one value per wavelength each, not negative: only their shapes matter.
    pub lights: &'a [Vec<f64>],
}

/// Why there is no basis, or no report of one.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BasisError {
    /// Nothing to train on.
    #[error("there are no {what}: a basis needs one at least")]
    NoSpectra {
        /// `reflectances` or `lights`.
        what: &'static str,
    },
    /// A spectrum on another grid.
    #[error("{what} {index} has {got} values, the grid has {expected} wavelengths")]
    Samples {
        /// `reflectances` or `lights`.
        what: &'static str,
        /// Which of them, from 0.
        index: usize,
        /// Its values.
        got: usize,
        /// The grid's wavelengths.
        expected: usize,
    },
    /// A negative, infinite or undefined value.
    #[error("{what} {index} is {got} at {lambda_nm} nm; spectra are finite and not negative")]
    Value {
        /// `reflectances` or `lights`.
        what: &'static str,
        /// Which of them, from 0.
        index: usize,
        /// Where, nm.
        lambda_nm: f64,
        /// The value.
        got: f64,
    },
    /// A light that nobody sees.
    #[error("lights {index} has no luminance on the grid")]
    Dark {
        /// Which of them, from 0.
        index: usize,
    },
    /// A light whose white cannot be balanced to D65.
    #[error("lights {index} has a cone response of 0 in Bradford's space: it cannot be balanced to D65")]
    NoBalance {
        /// Which of them, from 0.
        index: usize,
    },
    /// More coefficients than independent spectra, or fewer than white needs.
    #[error(
        "{asked} coefficients were asked for; with training spectra of rank {rank}, {least} to {rank} are possible"
    )]
    Coefficients {
        /// Coefficients asked for.
        asked: usize,
        /// The fewest there are: what white needs if it is to be exact, or 1.
        least: usize,
        /// The most there are.
        rank: usize,
    },
}

/// A pair of dual sets of functions; see [`self`](crate::basis).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectralBasis {
    kind: BasisKind,
    grid: SpectralGrid,
    observer: Observer,
    /// chi_j: one value per wavelength, function after function.
    light_functions: Vec<Vec<f64>>,
    /// phi_j, likewise.
    albedo_functions: Vec<Vec<f64>>,
    singular_values: Vec<f64>,
}

impl SpectralBasis {
    /// How it was found.
    pub fn kind(&self) -> BasisKind {
        self.kind
    }

    /// The wavelengths that spectra are sampled at.
    pub fn grid(&self) -> &SpectralGrid {
        &self.grid
    }

    /// Whose colour-matching functions the albedos are multiplied with.
    pub fn observer(&self) -> Observer {
        self.observer
    }

    /// Coefficients m of a light.
    pub fn coefficients(&self) -> usize {
        self.light_functions.len()
    }

    /// All singular values of the training matrix that are not rounding, as many as its rank: those of white first, where
    /// it is exact, then the others, largest first.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular_values
    }

    /// A light's coefficients, integral chi_j L: m numbers in the light's unit times nm^(1/2).
    ///
    /// # Panics
    /// If `light` has not one value per wavelength of the grid.
    pub fn light_coefficients(&self, light: &[f64]) -> Vec<f64> {
        self.light_functions.iter().map(|chi| self.grid.integral_of_product(chi, light)).collect()
    }

    /// An albedo's coefficients, integral phi_j R m for m = x, y, z: m times three numbers, nm^(1/2).
    ///
    /// # Panics
    /// If `reflectance` has not one value per wavelength of the grid.
    pub fn albedo_coefficients(&self, reflectance: &[f64]) -> Vec<[f64; 3]> {
        assert_eq!(reflectance.len(), self.grid.samples(), "a spectrum on another grid");
        let weighted = cmf_weighted(&self.grid, self.observer, reflectance);
        self.albedo_functions
            .iter()
            .map(|phi| weighted.each_ref().map(|row| self.grid.integral_of_product(phi, row)))
            .collect()
    }

    /// XYZ of an albedo under a light from the coefficients of both, in the light's unit times nm.
    pub fn xyz(albedo: &[[f64; 3]], light: &[f64]) -> [f64; 3] {
        let mut xyz = [0.0; 3];
        for (r, l) in albedo.iter().zip(light) {
            for c in 0..3 {
                xyz[c] += r[c] * l;
            }
        }
        xyz
    }

    /// The light that coefficients stand for, sum_j phi_j L_j. It may be negative where the training light is dark.
    ///
    /// # Panics
    /// If there are not m coefficients.
    pub fn light_from_coefficients(&self, coefficients: &[f64]) -> Vec<f64> {
        assert_eq!(coefficients.len(), self.coefficients(), "coefficients of another basis");
        let mut light = alloc::vec![0.0; self.grid.samples()];
        for (phi, coefficient) in self.albedo_functions.iter().zip(coefficients) {
            light.iter_mut().zip(phi).for_each(|(l, p)| *l += p * coefficient);
        }
        light
    }

    /// Condition numbers of chi and of phi, the ratio of the largest to the smallest singular value of each set of
    /// functions: 1 for an orthonormal set. Rounding of coefficients grows by that much at most.
    pub fn condition_numbers(&self) -> (f64, f64) {
        let condition = |functions: &[Vec<f64>]| {
            let values = SingularValues::of(&columns(functions)).values;
            values[0] / values[values.len() - 1]
        };
        (condition(&self.light_functions), condition(&self.albedo_functions))
    }
}

impl Training<'_> {
    /// Everything that both kinds of basis ask of the spectra.
    fn check(&self) -> Result<(), BasisError> {
        self.check_spectra("reflectances", self.reflectances)?;
        self.check_spectra("lights", self.lights)
    }

    fn check_spectra(&self, what: &'static str, spectra: &[Vec<f64>]) -> Result<(), BasisError> {
        if spectra.is_empty() {
            return Err(BasisError::NoSpectra { what });
        }
        for (index, spectrum) in spectra.iter().enumerate() {
            let (got, expected) = (spectrum.len(), self.grid.samples());
            if got != expected {
                return Err(BasisError::Samples { what, index, got, expected });
            }
            if let Some(at) = spectrum.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
                let lambda_nm = self.grid.lambda_nm(at);
                return Err(BasisError::Value { what, index, lambda_nm, got: spectrum[at] });
            }
        }
        Ok(())
    }
}

/// The rows R x, R y, R z.
fn cmf_weighted(grid: &SpectralGrid, observer: Observer, reflectance: &[f64]) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|c| {
        let row = reflectance.iter().enumerate();
        row.map(|(i, r)| r * observer.xyz_bar(grid.lambda_nm(i))[c]).collect()
    })
}

/// The matrix with these spectra as columns.
fn columns(spectra: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(spectra[0].len(), spectra.len(), |row, column| spectra[column][row])
}

/// Singular vectors have no sign of their own: the one that makes this vector's largest entry positive.
fn sign(vector: &DVectorView<'_, f64>) -> f64 {
    Float::signum(vector[vector.iamax()])
}
