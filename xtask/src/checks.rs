//! What is asserted about two results of one layer, and how.
//!
//! Parity of two executors is asserted tightly: they run the same plan, so only rounding may differ, that of vertices to
//! parts of a texel above all ([`Snapping`]). Against the oracle a method's own error shows; it is asserted only where
//! physics leaves the method no freedom.

use frame_plan::DeviceInfo;

use crate::metrics::{Map, Metrics, compare};
use serde::Serialize;

/// Largest distances that are accepted; what is `None` is not asserted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bound {
    /// Mean CIEDE2000.
    pub delta_e_mean: Option<f64>,
    /// Relative RMS of Y at 64 x 64.
    pub rms_64: Option<f64>,
    /// Distance of the ratio of total Y from 1.
    pub total_y: Option<f64>,
}

/// The coarser rounding of vertices of two devices, texels.
///
/// Executors do the same arithmetic on the same plan. What they may do differently is to snap vertices: Vulkan permits
/// 1/16 texel, GPUs and Mesa's software driver have 1/256, and the way of rounding is free. An edge then moves by up to
/// one such step, and the texel centres that it crosses, a share of all in proportion to the step over the texels
/// across the view, become photons of another path. So every parity bound is a step over a size times a constant; f32
/// rounding alone stays below the finest. The constants leave a factor of two or more above the worst that was measured on
/// each driver, see `docs/src/comparing.md`.
///
/// On one device through one driver there is nothing to round differently: the same plan gives the same bits, whichever
/// executor runs it, and any distance is too large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapping {
    texels: f64,
}

/// `subPixelPrecisionBits` that Vulkan guarantees, for devices that do not say.
const LEAST_SUBPIXEL_BITS: u32 = 4;

/// Emission view at which the constants were measured, texels across.
const MEASURED_EMISSION_SIZE: f64 = 512.0;

/// Picture at which the constant of FLIP was measured, pixels across.
const MEASURED_PICTURE_WIDTH: f64 = 320.0;

impl Snapping {
    /// Of two devices.
    #[must_use]
    pub fn between(a: &DeviceInfo, b: &DeviceInfo) -> Self {
        if !a.device.is_empty() && (&a.device, &a.driver) == (&b.device, &b.driver) {
            return Self { texels: 0.0 };
        }
        let bits = [a, b].map(|info| info.subpixel_bits.unwrap_or(LEAST_SUBPIXEL_BITS));
        Self { texels: 0.5_f64.powi(bits[0].min(bits[1]) as i32) }
    }

    /// Most that two bakes may be apart, whose emission views are `emission_size` texels across.
    #[must_use]
    pub fn parity(self, emission_size: u32) -> Bound {
        let step = self.texels * MEASURED_EMISSION_SIZE / f64::from(emission_size);
        Bound { delta_e_mean: Some(16.0 * step), rms_64: Some(0.08 * step), total_y: Some(0.016 * step) }
    }

    /// Largest mean FLIP of two pictures so many pixels across, whose emission views are `emission_size` texels across.
    #[must_use]
    pub fn parity_flip(self, width: u32, emission_size: u32) -> f64 {
        let step = self.texels * MEASURED_EMISSION_SIZE / f64::from(emission_size);
        0.064 * step * MEASURED_PICTURE_WIDTH / f64::from(width)
    }
}

/// A method against the oracle, unblocked light: no freedom but where a silhouette's shadow ends, to a texel of
/// the method's map.
pub const DIRECT: Bound = Bound { delta_e_mean: Some(1.0), rms_64: Some(0.05), total_y: Some(0.01) };

/// A method against the oracle where light crosses a surface once, or one convex body without total reflection:
/// image space loses nothing but what is reflected inside, below a hundredth.
pub const CONVEX: Bound = Bound { delta_e_mean: None, rms_64: None, total_y: Some(0.02) };

/// A method of several wavelengths against the oracle where light meets mirrors of one object and then lands: image space errs where
/// silhouettes hide what light lands on. Measured on `metal-ring`: total Y 0.2 % high, RMS 1.5 %; one wavelength misses the
/// colour of gold by an eighth of Y.
pub const MIRRORED: Bound = Bound { delta_e_mean: None, rms_64: Some(0.03), total_y: Some(0.006) };

/// What a comparison says.
pub struct Judgement {
    /// The distances, if there was something to compare.
    pub metrics: Option<Metrics>,
    /// What is wrong; empty if nothing is.
    pub problems: Vec<String>,
}

/// What any result must look like to be worth comparing.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// XYZ at Y = 1 of unblocked perpendicular light.
    pub white_xyz: [f64; 3],
    /// What the lamps can put on a texel on average, lux.
    pub max_mean_y: f64,
    /// Equal light everywhere would be wrong; only an unshadowed receiver has that.
    pub varies: bool,
}

/// Compare `a` with `b` after asking whether there is something to compare.
pub fn judge(a: &Map<'_>, b: &Map<'_>, expected: Expected, bound: Option<Bound>) -> Judgement {
    let mut problems = Vec::new();
    for (name, map) in [("a", a), ("b", b)] {
        let light = map.check_light(expected.max_mean_y);
        let light = if expected.varies { light.and_then(|()| map.check_varies()) } else { light };
        if let Err(error) = light {
            problems.push(format!("nothing to compare, {name}: {error}"));
        }
    }
    if !problems.is_empty() {
        return Judgement { metrics: None, problems };
    }
    match compare(a, b, expected.white_xyz) {
        Ok(metrics) => {
            problems.extend(bound.map(|bound| bound.violations(&metrics)).unwrap_or_default());
            Judgement { metrics: Some(metrics), problems }
        }
        Err(error) => Judgement { metrics: None, problems: vec![format!("nothing to compare: {error}")] },
    }
}

impl Bound {
    /// Which distances are larger, with the numbers.
    fn violations(&self, metrics: &Metrics) -> Vec<String> {
        let total_y = (metrics.total_y - 1.0).abs();
        [
            ("mean CIEDE2000", metrics.delta_e_mean, self.delta_e_mean),
            ("relative RMS of Y at 64 x 64", Some(metrics.rms_64), self.rms_64),
            ("|ratio of total Y - 1|", Some(total_y), self.total_y),
        ]
        .into_iter()
        .filter_map(|(name, value, limit)| {
            let (value, limit) = (value?, limit?);
            // NaN is a violation too.
            (value.is_nan() || value > limit)
                .then(|| format!("{name} is {value:.3e}, at most {limit:.1e} is accepted"))
        })
        .collect()
    }
}

/// Whether a relative distance from the oracle says nothing about the method: at least half of its square is the oracle's
/// own standard error. Independent errors add up in squares.
#[must_use]
pub fn is_within_noise(distance: f64, standard_error: f64) -> bool {
    distance <= std::f64::consts::SQRT_2 * standard_error
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(subpixel_bits: Option<u32>) -> DeviceInfo {
        DeviceInfo { subpixel_bits, ..DeviceInfo::default() }
    }

    #[test]
    fn the_coarser_device_and_the_smaller_view_set_the_bound() {
        let [fine, coarse, silent] = [Some(8), Some(4), None].map(device);
        let delta_e = |a, b, size| Snapping::between(a, b).parity(size).delta_e_mean.unwrap();
        assert_eq!(delta_e(&fine, &fine, 512), 0.0625);
        assert_eq!(delta_e(&fine, &coarse, 512), 1.0);
        assert_eq!(delta_e(&coarse, &fine, 512), 1.0);
        assert_eq!(delta_e(&fine, &silent, 512), 1.0);
        assert_eq!(delta_e(&fine, &fine, 128), 0.25);
        let flip = |width, size| Snapping::between(&fine, &fine).parity_flip(width, size);
        let [measured, narrow, few] = [flip(320, 512), flip(160, 512), flip(320, 64)];
        assert_eq!((measured, narrow, few), (0.064 / 256.0, 0.128 / 256.0, 0.512 / 256.0));
    }

    #[test]
    fn one_driver_gives_the_same_bits() {
        let on = |executor: &str, device: &str, driver: &str| DeviceInfo {
            executor: executor.into(),
            device: device.into(),
            driver: driver.into(),
            ..super::tests::device(Some(8))
        };
        let bound = |a: &DeviceInfo, b: &DeviceInfo| Snapping::between(a, b).parity(512).rms_64.unwrap();
        let wgpu = on("wgpu", "llvmpipe", "Mesa 22.3.6 (vulkan)");
        assert_eq!(bound(&wgpu, &on("vulkan", "llvmpipe", "Mesa 22.3.6 (vulkan)")), 0.0);
        assert!(bound(&wgpu, &on("vulkan", "llvmpipe", "Mesa 24.0.1 (vulkan)")) > 0.0);
        assert!(bound(&wgpu, &on("vulkan", "SwiftShader", "Mesa 22.3.6 (vulkan)")) > 0.0);
    }

    #[test]
    fn noise_is_what_hides_half_of_the_square() {
        assert!(is_within_noise(0.014, 0.01));
        assert!(!is_within_noise(0.015, 0.01));
        assert!(!is_within_noise(1e-9, 0.0));
        assert!(!is_within_noise(f64::NAN, 1.0));
    }
}
