//! The oracle's pictures: independent randomisations, averaged, whose spread tells the error.

use frame_plan::memory;
use serde::Serialize;
use spectral_reference::RenderSettings;
use spectral_scene::Scene;

use super::{REASON, check_memory, device, error, step_nm, warn_of_noise};
use crate::args::RunArgs;
use crate::error::CliError;
use crate::picture::Picture;
use crate::progress::Progress;
use crate::stats::{Stopwatch, Work};
use crate::values::Size;

/// Randomisations of a picture without a noise target, and the fewest of one with a target.
const REPLICATES: u64 = 4;
/// What a noise target may cost at most: photons, and where no glass calls for any, rays and randomisations.
const MAX_PHOTONS: u64 = 1 << 32;
const MAX_RAYS: u64 = 1 << 33;
const MAX_REPLICATES: u64 = 1 << 12;
/// What a pixel takes: sums, a replicate, the picture and its file.
const BYTES_PER_PIXEL: u64 = 128;

/// Odd, so that no two seeds share a first replicate; 2^64 over the golden ratio, so that neighbours are far apart.
const SEED_STRIDE: u64 = 0x9e37_79b9_7f4a_7c15;

#[derive(Serialize)]
struct Statistics {
    photons: u64,
    /// Eye and photon rays, without shadow rays.
    rays: u64,
    /// Independent randomisations that were averaged.
    replicates: u64,
    samples_per_pixel: u64,
}

/// Standard error of Y per pixel: RMS of the error over RMS of the picture.
#[derive(Serialize)]
struct StandardError {
    total: f64,
}

/// A picture by `camera`, an index into the scene's cameras.
pub(crate) fn render(
    scene: &Scene,
    camera: usize,
    size: Size,
    run: &RunArgs,
    times: &mut Stopwatch,
) -> Result<(Picture, Work), CliError> {
    check_memory(size, BYTES_PER_PIXEL, memory::usable_bytes())?;
    let default = RenderSettings::default();
    let settings = RenderSettings {
        size: [size.width, size.height],
        camera: scene.cameras.get(camera).cloned(),
        bounces: run.bounces.unwrap_or(default.bounces),
        samples_per_pixel: default.samples_per_pixel.div_ceil(REPLICATES as u32),
        photons: run.photons.unwrap_or(default.photons).div_ceil(REPLICATES),
        threads: run.device.threads,
        step_nm: step_nm(run.wavelengths).unwrap_or(default.step_nm),
        ..default
    };
    let progress = Progress::bar("reference");
    let mut mean = Mean::new(size);
    let (mut photons, mut rays) = (0, 0);
    while !mean.is_enough(run.noise, photons >= MAX_PHOTONS || rays >= MAX_RAYS) {
        // Every replicate of every seed draws from a stream of its own.
        let seed = run.seed.wrapping_mul(SEED_STRIDE).wrapping_add(mean.replicates);
        let share = |done: f64| progress.set((mean.replicates as f64 + done) / mean.expected(run.noise));
        let picture = spectral_reference::render(scene, &RenderSettings { seed, ..settings.clone() }, &share);
        let picture = picture.map_err(error)?;
        photons += picture.photons;
        rays += picture.rays;
        mean.add(&picture.xyz);
    }
    drop(progress);
    times.did("compute");
    let cost = format!("{photons} photons and {rays} rays in {} randomisations", mean.replicates);
    warn_of_noise(run.noise, mean.standard_error(), &cost);
    let statistics = Statistics {
        photons,
        rays,
        replicates: mean.replicates,
        samples_per_pixel: mean.replicates * u64::from(settings.samples_per_pixel),
    };
    let settings = RenderSettings { seed: run.seed, ..settings };
    let error = StandardError { total: mean.standard_error() };
    let work = Work::new(device(run)?, REASON.into(), &settings, &statistics, &error)?;
    Ok((Picture { size, xyz: mean.xyz() }, work))
}

/// A running mean of pictures.
struct Mean {
    replicates: u64,
    sum: Vec<[f64; 3]>,
    /// Of Y.
    sum_of_squares: Vec<f64>,
}

impl Mean {
    fn new(size: Size) -> Self {
        let pixels = size.texels() as usize;
        Self { replicates: 0, sum: vec![[0.0; 3]; pixels], sum_of_squares: vec![0.0; pixels] }
    }

    fn add(&mut self, xyz: &[[f32; 3]]) {
        self.replicates += 1;
        for ((sum, squares), xyz) in self.sum.iter_mut().zip(&mut self.sum_of_squares).zip(xyz) {
            for (sum, v) in sum.iter_mut().zip(xyz) {
                *sum += f64::from(*v);
            }
            *squares += f64::from(xyz[1]).powi(2);
        }
    }

    fn xyz(&self) -> Vec<[f32; 3]> {
        let n = self.replicates as f64;
        self.sum.iter().map(|xyz| xyz.map(|v| (v / n) as f32)).collect()
    }

    /// RMS over the pixels of the standard error of the mean of Y, over the RMS of that mean; 0 for a black picture.
    fn standard_error(&self) -> f64 {
        let n = self.replicates as f64;
        let (mut variance, mut signal) = (0.0, 0.0);
        for (sum, squares) in self.sum.iter().zip(&self.sum_of_squares) {
            let mean = sum[1] / n;
            // Rounding can bring the difference of two large squares below 0.
            variance += ((squares / n - mean * mean) / (n - 1.0)).max(0.0);
            signal += mean * mean;
        }
        if signal > 0.0 { (variance / signal).sqrt() } else { 0.0 }
    }

    /// `spent`: it has cost as much as it may.
    fn is_enough(&self, noise: Option<f64>, spent: bool) -> bool {
        let spent = spent || self.replicates >= MAX_REPLICATES;
        self.replicates >= REPLICATES && noise.is_none_or(|target| spent || self.standard_error() <= target)
    }

    /// How many replicates it will take, as far as one can tell: the error falls with their square root.
    fn expected(&self, noise: Option<f64>) -> f64 {
        let least = REPLICATES.max(self.replicates + 1) as f64;
        match noise {
            Some(target) if self.replicates >= REPLICATES => {
                let needed = self.replicates as f64 * (self.standard_error() / target).powi(2);
                needed.min(MAX_REPLICATES as f64).max(least)
            }
            _ => least,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: Size = Size { width: 2, height: 1 };

    #[test]
    fn the_mean_and_its_error_are_those_of_statistics() {
        let mut mean = Mean::new(TWO);
        for y in [1.0, 3.0, 1.0, 3.0] {
            mean.add(&[[0.5 * y, y, 2.0 * y], [0.0; 3]]);
        }
        assert_eq!(mean.xyz(), [[1.0, 2.0, 4.0], [0.0; 3]]);
        // Sample variance 4/3, of the mean 1/3; over a signal of 2.
        assert!((mean.standard_error() - (1.0_f64 / 3.0).sqrt() / 2.0).abs() < 1e-15);
    }

    #[test]
    fn a_noise_target_asks_for_more_until_it_is_met() {
        let mut mean = Mean::new(TWO);
        for y in [1.0, 3.0, 1.0, 3.0] {
            assert!(!mean.is_enough(None, false));
            mean.add(&[[y; 3]; 2]);
        }
        assert!(mean.is_enough(None, false));
        assert!(mean.is_enough(Some(0.3), false));
        assert!(!mean.is_enough(Some(0.1), false));
        assert!(mean.is_enough(Some(0.1), true));
        mean.replicates = MAX_REPLICATES;
        assert!(mean.is_enough(Some(1e-9), false));
        assert!(mean.expected(Some(0.1)) > 8.0);
    }

    #[test]
    fn a_black_picture_has_no_error() {
        let mut mean = Mean::new(TWO);
        for _ in 0..4 {
            mean.add(&[[0.0; 3]; 2]);
        }
        assert_eq!(mean.standard_error(), 0.0);
    }
}
