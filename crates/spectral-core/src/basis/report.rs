//! How well a basis represents spectra and their colours.

use alloc::vec::Vec;

use num_traits::Float;
use serde::{Deserialize, Serialize};

use super::{BasisError, BasisKind, SpectralBasis, Training, cmf_weighted};
use crate::patch::{Shown, light_xyz, sampled_xyz};

/// What [`SpectralBasis::report`] finds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BasisReport {
    /// How the basis was found.
    pub kind: BasisKind,
    /// Coefficients m.
    pub coefficients: usize,
    /// Condition numbers of the light's and the albedo's functions, [`SpectralBasis::condition_numbers`].
    pub condition_numbers: (f64, f64),
    /// Mean CIE94 difference over all reflectances and lights.
    pub delta_e_mean: f64,
    /// Largest CIE94 difference.
    pub delta_e_max: f64,
    /// For each reflectance the relative RMS difference between it, weighted with the colour-matching functions, and
    /// what its coefficients stand for; 0 for black.
    pub albedo_residuals: Vec<f64>,
    /// The same for each light, and its colours.
    pub lights: Vec<LightReport>,
}

/// One light of a [`BasisReport`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightReport {
    /// Relative RMS difference between the light and what its coefficients stand for.
    pub residual: f64,
    /// Mean CIE94 difference over all reflectances.
    pub delta_e_mean: f64,
    /// Largest CIE94 difference.
    pub delta_e_max: f64,
    /// The reflectance that has it, from 0.
    pub worst_reflectance: usize,
}

impl SpectralBasis {
    /// Errors of the basis for these spectra, which need not be those it was trained on: colours against sampling on
    /// the same grid, shown as [`Shown`] says.
    ///
    /// # Errors
    /// [`BasisError`] for bad spectra and for lights without luminance or without a balance to D65.
    pub fn report(&self, reflectances: &[Vec<f64>], lights: &[Vec<f64>]) -> Result<BasisReport, BasisError> {
        Training { grid: self.grid, observer: self.observer, reflectances, lights }.check()?;
        let albedos: Vec<_> = reflectances.iter().map(|r| self.albedo_coefficients(r)).collect();
        let mut light_reports = Vec::with_capacity(lights.len());
        for (index, light) in lights.iter().enumerate() {
            let white = light_xyz(&self.grid, self.observer, light);
            if white[1] <= 0.0 {
                return Err(BasisError::Dark { index });
            }
            let shown = Shown::under(white).ok_or(BasisError::NoBalance { index })?;
            let coefficients = self.light_coefficients(light);
            let differences: Vec<f64> = reflectances
                .iter()
                .zip(&albedos)
                .map(|(reflectance, albedo)| {
                    let reference = sampled_xyz(&self.grid, self.observer, reflectance, light);
                    shown.delta_e_94(reference, Self::xyz(albedo, &coefficients))
                })
                .collect();
            let (worst_reflectance, delta_e_max) = largest(&differences);
            light_reports.push(LightReport {
                residual: residual(light, &self.light_from_coefficients(&coefficients)),
                delta_e_mean: differences.iter().sum::<f64>() / differences.len() as f64,
                delta_e_max,
                worst_reflectance,
            });
        }
        let albedo_residuals = reflectances
            .iter()
            .zip(&albedos)
            .map(|(reflectance, albedo)| {
                let truth = cmf_weighted(&self.grid, self.observer, reflectance).concat();
                let stand_in: Vec<f64> = (0..3).flat_map(|c| self.albedo_row(albedo, c)).collect();
                residual(&truth, &stand_in)
            })
            .collect();
        Ok(BasisReport {
            kind: self.kind,
            coefficients: self.coefficients(),
            condition_numbers: self.condition_numbers(),
            delta_e_mean: light_reports.iter().map(|l| l.delta_e_mean).sum::<f64>() / lights.len() as f64,
            delta_e_max: light_reports.iter().map(|l| l.delta_e_max).fold(0.0, f64::max),
            albedo_residuals,
            lights: light_reports,
        })
    }

    /// What an albedo's coefficients of one channel stand for, sum_j chi_j R_j.
    fn albedo_row(&self, albedo: &[[f64; 3]], channel: usize) -> Vec<f64> {
        (0..self.grid.samples())
            .map(|i| self.light_functions.iter().zip(albedo).map(|(chi, r)| chi[i] * r[channel]).sum())
            .collect()
    }
}

/// RMS of the difference over RMS of the truth; 0 where the truth is 0 throughout.
fn residual(truth: &[f64], stand_in: &[f64]) -> f64 {
    let squares = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
    let power = squares(&mut truth.iter().copied());
    if power == 0.0 {
        return 0.0;
    }
    Float::sqrt(squares(&mut truth.iter().zip(stand_in).map(|(t, s)| t - s)) / power)
}

fn largest(values: &[f64]) -> (usize, f64) {
    let pairs = values.iter().copied().enumerate();
    pairs.fold((0, 0.0), |best, this| if this.1 > best.1 { this } else { best })
}
