//! How far two irradiance maps are apart: the metrics of `docs/src/comparing.md`.
//!
//! exposure   1 / (99th percentile of the reference's Y): both maps are multiplied by it before Lab
//! white      XYZ at Y = 1 of unblocked perpendicular light of the scene's lamps; Lab is relative to it,
//!            so a texel at the 99th percentile has L* = 100
//! Δe         CIEDE2000, over texels whose exposed Y is above [`DARK`] in the reference
//!
//! Percentiles interpolate linearly between samples, as NumPy's `quantile` does.

use serde::Serialize;
use spectral_core::color::{delta_e_2000, lab_from_xyz};

/// Share of the reference's 99th percentile below which colour is not judged.
pub const DARK: f64 = 0.005;

/// Texels across after binning: noise of single texels averages out, displaced light does not.
pub const BINS: usize = 64;

/// Negative components of this share of a map's largest are f32 roundings of a way through RGB, not light.
const ROUNDING: f32 = 1e-6;

/// Irradiance over a receiver's UV square: XYZ, row-major.
#[derive(Clone, Copy, Debug)]
pub struct Map<'a> {
    /// Texels in u and v.
    pub size: [usize; 2],
    /// One XYZ a texel, Y in lux.
    pub xyz: &'a [[f32; 3]],
}

/// Distance of a map from a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Mean CIEDE2000; `None` where less than a hundredth of the reference is lit, so that no exposure follows.
    pub delta_e_mean: Option<f64>,
    /// 95th percentile of CIEDE2000.
    pub delta_e_p95: Option<f64>,
    /// RMS of CIEDE2000: squares of independent errors add up, means do not.
    pub delta_e_rms: Option<f64>,
    /// RMS of the difference of Y over RMS of the reference's Y.
    pub rms: f64,
    /// The same after binning to 64 x 64.
    pub rms_64: f64,
    /// Total Y over the reference's.
    pub total_y: f64,
}

/// Why a comparison would mean nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Incomparable {
    /// The maps do not cover the same texels.
    #[error("{got} texels against {expected}, which must be equal and bin evenly to {BINS} x {BINS}")]
    Size {
        /// Texels of the map, or samples it holds.
        got: usize,
        /// Texels of the reference.
        expected: usize,
    },
    /// NaN or infinity.
    #[error("texel {texel} is not finite")]
    NotFinite {
        /// Its index.
        texel: usize,
    },
    /// XYZ of light is never below 0, but for rounding.
    #[error("texel {texel} has a negative component, {value}")]
    Negative {
        /// Its index.
        texel: usize,
        /// What it holds.
        value: f32,
    },
    /// No light at all.
    #[error("black")]
    Black,
    /// The same light everywhere, as a map that was only cleared has.
    #[error("constant, Y = {y} everywhere")]
    Constant {
        /// That value, lux.
        y: f64,
    },
    /// More light than the lamps send.
    #[error("mean Y is {mean_y:.4} lux, the lamps account for at most {max_y:.4}")]
    Energy {
        /// Mean of the map, lux.
        mean_y: f64,
        /// The bound, lux.
        max_y: f64,
    },
}

impl Map<'_> {
    /// Whether there is light to compare: finite, not negative, not black, and no more than `max_mean_y` lux on average.
    ///
    /// # Errors
    /// Says which of these does not hold.
    pub fn check_light(&self, max_mean_y: f64) -> Result<(), Incomparable> {
        self.check_values()?;
        let mean_y = mean(&self.luminance());
        if mean_y <= 0.0 {
            return Err(Incomparable::Black);
        }
        if mean_y > max_mean_y {
            return Err(Incomparable::Energy { mean_y, max_y: max_mean_y });
        }
        Ok(())
    }

    /// Whether it differs from place to place, as a map that was only cleared does not.
    ///
    /// # Errors
    /// [`Incomparable::Constant`] if it does not.
    pub fn check_varies(&self) -> Result<(), Incomparable> {
        let y = self.luminance();
        let mean_y = mean(&y);
        if y.iter().all(|&v| (v - mean_y).abs() <= 1e-6 * mean_y) {
            return Err(Incomparable::Constant { y: mean_y });
        }
        Ok(())
    }

    /// Total Y over all texels, lux.
    pub fn total_y(&self) -> f64 {
        self.xyz.iter().map(|xyz| f64::from(xyz[1])).sum()
    }

    fn check_values(&self) -> Result<(), Incomparable> {
        let expected = self.size[0] * self.size[1];
        if self.xyz.len() != expected || expected == 0 {
            return Err(Incomparable::Size { got: self.xyz.len(), expected });
        }
        let largest = self.xyz.iter().flatten().copied().fold(0.0, f32::max);
        for (texel, xyz) in self.xyz.iter().enumerate() {
            if xyz.iter().any(|v| !v.is_finite()) {
                return Err(Incomparable::NotFinite { texel });
            }
            if let Some(&value) = xyz.iter().find(|&&v| v < -ROUNDING * largest) {
                return Err(Incomparable::Negative { texel, value });
            }
        }
        Ok(())
    }

    fn luminance(&self) -> Vec<f64> {
        self.xyz.iter().map(|xyz| f64::from(xyz[1])).collect()
    }

    /// Means of Y over equal blocks, 64 x 64 of them or the map itself where it is smaller.
    fn binned_luminance(&self) -> Vec<f64> {
        let [width, height] = self.size;
        let (columns, rows) = (width.min(BINS), height.min(BINS));
        let (block_width, block_height) = (width / columns, height / rows);
        let mut bins = vec![0.0; columns * rows];
        for (texel, xyz) in self.xyz.iter().enumerate() {
            let (x, y) = (texel % width, texel / width);
            bins[y / block_height * columns + x / block_width] += f64::from(xyz[1]);
        }
        let share = 1.0 / (block_width * block_height) as f64;
        bins.iter_mut().for_each(|b| *b *= share);
        bins
    }
}

/// Distance of `map` from `reference`, with Lab relative to `white_xyz` (Y = 1).
///
/// # Errors
/// If the sizes differ or do not bin evenly, a value is not finite or negative, or the reference is black.
pub fn compare(map: &Map<'_>, reference: &Map<'_>, white_xyz: [f64; 3]) -> Result<Metrics, Incomparable> {
    let bins_evenly = map.size.iter().all(|&n| n > 0 && n % BINS.min(n) == 0);
    if map.size != reference.size || !bins_evenly {
        return Err(Incomparable::Size { got: map.xyz.len(), expected: reference.xyz.len() });
    }
    map.check_values()?;
    reference.check_values()?;
    let reference_y = reference.total_y();
    if reference_y <= 0.0 {
        return Err(Incomparable::Black);
    }
    let mut delta_e = delta_e(map, reference, white_xyz);
    delta_e.sort_by(f64::total_cmp);
    Ok(Metrics {
        delta_e_mean: (!delta_e.is_empty()).then(|| mean(&delta_e)),
        delta_e_p95: (!delta_e.is_empty()).then(|| quantile(&delta_e, 0.95)),
        delta_e_rms: (!delta_e.is_empty()).then(|| root_mean_square(&delta_e)),
        rms: relative_rms(&map.luminance(), &reference.luminance()),
        rms_64: relative_rms(&map.binned_luminance(), &reference.binned_luminance()),
        total_y: map.total_y() / reference_y,
    })
}

/// The exposure at which `reference` is looked at, if enough of it is lit for its 99th percentile to be above 0.
pub fn exposure(reference: &Map<'_>) -> Option<f64> {
    let mut y = reference.luminance();
    y.sort_by(f64::total_cmp);
    let bright = quantile(&y, 0.99);
    (bright > 0.0).then(|| 1.0 / bright)
}

/// The mean of two maps, texel by texel.
#[must_use]
pub fn mean_of(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<[f32; 3]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect()
}

/// CIEDE2000 of each texel that is not dark in the reference.
fn delta_e(map: &Map<'_>, reference: &Map<'_>, white_xyz: [f64; 3]) -> Vec<f64> {
    let Some(exposure) = exposure(reference) else { return Vec::new() };
    let lab = |xyz: &[f32; 3]| lab_from_xyz(xyz.map(|v| f64::from(v) * exposure), white_xyz);
    map.xyz
        .iter()
        .zip(reference.xyz)
        .filter(|(_, r)| f64::from(r[1]) * exposure > DARK)
        .map(|(m, r)| delta_e_2000(lab(r), lab(m)))
        .collect()
}

/// RMS(values - reference) / RMS(reference).
fn relative_rms(values: &[f64], reference: &[f64]) -> f64 {
    let difference: f64 = values.iter().zip(reference).map(|(v, r)| (v - r) * (v - r)).sum();
    let scale: f64 = reference.iter().map(|r| r * r).sum();
    (difference / scale).sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Quantile of ascending values, at least one, interpolated linearly.
pub fn quantile(ascending: &[f64], share: f64) -> f64 {
    let position = share * (ascending.len() - 1) as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(ascending.len() - 1);
    let fraction = position - below as f64;
    ascending[below] + (ascending[above] - ascending[below]) * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [f64; 3] = [0.95047, 1.0, 1.08883];

    /// A soft spot of white light, off centre.
    fn spot(size: usize) -> Vec<[f32; 3]> {
        let texel = |i: usize| {
            let (x, y) = ((i % size) as f64 / size as f64 - 0.4, (i / size) as f64 / size as f64 - 0.6);
            let value = (-(x * x + y * y) / 0.02).exp();
            WHITE.map(|w| (w * value) as f32)
        };
        (0..size * size).map(texel).collect()
    }

    fn map(size: usize, xyz: &[[f32; 3]]) -> Map<'_> {
        Map { size: [size, size], xyz }
    }

    #[test]
    fn equal_maps_are_at_distance_zero() {
        let xyz = spot(128);
        let metrics = compare(&map(128, &xyz), &map(128, &xyz), WHITE).unwrap();
        assert_eq!((metrics.rms, metrics.rms_64, metrics.total_y), (0.0, 0.0, 1.0));
        assert_eq!((metrics.delta_e_mean, metrics.delta_e_p95), (Some(0.0), Some(0.0)));
    }

    #[test]
    fn brighter_light_shows_as_its_factor() {
        let xyz = spot(128);
        let brighter: Vec<_> = xyz.iter().map(|v| v.map(|c| c * 1.25)).collect();
        let metrics = compare(&map(128, &brighter), &map(128, &xyz), WHITE).unwrap();
        for value in [metrics.rms, metrics.rms_64, metrics.total_y - 1.0] {
            assert!((value - 0.25).abs() < 1e-6, "{metrics:?}");
        }
        assert!(metrics.delta_e_mean > Some(1.0), "{metrics:?}");
    }

    #[test]
    fn swapped_channels_show_in_colour_alone() {
        let xyz = spot(128);
        let swapped: Vec<_> = xyz.iter().map(|&[x, y, z]| [z, y, x]).collect();
        let metrics = compare(&map(128, &swapped), &map(128, &xyz), WHITE).unwrap();
        assert_eq!((metrics.rms, metrics.total_y), (0.0, 1.0));
        assert!(metrics.delta_e_mean > Some(3.0), "{metrics:?}");
    }

    #[test]
    fn binning_forgives_a_swap_of_neighbours_but_no_displacement() {
        let xyz = spot(128);
        let mut neighbours = xyz.clone();
        neighbours.chunks_exact_mut(2).for_each(|pair| pair.swap(0, 1));
        let metrics = compare(&map(128, &neighbours), &map(128, &xyz), WHITE).unwrap();
        assert!(metrics.rms > 1e-3 && metrics.rms_64 < 1e-6, "{metrics:?}");

        let mut displaced = xyz.clone();
        displaced.rotate_right(4);
        let metrics = compare(&map(128, &displaced), &map(128, &xyz), WHITE).unwrap();
        assert!(metrics.rms_64 > 0.05, "{metrics:?}");
    }

    #[test]
    fn quantile_interpolates_as_numpy_does() {
        // numpy.quantile([1, 2, 4, 8], 0.9) = 6.8
        assert!((quantile(&[1.0, 2.0, 4.0, 8.0], 0.9) - 6.8).abs() < 1e-12);
        assert_eq!(quantile(&[3.0], 0.99), 3.0);
    }

    #[test]
    fn nothing_to_compare_is_said() {
        let xyz = spot(64);
        let dark = vec![[0.0; 3]; 64 * 64];
        let flat = vec![[0.5; 3]; 64 * 64];
        let mut broken = xyz.clone();
        broken[7] = [0.0, f32::NAN, 0.0];
        let mut negative = xyz.clone();
        negative[9] = [-1.0, 0.5, 0.0];
        assert_eq!(map(64, &xyz).check_light(10.0), Ok(()));
        assert_eq!(map(64, &xyz).check_varies(), Ok(()));
        assert_eq!(map(64, &dark).check_light(10.0), Err(Incomparable::Black));
        assert_eq!(map(64, &flat).check_varies(), Err(Incomparable::Constant { y: 0.5 }));
        assert_eq!(map(64, &broken).check_light(10.0), Err(Incomparable::NotFinite { texel: 7 }));
        assert_eq!(
            map(64, &negative).check_light(10.0),
            Err(Incomparable::Negative { texel: 9, value: -1.0 })
        );
        assert!(matches!(map(64, &xyz).check_light(1e-3), Err(Incomparable::Energy { .. })));
        assert!(matches!(map(65, &xyz).check_light(10.0), Err(Incomparable::Size { .. })));
        let uneven = spot(65);
        assert!(matches!(
            compare(&map(65, &uneven), &map(65, &uneven), WHITE),
            Err(Incomparable::Size { .. })
        ));
        assert_eq!(compare(&map(64, &xyz), &map(64, &dark), WHITE), Err(Incomparable::Black));
    }

    #[test]
    fn a_few_lit_texels_give_no_colour_but_an_energy() {
        let mut xyz = vec![[0.0; 3]; 64 * 64];
        xyz[5] = [1.0; 3];
        let metrics = compare(&map(64, &xyz), &map(64, &xyz), WHITE).unwrap();
        assert_eq!((metrics.delta_e_mean, metrics.total_y), (None, 1.0));
    }
}
