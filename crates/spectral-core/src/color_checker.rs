//! The 24 patches of the ColorChecker: reflectances after Ohta, 380 to 780 nm by 5 nm.

use alloc::vec::Vec;

use crate::csv_table::{interpolate, parse_csv};
use crate::grid::SpectralGrid;

/// 380 to 780 nm by 5; columns as in [`PATCHES`].
static TABLE: [[f64; 25]; 81] = parse_csv(include_str!("../data/colorchecker24_ohta.csv"));

/// Names of the patches, row by row from the chart's upper left.
pub const PATCHES: [&str; 24] = [
    "dark skin",
    "light skin",
    "blue sky",
    "foliage",
    "blue flower",
    "bluish green",
    "orange",
    "purplish blue",
    "moderate red",
    "purple",
    "yellow green",
    "orange yellow",
    "blue",
    "green",
    "red",
    "yellow",
    "magenta",
    "cyan",
    "white 9.5",
    "neutral 8",
    "neutral 6.5",
    "neutral 5",
    "neutral 3.5",
    "black 2",
];

/// Reflectance, 0 to 1, of the patch [`PATCHES`]`[patch]` at a wavelength in nm: linear between the entries; the first
/// and the last entry outside of 380 to 780 nm.
///
/// # Panics
/// If `patch` is not below 24.
pub fn reflectance(patch: usize, lambda_nm: f64) -> f64 {
    assert!(patch < PATCHES.len(), "patch {patch} of {}", PATCHES.len());
    interpolate(&TABLE, 1 + patch, lambda_nm.clamp(TABLE[0][0], TABLE[80][0]))
}

/// All 24 reflectances at the wavelengths of a grid.
pub fn sampled(grid: &SpectralGrid) -> Vec<Vec<f64>> {
    (0..PATCHES.len()).map(|patch| grid.sample(|lambda_nm| reflectance(patch, lambda_nm))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_belong_to_their_patches() {
        let header = include_str!("../data/colorchecker24_ohta.csv").lines().next().expect("a header");
        for (column, patch) in header.split(',').skip(1).zip(PATCHES) {
            assert!(column.starts_with(patch), "{column} {patch}");
        }
        assert_eq!(header.split(',').count(), 1 + PATCHES.len());
        assert_eq!(reflectance(0, 385.0), 0.051);
    }

    #[test]
    fn the_greys_fall_from_white_to_black_and_red_is_red() {
        for lambda_nm in [450.0, 550.0, 650.0] {
            assert!((18..23).all(|p| reflectance(p, lambda_nm) > reflectance(p + 1, lambda_nm)));
        }
        assert!(reflectance(14, 650.0) > 0.6 && reflectance(14, 500.0) < 0.06);
    }

    #[test]
    fn outside_of_the_table_the_ends_are_held() {
        assert_eq!(reflectance(3, 300.0), reflectance(3, 380.0));
        assert_eq!(reflectance(3, 900.0), reflectance(3, 780.0));
    }
}
