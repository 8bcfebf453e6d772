//! Spectra of light given as linear sRGB.

use rayon::prelude::*;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_core::patch::light_xyz;
use spectral_core::upsample::SmoothSpectrum;

/// Intervals of the table along each side of a face.
const STEPS: usize = 48;

/// D65 times the smooth spectrum of a colour (Jakob & Hanika 2019), for every chromaticity: on a grid, white having Y = 1.
///
/// A colour is its largest component times a point on one of three faces of the unit cube; the table has a grid of solved
/// spectra on each, closer together towards saturated colours, where spectra change fast, and linear between them. White
/// is a corner and exact.
pub(crate) struct Upsampled {
    /// Face after face, node after node.
    nodes: Vec<Vec<f64>>,
}

impl Upsampled {
    pub(crate) fn new(grid: &SpectralGrid, observer: Observer) -> Self {
        let d65 = grid.sample(|lambda_nm| Illuminant::D65.relative_power(lambda_nm));
        let y = light_xyz(grid, observer, &d65)[1];
        let side = STEPS + 1;
        let nodes = (0..3 * side * side)
            .into_par_iter()
            .map(|node| {
                let (face, at) = (node / (side * side), node % (side * side));
                let share = |i: usize| (i as f64 / STEPS as f64).powi(2);
                let mut colour = [1.0; 3];
                colour[(face + 1) % 3] = share(at % side);
                colour[(face + 2) % 3] = share(at / side);
                let shape = SmoothSpectrum::reflectance(colour);
                d65.iter().enumerate().map(|(i, d)| d / y * shape.at(grid.lambda_nm(i))).collect()
            })
            .collect();
        Self { nodes }
    }

    /// Adds the spectrum of a colour that is not negative.
    pub(crate) fn add(&self, colour: [f64; 3], sum: &mut [f64]) {
        let face = (1..3).fold(0, |best, c| if colour[c] > colour[best] { c } else { best });
        let largest = colour[face];
        if largest == 0.0 {
            return;
        }
        let place = |c: usize| {
            let share = colour[(face + c) % 3] / largest;
            let steps = STEPS as f64;
            // Truncation is floor here: shares are not negative.
            let below = ((share.sqrt() * steps) as usize).min(STEPS - 1);
            let (low, high) = (below as f64 / steps, (below + 1) as f64 / steps);
            (below, (share - low * low) / (high * high - low * low))
        };
        let ((i, s), (j, t)) = (place(1), place(2));
        let side = STEPS + 1;
        let first = face * side * side + j * side + i;
        let corners =
            [(0, (1.0 - s) * (1.0 - t)), (1, s * (1.0 - t)), (side, (1.0 - s) * t), (side + 1, s * t)];
        for (offset, weight) in corners {
            let node = &self.nodes[first + offset];
            sum.iter_mut().zip(node).for_each(|(sum, c)| *sum += largest * weight * c);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spectral_core::rgb::xyz_from_linear_srgb;

    /// The table's colours are those of the solved spectra, and these, on 5 nm from 400 to 700, nearly those asked for.
    #[test]
    fn colours_come_back() {
        let grid = SpectralGrid::SCHWENK_2010;
        let observer = Observer::Cie1931;
        let table = Upsampled::new(&grid, observer);
        let d65 = grid.sample(|lambda_nm| Illuminant::D65.relative_power(lambda_nm));
        let y = light_xyz(&grid, observer, &d65)[1];
        let (mut by_table, mut by_grid): (f64, f64) = (0.0, 0.0);
        let shares = [0.02, 0.1, 0.35, 0.7, 1.0];
        for (r, g, b) in (0..125).map(|i| (shares[i % 5], shares[i / 5 % 5], shares[i / 25])) {
            let mut spectrum = vec![0.0; grid.samples()];
            table.add([r, g, b], &mut spectrum);
            let seen = light_xyz(&grid, observer, &spectrum);
            let shape = SmoothSpectrum::reflectance([r, g, b]);
            let light: Vec<f64> =
                d65.iter().enumerate().map(|(i, d)| d / y * shape.at(grid.lambda_nm(i))).collect();
            let (solved, asked) = (light_xyz(&grid, observer, &light), xyz_from_linear_srgb([r, g, b]));
            // Of X + Y + Z: Y alone is next to nothing for a saturated blue.
            let scale: f64 = asked.iter().sum();
            for c in 0..3 {
                by_table = by_table.max((seen[c] - solved[c]).abs() / scale);
                by_grid = by_grid.max((solved[c] - asked[c]).abs() / scale);
            }
            if r == g && g == b {
                assert!((0..3).all(|c| (seen[c] - solved[c]).abs() < 1e-9));
            }
        }
        println!("largest error of X, Y, Z over their sum: table {by_table:.1e}, grid {by_grid:.1e}");
        assert!(by_table < 7e-3 && by_grid < 8e-3, "{by_table} {by_grid}");
        let mut black = vec![0.0; grid.samples()];
        table.add([0.0; 3], &mut black);
        assert!(black.iter().all(|v| *v == 0.0));
    }
}
