//! The paper's six passes (section 4.2) in frame buffers of any format: 4 to 16 bits, f16 or f32.
//!
//! Passes 1 to 5 are compiled from their expressions ([`crate::adjusted`]), pass 6 convolves. What this differs in from
//! [`crate::Convolution`] is what frame buffers lose, and nothing else.

mod floor_sum;
mod surface_passes;

use serde::{Deserialize, Serialize};

use crate::adjusted::{Format, PassReport, Program};
use crate::convolution::{Kernels, check_same_grid};
use crate::error::PondError;
use crate::exact::check_clear_of_floor;
use crate::floor::{FloorGrid, FloorLight, floor_light};
use crate::height_field::HeightField;
use crate::pond::{Form, Pond};
use crate::shadow::Shadows;
use crate::surface_light::SurfaceLight;
use floor_sum::FloorSum;
use surface_passes::{Inputs, Seen, surface_passes};

/// Where the sums of pass 6 are rounded and clamped. Of the width of the hardware's sums the paper says nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Accumulation {
    /// Three convolutions, each in wide registers and then stored (OpenGL's convolution filters, which the paper uses); the frame
    /// buffer adds up the three.
    #[default]
    PerTerm,
    /// Every tap of every kernel is an image that is added to the frame buffer, which rounds and clamps each time, as hardware must that
    /// has no convolution filters or only smaller ones.
    PerTap,
}

/// How the six passes are done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SixPassSettings {
    /// Samples across the kernels, an odd number; 7 is the paper's. `None` for as far as there is a pond.
    pub kernel_samples: Option<usize>,
    /// How pass 6 sums.
    pub accumulation: Accumulation,
}

/// The six passes for one pond, grid and format, and for waves like those they were shown.
pub struct SixPasses<F: Format> {
    pond: Pond,
    size: [usize; 2],
    extent_m: [f64; 2],
    tiles: (i64, f64),
    highest_m: f64,
    brightest: f64,
    surface: Program<F>,
    floor: FloorSum<F>,
    /// Irradiance per unit of the floor's frame buffer.
    scale: f64,
    accumulation: Accumulation,
}

/// What each pass stores.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SixPassReport {
    /// The frame buffers' format.
    pub format: String,
    /// How pass 6 sums.
    pub accumulation: Accumulation,
    /// Passes 1 to 5, step by step.
    pub surface: Vec<PassReport>,
    /// Pass 6; irradiance in its own unit.
    pub floor: Vec<PassReport>,
    /// Irradiance differs nowhere by more from what the same passes give in real numbers.
    pub error_bound: f64,
}

/// A floor by the six passes.
#[derive(Clone, Debug)]
pub struct SixPassFloor {
    /// The light.
    pub light: FloorLight,
    /// How often a pass clamped what it stored. Where that is not 0 the waves are higher or steeper than those shown, or
    /// errors drove values past the ends of their range.
    pub clamped: usize,
}

impl<F: Format> SixPasses<F> {
    /// Passes for surfaces like `examples`, which have one grid: their heights and slopes say how these are scaled.
    ///
    /// # Errors
    /// As [`crate::Convolution::new`]; no examples, or of different grids; values that the format does not hold.
    pub fn new(
        examples: &[HeightField],
        pond: &Pond,
        settings: SixPassSettings,
        format: F,
    ) -> Result<Self, PondError> {
        let Some(first) = examples.first() else {
            return Err(PondError::Setting { name: "number of surfaces", got: 0.0, expected: "1 or more" });
        };
        let (size, extent_m) = (first.size, first.extent_m);
        for surface in examples {
            pond.check(surface)?;
            check_same_grid(surface, size, extent_m)?;
        }
        let kernels = Kernels::new(size, extent_m, pond, settings.kernel_samples)?;
        let seen = Seen::of(examples, pond);
        let (expressions, outputs) = surface_passes(&seen, pond, format);
        let surface = expressions.compile(&outputs, format)?;
        let sources = [0, 1, 2].map(|k| surface.output(k));
        let tiles = (kernels.tiles, kernels.tail);
        let floor = FloorSum::new(size, pond.outside, kernels, &sources, settings.accumulation, format)?;
        let brightest = pond.illumination.largest();
        let scale = floor.kernel_scale() * brightest * first.pitch_m().iter().product::<f64>();
        Ok(Self {
            pond: pond.clone(),
            size,
            extent_m,
            tiles,
            highest_m: seen.highest_m(),
            brightest,
            surface,
            floor,
            scale,
            accumulation: settings.accumulation,
        })
    }

    /// What each pass stores, and a bound on the error of the last.
    #[must_use]
    pub fn report(&self) -> SixPassReport {
        let floor = self.floor.passes();
        let last = floor.last().map_or(0.0, |pass| pass.error_bound);
        SixPassReport {
            format: self.floor.format().name(),
            accumulation: self.accumulation,
            surface: self.surface.passes(),
            error_bound: last * self.scale,
            floor,
        }
    }

    /// The light on the floor below `surface`, with the report that every method gives.
    ///
    /// # Errors
    /// As [`Pond::check`]; a surface of another grid; one that touches the floor.
    pub fn floor(&self, surface: &HeightField) -> Result<SixPassFloor, PondError> {
        let (irradiance, clamped) = self.irradiance(surface)?;
        let light = SurfaceLight::new(surface, &self.pond)?;
        let light = floor_light(
            surface.pitch_m(),
            &self.pond,
            light.report,
            FloorGrid::below(surface),
            irradiance,
            self.tiles,
        );
        Ok(SixPassFloor { light, clamped })
    }

    /// The six passes alone: irradiance at every sample, and how often a pass clamped what it stored.
    ///
    /// # Errors
    /// As [`Self::floor`].
    pub fn irradiance(&self, surface: &HeightField) -> Result<(Vec<f64>, usize), PondError> {
        self.pond.check(surface)?;
        check_same_grid(surface, self.size, self.extent_m)?;
        check_clear_of_floor(surface, &self.pond)?;
        let physical = self.pond.form == Form::Physical;
        let shadows =
            physical.then(|| Shadows::new(surface, self.pond.unit_light_direction(), self.pond.outside));
        let (pond, highest_m, brightest) = (&self.pond, self.highest_m, self.brightest);
        let inputs = Inputs { surface, pond, highest_m, brightest, shadows };
        let values = self.surface.run(surface.heights_m.len(), |number, sample| inputs.at(number, sample));
        let sources =
            (0..3).map(|k| values.cells[k].iter().map(|&c| self.surface.value(k, c)).collect()).collect();
        let (floor, clamped) = self.floor.sum(sources);
        Ok((floor.into_iter().map(|e| e * self.scale).collect(), values.clamped + clamped))
    }
}
