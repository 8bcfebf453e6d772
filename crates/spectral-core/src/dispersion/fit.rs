//! Fits of one dispersion formula to another by least squares, 380 to 780 nm by 1.

use alloc::vec;
use alloc::vec::Vec;

use num_traits::Float;

use super::{Dispersion, DispersionError, inverse_square_um2, visible_nm};

/// A fitted formula and how far its index is from the original's.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The fitted formula.
    pub dispersion: Dispersion,
    /// Largest |difference of n| from 380 to 780 nm.
    pub max_residual: f64,
    /// Where it is, nm.
    pub max_residual_nm: f64,
    /// Root mean square difference of n from 380 to 780 nm.
    pub rms_residual: f64,
}

/// How many terms of Cauchy's formula to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CauchyTerms {
    /// A + B / lambda^2.
    Two,
    /// A + B / lambda^2 + C / lambda^4.
    Three,
}

impl Dispersion {
    /// The Cauchy formula closest to this index in the least-squares sense.
    ///
    /// # Errors
    /// If the closest formula dips below n = 1.
    pub fn fit_cauchy(&self, terms: CauchyTerms) -> Result<Fit, DispersionError> {
        // Polynomials in u = 1 / lambda^2 that are orthogonal on the samples (Forsythe 1957): no ill-conditioned
        // normal equations, and the two-term fit is the three-term one without its last polynomial.
        let samples: Vec<(f64, f64)> =
            visible_nm().map(|nm| (inverse_square_um2(nm), self.ior(nm))).collect();
        let mean = |f: &dyn Fn(f64, f64) -> f64| {
            samples.iter().map(|&(u, n)| f(u, n)).sum::<f64>() / samples.len() as f64
        };
        let center = mean(&|u, _| u);
        let p1 = |u: f64| u - center;
        let p1_norm = mean(&|u, _| p1(u) * p1(u));
        let shift = mean(&|u, _| u * p1(u) * p1(u)) / p1_norm;
        let p2 = |u: f64| (u - shift) * p1(u) - p1_norm;

        let k0 = mean(&|_, n| n);
        // The mean is taken off first, so that an index that hardly varies keeps its digits.
        let k1 = mean(&|u, n| (n - k0) * p1(u)) / p1_norm;
        let k2 = match terms {
            CauchyTerms::Two => 0.0,
            CauchyTerms::Three => mean(&|u, n| (n - k0) * p2(u)) / mean(&|u, _| p2(u) * p2(u)),
        };
        let a = k0 - k1 * center + k2 * (shift * center - p1_norm);
        self.residual_of(Self::Cauchy { a, b_um2: k1 - k2 * (shift + center), c_um4: k2 })
    }

    /// The one-term Sellmeier formula closest to this index.
    ///
    /// 1 / (n^2 - 1) = 1/B - (C/B) / lambda^2 is linear in its unknowns; the samples are weighted by
    /// dn / d(1 / (n^2 - 1)), so residuals count in n.
    ///
    /// # Errors
    /// If the formula has its pole between 380 and 780 nm or dips below n = 1.
    pub fn fit_sellmeier(&self) -> Result<Fit, DispersionError> {
        if !self.is_dispersive() {
            let n = self.n_d();
            return self.residual_of(Self::Sellmeier { terms: vec![[(n - 1.0) * (n + 1.0), 0.0]] });
        }
        // Weighted rows (w, w u | w y); w y has no division, so n = 1 is an empty row.
        let (mut ww, mut wwu, mut wwuu, mut wwy, mut wwuy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for nm in visible_nm() {
            let (u, n) = (inverse_square_um2(nm), self.ior(nm));
            let susceptibility = (n - 1.0) * (n + 1.0);
            let w = susceptibility * susceptibility / (2.0 * n);
            let wy = susceptibility / (2.0 * n);
            ww += w * w;
            wwu += w * w * u;
            wwuu += w * w * u * u;
            wwy += w * wy;
            wwuy += w * wy * u;
        }
        let determinant = ww * wwuu - wwu * wwu;
        let intercept = (wwy * wwuu - wwuy * wwu) / determinant;
        let slope = (wwuy * ww - wwy * wwu) / determinant;
        self.residual_of(Self::Sellmeier { terms: vec![[1.0 / intercept, -slope / intercept]] })
    }

    /// The medium that glTF can state, [`Dispersion::from_khr`] of this one's n_d and 20 / V_d.
    ///
    /// # Errors
    /// As [`Dispersion::from_khr`].
    pub fn fit_khr(&self) -> Result<Fit, DispersionError> {
        self.residual_of(Self::from_khr(self.n_d(), self.khr_dispersion())?)
    }

    fn residual_of(&self, dispersion: Self) -> Result<Fit, DispersionError> {
        let dispersion = dispersion.validated()?;
        let (mut max_residual, mut max_residual_nm, mut sum_of_squares, mut count) = (0.0, 0.0, 0.0, 0.0);
        for nm in visible_nm() {
            let residual = (dispersion.ior(nm) - self.ior(nm)).abs();
            if residual >= max_residual {
                (max_residual, max_residual_nm) = (residual, nm);
            }
            sum_of_squares += residual * residual;
            count += 1.0;
        }
        Ok(Fit {
            dispersion,
            max_residual,
            max_residual_nm,
            rms_residual: Float::sqrt(sum_of_squares / count),
        })
    }
}
