//! 3 x 3 matrices in f64, row-major: rows are outputs, columns inputs.
//!
//! Everything here is `const`, so colour matrices are derived from their definitions at compile time
//! instead of being copied from tables with a few digits.

/// A row-major 3 x 3 matrix.
pub type Mat3 = [[f64; 3]; 3];

/// The identity.
pub const IDENTITY: Mat3 = diagonal([1.0, 1.0, 1.0]);

/// The matrix with `d` on its diagonal.
pub const fn diagonal(d: [f64; 3]) -> Mat3 {
    [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]]
}

/// `m * v`, each row summed from left to right.
pub const fn apply(m: &Mat3, v: [f64; 3]) -> [f64; 3] {
    let mut out = [0.0; 3];
    let mut i = 0;
    while i < 3 {
        out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
        i += 1;
    }
    out
}

/// `a * b`: `b` acts first.
pub const fn multiply(a: &Mat3, b: &Mat3) -> Mat3 {
    let mut out = [[0.0; 3]; 3];
    let mut i = 0;
    while i < 3 {
        let mut j = 0;
        while j < 3 {
            out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
            j += 1;
        }
        i += 1;
    }
    out
}

/// The determinant, expanded along the first row.
pub const fn determinant(m: &Mat3) -> f64 {
    m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        + m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
}

/// The inverse by cofactors. A singular matrix has none: its result is not finite.
pub const fn inverse(m: &Mat3) -> Mat3 {
    let reciprocal = 1.0 / determinant(m);
    let mut out = [[0.0; 3]; 3];
    let mut i = 0;
    while i < 3 {
        let (r, s) = ((i + 1) % 3, (i + 2) % 3);
        let mut j = 0;
        while j < 3 {
            let (p, q) = ((j + 1) % 3, (j + 2) % 3);
            out[j][i] = (m[r][p] * m[s][q] - m[r][q] * m[s][p]) * reciprocal;
            j += 1;
        }
        i += 1;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_a_matrix_without_symmetry() {
        const M: Mat3 = [[1.0, 2.0, -1.0], [0.5, -3.0, 4.0], [7.0, 0.25, 2.0]];
        let (left, right) = (multiply(&inverse(&M), &M), multiply(&M, &inverse(&M)));
        for i in 0..3 {
            for j in 0..3 {
                assert!((left[i][j] - IDENTITY[i][j]).abs() < 1e-15, "{left:?}");
                assert!((right[i][j] - IDENTITY[i][j]).abs() < 1e-15, "{right:?}");
            }
        }
    }

    #[test]
    fn product_acts_with_its_right_factor_first() {
        let scale_x = diagonal([2.0, 1.0, 1.0]);
        let swap_xy = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(apply(&multiply(&swap_xy, &scale_x), [1.0, 0.0, 0.0]), [0.0, 2.0, 0.0]);
    }
}
