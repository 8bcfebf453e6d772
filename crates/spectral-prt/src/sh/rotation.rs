//! Rotation of functions on the sphere.

use glam::DMat3;

use crate::bands::Bands;

/// Rotates functions given by coefficients of real spherical harmonics; exact, degree by degree.
///
/// The matrix of each degree follows from that of the degree below and the rotation itself (Ivanic & Ruedenberg, J. Phys.
/// Chem. 1996, 100, 6342, eq. 8.1 and table 2, with the additions and corrections of 1998, 102, 9099).
#[derive(Clone, Debug, PartialEq)]
pub struct ShRotation {
    bands: Bands,
    /// For each degree l a matrix of 2 l + 1 rows, row-major: output from input.
    blocks: Vec<Vec<f64>>,
}

/// A matrix that stretches, shears or mirrors.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "not a rotation: M M^T differs from the identity by {off_identity:.3e}, the determinant is {determinant:.6}; rotations have 0 and 1"
)]
pub struct NotARotation {
    /// Largest entry of M M^T - I, absolute.
    pub off_identity: f64,
    /// The determinant.
    pub determinant: f64,
}

/// How far from orthogonal a matrix may be: what f32 input leaves.
const ORTHOGONALITY: f64 = 1e-5;

/// One degree's matrix, addressed by order.
struct Block<'a> {
    l: isize,
    entries: &'a [f64],
}

impl Block<'_> {
    fn at(&self, row: isize, column: isize) -> f64 {
        self.entries[((row + self.l) * (2 * self.l + 1) + column + self.l) as usize]
    }
}

impl ShRotation {
    /// Turns a function f into the one whose value at `rotation * d` is f(d).
    ///
    /// # Errors
    /// [`NotARotation`] if the matrix is not orthogonal to 1e-5 with determinant 1.
    pub fn new(bands: Bands, rotation: DMat3) -> Result<Self, NotARotation> {
        let off = rotation * rotation.transpose() - DMat3::IDENTITY;
        let off_identity =
            off.to_cols_array().into_iter().fold(0.0, |m: f64, v| if v.abs() <= m { m } else { v.abs() });
        let determinant = rotation.determinant();
        if !(off_identity <= ORTHOGONALITY && determinant > 0.0) {
            return Err(NotARotation { off_identity, determinant });
        }
        // What f32 has rounded is made orthogonal again, so that energy is kept.
        let x = rotation.x_axis.normalize();
        let y = (rotation.y_axis - x * x.dot(rotation.y_axis)).normalize();
        let columns = [x, y, x.cross(y)];
        // Orders -1, 0, 1 are y, z, x.
        let axis = [1, 2, 0];
        let first: Vec<f64> = (0..9).map(|i| columns[axis[i % 3]][axis[i / 3]]).collect();
        let mut blocks = vec![vec![1.0]];
        for l in 1..bands.count() {
            let block = if l == 1 { first.clone() } else { next_block(l as isize, &first, &blocks[l - 1]) };
            blocks.push(block);
        }
        Ok(Self { bands, blocks })
    }

    /// For each degree l its matrix of 2 l + 1 rows, row-major: output from input, orders ascending.
    pub fn degrees(&self) -> &[Vec<f64>] {
        &self.blocks
    }

    /// Turns the coefficients of one function.
    ///
    /// # Panics
    /// If there are not [`Bands::coefficients`] of them.
    pub fn rotate(&self, coefficients: &[f64]) -> Vec<f64> {
        assert_eq!(coefficients.len(), self.bands.coefficients(), "coefficients of another number of bands");
        let mut out = Vec::with_capacity(coefficients.len());
        for (l, block) in self.blocks.iter().enumerate() {
            let degree = &coefficients[l * l..(l + 1) * (l + 1)];
            out.extend(
                block.chunks(degree.len()).map(|row| row.iter().zip(degree).map(|(a, b)| a * b).sum::<f64>()),
            );
        }
        out
    }
}

/// The matrix of degree `l`, 2 or more.
fn next_block(l: isize, first: &[f64], below: &[f64]) -> Vec<f64> {
    let first = Block { l: 1, entries: first };
    let below = Block { l: l - 1, entries: below };
    // P_i of table 2.
    let p = |i: isize, row: isize, n: isize| {
        if n == l {
            first.at(i, 1) * below.at(row, l - 1) - first.at(i, -1) * below.at(row, 1 - l)
        } else if n == -l {
            first.at(i, 1) * below.at(row, 1 - l) + first.at(i, -1) * below.at(row, l - 1)
        } else {
            first.at(i, 0) * below.at(row, n)
        }
    };
    let root = |v: isize| (v as f64).sqrt();
    let mut block = Vec::with_capacity(((2 * l + 1) * (2 * l + 1)) as usize);
    for m in -l..=l {
        for n in -l..=l {
            let denominator = root(if n.abs() == l { 2 * l * (2 * l - 1) } else { (l + n) * (l - n) });
            let mut sum = 0.0;
            if m.abs() < l {
                sum += root((l + m) * (l - m)) * p(0, m, n);
            }
            let a = m.abs();
            let v = 0.5 * root((l + a - 1) * (l + a));
            sum += match m {
                0 => -v * std::f64::consts::SQRT_2 * (p(1, 1, n) + p(-1, -1, n)),
                1 => v * std::f64::consts::SQRT_2 * p(1, 0, n),
                -1 => v * std::f64::consts::SQRT_2 * p(-1, 0, n),
                2.. => v * (p(1, m - 1, n) - p(-1, 1 - m, n)),
                _ => v * (p(1, m + 1, n) + p(-1, -m - 1, n)),
            };
            if a != 0 && a <= l - 2 {
                let w = -0.5 * root((l - a - 1) * (l - a));
                sum += w * if m > 0 {
                    p(1, m + 1, n) + p(-1, -m - 1, n)
                } else {
                    p(1, m - 1, n) - p(-1, 1 - m, n)
                };
            }
            block.push(sum / denominator);
        }
    }
    block
}
