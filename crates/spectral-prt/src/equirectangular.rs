//! Pictures of all directions: the first row is straight up, +Y; the middle column looks along -Z, and +X is to its right.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use crate::bands::Bands;
use crate::sh;

/// Texels are cut until the sphere has so many rows: harmonics are even then to 1e-6 over an even picture.
const ROWS: usize = 1024;
/// Rows of texels that are summed up together.
const ROWS_AT_ONCE: usize = 16;

/// The direction of a place, 0 to 1 from the left and from the top, and the solid angle of a cell of this width and height
/// about it, steradians.
pub(crate) fn cell([u, v]: [f64; 2], [width, height]: [f64; 2]) -> (DVec3, f64) {
    let (theta, phi) = (PI * v, TAU * (u - 0.5));
    let direction = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
    // cos(a) - cos(b) over the row, without cancellation.
    let solid_angle = TAU * width * 2.0 * theta.sin() * (0.5 * PI * height).sin();
    (direction, solid_angle)
}

/// Harmonic coefficients of pictures of `size` columns and rows, even within each texel: one list of
/// [`Bands::coefficients`] numbers for each of `values` numbers that `radiance` writes for a texel, counted row after row.
pub(crate) fn projected(
    bands: Bands,
    size: [usize; 2],
    values: usize,
    radiance: impl Fn(usize, &mut [f64]) + Sync,
) -> Vec<Vec<f64>> {
    let [width, height] = size;
    let rows: Vec<usize> = (0..height).collect();
    let sums: Vec<Vec<Vec<f64>>> = rows
        .par_chunks(ROWS_AT_ONCE)
        .map(|rows| {
            let mut sums = vec![vec![0.0; bands.coefficients()]; values];
            let mut of_texel = vec![0.0; values];
            let mut harmonics = Harmonics::new(bands, size);
            for texel in rows.iter().flat_map(|row| row * width..(row + 1) * width) {
                of_texel.fill(0.0);
                radiance(texel, &mut of_texel);
                let over_texel = harmonics.over(texel);
                for (sums, value) in sums.iter_mut().zip(&of_texel) {
                    sums.iter_mut().zip(over_texel).for_each(|(sum, y)| *sum += value * y);
                }
            }
            sums
        })
        .collect();
    // One after the other: the same sum on any number of threads.
    let mut all = vec![vec![0.0; bands.coefficients()]; values];
    for sums in &sums {
        for (all, sum) in all.iter_mut().flatten().zip(sums.iter().flatten()) {
            *all += sum;
        }
    }
    all
}

/// Harmonics, integrated over texels.
struct Harmonics {
    bands: Bands,
    size: [usize; 2],
    /// Cells across and down a texel.
    cells: [usize; 2],
    at: Vec<f64>,
    over: Vec<f64>,
}

impl Harmonics {
    fn new(bands: Bands, size: [usize; 2]) -> Self {
        let empty = vec![0.0; bands.coefficients()];
        Self {
            bands,
            size,
            cells: [(2 * ROWS).div_ceil(size[0]), ROWS.div_ceil(size[1])],
            at: empty.clone(),
            over: empty,
        }
    }

    fn over(&mut self, texel: usize) -> &[f64] {
        let ([width, _], [across, down]) = (self.size, self.cells);
        let at = [texel % width, texel / width];
        let corner = [0, 1].map(|axis| (at[axis] * self.cells[axis]) as f64);
        let side = [0, 1].map(|axis| 1.0 / (self.size[axis] * self.cells[axis]) as f64);
        self.over.fill(0.0);
        for (column, row) in (0..across * down).map(|i| (i % across, i / across)) {
            let place =
                [(corner[0] + column as f64 + 0.5) * side[0], (corner[1] + row as f64 + 0.5) * side[1]];
            let (direction, solid_angle) = cell(place, side);
            sh::evaluate(self.bands, direction, &mut self.at);
            self.over.iter_mut().zip(&self.at).for_each(|(over, y)| *over += solid_angle * y);
        }
        &self.over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_picture_of_any_size_is_even() {
        for size in [[1, 1], [3, 2], [64, 32], [100, 1500], [3000, 1]] {
            let [even] = &projected(Bands::MAX, size, 1, |_, value| value[0] = 1.0)[..] else {
                panic!("one")
            };
            assert!((even[0] - 2.0 * PI.sqrt()).abs() < 1e-9, "{size:?}: {}", even[0]);
            let most = even[1..].iter().fold(0.0_f64, |most, c| most.max(c.abs()));
            assert!(most < 1e-5, "{size:?}: {most}");
        }
    }

    #[test]
    fn the_light_half_of_a_picture_is_where_it_is() {
        // The upper half: Y_1 of y is the integral of sqrt(3 / 4 pi) y over it, pi times that.
        let half = projected(Bands::default(), [8, 4], 1, |texel, value| value[0] = f64::from(texel < 16));
        let expected = (3.0 / (4.0 * PI)).sqrt() * PI;
        assert!((half[0][1] - expected).abs() < 1e-5 && half[0][2].abs() < 1e-9, "{:?}", half[0]);
    }
}
