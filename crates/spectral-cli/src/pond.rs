//! `spectral pond`: the light on the floor of a pond, at one time or many.

mod color;
pub(crate) mod floors;
mod method;
mod output;
mod photon;
mod planned;
mod water;

use std::path::{Path, PathBuf};

use caustic_heightfield::{FloorReport, Pond, PondScene, SurfaceReport};
use clap::Args;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::choices::{PondMethod, Precision};
use crate::error::CliError;
use crate::progress::Progress;
use crate::stats::{Stopwatch, json};
use crate::values::{self, Exposure};
use crate::{messages, targets};
use color::{ColorArgs, DispersionStats};
use method::MethodArgs;
use output::{Output, Series};
use water::Waters;

/// Samples on a side if nothing else is said.
pub(crate) const DEFAULT_SIDE: usize = 128;
/// Seconds between frames if nothing else is said.
const DEFAULT_STEP_S: f64 = 0.04;
/// Surfaces of a series that a method is fitted to.
const EXAMPLES: usize = 8;

#[derive(Debug, Args)]
pub(crate) struct PondArgs {
    /// JSON file of a pond [default: gentle waves under light from 20 degrees].
    #[arg(long, value_name = "POND.json")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    how: MethodArgs,
    #[command(flatten)]
    color: ColorArgs,
    /// Samples of the surface and the floor on a side [default: 128, or what the surface's file has].
    #[arg(long, value_name = "N", value_parser = values::side, allow_negative_numbers = true)]
    size: Option<usize>,
    /// Frames of a series; it starts at the scene's time.
    #[arg(long, value_name = "N", value_parser = values::frames, allow_negative_numbers = true)]
    frames: Option<usize>,
    /// Seconds between frames [default: 0.04].
    #[arg(long, value_name = "SECONDS", value_parser = values::frame_step, requires = "frames", allow_negative_numbers = true)]
    step: Option<f64>,
    /// Factor before the tone map of PNGs: a number, or auto for 1 / the 99th percentile of Y, of a series' first frame.
    #[arg(long, value_name = "E", default_value = "auto", allow_negative_numbers = true)]
    exposure: Exposure,
    /// File to write: .exr for irradiance, as channel Y or with dispersion X Y Z, in the unit of the light's; .png for a picture. For a
    /// series # signs in its name stand for the frame's number, and an .apng has all frames.
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
    /// Of the first frame.
    report: Value,
    /// What the method says about itself.
    details: Value,
    dispersion: DispersionStats,
    frames: Vec<FrameStats>,
    times_ms: Map<String, Value>,
}

/// One frame.
#[derive(Serialize)]
struct FrameStats {
    after_s: f64,
    floor_flux: f64,
    /// Samples with a state that low-rank was not fitted to and took to be the nearest; values that frame buffers clamped.
    outside: usize,
    ms: f64,
}

pub(crate) fn run(args: &PondArgs) -> Result<(), CliError> {
    let precision = args.how.precision()?;
    let asked = args.frames.map(|frames| Series { frames, step_s: args.step.unwrap_or(DEFAULT_STEP_S) });
    let output = Output::new(&args.output, asked)?;
    let stats_file = output.stats(args.stats.as_deref())?;
    let series = asked.unwrap_or(Series { frames: 1, step_s: DEFAULT_STEP_S });
    let mut times = Stopwatch::start();
    let (scene, folder) = open(args.scene.as_deref())?;
    args.check_scene(&scene)?;
    let size = [args.size.unwrap_or(DEFAULT_SIDE); 2];
    let waters = Waters { scene: &scene, folder: &folder, size, series };
    let first_water = waters.at(0);
    let examples = examples(series.frames).map(|frame| match frame {
        0 => first_water.heights().cloned(),
        _ => waters.at(frame).heights().cloned(),
    });
    let examples = examples.collect::<Result<Vec<_>, _>>().map_err(CliError::failed)?;
    times.did("surface");
    let method = args.color.prepare(&scene, &examples, &args.how, args.stats.is_some())?;
    times.did("prepare");

    let mut frames = Vec::with_capacity(series.frames);
    let mut first: Option<FloorReport> = None;
    let progress = Progress::bar("floors");
    output.write(series, args.exposure, |frame| {
        let watch = Stopwatch::start();
        let image = match frame {
            0 => method.floor(&first_water),
            _ => method.floor(&waters.at(frame)),
        }?;
        first.get_or_insert(image.report);
        frames.push(FrameStats {
            after_s: frame as f64 * series.step_s,
            floor_flux: image.report.floor_flux,
            outside: image.outside,
            ms: watch.total_ms(),
        });
        progress.set((frame + 1) as f64 / series.frames as f64);
        Ok(image)
    })?;
    drop(progress);
    times.did("floor");
    let samples = examples[0].heights_m.len();
    let warnings = match args.how.method {
        PondMethod::Photon => photon_warnings(&scene.pond, first.as_ref()),
        method => warnings(first.as_ref(), method, &frames, samples),
    };
    warnings.iter().for_each(|warning| messages::warn(warning));
    let Some(stats_file) = stats_file else { return Ok(()) };
    let stats = PondStats {
        command: "pond",
        version: env!("CARGO_PKG_VERSION"),
        method: args.how.method,
        precision,
        size: examples[0].size,
        output: args.output.display().to_string(),
        warnings,
        report: json(&first)?,
        details: method.details(),
        dispersion: method.stats,
        frames,
        times_ms: times.finish(),
    };
    targets::write_json(&stats_file, &stats)
}

impl PondArgs {
    /// Hold the options against the scene.
    ///
    /// # Errors
    /// A usage error that names the option and what would be right.
    fn check_scene(&self, scene: &PondScene) -> Result<(), CliError> {
        if let Some(size) = self.size.filter(|_| scene.has_own_grid()) {
            let problem = format!("--size {size}: this surface has a grid of its own; leave --size out");
            return Err(CliError::Usage(problem));
        }
        if let Some(frames) = self.frames.filter(|_| !scene.varies()) {
            return Err(CliError::Usage(format!(
                "--frames {frames}: this surface stands still; impulses, wave-equation, waves with frequency_rad_s and EXR files with # \
                 signs in their name do not"
            )));
        }
        Ok(())
    }
}

/// Frames from all over a series: the first, the last and what is between.
fn examples(frames: usize) -> impl Iterator<Item = usize> {
    let count = frames.min(EXAMPLES);
    (0..count).map(move |i| i * (frames - 1) / (count - 1).max(1))
}

/// The pond of a file, or the one that is shown if there is none, and the folder that its other files are in.
pub(crate) fn open(path: Option<&Path>) -> Result<(PondScene, PathBuf), CliError> {
    let Some(path) = path else { return Ok((PondScene::default(), PathBuf::new())) };
    let failed = |problem: String| CliError::failed(format!("{}: {problem}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    let scene = serde_json::from_str(&text).map_err(|error| failed(format!("is no pond: {error}")))?;
    Ok((scene, path.parent().map(Path::to_path_buf).unwrap_or_default()))
}

/// What a user should know about a floor below a mesh of water.
fn photon_warnings(pond: &Pond, first: Option<&FloorReport>) -> Vec<String> {
    let mut warnings = vec![format!(
        "--method photon: this water is clear; the scattering exponent a = {} of the pond is left out",
        pond.scattering
    )];
    let past_45 = first.map(|report| report.surface).filter(|surface| surface.past_45_degrees > 0);
    warnings.extend(past_45.map(|surface| steep(&surface)));
    warnings
}

fn steep(surface: &SurfaceReport) -> String {
    let (count, samples) = (surface.past_45_degrees, surface.samples);
    format!(
        "{count} of {samples} samples of the surface are steeper than 45 degrees, where water is no height field"
    )
}

/// What a user should know about this floor.
fn warnings(
    first: Option<&FloorReport>,
    method: PondMethod,
    frames: &[FrameStats],
    samples: usize,
) -> Vec<String> {
    let Some(report) = first else { return Vec::new() };
    let surface = &report.surface;
    let mut warnings = Vec::new();
    if surface.past_45_degrees > 0 {
        warnings.push(steep(surface));
    }
    let counts = [
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
    let most = frames.iter().map(|frame| frame.outside).max().unwrap_or(0);
    if method == PondMethod::LowRank && most > samples / 50 {
        warnings.push(format!(
            "up to {most} of {samples} samples of a frame have states that low-rank was not fitted to: take a shorter series"
        ));
    }
    warnings
}
