//! The options that say how a floor is computed, and in which numbers.

use caustic_heightfield::{HeightField, Pond, PondError, PondScene};
use clap::Args;
use serde_json::Value;

use super::floors::{Floor, FloorChoice, Floors};
use super::water::Water;
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

/// A method that is ready for the frames of a series.
pub(super) struct Prepared {
    /// What it says about itself.
    pub(super) details: Value,
    pub(super) floor: Box<FloorOf>,
}

type FloorOf = dyn Fn(&Water<'_>) -> Result<Floor, PondError>;

impl From<Floors> for Prepared {
    fn from(floors: Floors) -> Self {
        let details = floors.details.clone();
        Self { details, floor: Box::new(move |water| floors.below(water.heights()?)) }
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
            method if let Err(problem) = method.precision(self.precision) => usage(problem),
            _ if self.sums.is_some() && !self.precision.is_some_and(Precision::is_frame_buffer) => {
                usage("--sums is for --precision f16 and fixed point")
            }
            method if method != PondMethod::LowRank && self.error.is_some() => {
                usage("--error is for --method low-rank")
            }
            method if method != PondMethod::Convolution && self.kernel.is_some() => {
                usage("--kernel is for --method convolution")
            }
            method => method.precision(self.precision).map_err(CliError::usage),
        }
    }

    /// What the options choose.
    ///
    /// # Errors
    /// As [`MethodArgs::precision`].
    pub(super) fn choice(&self) -> Result<FloorChoice, CliError> {
        let sums = self.sums.map(|sums| sums.0).unwrap_or_default();
        let (error, kernel) = (self.error, self.kernel);
        Ok(FloorChoice { sums, error, kernel, ..FloorChoice::new(self.method, self.precision()?) })
    }

    /// The method for surfaces of `scene` like these, at the index of refraction of `pond`; `measured` asks what a frame buffer's format
    /// costs, against f64.
    ///
    /// # Errors
    /// What the method says.
    pub(super) fn prepare(
        &self,
        scene: &PondScene,
        examples: &[HeightField],
        pond: &Pond,
        measured: bool,
    ) -> Result<Prepared, CliError> {
        let choice = self.choice()?;
        if choice.is_plan() {
            return self.planned(&choice, scene, examples, pond);
        }
        choice.without_plan(examples, pond, measured).map(Prepared::from).map_err(CliError::failed)
    }
}
