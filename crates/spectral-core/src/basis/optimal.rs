//! The basis that is best for the colours shown.

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::{DMatrix, DVectorView, Matrix3, SymmetricEigen};
use num_traits::Float;

use super::{
    BasisError, BasisKind, Optimal, RANK_TOLERANCE, SpectralBasis, Training, Weighting, cmf_weighted,
    columns, sign,
};
use crate::color::lab_jacobian;
use crate::mat3;
use crate::patch::{Shown, light_xyz, sampled_xyz};
use crate::rgb::D65_WHITE_XYZ;
use crate::singular::SingularValues;

impl Training<'_> {
    /// The pair of dual sets of `coefficients` functions that gives the colours of all reflectances under all lights with
    /// the least squared error, each light scaled to Y = 1, among those that do what `settings` asks.
    ///
    /// # Errors
    /// [`BasisError`] for bad spectra and for more coefficients than the rank of the colours: at most the number of
    /// lights, and that of reflectances, and white if it is to be exact, three times each.
    pub fn optimal(&self, coefficients: usize, settings: Optimal) -> Result<SpectralBasis, BasisError> {
        self.check()?;
        let lights = self.lights_of_unit_luminance()?;
        let rows = columns(&self.weighted_rows(settings.weighting, &lights)?);
        let lights = columns(&lights);
        let colours = rows.tr_mul(&lights) * self.grid.step_nm();
        let white = if settings.exact_white {
            White::of(self, &lights)
        } else {
            White::none(self.grid.samples(), lights.ncols())
        };
        let taken = white.values.len();

        // What is left of the colours is orthogonal to white's; so are its right singular vectors.
        let by_white = &colours * &white.right;
        let left = &colours - &by_white * white.right.transpose();
        let svd = SingularValues::of(&left);
        let least = RANK_TOLERANCE * colours.norm();
        let others = svd.values.iter().take_while(|&&v| v > least).count();
        let rank = taken + others;
        if !(taken.max(1)..=rank).contains(&coefficients) {
            return Err(BasisError::Coefficients { asked: coefficients, least: taken.max(1), rank });
        }
        // Of a light that was not trained on, white's functions take their part first.
        let light_vectors = &rows * &svd.left - &white.light_vectors * by_white.tr_mul(&svd.left);
        let albedo_vectors = &lights * &svd.right;
        let white_albedo_vectors = &lights * &white.right;
        let unit = vec![1.0; taken];
        let (light_functions, albedo_functions) = pairs(&white.light_vectors, &white_albedo_vectors, &unit)
            .chain(pairs(&light_vectors, &albedo_vectors, &svd.values[..coefficients - taken]))
            .unzip();
        Ok(SpectralBasis {
            kind: BasisKind::Optimal(settings),
            grid: self.grid,
            observer: self.observer,
            light_functions,
            albedo_functions,
            singular_values: [&white.values, &svd.values[..others]].concat(),
        })
    }

    /// The rows m R of all reflectances, weighted.
    fn weighted_rows(&self, weighting: Weighting, lights: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, BasisError> {
        let mut rows = Vec::with_capacity(3 * self.reflectances.len());
        for reflectance in self.reflectances {
            let xyz_rows = cmf_weighted(&self.grid, self.observer, reflectance);
            match weighting {
                Weighting::Uniform => rows.extend(xyz_rows),
                Weighting::Perceptual => {
                    let root = self.perceptual_root(reflectance, lights)?;
                    rows.extend((0..3).map(|r| {
                        (0..self.grid.samples())
                            .map(|i| (0..3).map(|c| root[(r, c)] * xyz_rows[c][i]).sum())
                            .collect::<Vec<f64>>()
                    }));
                }
            }
        }
        Ok(rows)
    }

    fn lights_of_unit_luminance(&self) -> Result<Vec<Vec<f64>>, BasisError> {
        let scaled = |(index, light): (usize, &Vec<f64>)| {
            let y = light_xyz(&self.grid, self.observer, light)[1];
            if y > 0.0 { Ok(light.iter().map(|v| v / y).collect()) } else { Err(BasisError::Dark { index }) }
        };
        self.lights.iter().enumerate().map(scaled).collect()
    }

    /// The symmetric root of the metric G that makes e^T G e the mean, over the lights, of the squared CIE94 difference
    /// that a small error e in XYZ makes to this reflectance's colour.
    fn perceptual_root(&self, reflectance: &[f64], lights: &[Vec<f64>]) -> Result<Matrix3<f64>, BasisError> {
        let mut metric = Matrix3::zeros();
        for (index, light) in lights.iter().enumerate() {
            let white = light_xyz(&self.grid, self.observer, light);
            let shown = Shown::under(white).ok_or(BasisError::NoBalance { index })?;
            let display_from_light = shown.display_from_light();
            let xyz = sampled_xyz(&self.grid, self.observer, reflectance, light);
            let on_display = mat3::apply(&display_from_light, xyz);
            let jacobian = mat3::multiply(&lab_jacobian(on_display, D65_WHITE_XYZ), &display_from_light);
            let jacobian = Matrix3::from_fn(|r, c| jacobian[r][c]);
            let weighted = cie94_weights(shown.lab(xyz)) * jacobian;
            metric += weighted.tr_mul(&weighted) / lights.len() as f64;
        }
        let eigen = SymmetricEigen::new(metric);
        let roots = eigen.eigenvalues.map(|v| Float::sqrt(v.max(0.0)));
        Ok(eigen.eigenvectors * Matrix3::from_diagonal(&roots) * eigen.eigenvectors.transpose())
    }
}

/// Columns of chi and phi whose integrals are `products`, scaled so that they are 1 and both have one norm.
fn pairs<'a>(
    chi: &'a DMatrix<f64>,
    phi: &'a DMatrix<f64>,
    products: &'a [f64],
) -> impl Iterator<Item = (Vec<f64>, Vec<f64>)> + 'a {
    chi.column_iter().zip(phi.column_iter()).zip(products).map(|((chi, phi), product)| {
        let (chi_norm, phi_norm) = (chi.norm(), phi.norm());
        let scaled = |v: DVectorView<'_, f64>, share: f64| {
            let scale = sign(&phi.as_view()) * Float::sqrt(share / product);
            v.iter().map(|x| x * scale).collect()
        };
        (scaled(chi.as_view(), phi_norm / chi_norm), scaled(phi.as_view(), chi_norm / phi_norm))
    })
}

/// The colours of the lights themselves: W B = U S Q^T with W the colour-matching functions.
struct White {
    /// S, without rounding.
    values: Vec<f64>,
    /// Q: an orthonormal column for each value.
    right: DMatrix<f64>,
    /// W^T U S^(-1): their integrals with a light of the training are its coordinates in Q.
    light_vectors: DMatrix<f64>,
}

impl White {
    fn none(samples: usize, lights: usize) -> Self {
        Self {
            values: Vec::new(),
            right: DMatrix::zeros(lights, 0),
            light_vectors: DMatrix::zeros(samples, 0),
        }
    }

    fn of(training: &Training<'_>, lights: &DMatrix<f64>) -> Self {
        let grid = &training.grid;
        let cmf = columns(&cmf_weighted(grid, training.observer, &grid.sample(|_| 1.0)));
        let svd = SingularValues::of(&(cmf.tr_mul(lights) * grid.step_nm()));
        let rank = svd.rank(RANK_TOLERANCE);
        let mut light_vectors = cmf * svd.left.columns(0, rank);
        for (mut column, value) in light_vectors.column_iter_mut().zip(&svd.values) {
            column /= *value;
        }
        let right = svd.right.columns(0, rank).into_owned();
        Self { values: svd.values[..rank].to_vec(), right, light_vectors }
    }
}

/// Turns a difference in L*, a*, b* into lightness, chroma and hue divided by CIE94's weights at the colour `lab`.
fn cie94_weights([_, a, b]: [f64; 3]) -> Matrix3<f64> {
    let chroma = Float::hypot(a, b);
    // A neutral colour has no hue, and weights of 1 in every direction.
    let (cos, sin) = if chroma > 0.0 { (a / chroma, b / chroma) } else { (1.0, 0.0) };
    let (c, h) = (1.0 / (1.0 + 0.045 * chroma), 1.0 / (1.0 + 0.015 * chroma));
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c * cos, c * sin, 0.0, -h * sin, h * cos)
}
