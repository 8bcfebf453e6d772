//! Singular values and vectors, by one-sided Jacobi rotations after a QR decomposition with column pivoting (Hestenes 1958;
//! Drmač & Veselić 2008, "New fast and accurate Jacobi SVD algorithm").
//!
//! nalgebra's own are not used: up to 0.35 at least they are wrong for some matrices (dimforge/nalgebra issue 1172), mostly
//! for those short of rank. The columns 1, 1, 0.5 times one constant vector come out 6 % too large and do not recompose; and
//! palettes with greys or repeated entries are just that.

use alloc::vec::Vec;

use nalgebra::{DMatrix, DVector};
use num_traits::Float;

/// Pivots below this share of the first are rounding.
const PIVOT_TOLERANCE: f64 = 1e-13;

/// Columns whose cosine is below this are orthogonal.
const ORTHOGONAL: f64 = 4.0 * f64::EPSILON;
/// It takes about ten sweeps over the pairs of columns; each squares what is left.
const MAX_SWEEPS: usize = 60;

/// M = U S V^T without the singular values that are rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct SingularValues {
    /// S, largest first.
    pub values: Vec<f64>,
    /// U: an orthonormal column for each value.
    pub left: DMatrix<f64>,
    /// V, likewise.
    pub right: DMatrix<f64>,
}

impl SingularValues {
    /// Of a finite matrix of any shape and rank; none of a zero matrix.
    pub fn of(matrix: &DMatrix<f64>) -> Self {
        let (rows, columns) = matrix.shape();
        if rows == 0 || columns == 0 {
            return Self::none(rows, columns);
        }
        let decomposed = matrix.clone().col_piv_qr();
        let mut triangle = decomposed.r();
        let least = PIVOT_TOLERANCE * triangle[(0, 0)].abs();
        let rank = (0..rows.min(columns)).take_while(|&i| triangle[(i, i)].abs() > least).count();
        if rank == 0 {
            return Self::none(rows, columns);
        }
        decomposed.p().inv_permute_columns(&mut triangle);
        let mut rotated = triangle.rows(0, rank).transpose();
        let mut rotation = DMatrix::identity(rank, rank);
        for _ in 0..MAX_SWEEPS {
            if !sweep(&mut rotated, &mut rotation) {
                break;
            }
        }
        let mut order: Vec<(f64, usize)> = rotated.column_iter().map(|c| c.norm()).zip(0..).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let left = decomposed.q().columns(0, rank) * rotation;
        Self {
            values: order.iter().map(|o| o.0).collect(),
            left: DMatrix::from_fn(rows, rank, |i, j| left[(i, order[j].1)]),
            right: DMatrix::from_fn(columns, rank, |i, j| rotated[(i, order[j].1)] / order[j].0),
        }
    }

    fn none(rows: usize, columns: usize) -> Self {
        Self { values: Vec::new(), left: DMatrix::zeros(rows, 0), right: DMatrix::zeros(columns, 0) }
    }

    /// The shortest of those x that leave the least |M x - b|.
    ///
    /// # Panics
    /// If b has not as many entries as M has rows.
    pub fn least_squares(&self, b: &DVector<f64>) -> DVector<f64> {
        let mut shares = self.left.tr_mul(b);
        shares.iter_mut().zip(&self.values).for_each(|(share, value)| *share /= value);
        &self.right * shares
    }

    /// How many values exceed `share` of the largest.
    pub fn rank(&self, share: f64) -> usize {
        self.values.iter().take_while(|&&v| v > share * self.values[0]).count()
    }
}

/// Makes each pair of columns orthogonal in turn; false when all of them were.
fn sweep(columns: &mut DMatrix<f64>, rotation: &mut DMatrix<f64>) -> bool {
    let mut any = false;
    for q in 1..columns.ncols() {
        for p in 0..q {
            let (a, b) = (columns.column(p).norm_squared(), columns.column(q).norm_squared());
            let c = columns.column(p).dot(&columns.column(q));
            if c.abs() <= ORTHOGONAL * Float::sqrt(a) * Float::sqrt(b) {
                continue;
            }
            any = true;
            let zeta = (b - a) / (2.0 * c);
            let tan = Float::signum(zeta) / (zeta.abs() + Float::sqrt(1.0 + zeta * zeta));
            let cos = 1.0 / Float::sqrt(1.0 + tan * tan);
            for matrix in [&mut *columns, &mut *rotation] {
                for i in 0..matrix.nrows() {
                    let (x, y) = (matrix[(i, p)], matrix[(i, q)]);
                    matrix[(i, p)] = cos * (x - tan * y);
                    matrix[(i, q)] = cos * (y + tan * x);
                }
            }
        }
    }
    any
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;

    fn check(matrix: &DMatrix<f64>) -> SingularValues {
        let found = SingularValues::of(matrix);
        let n = found.values.len();
        assert!(found.values.is_sorted_by(|a, b| a >= b), "{:?}", found.values);
        for vectors in [&found.left, &found.right] {
            assert!((vectors.tr_mul(vectors) - DMatrix::identity(n, n)).norm() < 1e-12);
        }
        let values = DMatrix::from_fn(n, n, |i, j| if i == j { found.values[i] } else { 0.0 });
        let back = &found.left * values * found.right.transpose();
        assert!((back - matrix).norm() <= 1e-12 * matrix.norm(), "{matrix}");
        found
    }

    #[test]
    fn multiples_of_one_vector_have_rank_one() {
        let shares = [1.0, 1.0, 1.0, 0.5, 0.18];
        for height in [5, 61] {
            let found = check(&DMatrix::from_fn(height, 5, |_, j| shares[j]));
            let norm = (height as f64 * shares.iter().map(|s| s * s).sum::<f64>()).sqrt();
            assert!(
                found.values.len() == 1 && (found.values[0] / norm - 1.0).abs() < 1e-14,
                "{:?}",
                found.values
            );
        }
    }

    /// Full rank, and wrong in nalgebra 0.35: the squares of the singular values add up to those of the entries, 21.
    #[test]
    fn the_full_rank_matrix_of_the_issue_is_right() {
        let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 2.0, 2.0, 2.0, -1.0, -1.0, 2.0, 1.0, -1.0]);
        let squares: f64 = check(&matrix).values.iter().map(|v| v * v).sum();
        assert!((squares - 21.0).abs() < 1e-13, "{squares}");
    }

    /// The normal equations hold, and where columns repeat the shares are equal.
    #[test]
    fn least_squares_are_least_and_short() {
        let matrix = DMatrix::from_fn(9, 3, |i, j| if j == 2 { i as f64 } else { 1.0 });
        let b = DVector::from_fn(9, |i, _| 2.0 + 3.0 * i as f64 + if i % 2 == 0 { 0.1 } else { -0.1 });
        let x = SingularValues::of(&matrix).least_squares(&b);
        assert!(matrix.tr_mul(&(&matrix * &x - &b)).norm() < 1e-11, "{x}");
        assert!((x[0] - x[1]).abs() < 1e-13 && (x[0] - 1.0).abs() < 0.1 && (x[2] - 3.0).abs() < 0.1, "{x}");
    }

    #[test]
    fn a_zero_matrix_has_none() {
        for (rows, columns) in [(3, 4), (4, 3), (0, 2), (2, 0)] {
            let found = SingularValues::of(&DMatrix::zeros(rows, columns));
            assert!(found.values.is_empty());
            assert_eq!((found.left.nrows(), found.right.nrows()), (rows, columns));
        }
    }

    #[test]
    fn values_over_many_magnitudes_are_found() {
        // Diagonal times rotations: the singular values are the diagonal's.
        let values = [1e3, 1.0, 1e-3, 1e-6];
        let turn = |a: f64| DMatrix::from_row_slice(2, 2, &[a.cos(), -a.sin(), a.sin(), a.cos()]);
        let (u, v) = (turn(0.7).kronecker(&turn(-0.3)), turn(2.1).kronecker(&turn(1.2)));
        let matrix = &u * DMatrix::from_fn(4, 4, |i, j| if i == j { values[i] } else { 0.0 }) * v.transpose();
        for (found, expected) in check(&matrix).values.iter().zip(values) {
            // The matrix's own rounding moves the smallest by 1e3 * 2e-16.
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        }
        assert_eq!(check(&matrix).rank(1e-7), 3);
    }

    proptest! {
        /// Products of thin matrices, with repeated and with missing columns.
        #[test]
        fn every_matrix_recomposes(
            rows in 1_usize..20, columns in 1_usize..20, inner in 1_usize..6,
            numbers in prop::collection::vec(-3_i8..=3, 20 * 6 * 2),
        ) {
            let left = DMatrix::from_fn(rows, inner, |i, k| f64::from(numbers[i * 6 + k]));
            let right = DMatrix::from_fn(inner, columns, |k, j| f64::from(numbers[120 + j * 6 + k]) / 3.0);
            let found = check(&(left * right));
            prop_assert!(found.values.len() <= inner.min(rows).min(columns));
        }
    }
}
