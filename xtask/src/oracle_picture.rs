//! The oracle's camera picture, with what tells its noise.

use spectral_reference::{ReferenceError, RenderSettings, render};
use spectral_scene::Scene;

use crate::metrics::mean_of;

/// A picture and its half.
pub struct OraclePicture {
    /// The mean of two independent halves.
    pub xyz: Vec<[f32; 3]>,
    /// One of them: its distance from the mean has the variance of the mean's own error.
    pub half: Vec<[f32; 3]>,
}

impl OraclePicture {
    /// Two halves of `settings`' effort, with a seed of its own each.
    ///
    /// # Errors
    /// Those of [`render`].
    pub fn render(
        scene: &Scene,
        settings: &RenderSettings,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Self, ReferenceError> {
        let half = |seed| RenderSettings {
            samples_per_pixel: settings.samples_per_pixel.div_ceil(2),
            photons: settings.photons.div_ceil(2),
            seed,
            ..settings.clone()
        };
        let half_of = |seed| render(scene, &half(seed), progress).map(|picture| picture.xyz);
        let (half, other) = (half_of(0)?, half_of(1)?);
        Ok(Self { xyz: mean_of(&half, &other), half })
    }
}
