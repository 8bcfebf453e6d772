//! Fits of one dispersion formula to another by least squares, 380 to 780 nm by 1.

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};
use num_traits::Float;

use super::{Dispersion, DispersionError, inverse_square_um2, visible_nm};
use crate::singular::SingularValues;

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

    /// The Sellmeier formula with these poles, um^2, that is closest to pairs of a wavelength in nm and an index, in the least-squares sense.
    /// A pole at 0 is a constant.
    ///
    /// n^2 - 1 is linear in the unknowns; pairs are weighted by dn / d(n^2 - 1), so residuals count in n.
    ///
    /// # Errors
    /// As [`Dispersion::validate`].
    pub fn sellmeier_with_poles(poles_um2: &[f64], indices: &[(f64, f64)]) -> Result<Self, DispersionError> {
        let rows = DMatrix::from_fn(indices.len(), poles_um2.len(), |row, term| {
            let (nm, n) = indices[row];
            1.0 / (2.0 * n * (1.0 - poles_um2[term] * inverse_square_um2(nm)))
        });
        let wanted = indices.iter().map(|&(_, n)| (n - 1.0) * (n + 1.0) / (2.0 * n));
        let wanted = DVector::from_iterator(indices.len(), wanted);
        let weights = SingularValues::of(&rows).least_squares(&wanted);
        let terms: Vec<[f64; 2]> = weights.iter().zip(poles_um2).map(|(&b, &c_um2)| [b, c_um2]).collect();
        Self::sellmeier(terms)
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

#[cfg(test)]
mod tests {
    use super::super::tests::bk7;
    use super::*;

    #[test]
    fn three_cauchy_terms_fit_a_glass_better_than_two_and_both_say_how_well() {
        let two = bk7().fit_cauchy(CauchyTerms::Two).unwrap();
        let three = bk7().fit_cauchy(CauchyTerms::Three).unwrap();
        // N-BK7's infrared term grows with lambda^2, which no Cauchy term can follow.
        assert!(three.rms_residual < 0.75 * two.rms_residual, "{two:?} {three:?}");
        assert!(two.max_residual < 2.5e-4 && three.max_residual < 1.6e-4, "{two:?} {three:?}");
        for fit in [two, three] {
            assert!(fit.rms_residual < fit.max_residual);
            let there = (fit.dispersion.ior(fit.max_residual_nm) - bk7().ior(fit.max_residual_nm)).abs();
            assert_eq!(there, fit.max_residual);
        }
    }

    #[test]
    fn a_third_term_takes_up_the_curvature_of_an_ultraviolet_resonance() {
        let acrylic = Dispersion::sellmeier([[1.1819, 0.011_313]]).unwrap();
        let two = acrylic.fit_cauchy(CauchyTerms::Two).unwrap();
        let three = acrylic.fit_cauchy(CauchyTerms::Three).unwrap();
        assert!(three.rms_residual < 0.05 * two.rms_residual, "{two:?} {three:?}");
    }

    #[test]
    fn least_squares_is_least() {
        for terms in [CauchyTerms::Two, CauchyTerms::Three] {
            let fit = bk7().fit_cauchy(terms).unwrap();
            let Dispersion::Cauchy { a, b_um2, c_um4 } = fit.dispersion else { panic!("{fit:?}") };
            let rms = |a: f64, b_um2: f64, c_um4: f64| {
                bk7().residual_of(Dispersion::Cauchy { a, b_um2, c_um4 }).unwrap().rms_residual
            };
            for sign in [-1.0, 1.0] {
                assert!(rms(a + sign * 1e-6, b_um2, c_um4) > fit.rms_residual);
                assert!(rms(a, b_um2 + sign * 1e-6, c_um4) > fit.rms_residual);
                if terms == CauchyTerms::Three {
                    assert!(rms(a, b_um2, c_um4 + sign * 1e-6) > fit.rms_residual);
                }
            }
        }
    }

    #[test]
    fn fits_return_their_own_kind() {
        let cauchy = Dispersion::cauchy(&[1.58, 0.008, 2e-4]).unwrap();
        let fit = cauchy.fit_cauchy(CauchyTerms::Three).unwrap();
        assert!(fit.max_residual < 1e-14, "{fit:?}");
        let sellmeier = Dispersion::sellmeier([[1.1819, 0.011_313]]).unwrap();
        let fit = sellmeier.fit_sellmeier().unwrap();
        assert!(fit.max_residual < 1e-14, "{fit:?}");
        let khr = Dispersion::from_khr(1.7, 0.9).unwrap();
        assert!(khr.fit_khr().unwrap().max_residual < 1e-14);
        let constant = Dispersion::constant(1.5).unwrap();
        for fit in [constant.fit_cauchy(CauchyTerms::Three), constant.fit_sellmeier(), constant.fit_khr()] {
            assert!(fit.unwrap().max_residual < 1e-14);
        }
    }

    #[test]
    fn known_poles_give_their_own_formula_back() {
        let Dispersion::Sellmeier { terms } = bk7() else { panic!("a catalogue glass") };
        let poles: Vec<f64> = terms.iter().map(|[_, c_um2]| *c_um2).collect();
        let indices: Vec<(f64, f64)> = visible_nm().map(|nm| (nm, bk7().ior(nm))).collect();
        let same = Dispersion::sellmeier_with_poles(&poles, &indices).unwrap();
        // A part of the poles, and a constant: not the same, and near.
        let other = Dispersion::sellmeier_with_poles(&[0.0, poles[0]], &indices).unwrap();
        let worst =
            |fit: &Dispersion| visible_nm().map(|nm| (fit.ior(nm) - bk7().ior(nm)).abs()).fold(0.0, f64::max);
        assert!(worst(&same) < 1e-12, "{:e}", worst(&same));
        assert!((1e-6..1e-2).contains(&worst(&other)), "{:e}", worst(&other));
    }

    #[test]
    fn one_sellmeier_term_follows_a_cauchy_glass() {
        let fit = Dispersion::cauchy(&[1.5046, 0.0042]).unwrap().fit_sellmeier().unwrap();
        assert!(fit.max_residual < 1e-3 && fit.rms_residual < 4e-4, "{fit:?}");
    }

    #[test]
    fn what_gltf_can_say_of_a_glass_keeps_n_d_and_v_d() {
        let fit = bk7().fit_khr().unwrap();
        assert!((fit.dispersion.n_d() - bk7().n_d()).abs() < 1e-15 * 4.0);
        assert!((fit.dispersion.abbe_v_d() / bk7().abbe_v_d() - 1.0).abs() < 1e-12);
        assert!(fit.max_residual > 1e-4 && fit.max_residual < 3e-3, "{fit:?}");
    }
}
