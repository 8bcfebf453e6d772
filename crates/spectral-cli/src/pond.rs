//! `spectral pond`: the light on the floor of a pond.

mod frame_buffers;

use std::path::{Path, PathBuf};

use caustic_heightfield::adjusted::{F16, Format};
use caustic_heightfield::{
    Accumulation, Convolution, ConvolutionSettings, FloorGrid, FloorLight, HeightField, LowRank,
    LowRankSettings, Pond, PondError, PondScene, Sample, exact,
};
use clap::Args;
use serde::Serialize;
use serde_json::Value;

use crate::choices::{PondMethod, Precision, Sums};
use crate::error::CliError;
use crate::output::exr::{Channel, ExrImage};
use crate::stats::{Stopwatch, json};
use crate::values::{self, Size};
use crate::{messages, targets};

/// Samples on a side if nothing else is said.
const DEFAULT_SIDE: usize = 128;

#[derive(Debug, Args)]
pub(crate) struct PondArgs {
    /// JSON file of a pond [default: gentle waves under light from 20 degrees].
    #[arg(long, value_name = "POND.json")]
    scene: Option<PathBuf>,
    /// How light is computed: convolution (the paper's), low-rank or exact.
    #[arg(long, value_name = "METHOD", default_value = "low-rank")]
    method: PondMethod,
    /// What it is computed in: f32 or f64; for convolution also f16, fixed8, fixed12, any fixed4 to fixed16 [default: f64 for exact,
    /// else f32].
    #[arg(long, value_name = "PRECISION")]
    precision: Option<Precision>,
    /// Where f16 and fixed-point sums of convolution are rounded: per-term or per-tap [default: per-term].
    #[arg(long, value_name = "SUMS")]
    sums: Option<Sums>,
    /// Samples of the surface and the floor on a side [default: 128, or what the surface's file has].
    #[arg(long, value_name = "N", value_parser = values::side, allow_negative_numbers = true)]
    size: Option<usize>,
    /// Relative RMS error that low-rank stays below [default: 0.01].
    #[arg(long, value_name = "E", value_parser = values::noise, allow_negative_numbers = true)]
    error: Option<f64>,
    /// Samples across the kernels of convolution, odd; 7 is the paper's [default: as far as the pond goes].
    #[arg(long, value_name = "N", value_parser = values::side, allow_negative_numbers = true)]
    kernel: Option<usize>,
    /// EXR file to write: irradiance as channel Y, in the unit of the light's.
    #[arg(short, long, value_name = "E.exr")]
    output: PathBuf,
    /// JSON file for what was done: reports, warnings and times.
    #[arg(long, value_name = "STATS.json")]
    stats: Option<PathBuf>,
}

/// The statistics of a run.
#[derive(Serialize)]
struct PondStats {
    command: &'static str,
    version: &'static str,
    method: PondMethod,
    precision: Precision,
    size: [usize; 2],
    output: String,
    warnings: Vec<String>,
    report: Value,
    /// What the method says about itself.
    details: Value,
    times_ms: serde_json::Map<String, Value>,
}

pub(crate) fn run(args: &PondArgs) -> Result<(), CliError> {
    let precision = args.check()?;
    let file = targets::exr(&args.output)?;
    let stats_file = targets::stats(args.stats.as_deref(), &file)?;
    let mut times = Stopwatch::start();
    let (scene, folder) = open(args.scene.as_deref())?;
    if let Some(size) = args.size.filter(|_| scene.has_own_grid()) {
        let problem = format!("--size {size}: this surface has a grid of its own; leave --size out");
        return Err(CliError::Usage(problem));
    }
    let surface = scene.heights([args.size.unwrap_or(DEFAULT_SIDE); 2], &folder).map_err(CliError::failed)?;
    times.did("surface");
    let computed = match precision {
        Precision::F32 => args.compute::<f32>(&surface, &scene.pond, &mut times),
        Precision::F64 => args.compute::<f64>(&surface, &scene.pond, &mut times),
        Precision::F16 => args.frame_buffers(&surface, &scene.pond, F16::default(), &mut times),
        Precision::Fixed(format) => args.frame_buffers(&surface, &scene.pond, format, &mut times),
    };
    let (light, details) = computed.map_err(CliError::failed)?;
    let warnings = warnings(&light);
    warnings.iter().for_each(|warning| messages::warn(warning));
    image(&light)
        .write(&file)
        .map_err(|error| CliError::failed(format!("cannot write {}: {error}", args.output.display())))?;
    times.did("write");
    let Some(stats_file) = stats_file else { return Ok(()) };
    let stats = PondStats {
        command: "pond",
        version: env!("CARGO_PKG_VERSION"),
        method: args.method,
        precision,
        size: surface.size,
        output: args.output.display().to_string(),
        warnings,
        report: json(&light.report)?,
        details,
        times_ms: times.finish(),
    };
    targets::write_json(&stats_file, &stats)
}

impl PondArgs {
    /// Hold the options against the method.
    ///
    /// # Errors
    /// A usage error that names the option and what would be right.
    fn check(&self) -> Result<Precision, CliError> {
        let usage = |problem: &str| Err(CliError::Usage(problem.into()));
        match self.method {
            PondMethod::Exact if self.precision.is_some_and(|p| p != Precision::F64) => {
                usage("--precision: --method exact is what others are held against, and is f64")
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

    /// The paper's passes in frame buffers.
    fn frame_buffers(
        &self,
        surface: &HeightField,
        pond: &Pond,
        format: impl Format,
        times: &mut Stopwatch,
    ) -> Result<(FloorLight, Value), PondError> {
        let sums = self.sums.map_or(Accumulation::default(), |sums| sums.0);
        frame_buffers::compute(surface, pond, self.kernel, sums, format, self.stats.is_some(), times)
    }

    /// The floor, and what the method says about itself.
    fn compute<T: Sample>(
        &self,
        surface: &HeightField,
        pond: &Pond,
        times: &mut Stopwatch,
    ) -> Result<(FloorLight, Value), PondError> {
        let done = match self.method {
            PondMethod::Exact => (exact(surface, pond, FloorGrid::below(surface))?, Value::Null),
            PondMethod::Convolution => {
                let settings = ConvolutionSettings { kernel_samples: self.kernel, ..Default::default() };
                let method = Convolution::<T>::new(surface.size, surface.extent_m, pond, settings)?;
                times.did("prepare");
                let details = serde_json::json!({ "kernel_samples": self.kernel, "fft": method.is_fft() });
                (method.floor(surface)?, details)
            }
            PondMethod::LowRank => {
                let mut settings = LowRankSettings::default();
                settings.target_error = self.error.unwrap_or(settings.target_error);
                let method = LowRank::<T>::new(std::slice::from_ref(surface), pond, settings)?;
                times.did("prepare");
                let details = serde_json::json!(method.report());
                (method.floor(surface)?.light, details)
            }
        };
        times.did("floor");
        Ok(done)
    }
}

/// The pond of a file and the folder that its other files are in.
fn open(path: Option<&Path>) -> Result<(PondScene, PathBuf), CliError> {
    let Some(path) = path else { return Ok((PondScene::default(), PathBuf::new())) };
    let failed = |problem: String| CliError::failed(format!("{}: {problem}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    let scene = serde_json::from_str(&text).map_err(|error| failed(format!("is no pond: {error}")))?;
    Ok((scene, path.parent().map(Path::to_path_buf).unwrap_or_default()))
}

/// What a user should know about this floor.
fn warnings(light: &FloorLight) -> Vec<String> {
    let report = &light.report;
    let surface = &report.surface;
    let mut warnings = Vec::new();
    let counts = [
        (surface.past_45_degrees, "are steeper than 45 degrees, where water is no height field"),
        (surface.turned_away, "are turned away from the light, and dark"),
        (surface.self_shadowed, "are behind a crest, and dark"),
        (surface.totally_reflected, "reflect all light"),
    ];
    for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
        warnings.push(format!("{count} of {} samples of the surface {what}", surface.samples));
    }
    if report.lobe_samples < 1.0 {
        warnings.push(format!(
            "the lobe is {:.2} samples wide on the floor, which is not resolved; take more samples",
            report.lobe_samples
        ));
    }
    if report.periodic_tail > 1e-3 {
        warnings.push(format!(
            "up to {:.1} % of the light comes from farther copies of the pond than were summed",
            100.0 * report.periodic_tail
        ));
    }
    warnings
}

fn image(light: &FloorLight) -> ExrImage {
    let [width, height] = light.grid.size.map(|side| side as u32);
    ExrImage {
        size: Size { width, height },
        channels: vec![Channel {
            name: "Y".into(),
            samples: light.irradiance.iter().map(|&e| e as f32).collect(),
        }],
        comments: "Irradiance on the floor of a pond, in the unit of the light's. Row 0 is the smallest y, column 0 the \
                   smallest x.",
        rgb_space: None,
    }
}
