//! `cargo xtask bench --pond`: Table 1 of Trendall & Stewart 2000, frames per second of the pond per executor, and height fields by
//! themselves; beside it what low-rank terms cost against the paper's three convolutions.

use std::fmt::Write;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use caustic_heightfield::{
    Convolution, ConvolutionSettings, HeightSource, Impulse, LowRank, LowRankSettings, PlanSettings,
    PondPlan, Ripple, WallImages,
};
use frame_plan::{DeviceInfo, ExecuteError, Executor, Plan};
use serde::Serialize;
use xtask::executors::{self, POND_EXECUTORS};
use xtask::frame_time::{WarmFrames, median};
use xtask::ponds::{EXTENT_M, PONDS};
use xtask::whole_file;

use super::super::Args;
use crate::driver::{self, Drivers};

/// Samples across the kernels of the paper's table.
const KERNEL_SAMPLES: usize = 7;
/// Ponds of more samples on a side are measured with the paper's kernels alone: those as far as the pond goes have four times its samples.
const MOST_WHOLE: usize = 1024;
/// Impulses whose height fields the paper times, at 128 and at 256 samples on a side; each has four images.
const IMPULSES: [usize; 2] = [1, 3];

/// Milliseconds of frames at one size on one executor.
#[derive(Serialize)]
struct Row {
    executor: String,
    device: String,
    side: usize,
    /// The paper's method with its 7 x 7 kernels: passes 1 to 6.
    seven_by_seven_ms: f64,
    /// The paper's method by the crate's own functions, in the same run, by this.
    by_software: f64,
    #[serde(flatten)]
    whole: Option<WholeRow>,
    /// Heights of one and of three impulses with their images.
    heights_ms: [f64; 2],
}

/// Of sizes up to [`MOST_WHOLE`].
#[derive(Serialize)]
struct WholeRow {
    /// The paper's method with kernels as far as there is a pond.
    convolution_ms: f64,
    /// Low-rank terms for 1 %.
    low_rank_ms: f64,
    terms: usize,
}

/// Milliseconds of the crate's own f32 functions, which are no plans.
#[derive(Serialize)]
struct Software {
    side: usize,
    seven_by_seven_ms: f64,
    low_rank_ms: Option<f64>,
}

#[derive(Serialize)]
struct Report {
    rounds: u32,
    rows: Vec<Row>,
    software: Vec<Software>,
    skipped: Vec<(String, String)>,
}

/// Measure, write `pond.json` and `pond.md`, print the table.
pub(in crate::bench) fn run(args: &Args) -> Result<ExitCode> {
    if driver::in_environment().is_none() {
        return driver::restart(Drivers::One);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot create {}", args.out.display()))?;
    let mut report =
        Report { rounds: args.rounds, rows: Vec::new(), software: Vec::new(), skipped: Vec::new() };
    let subjects: Vec<Subject> =
        args.pond_sizes.iter().map(|&side| Subject::new(side as usize)).collect::<Result<_>>()?;
    for subject in &subjects {
        report.software.push(subject.software(args.rounds)?);
    }
    for candidate in executors::named_of(POND_EXECUTORS, &args.executors)? {
        match (candidate.open)(None) {
            Ok(mut executor) => {
                for (subject, software) in subjects.iter().zip(&report.software) {
                    match subject.measure(executor.as_mut(), software, args.rounds) {
                        Ok(row) => report.rows.push(row),
                        // What is beyond the device's limits; other sizes are not.
                        Err(error) if is_refusal(&error) => {
                            let what = format!("{}, {}²", candidate.id, subject.side);
                            report.skipped.push((what, format!("{error:#}")));
                        }
                        Err(error) => return Err(error),
                    }
                }
            }
            Err(ExecuteError::NoDevice { reason, .. }) => {
                report.skipped.push((candidate.id.to_owned(), reason));
            }
            Err(error) => return Err(error.into()),
        }
    }
    let markdown = report.markdown();
    whole_file::write(&args.out.join("pond.json"), serde_json::to_string_pretty(&report)?.as_bytes())?;
    whole_file::write(&args.out.join("pond.md"), markdown.as_bytes())?;
    println!("{markdown}");
    Ok(ExitCode::SUCCESS)
}

fn is_refusal(error: &anyhow::Error) -> bool {
    matches!(error.downcast_ref(), Some(ExecuteError::InvalidPlan { .. } | ExecuteError::OutOfMemory { .. }))
}

/// What is measured at one size: gentle waves under light from 40 degrees.
struct Subject {
    side: usize,
    surface: caustic_heightfield::HeightField,
    seven: Convolution<f32>,
    whole: Option<Whole>,
}

/// Kernels as far as there is a pond.
struct Whole {
    convolution: Convolution<f32>,
    terms: LowRank<f32>,
}

impl Subject {
    fn new(side: usize) -> Result<Self> {
        let (surface, pond) = (PONDS[0].surface([side; 2])?, PONDS[0].pond());
        let convolution = |kernel_samples| {
            let settings = ConvolutionSettings { kernel_samples, ..ConvolutionSettings::default() };
            Convolution::new([side; 2], EXTENT_M, &pond, settings)
        };
        let whole = || -> Result<Whole> {
            let terms = LowRank::new(std::slice::from_ref(&surface), &pond, LowRankSettings::default())?;
            Ok(Whole { convolution: convolution(None)?, terms })
        };
        let whole = (side <= MOST_WHOLE).then(whole).transpose()?;
        Ok(Self { side, seven: convolution(Some(KERNEL_SAMPLES))?, whole, surface })
    }

    fn software(&self, rounds: u32) -> Result<Software> {
        let time = |floor: &dyn Fn() -> Result<()>| -> Result<f64> {
            floor()?;
            let mut ms = Vec::new();
            for _ in 0..rounds {
                let start = Instant::now();
                floor()?;
                ms.push(1e3 * start.elapsed().as_secs_f64());
            }
            Ok(median(ms))
        };
        Ok(Software {
            side: self.side,
            seven_by_seven_ms: time(&|| Ok(self.seven.floor(&self.surface).map(drop)?))?,
            low_rank_ms: (self.whole.as_ref())
                .map(|whole| time(&|| Ok(whole.terms.floor(&self.surface).map(drop)?)))
                .transpose()?,
        })
    }

    fn measure(&self, executor: &mut dyn Executor, software: &Software, rounds: u32) -> Result<Row> {
        let DeviceInfo { executor: id, device, .. } = executor.info().clone();
        eprintln!("{id}, {} x {} samples", self.side, self.side);
        let settings = PlanSettings::default();
        let mut frames = |plan: &PondPlan| -> Result<f64> {
            executor.prepare(&plan.plan)?;
            plan.write_heights(executor, &self.surface)?;
            warm_ms(&plan.plan, executor, rounds)
        };
        let seven_by_seven_ms = frames(&self.seven.plan(&settings)?)?;
        let whole = match &self.whole {
            Some(Whole { convolution, terms }) => Some(WholeRow {
                convolution_ms: frames(&convolution.plan(&settings)?)?,
                low_rank_ms: frames(&terms.plan(&settings)?)?,
                terms: terms.report().terms,
            }),
            None => None,
        };
        let mut heights_ms = [0.0; 2];
        for (ms, impulses) in heights_ms.iter_mut().zip(IMPULSES) {
            *ms = self.heights_ms(executor, impulses, rounds)?;
        }
        Ok(Row {
            executor: id,
            device,
            side: self.side,
            seven_by_seven_ms,
            by_software: software.seven_by_seven_ms / seven_by_seven_ms,
            whole,
            heights_ms,
        })
    }

    /// The pass that makes heights, by itself.
    fn heights_ms(&self, executor: &mut dyn Executor, impulses: usize, rounds: u32) -> Result<f64> {
        let heights = HeightSource::Impulses { capacity: 5 * impulses, distance_levels: None };
        let mut plan = self.seven.plan(&PlanSettings { heights, ..PlanSettings::default() })?;
        plan.plan.steps.truncate(1);
        executor.prepare(&plan.plan)?;
        let pebbles: Vec<Impulse> = (0..impulses)
            .map(|i| Impulse { position_m: [0.3, 0.2 + 0.2 * i as f64], start_s: 0.0, amplitude_m: 0.002 })
            .collect();
        // By then all waves are all over the pond.
        plan.write_impulses(executor, &Ripple::PEBBLE, &pebbles, WallImages::Four, 8.0)?;
        warm_ms(&plan.plan, executor, rounds)
    }
}

/// Milliseconds per warm frame: median of the rounds.
fn warm_ms(plan: &Plan, executor: &mut dyn Executor, rounds: u32) -> Result<f64> {
    WarmFrames::warm_up(plan, executor, 2)?;
    let warm = WarmFrames::of(plan, executor)?;
    let ms = (0..rounds).map(|_| warm.round_ms(executor)).collect::<Result<Vec<_>, _>>()?;
    Ok(median(ms))
}

impl Report {
    fn markdown(&self) -> String {
        let mut text = format!(
            "Frames per second, medians of {} rounds; 7 x 7: the paper's convolutions; ratio: low-rank for 1 % by convolutions \
             with kernels as far as there is a pond; by software: 7 x 7 against the crate's own functions; heights: one impulse \
             and three, with four images each.\n\n\
             | size | executor | 7 x 7 | by software | convolution | low-rank | terms | ratio | heights, 1 | heights, 3 |\n\
             |---|---|---|---|---|---|---|---|---|---|\n",
            self.rounds
        );
        let fps = |ms: f64| match 1e3 / ms {
            few if few < 10.0 => format!("{few:.1}"),
            many => format!("{many:.0}"),
        };
        for row in &self.rows {
            let whole = row.whole.as_ref().map_or_else(
                || "- | - | - | -".to_owned(),
                |whole| {
                    format!(
                        "{} | {} | {} | {:.2}",
                        fps(whole.convolution_ms),
                        fps(whole.low_rank_ms),
                        whole.terms,
                        whole.low_rank_ms / whole.convolution_ms,
                    )
                },
            );
            let _ = writeln!(
                text,
                "| {}² | {}, {} | {} | {:.2} | {whole} | {} | {} |",
                row.side,
                row.executor,
                row.device,
                fps(row.seven_by_seven_ms),
                row.by_software,
                fps(row.heights_ms[0]),
                fps(row.heights_ms[1]),
            );
        }
        for row in &self.software {
            let _ = writeln!(
                text,
                "| {}² | functions of the crate, f32 | {} | 1 | - | {} | | | | |",
                row.side,
                fps(row.seven_by_seven_ms),
                row.low_rank_ms.map_or_else(|| "-".to_owned(), fps),
            );
        }
        for (id, reason) in &self.skipped {
            let _ = writeln!(text, "\n{id}: skipped, {reason}");
        }
        text
    }
}
