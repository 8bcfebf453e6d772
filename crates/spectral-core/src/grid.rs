//! Wavelengths in equal steps, and spectra sampled on them.

use alloc::vec;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

/// Wavelengths in equal steps. A spectrum on it is a slice with one value per wavelength; its integral is the sum times
/// the step, as colorimetry at 5 nm is usually done.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpectralGrid {
    first_nm: f64,
    step_nm: f64,
    samples: usize,
}

/// Why there is no such grid, or no such line on it.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// The range is empty, or not a range.
    #[error(
        "a grid starts above 0 nm and has at least 2 samples in steps above 0, got {samples} from {first_nm} nm by {step_nm} nm"
    )]
    Range {
        /// First wavelength asked for, nm.
        first_nm: f64,
        /// Step asked for, nm.
        step_nm: f64,
        /// Samples asked for.
        samples: usize,
    },
    /// A line is outside of the grid.
    #[error("a line at {got_nm} nm is outside of the grid, {first_nm} to {last_nm} nm")]
    Line {
        /// Where it is, nm.
        got_nm: f64,
        /// The grid's first wavelength, nm.
        first_nm: f64,
        /// The grid's last wavelength, nm.
        last_nm: f64,
    },
}

impl SpectralGrid {
    /// 400 to 700 nm by 5 nm: the range of Schwenk et al. 2010, eq. 3, and the sampling it is compared with.
    pub const SCHWENK_2010: Self = Self { first_nm: 400.0, step_nm: 5.0, samples: 61 };

    /// `samples` wavelengths from `first_nm` in steps of `step_nm`.
    ///
    /// # Errors
    /// [`GridError::Range`] unless all three are finite and positive, and there are two samples or more.
    pub fn new(first_nm: f64, step_nm: f64, samples: usize) -> Result<Self, GridError> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if positive(first_nm) && positive(step_nm) && samples >= 2 {
            Ok(Self { first_nm, step_nm, samples })
        } else {
            Err(GridError::Range { first_nm, step_nm, samples })
        }
    }

    /// How many wavelengths there are.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Distance between two wavelengths, nm.
    pub fn step_nm(&self) -> f64 {
        self.step_nm
    }

    /// The wavelength of a sample, nm.
    pub fn lambda_nm(&self, sample: usize) -> f64 {
        self.first_nm + self.step_nm * sample as f64
    }

    /// The values of a function of the wavelength in nm.
    pub fn sample(&self, spectrum: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..self.samples).map(|i| spectrum(self.lambda_nm(i))).collect()
    }

    /// The integral of the product of two spectra, in their units times nm.
    ///
    /// # Panics
    /// If one of them has not one value per wavelength.
    pub fn integral_of_product(&self, a: &[f64], b: &[f64]) -> f64 {
        assert_eq!((a.len(), b.len()), (self.samples, self.samples), "spectra on another grid");
        self.step_nm * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
    }

    /// A line of unit power, shared between the two wavelengths next to it so that its power and its mean wavelength are
    /// right; 1/nm.
    ///
    /// # Errors
    /// [`GridError::Line`] outside of the grid, and for NaN.
    pub fn line(&self, lambda_nm: f64) -> Result<Vec<f64>, GridError> {
        let last_nm = self.lambda_nm(self.samples - 1);
        if !(self.first_nm..=last_nm).contains(&lambda_nm) {
            return Err(GridError::Line { got_nm: lambda_nm, first_nm: self.first_nm, last_nm });
        }
        let position = (lambda_nm - self.first_nm) / self.step_nm;
        // Truncation is floor here: position >= 0.
        let below = (position as usize).min(self.samples - 2);
        let t = position - below as f64;
        let mut spectrum = vec![0.0; self.samples];
        spectrum[below] = (1.0 - t) / self.step_nm;
        spectrum[below + 1] = t / self.step_nm;
        Ok(spectrum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;

    const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;

    #[test]
    fn the_paper_s_grid_runs_from_400_to_700() {
        assert_eq!((GRID.lambda_nm(0), GRID.lambda_nm(60)), (400.0, 700.0));
        assert_eq!(SpectralGrid::new(400.0, 5.0, 61), Ok(GRID));
    }

    #[test]
    fn a_line_keeps_its_power_and_its_place() {
        let (one, place) = (GRID.sample(|_| 1.0), GRID.sample(|l| l));
        for lambda_nm in [400.0, 402.5, 546.1, 699.999, 700.0] {
            let line = GRID.line(lambda_nm).unwrap();
            assert!((GRID.integral_of_product(&line, &one) - 1.0).abs() < 1e-12);
            assert!((GRID.integral_of_product(&line, &place) - lambda_nm).abs() < 1e-9, "{lambda_nm}");
        }
    }

    #[test]
    fn impossible_grids_and_lines_are_refused_with_the_numbers() {
        for (first_nm, step_nm, samples) in
            [(0.0, 5.0, 61), (400.0, -1.0, 61), (400.0, 5.0, 1), (f64::NAN, 5.0, 9)]
        {
            assert!(SpectralGrid::new(first_nm, step_nm, samples).is_err());
        }
        assert_eq!(
            GRID.line(760.0).unwrap_err().to_string(),
            "a line at 760 nm is outside of the grid, 400 to 700 nm"
        );
        assert!(GRID.line(f64::NAN).is_err());
    }
}
