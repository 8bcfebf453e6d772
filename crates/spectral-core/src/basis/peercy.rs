//! Peercy's basis: the spectra's own singular vectors.

use alloc::vec::Vec;

use num_traits::Float;

use super::{BasisError, BasisKind, RANK_TOLERANCE, SpectralBasis, Training, columns, sign};
use crate::singular::SingularValues;

impl Training<'_> {
    /// The orthonormal basis of `coefficients` functions that represents the reflectances and the lights with the least
    /// squared error (Peercy 1993, section 3; Schwenk et al. 2010, section 3.2). Each light is scaled to a peak of 1, so
    /// that it weighs about as much as a reflectance.
    ///
    /// # Errors
    /// [`BasisError`] for bad spectra and for more coefficients than the spectra's rank.
    pub fn peercy(&self, coefficients: usize) -> Result<SpectralBasis, BasisError> {
        self.check()?;
        let mut spectra = self.reflectances.to_vec();
        for (index, light) in self.lights.iter().enumerate() {
            let peak = light.iter().copied().fold(0.0, f64::max);
            if peak == 0.0 {
                return Err(BasisError::Dark { index });
            }
            spectra.push(light.iter().map(|v| v / peak).collect());
        }
        let svd = SingularValues::of(&columns(&spectra));
        let rank = svd.rank(RANK_TOLERANCE);
        if !(1..=rank).contains(&coefficients) {
            return Err(BasisError::Coefficients { asked: coefficients, least: 1, rank });
        }
        // Unit vectors of samples become functions whose squares integrate to 1.
        let scale = 1.0 / Float::sqrt(self.grid.step_nm());
        let functions: Vec<Vec<f64>> = svd
            .left
            .column_iter()
            .take(coefficients)
            .map(|v| v.iter().map(|x| x * scale * sign(&v)).collect())
            .collect();
        Ok(SpectralBasis {
            kind: BasisKind::Peercy,
            grid: self.grid,
            observer: self.observer,
            light_functions: functions.clone(),
            albedo_functions: functions,
            singular_values: svd.values[..rank].to_vec(),
        })
    }
}
