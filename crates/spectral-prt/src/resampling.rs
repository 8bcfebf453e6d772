//! Spectra from the wavelengths that a file has to those of a grid.

use spectral_core::grid::SpectralGrid;

/// Why wavelengths are none that a spectrum could be read at.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WavelengthsError {
    /// One wavelength is no spectrum.
    #[error("{got} wavelengths; a spectrum has 2 at least")]
    Few {
        /// How many there are.
        got: usize,
    },
    /// Not in ascending order, twice, or no number.
    #[error("{got_nm} nm after {before_nm} nm; wavelengths ascend")]
    Order {
        /// The one before.
        before_nm: f64,
        /// The one that does not follow.
        got_nm: f64,
    },
    /// A part of the grid has no data.
    #[error(
        "wavelengths from {first_nm} to {last_nm} nm; {needed_first_nm} to {needed_last_nm} nm are needed"
    )]
    Range {
        /// First there is, nm.
        first_nm: f64,
        /// Last there is, nm.
        last_nm: f64,
        /// First needed, nm.
        needed_first_nm: f64,
        /// Last needed, nm.
        needed_last_nm: f64,
    },
}

/// From spectra at some wavelengths to a grid.
///
/// A spectrum is linear between its wavelengths. Each value of the grid is its mean, weighted with a tent that ends at the
/// neighbouring wavelengths of the grid, by the trapezoidal rule over the wavelengths of both. So the grid's own wavelengths
/// give their values back to the bit, coarser ones are interpolated, and a line between two of the grid's wavelengths is shared by
/// them and keeps its power.
#[derive(Clone, Debug, PartialEq)]
pub struct Resampling {
    wavelengths: usize,
    /// For each wavelength of the grid: of which values it is the weighted sum.
    weights: Vec<Vec<(usize, f64)>>,
}

impl Resampling {
    /// From `wavelengths_nm` to `grid`.
    ///
    /// # Errors
    /// [`WavelengthsError`].
    pub fn new(wavelengths_nm: &[f64], grid: &SpectralGrid) -> Result<Self, WavelengthsError> {
        let (Some(&first_nm), Some(&last_nm)) = (wavelengths_nm.first(), wavelengths_nm.last()) else {
            return Err(WavelengthsError::Few { got: 0 });
        };
        if wavelengths_nm.len() < 2 {
            return Err(WavelengthsError::Few { got: 1 });
        }
        ascending(wavelengths_nm)?;
        let (needed_first_nm, needed_last_nm) = (grid.lambda_nm(0), grid.lambda_nm(grid.samples() - 1));
        if !(first_nm <= needed_first_nm && last_nm >= needed_last_nm) {
            return Err(WavelengthsError::Range { first_nm, last_nm, needed_first_nm, needed_last_nm });
        }
        let weights = (0..grid.samples()).map(|i| weights(wavelengths_nm, grid, i)).collect();
        Ok(Self { wavelengths: wavelengths_nm.len(), weights })
    }

    /// The spectrum on the grid.
    ///
    /// # Panics
    /// If there is not one value per wavelength.
    pub fn apply(&self, spectrum: &[f64]) -> Vec<f64> {
        assert_eq!(spectrum.len(), self.wavelengths, "a spectrum at other wavelengths");
        self.weights.iter().map(|weights| weights.iter().map(|&(i, w)| w * spectrum[i]).sum()).collect()
    }
}

/// Whether each of the wavelengths is finite and longer than the one before.
pub(crate) fn ascending(wavelengths_nm: &[f64]) -> Result<(), WavelengthsError> {
    let follows = |pair: &&[f64]| pair[0].is_finite() && pair[0] < pair[1] && pair[1].is_finite();
    match wavelengths_nm.windows(2).find(|pair| !follows(pair)) {
        Some(pair) => Err(WavelengthsError::Order { before_nm: pair[0], got_nm: pair[1] }),
        None => Ok(()),
    }
}

fn weights(wavelengths_nm: &[f64], grid: &SpectralGrid, sample: usize) -> Vec<(usize, f64)> {
    let (middle, step) = (grid.lambda_nm(sample), grid.step_nm());
    let last = wavelengths_nm.len() - 1;
    let (low, high) = ((middle - step).max(wavelengths_nm[0]), (middle + step).min(wavelengths_nm[last]));
    let mut nodes: Vec<f64> = wavelengths_nm.iter().copied().filter(|&l| low < l && l < high).collect();
    nodes.extend([low, middle, high]);
    nodes.sort_by(f64::total_cmp);
    nodes.dedup();
    let mut weights: Vec<(usize, f64)> = Vec::new();
    let mut sum = 0.0;
    for (i, &node) in nodes.iter().enumerate() {
        let (before, after) = (nodes[i.saturating_sub(1)], nodes[(i + 1).min(nodes.len() - 1)]);
        let weight = (1.0 - (node - middle).abs() / step).max(0.0) * (after - before);
        // The node lies at or after the one `below`, and before the next.
        let below = wavelengths_nm.partition_point(|&l| l <= node).clamp(1, last) - 1;
        let share = (node - wavelengths_nm[below]) / (wavelengths_nm[below + 1] - wavelengths_nm[below]);
        for (at, weight) in [(below, weight * (1.0 - share)), (below + 1, weight * share)] {
            if weight > 0.0 {
                weights.push((at, weight));
            }
        }
        sum += weight;
    }
    weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use spectral_core::illuminant::Illuminant;

    const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;

    fn by(first_nm: f64, step_nm: f64, last_nm: f64) -> Vec<f64> {
        let count = ((last_nm - first_nm) / step_nm).round() as usize + 1;
        (0..count).map(|i| first_nm + step_nm * i as f64).collect()
    }

    fn resampled(wavelengths_nm: &[f64], spectrum: impl Fn(f64) -> f64) -> Vec<f64> {
        let values: Vec<f64> = wavelengths_nm.iter().map(|&l| spectrum(l)).collect();
        Resampling::new(wavelengths_nm, &GRID).unwrap().apply(&values)
    }

    #[test]
    fn the_grid_s_own_wavelengths_come_back_to_the_bit() {
        let spiky = |l| Illuminant::Fl11.relative_power(l);
        for (first, last) in [(400.0, 700.0), (380.0, 780.0)] {
            assert_eq!(resampled(&by(first, 5.0, last), spiky), GRID.sample(spiky));
        }
    }

    /// The spectrum is the wavelength itself, so that errors are those of the place. Wavelengths that lie unevenly about the
    /// grid's shift it a little.
    #[test]
    fn straight_spectra_stay_straight() {
        for (first, step, last, bound_nm) in [
            (380.0, 10.0, 780.0, 1e-9),
            (390.0, 1.0, 710.0, 1e-9),
            (400.0, 300.0, 700.0, 1e-9),
            (391.0, 2.6, 729.0, 0.2),
        ] {
            for (got, expected) in resampled(&by(first, step, last), |l| l).iter().zip(GRID.sample(|l| l)) {
                assert!((got - expected).abs() < bound_nm, "{first} by {step}: {got} {expected}");
            }
        }
    }

    /// A line of one sample among wavelengths 0.5 nm apart keeps its power wherever it stands; picked values would lose it.
    #[test]
    fn lines_between_the_grid_s_wavelengths_keep_their_power() {
        let fine = by(390.0, 0.5, 710.0);
        for line_nm in [436.0, 546.0, 547.5, 611.5] {
            let line = |l: f64| f64::from(l == line_nm);
            let power: f64 = resampled(&fine, line).iter().sum::<f64>() * GRID.step_nm();
            assert!((power - 0.5).abs() < 1e-12, "{line_nm} nm: {power}");
            assert_eq!(GRID.sample(line).iter().sum::<f64>(), 0.0);
        }
    }

    #[test]
    fn what_is_no_spectrum_is_refused_with_the_numbers() {
        let refused =
            |wavelengths_nm: &[f64]| Resampling::new(wavelengths_nm, &GRID).unwrap_err().to_string();
        assert_eq!(refused(&[]), "0 wavelengths; a spectrum has 2 at least");
        assert_eq!(refused(&[500.0]), "1 wavelengths; a spectrum has 2 at least");
        assert_eq!(refused(&[400.0, 390.0, 700.0]), "390 nm after 400 nm; wavelengths ascend");
        assert_eq!(refused(&[400.0, 400.0, 700.0]), "400 nm after 400 nm; wavelengths ascend");
        assert_eq!(refused(&[400.0, f64::NAN, 700.0]), "NaN nm after 400 nm; wavelengths ascend");
        assert_eq!(refused(&[410.0, 700.0]), "wavelengths from 410 to 700 nm; 400 to 700 nm are needed");
    }
}
