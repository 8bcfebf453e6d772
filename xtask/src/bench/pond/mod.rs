//! `cargo xtask bench --pond-scipy`: the pond's three convolutions here and by SciPy's `fftconvolve`, in turns, on the same cores.
//!
//! SciPy's side is a program of its own from the heights on, so that equal floors also say that both compute the same sums.

mod scipy;
pub(super) mod table_1;

use std::fmt::Write;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use caustic_heightfield::{
    Convolution, ConvolutionSettings, HeightField, Moment, Pond, PondScene, light_tilted_deg, relative_rms,
};
use serde::Serialize;
use xtask::frame_time::median;
use xtask::whole_file;

use super::Args;
use super::python;
use crate::paths;
use scipy::{Job, Scipy};

/// Samples on a side, and across the kernels: the paper's 7, and as far as the pond goes.
const CASES: [(usize, Option<usize>); 7] =
    [(128, Some(7)), (256, Some(7)), (512, Some(7)), (128, None), (256, None), (512, None), (1024, None)];

/// Off the vertical, where the paper's expansion is good.
const TILT_DEG: f64 = 5.0;

/// Floors in f32 differ by rounding.
const MAX_DIFFERENCE: f64 = 2e-4;

/// One row of the table.
#[derive(Serialize)]
struct Row {
    side: usize,
    kernel: usize,
    fft: bool,
    #[serde(flatten)]
    times: Times,
    /// Relative RMS of our floor against SciPy's.
    difference: f64,
}

/// Of one case, medians of the rounds.
#[derive(Serialize)]
struct Times {
    /// Passes 1 to 5.
    surface_ms: f64,
    /// Pass 6.
    sums_ms: f64,
    scipy_surface_ms: f64,
    scipy_sums_ms: f64,
    /// SciPy's sums by ours, and all that it does by all that we do.
    sums_ratio: f64,
    ratio: f64,
}

#[derive(Serialize)]
struct Race {
    command: &'static str,
    scipy: String,
    numpy: String,
    threads: usize,
    rounds: u32,
    rows: Vec<Row>,
}

/// Install SciPy, race, write `pond.json` and `pond.md`, print the table.
///
/// # Errors
/// No Python, pip or network; floors that differ; an unwritable folder.
pub(super) fn run(args: &Args) -> Result<ExitCode> {
    let python = python::with(&["scipy==1.17.*", "numpy"], &paths::target().join("peers/scipy"))?;
    let threads = std::thread::available_parallelism()?.get();
    let folder = args.out.join("pond");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let pond = Pond { light_direction: light_tilted_deg(TILT_DEG), ..Pond::default() };
    let mut race = Race {
        command: "cargo xtask bench --pond-scipy",
        scipy: String::new(),
        numpy: String::new(),
        threads,
        rounds: args.rounds,
        rows: Vec::new(),
    };
    for (side, kernel) in CASES {
        eprintln!("{side} x {side}, {}", kernel.map_or("full kernel".into(), |k| format!("{k} x {k}")));
        let size = [side; 2];
        let surface = PondScene::default().heights(size, &folder, Moment::default())?;
        let settings = ConvolutionSettings { kernel_samples: kernel, ..ConvolutionSettings::default() };
        let ours = Convolution::<f32>::new(size, surface.extent_m, &pond, settings)?;
        let radius = kernel.map_or(side - 1, |samples| samples / 2);
        let job = Job::new(&surface, &pond, radius, threads, &folder)?;
        let mut peer = Scipy::start(&python, &job, &folder)?;
        let difference = relative_rms(&ours.floor(&surface)?.irradiance, &peer.floor()?);
        ensure!(
            difference < MAX_DIFFERENCE,
            "{side} x {side}: floors differ by {difference:.1e}, more than {MAX_DIFFERENCE:.0e}"
        );
        let times = race_of(&ours, &surface, &mut peer, args.rounds)?;
        race.rows.push(Row { side, kernel: 2 * radius + 1, fft: ours.is_fft(), times, difference });
        (race.scipy, race.numpy) = peer.versions();
    }
    let text = race.markdown();
    whole_file::write(&args.out.join("pond.json"), serde_json::to_string_pretty(&race)?.as_bytes())?;
    whole_file::write(&args.out.join("pond.md"), text.as_bytes())?;
    println!("{text}");
    Ok(ExitCode::SUCCESS)
}

/// Times of one case, in turns.
fn race_of(ours: &Convolution<f32>, surface: &HeightField, peer: &mut Scipy, rounds: u32) -> Result<Times> {
    let mut times: [Vec<f64>; 6] = Default::default();
    for _ in 0..rounds {
        let start = Instant::now();
        let sources = ours.sources(surface)?;
        let surface_ms = 1e3 * start.elapsed().as_secs_f64();
        std::hint::black_box(ours.sum(&sources));
        let ours_ms = 1e3 * start.elapsed().as_secs_f64();
        let (sums_ms, theirs) = (ours_ms - surface_ms, peer.time()?);
        let all = [
            surface_ms,
            sums_ms,
            theirs.surface_ms,
            theirs.sums_ms,
            theirs.sums_ms / sums_ms,
            (theirs.surface_ms + theirs.sums_ms) / ours_ms,
        ];
        times.iter_mut().zip(all).for_each(|(times, time)| times.push(time));
    }
    let [surface_ms, sums_ms, scipy_surface_ms, scipy_sums_ms, sums_ratio, ratio] = times.map(median);
    Ok(Times { surface_ms, sums_ms, scipy_surface_ms, scipy_sums_ms, sums_ratio, ratio })
}

impl Race {
    fn markdown(&self) -> String {
        let mut text = format!(
            "SciPy {}, NumPy {}, {} threads, medians of {} rounds in turns.\n\n\
             | size | kernel | ours, surface, ms | ours, sums, ms | SciPy, surface, ms | SciPy, sums, ms | sums / sums | all / all | difference |\n\
             |---|---|---|---|---|---|---|---|---|\n",
            self.scipy, self.numpy, self.threads, self.rounds
        );
        for row in &self.rows {
            let Row { side, kernel, difference, fft, times } = row;
            let Times { surface_ms, sums_ms, scipy_surface_ms, scipy_sums_ms, sums_ratio, ratio } = times;
            let way = if *fft { "FFT" } else { "in space" };
            let _ = writeln!(
                text,
                "| {side} x {side} | {kernel} x {kernel}, {way} | {surface_ms:.2} | {sums_ms:.2} | {scipy_surface_ms:.2} | \
                 {scipy_sums_ms:.2} | {sums_ratio:.1} | {ratio:.1} | {difference:.0e} |"
            );
        }
        text
    }
}
