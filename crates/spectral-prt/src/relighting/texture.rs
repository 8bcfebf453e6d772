//! RGB textures as spectra.

use std::collections::HashMap;

use rayon::prelude::*;
use spectral_core::color::{delta_e_94, lab_from_xyz};
use spectral_core::display::linear_from_srgb;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::{Shown, light_xyz};
use spectral_core::rgb::{D65_WHITE_XYZ, xyz_from_linear_srgb};
use spectral_core::upsample::SmoothSpectrum;

use super::albedo::{Projection, SpectralMap};
use super::error::RelightingError;

/// How far colours are from themselves on their way through smooth spectra, the grid and the basis, under D65.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundTrip {
    /// Different colours of the texture.
    pub colours: usize,
    /// CIE94 difference, mean over all texels.
    pub delta_e_mean: f64,
    /// The largest.
    pub delta_e_max: f64,
    /// The colour that has it, sRGB.
    pub worst: [u8; 3],
}

impl SpectralMap {
    /// A texture of `size` columns and rows in 8-bit sRGB, row after row from v = 0. Each colour becomes the smooth
    /// reflectance that has it under D65 (Jakob & Hanika 2019); colours are solved once each, on all cores.
    ///
    /// # Errors
    /// [`RelightingError::MapSize`] without texels, and for another number of them; [`RelightingError::Value`] where the
    /// projection's grid sees nothing of D65.
    pub fn from_srgb(
        projection: &Projection<'_>,
        size: [u32; 2],
        texels: &[[u8; 3]],
    ) -> Result<(Self, RoundTrip), RelightingError> {
        let mut colours: Vec<[u8; 3]> = Vec::new();
        let mut counts: Vec<usize> = Vec::new();
        let mut places = HashMap::new();
        let indices: Vec<u32> = texels
            .iter()
            .map(|texel| {
                let place = *places.entry(*texel).or_insert_with(|| {
                    colours.push(*texel);
                    counts.push(0);
                    colours.len() - 1
                });
                counts[place] += 1;
                place as u32
            })
            .collect();
        let grid = *projection.grid();
        let reflectances: Vec<Vec<f64>> = colours
            .par_iter()
            .map(|colour| {
                let smooth = SmoothSpectrum::reflectance(linear(*colour));
                grid.sample(|lambda_nm| smooth.at(lambda_nm))
            })
            .collect();
        let map = Self::new(projection, size, indices, &reflectances)?;
        let d65 = grid.sample(|lambda_nm| Illuminant::D65.relative_power(lambda_nm));
        let white = light_xyz(&grid, projection.observer(), &d65);
        let shown = Shown::under(white).ok_or(RelightingError::Value {
            what: "the luminance of D65 on the grid",
            got: white[1],
            expected: "above 0, with a white that Bradford can balance",
        })?;
        let difference = |(colour, reflectance): (&[u8; 3], &Vec<f64>)| {
            let asked = lab_from_xyz(xyz_from_linear_srgb(linear(*colour)), D65_WHITE_XYZ);
            delta_e_94(asked, shown.lab(projection.seen(reflectance, &d65)))
        };
        let differences: Vec<f64> = colours.iter().zip(&reflectances).map(difference).collect();
        let sum: f64 = differences.iter().zip(&counts).map(|(d, count)| d * *count as f64).sum();
        let worst = (0..colours.len()).max_by(|a, b| differences[*a].total_cmp(&differences[*b]));
        let worst = worst.unwrap_or_default();
        let round_trip = RoundTrip {
            colours: colours.len(),
            delta_e_mean: sum / texels.len() as f64,
            delta_e_max: differences[worst],
            worst: colours[worst],
        };
        Ok((map, round_trip))
    }
}

fn linear(srgb: [u8; 3]) -> [f64; 3] {
    srgb.map(|component| linear_from_srgb(f64::from(component) / 255.0))
}
