//! The spectra that light can be multiplied with on its way from surface to surface, in few functions.

use nalgebra::DMatrix;
use spectral_core::grid::SpectralGrid;
use spectral_core::singular::SingularValues;

/// Singular values below this share of the largest are left out: a hundredth of what a byte per channel shows.
const TOLERANCE: f64 = 4e-5;

/// An orthonormal basis of 1 and of all products of up to a number of reflectances. Greys need one function, whatever
/// their number; five saturated paints and three bounces about twenty.
#[derive(Clone, Debug)]
pub(crate) struct ReflectedSpectra {
    /// One column per function, one row per wavelength.
    functions: DMatrix<f64>,
}

impl ReflectedSpectra {
    pub(crate) fn new(grid: &SpectralGrid, reflectances: &[Vec<f64>], bounces: u32) -> Self {
        let samples = grid.samples();
        let one = DMatrix::from_element(samples, 1, 1.0);
        // Weighted with their singular values next to the largest, so that what is rare stays small in the next product.
        let mut spectra = one.clone();
        let mut functions = one.normalize();
        for _ in 0..bounces {
            let mut columns: Vec<_> =
                one.column_iter().chain(spectra.column_iter()).map(|c| c.into_owned()).collect();
            for reflectance in reflectances {
                for spectrum in spectra.column_iter() {
                    columns.push(
                        spectrum.zip_map(
                            &DMatrix::from_column_slice(samples, 1, reflectance).column(0),
                            |s, r| s * r,
                        ),
                    );
                }
            }
            let svd = SingularValues::of(&DMatrix::from_columns(&columns));
            let (rank, values) = (svd.rank(TOLERANCE), svd.values);
            functions = svd.left.columns(0, rank).into_owned();
            spectra = DMatrix::from_fn(samples, rank, |i, j| {
                functions[(i, j)] * values[j] / values[0] * one.norm()
            });
        }
        Self { functions }
    }

    /// How many functions there are.
    pub(crate) fn count(&self) -> usize {
        self.functions.ncols()
    }

    /// The functions, one value per wavelength each.
    pub(crate) fn functions(&self) -> Vec<Vec<f64>> {
        self.functions.column_iter().map(|c| c.iter().copied().collect()).collect()
    }

    /// The coordinates of the constant 1: light as it came.
    pub(crate) fn one(&self) -> Vec<f64> {
        self.functions.column_iter().map(|c| c.sum()).collect()
    }

    /// What reflection does to coordinates: row-major, output from input.
    pub(crate) fn reflection(&self, reflectance: &[f64]) -> Vec<f64> {
        let reflected = DMatrix::from_fn(self.functions.nrows(), self.count(), |i, j| {
            reflectance[i] * self.functions[(i, j)]
        });
        // A product's entries lie column by column: the transpose of the matrix, row by row.
        reflected.tr_mul(&self.functions).as_slice().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spectral_core::color_checker;

    const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;

    #[test]
    fn greys_need_one_function_and_paints_few() {
        let greys: Vec<Vec<f64>> = [1.0, 0.5, 0.18].iter().map(|&grey| GRID.sample(|_| grey)).collect();
        let spectra = ReflectedSpectra::new(&GRID, &greys, 9);
        assert_eq!(spectra.count(), 1);
        assert!((spectra.reflection(&greys[2])[0] - 0.18).abs() < 1e-14);

        let paints = color_checker::sampled(&GRID)[12..16].to_vec();
        let spectra = ReflectedSpectra::new(&GRID, &paints, 3);
        println!("four paints, three bounces: {} functions", spectra.count());
        assert!((5..40).contains(&spectra.count()), "{}", spectra.count());
    }

    /// Coordinates multiplied three times stand for the product of the three spectra.
    #[test]
    fn products_are_what_they_stand_for() {
        let paints = color_checker::sampled(&GRID)[12..16].to_vec();
        let spectra = ReflectedSpectra::new(&GRID, &paints, 3);
        let q = spectra.count();
        let mut coordinates = spectra.one();
        let mut product = vec![1.0; GRID.samples()];
        for paint in [0, 2, 3] {
            let matrix = spectra.reflection(&paints[paint]);
            coordinates =
                matrix.chunks(q).map(|row| row.iter().zip(&coordinates).map(|(a, b)| a * b).sum()).collect();
            product.iter_mut().zip(&paints[paint]).for_each(|(p, r)| *p *= r);
        }
        for (i, product) in product.iter().enumerate() {
            let value: f64 = spectra.functions().iter().zip(&coordinates).map(|(g, c)| g[i] * c).sum();
            // The tolerance times the norm of 1, the square root of 61 wavelengths.
            assert!((value - product).abs() < 3e-4, "{i} {value} {product}");
        }
    }
}
