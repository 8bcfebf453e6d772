//! How a floor is computed, and in which numbers.

use caustic_heightfield::adjusted::{F16, Format};
use caustic_heightfield::{
    Convolution, ConvolutionSettings, FloorGrid, FloorLight, HeightField, LobeSum, LowRankSettings, Pond,
    PondError, Sample, SixPassSettings, SixPasses, exact, relative_rms,
};
use clap::Args;
use serde_json::{Value, json};

use crate::args::DeviceArgs;
use crate::choices::{PondMethod, Precision, Sums};
use crate::error::CliError;
use crate::values;

#[derive(Debug, Args)]
pub(crate) struct MethodArgs {
    /// How light is computed: convolution (the paper's), low-rank, exact, or photon (the water as a refractor, which scatters nothing).
    #[arg(long, value_name = "METHOD", default_value = "low-rank")]
    pub(super) method: PondMethod,
    /// What it is computed in: f32 or f64; for convolution also f16, fixed8, fixed12, any fixed4 to fixed16 [default: f64 for exact,
    /// else f32].
    #[arg(long, value_name = "PRECISION")]
    precision: Option<Precision>,
    /// Where f16 and fixed-point sums of convolution are rounded: per-term or per-tap [default: per-term].
    #[arg(long, value_name = "SUMS")]
    sums: Option<Sums>,
    /// Relative RMS error that low-rank stays below [default: 0.01].
    #[arg(long, value_name = "E", value_parser = values::noise, allow_negative_numbers = true)]
    error: Option<f64>,
    /// Samples across the kernels of convolution, odd; 7 is the paper's [default: as far as the pond goes].
    #[arg(long, value_name = "N", value_parser = values::side, allow_negative_numbers = true)]
    pub(super) kernel: Option<usize>,
    #[command(flatten)]
    pub(super) device: DeviceArgs,
}

/// A method that is ready for surfaces of one grid.
pub(super) struct Method {
    /// What it says about itself.
    pub(super) details: Value,
    pub(super) floor: Box<Floors>,
}

type Floors = dyn Fn(&HeightField) -> Result<Floor, PondError>;

/// The light on one floor.
pub(super) struct Floor {
    pub(super) light: FloorLight,
    /// Values that were not as those of the surfaces that the method was made for: states of low-rank's table that were taken to be the
    /// nearest, or numbers that a frame buffer clamped.
    pub(super) outside: usize,
    /// XYZ, of a method that has all wavelengths at once.
    pub(super) xyz: Option<Vec<[f64; 3]>>,
}

impl From<FloorLight> for Floor {
    fn from(light: FloorLight) -> Self {
        Self { light, outside: 0, xyz: None }
    }
}

impl Method {
    /// The light on the floor below a surface.
    pub(super) fn floor(&self, surface: &HeightField) -> Result<Floor, PondError> {
        (self.floor)(surface)
    }
}

impl MethodArgs {
    /// Hold the options against the method.
    ///
    /// # Errors
    /// A usage error that names the option and what would be right.
    pub(super) fn precision(&self) -> Result<Precision, CliError> {
        let usage = |problem: &str| Err(CliError::Usage(problem.into()));
        self.device.check()?;
        let is_f32 = matches!(self.precision, None | Some(Precision::F32));
        let is_plan = self.method != PondMethod::Exact && is_f32;
        match self.method {
            _ if !is_plan && let Some(option) = self.device.given() => Err(CliError::Usage(format!(
                "{option} is for plans, which are --precision f32 with --method convolution, low-rank or photon"
            ))),
            PondMethod::Exact if self.precision.is_some_and(|p| p != Precision::F64) => {
                usage("--precision: --method exact is what others are held against, and is f64")
            }
            PondMethod::Photon if !is_f32 => {
                usage("--precision: --method photon traces light in f32 and in nothing else")
            }
            PondMethod::LowRank if self.precision.is_some_and(Precision::is_frame_buffer) => {
                usage("--precision f16 and fixed point are for --method convolution")
            }
            _ if self.sums.is_some() && !self.precision.is_some_and(Precision::is_frame_buffer) => {
                usage("--sums is for --precision f16 and fixed point")
            }
            method if method != PondMethod::LowRank && self.error.is_some() => {
                usage("--error is for --method low-rank")
            }
            method if method != PondMethod::Convolution && self.kernel.is_some() => {
                usage("--kernel is for --method convolution")
            }
            PondMethod::Exact => Ok(Precision::F64),
            _ => Ok(self.precision.unwrap_or(Precision::F32)),
        }
    }

    /// The method for surfaces like these at one index of refraction; `measured` asks what a frame buffer's format costs, against f64.
    ///
    /// # Errors
    /// What the method says.
    pub(super) fn prepare(
        &self,
        examples: &[HeightField],
        pond: &Pond,
        measured: bool,
    ) -> Result<Method, CliError> {
        match self.precision()? {
            Precision::F32 => return self.planned(examples, pond),
            Precision::F64 => self.in_f64(examples, pond),
            Precision::F16 => self.in_frame_buffers(examples, pond, F16::default(), measured),
            Precision::Fixed(format) => self.in_frame_buffers(examples, pond, format, measured),
        }
        .map_err(CliError::failed)
    }

    fn in_f64(&self, examples: &[HeightField], pond: &Pond) -> Result<Method, PondError> {
        let (details, floor): (Value, Box<Floors>) = match self.method {
            PondMethod::Exact => {
                let pond = pond.clone();
                let floor =
                    move |surface: &HeightField| Ok(exact(surface, &pond, FloorGrid::below(surface))?.into());
                (Value::Null, Box::new(floor))
            }
            PondMethod::Convolution => {
                let method = self.convolution::<f64>(&examples[0], pond)?;
                let details = json!({ "kernel_samples": self.kernel, "fft": method.is_fft() });
                let floor = move |surface: &HeightField| Ok(method.floor(surface)?.into());
                (details, Box::new(floor))
            }
            PondMethod::LowRank => {
                let method = self.lobe_sum::<f64>(examples, pond)?;
                let details = json!(method.report());
                let floor = move |surface: &HeightField| {
                    let (light, outside) = method.floor(surface)?;
                    Ok(Floor { outside, ..light.into() })
                };
                (details, Box::new(floor))
            }
            PondMethod::Photon => return Err(PondError::Photon { what: "f64; take f32" }),
        };
        Ok(Method { details, floor })
    }

    /// The paper's six passes in frame buffers.
    fn in_frame_buffers(
        &self,
        examples: &[HeightField],
        pond: &Pond,
        format: impl Format + 'static,
        measured: bool,
    ) -> Result<Method, PondError> {
        let accumulation = self.sums.map(|sums| sums.0).unwrap_or_default();
        let settings = SixPassSettings { kernel_samples: self.kernel, accumulation };
        let method = SixPasses::new(examples, pond, settings, format)?;
        let mut details = json!({ "kernel_samples": self.kernel, "passes": method.report() });
        if measured {
            let in_f64 = self.convolution::<f64>(&examples[0], pond)?.floor(&examples[0])?;
            let (irradiance, _) = method.irradiance(&examples[0])?;
            details["error_against_f64"] = json!(relative_rms(&irradiance, &in_f64.irradiance));
        }
        let floor = move |surface: &HeightField| {
            let floor = method.floor(surface)?;
            Ok(Floor { outside: floor.clamped, ..floor.light.into() })
        };
        Ok(Method { details, floor: Box::new(floor) })
    }

    pub(super) fn convolution<T: Sample>(
        &self,
        surface: &HeightField,
        pond: &Pond,
    ) -> Result<Convolution<T>, PondError> {
        let settings = ConvolutionSettings { kernel_samples: self.kernel, ..ConvolutionSettings::default() };
        Convolution::new(surface.size, surface.extent_m, pond, settings)
    }

    pub(super) fn lobe_sum<T: Sample>(
        &self,
        examples: &[HeightField],
        pond: &Pond,
    ) -> Result<LobeSum<T>, PondError> {
        let default = LowRankSettings::default();
        let settings =
            LowRankSettings { target_error: self.error.unwrap_or(default.target_error), ..default };
        LobeSum::new(examples, pond, settings)
    }
}
