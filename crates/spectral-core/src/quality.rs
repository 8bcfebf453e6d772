//! How well a few wavelengths stand for a continuous spectrum: the colour error of a dispersed line.
//!
//! A slit is imaged through a dispersive prism: wavelength lambda lands around x = D * offset(lambda) pixels with a
//! Gaussian profile of sigma = 0.7 px, where offset is the Cauchy IOR offset (so D is the distance between the lines
//! F and C). The picture that a set of wavelengths makes of it is compared with the one of every nanometre from 380
//! to 780, both with channels that sum to D65 white: mean CIEDE2000 over the samples, 0.25 px apart, where Y of either
//! is above 0.01 of the reference's largest Y. The smaller D, the easier: at 0 every set is perfect.

use alloc::vec;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::color::{delta_e_2000, lab_from_xyz};
use crate::dispersion::OffsetConvention;
use crate::observer::{Observer, TABLE_NM, VISIBLE_NM};
use crate::rgb::D65_WHITE_XYZ;
use crate::wavelengths::WavelengthSet;

/// The spreads that every report states, px.
pub const SPREADS_PX: [f64; 4] = [1.0, 4.0, 16.0, 64.0];

/// Largest spread that can be asked for, px: beyond it the 1 nm samples of the reference come apart themselves.
pub const MAX_SPREAD_PX: f64 = 64.0;

/// Standard deviation of the slit's image, px.
const SIGMA_PX: f64 = 0.7;
/// Samples per pixel.
const SAMPLES_PER_PX: f64 = 4.0;
/// Where the slit's image ends: its profile is below 2e-8 there.
const REACH_PX: f64 = 6.0 * SIGMA_PX;
/// Samples darker than this in both pictures are not judged.
const MIN_Y: f64 = 0.01;

/// A spread that the comparison is not defined for.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("the spread between F and C must be from 0 to {MAX_SPREAD_PX} px, got {got_px} px")]
pub struct SpreadError {
    /// The spread asked for, px.
    pub got_px: f64,
}

/// The reference picture of a dispersed line, to compare sets of wavelengths with.
#[derive(Clone, Debug)]
pub struct DispersedLine {
    spread_px: f64,
    /// Position of the first sample, in samples from x = 0.
    first_sample: i32,
    /// XYZ of the brightest sample has Y = 1.
    reference: Vec<[f64; 3]>,
    reference_lab: Vec<[f64; 3]>,
    /// From pictures whose white is D65 with Y = 1 to pictures whose brightest reference sample has Y = 1.
    exposure: f64,
}

impl DispersedLine {
    /// The line that `observer` sees with the lines F and C `spread_px` apart.
    ///
    /// # Errors
    /// If the spread is NaN, negative or above [`MAX_SPREAD_PX`].
    pub fn new(observer: Observer, spread_px: f64) -> Result<Self, SpreadError> {
        if !(0.0..=MAX_SPREAD_PX).contains(&spread_px) {
            return Err(SpreadError { got_px: spread_px });
        }
        let end =
            |lambda_nm: f64, reach_px: f64| (position_px(spread_px, lambda_nm) + reach_px) * SAMPLES_PER_PX;
        let first_sample = libm::floor(end(TABLE_NM.1, -REACH_PX)) as i32;
        let last_sample = libm::ceil(end(TABLE_NM.0, REACH_PX)) as i32;
        let samples = usize::try_from(last_sample - first_sample).map_or(0, |n| n + 1);
        let mut line = Self {
            spread_px,
            first_sample,
            reference: vec![[0.0; 3]; samples],
            reference_lab: Vec::new(),
            exposure: 1.0,
        };

        let wavelengths_nm: Vec<f64> = (0..=400).map(|i| VISIBLE_NM.0 + f64::from(i)).collect();
        let mut weights: Vec<[f64; 3]> = wavelengths_nm.iter().map(|&nm| observer.xyz_bar(nm)).collect();
        let sums = [0, 1, 2].map(|c| weights.iter().map(|w| w[c]).sum::<f64>());
        for weight in &mut weights {
            for c in 0..3 {
                weight[c] /= sums[c];
            }
        }
        let mut picture = line.picture(&wavelengths_nm, &weights);
        line.exposure = 1.0 / picture.iter().fold(0.0, |max: f64, xyz| max.max(xyz[1]));
        for xyz in &mut picture {
            *xyz = xyz.map(|v| v * line.exposure);
        }
        line.reference_lab = picture.iter().map(|&xyz| lab_from_xyz(xyz, D65_WHITE_XYZ)).collect();
        line.reference = picture;
        Ok(line)
    }

    /// Mean CIEDE2000 between the reference and the picture of `wavelengths_nm`, each weighted in XYZ so that every
    /// channel sums to 1. Wavelengths outside 360 to 830 nm fall off the picture.
    pub fn delta_e(&self, wavelengths_nm: &[f64], weights_xyz: &[[f64; 3]]) -> f64 {
        let picture = self.picture(wavelengths_nm, weights_xyz);
        let (mut sum, mut count) = (0.0, 0_u32);
        for ((xyz, reference), reference_lab) in picture.iter().zip(&self.reference).zip(&self.reference_lab)
        {
            if xyz[1] > MIN_Y || reference[1] > MIN_Y {
                sum += delta_e_2000(*reference_lab, lab_from_xyz(*xyz, D65_WHITE_XYZ));
                count += 1;
            }
        }
        // The reference's own brightest sample is always counted.
        sum / f64::from(count)
    }

    /// XYZ of every sample.
    fn picture(&self, wavelengths_nm: &[f64], weights_xyz: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut picture = vec![[0.0; 3]; self.reference.len()];
        for (&lambda_nm, weight) in wavelengths_nm.iter().zip(weights_xyz) {
            let center =
                position_px(self.spread_px, lambda_nm) * SAMPLES_PER_PX - f64::from(self.first_sample);
            let white: [f64; 3] = core::array::from_fn(|c| weight[c] * D65_WHITE_XYZ[c] * self.exposure);
            // Casts saturate, so wavelengths far outside give empty ranges.
            let begin = libm::ceil(center - REACH_PX * SAMPLES_PER_PX).max(0.0) as usize;
            let end = (center + REACH_PX * SAMPLES_PER_PX).max(0.0) as usize;
            for (i, xyz) in picture.iter_mut().enumerate().take(end.saturating_add(1)).skip(begin) {
                let d = (i as f64 - center) / (SIGMA_PX * SAMPLES_PER_PX);
                let profile = libm::exp(-0.5 * d * d);
                for c in 0..3 {
                    xyz[c] += profile * white[c];
                }
            }
        }
        picture
    }
}

/// Where a wavelength's image is centred, px from that of the D line.
fn position_px(spread_px: f64, lambda_nm: f64) -> f64 {
    spread_px * OffsetConvention::Specgen.ior_offset(lambda_nm)
}

/// Mean CIEDE2000 of a set at the four stated spreads.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EdgeReport {
    /// In the order of [`SPREADS_PX`].
    pub delta_e: [f64; 4],
}

impl EdgeReport {
    /// The report of a set, against the reference that its own observer sees.
    pub fn new(set: &WavelengthSet) -> Self {
        let delta_e = SPREADS_PX
            .map(|spread_px| edge_delta_e(set, spread_px).expect("the stated spreads are within the limit"));
        Self { delta_e }
    }

    /// Spread in px and mean CIEDE2000, from the narrowest to the widest.
    pub fn iter(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        SPREADS_PX.into_iter().zip(self.delta_e)
    }
}

/// Mean CIEDE2000 of a set's dispersed line, whose lines F and C are `spread_px` apart, as its own observer sees it.
///
/// # Errors
/// If the spread is NaN, negative or above [`MAX_SPREAD_PX`].
pub fn edge_delta_e(set: &WavelengthSet, spread_px: f64) -> Result<f64, SpreadError> {
    Ok(DispersedLine::new(set.observer, spread_px)?.delta_e(&set.wavelengths_nm, &set.relative_weights_xyz()))
}
