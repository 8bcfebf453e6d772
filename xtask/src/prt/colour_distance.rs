//! How far pictures are from each other, in colour and pixel by pixel.

use serde::Serialize;
use spectral_cli::metrics::quantile;
use spectral_core::color::{delta_e_94, delta_e_2000, lab_from_xyz};
use spectral_core::rgb::D65_WHITE_XYZ;

use super::Reference;

/// Colours of a picture against a reference's, over the pixels that show something and that every rasteriser sees alike.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ColourDistance {
    /// Mean of CIE94.
    pub cie94_mean: f64,
    /// Its 95th percentile.
    pub cie94_p95: f64,
    /// The largest.
    pub cie94_max: f64,
    /// Mean of CIEDE2000.
    pub delta_e_mean: f64,
    /// Its 95th percentile.
    pub delta_e_p95: f64,
    /// RMS of the difference of Y by RMS of the reference's.
    pub rms: f64,
    /// Largest difference of X, Y or Z, as a share of the reference's Y there.
    pub xyz_max: f64,
}

impl ColourDistance {
    /// Of `picture` from `truth`, which `reference` has drawn; XYZ relative to D65, exposed.
    #[must_use]
    pub fn of(picture: &[[f32; 3]], truth: &[[f64; 3]], reference: &Reference) -> Self {
        let lab = |xyz| lab_from_xyz(xyz, D65_WHITE_XYZ);
        let (mut cie94, mut delta_e) = (Vec::new(), Vec::new());
        let (mut error, mut light, mut xyz_max) = (0.0, 0.0, 0.0_f64);
        for i in reference.shown_pixels() {
            let (truth, got) = (truth[i], picture[i].map(f64::from));
            cie94.push(delta_e_94(lab(truth), lab(got)));
            delta_e.push(delta_e_2000(lab(truth), lab(got)));
            error += (got[1] - truth[1]).powi(2);
            light += truth[1].powi(2);
            // Backs are black, in a picture as in the truth.
            if truth[1] != 0.0 {
                let worst = (0..3).map(|c| (got[c] - truth[c]).abs()).fold(0.0, nan_is_largest);
                xyz_max = nan_is_largest(xyz_max, worst / truth[1].abs());
            }
        }
        cie94.sort_by(f64::total_cmp);
        delta_e.sort_by(f64::total_cmp);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        Self {
            cie94_mean: mean(&cie94),
            cie94_p95: quantile(&cie94, 0.95),
            cie94_max: cie94.last().copied().unwrap_or(f64::NAN),
            delta_e_mean: mean(&delta_e),
            delta_e_p95: quantile(&delta_e, 0.95),
            rms: (error / light).sqrt(),
            xyz_max,
        }
    }
}

/// CIE94 of all pixels as greys: white is `white` and more.
#[must_use]
pub fn colour_map(picture: &[[f32; 3]], truth: &[[f64; 3]], white: f64) -> Vec<[u8; 3]> {
    let lab = |xyz| lab_from_xyz(xyz, D65_WHITE_XYZ);
    let grey = |(picture, truth): (&[f32; 3], &[f64; 3])| {
        let difference = delta_e_94(lab(*truth), lab(picture.map(f64::from)));
        [(255.0 * (difference / white).min(1.0)).round() as u8; 3]
    };
    picture.iter().zip(truth).map(grey).collect()
}

/// Two pictures of the same light, pixel by pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PixelDistance {
    /// Share of the pixels that differ by more than rounding.
    pub differing: f64,
    /// The largest difference of X, Y or Z, as a share of the brightest Y.
    pub largest: f64,
}

impl PixelDistance {
    /// Of `a` from `b` over some pixels; `rounding` is a share of the brightest Y of `b`.
    #[must_use]
    pub fn of(a: &[[f32; 3]], b: &[[f64; 3]], pixels: impl Iterator<Item = usize>, rounding: f64) -> Self {
        let brightest = b.iter().map(|xyz| xyz[1]).fold(0.0, f64::max);
        let (mut count, mut differing, mut largest) = (0_usize, 0_usize, 0.0_f64);
        for i in pixels {
            let worst = (0..3).map(|c| (f64::from(a[i][c]) - b[i][c]).abs()).fold(0.0, nan_is_largest);
            count += 1;
            differing += usize::from(worst.is_nan() || worst > rounding * brightest);
            largest = nan_is_largest(largest, worst / brightest);
        }
        Self { differing: differing as f64 / count as f64, largest }
    }
}

fn nan_is_largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// What makes a picture none of a lit figure: black, even, or no numbers.
///
/// # Errors
/// Says which.
pub fn something_to_compare(picture: &[[f32; 3]]) -> Result<(), String> {
    if let Some(pixel) = picture.iter().position(|xyz| xyz.iter().any(|v| !v.is_finite())) {
        return Err(format!("pixel {pixel} is not finite"));
    }
    let y = || picture.iter().map(|xyz| xyz[1]);
    let (darkest, brightest) = (y().fold(f32::INFINITY, f32::min), y().fold(f32::NEG_INFINITY, f32::max));
    if brightest <= 0.0 {
        return Err("black".into());
    }
    // Exposed so that the brightest is 1.
    if brightest > BRIGHTEST {
        return Err(format!("Y is {brightest}, exposed for 1"));
    }
    if darkest == brightest {
        return Err(format!("constant, Y = {brightest} everywhere"));
    }
    Ok(())
}

/// Room for what colours in place of spectra do to the brightest pixel.
const BRIGHTEST: f32 = 1.5;
