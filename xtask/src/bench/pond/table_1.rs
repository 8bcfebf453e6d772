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
    /// The same with kernels as far as there is a pond.
    convolution_ms: f64,
    /// Low-rank terms for 1 %.
    low_rank_ms: f64,
    terms: usize,
    /// Heights of one and of three impulses with their images.
    heights_ms: [f64; 2],
}

/// Milliseconds of the crate's own f32 functions, which are no plans.
#[derive(Serialize)]
struct Software {
    side: usize,
    seven_by_seven_ms: f64,
    low_rank_ms: f64,
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
                for subject in &subjects {
                    report.rows.push(subject.measure(executor.as_mut(), args.rounds)?);
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

/// What is measured at one size: gentle waves under light from 40 degrees.
struct Subject {
    side: usize,
    surface: caustic_heightfield::HeightField,
    seven: Convolution<f32>,
    whole: Convolution<f32>,
    terms: LowRank<f32>,
}

impl Subject {
    fn new(side: usize) -> Result<Self> {
        let (surface, pond) = (PONDS[0].surface([side; 2])?, PONDS[0].pond());
        let convolution = |kernel_samples| {
            let settings = ConvolutionSettings { kernel_samples, ..ConvolutionSettings::default() };
            Convolution::new([side; 2], EXTENT_M, &pond, settings)
        };
        Ok(Self {
            side,
            seven: convolution(Some(KERNEL_SAMPLES))?,
            whole: convolution(None)?,
            terms: LowRank::new(std::slice::from_ref(&surface), &pond, LowRankSettings::default())?,
            surface,
        })
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
            low_rank_ms: time(&|| Ok(self.terms.floor(&self.surface).map(drop)?))?,
        })
    }

    fn measure(&self, executor: &mut dyn Executor, rounds: u32) -> Result<Row> {
        let DeviceInfo { executor: id, device, .. } = executor.info().clone();
        eprintln!("{id}, {} x {} samples", self.side, self.side);
        let settings = PlanSettings::default();
        let mut frames = |plan: &PondPlan| -> Result<f64> {
            executor.prepare(&plan.plan)?;
            plan.write_heights(executor, &self.surface)?;
            warm_ms(&plan.plan, executor, rounds)
        };
        let seven_by_seven_ms = frames(&self.seven.plan(&settings)?)?;
        let convolution_ms = frames(&self.whole.plan(&settings)?)?;
        let low_rank_ms = frames(&self.terms.plan(&settings)?)?;
        let mut heights_ms = [0.0; 2];
        for (ms, impulses) in heights_ms.iter_mut().zip(IMPULSES) {
            *ms = self.heights_ms(executor, impulses, rounds)?;
        }
        let terms = self.terms.report().terms;
        Ok(Row {
            executor: id,
            device,
            side: self.side,
            seven_by_seven_ms,
            convolution_ms,
            low_rank_ms,
            terms,
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
             with kernels as far as there is a pond; heights: one impulse and three, with four images each.\n\n\
             | size | executor | 7 x 7 | convolution | low-rank | terms | ratio | heights, 1 | heights, 3 |\n\
             |---|---|---|---|---|---|---|---|---|\n",
            self.rounds
        );
        let fps = |ms: f64| match 1e3 / ms {
            few if few < 10.0 => format!("{few:.1}"),
            many => format!("{many:.0}"),
        };
        for row in &self.rows {
            let _ = writeln!(
                text,
                "| {}² | {}, {} | {} | {} | {} | {} | {:.2} | {} | {} |",
                row.side,
                row.executor,
                row.device,
                fps(row.seven_by_seven_ms),
                fps(row.convolution_ms),
                fps(row.low_rank_ms),
                row.terms,
                row.low_rank_ms / row.convolution_ms,
                fps(row.heights_ms[0]),
                fps(row.heights_ms[1]),
            );
        }
        for row in &self.software {
            let _ = writeln!(
                text,
                "| {}² | functions of the crate, f32 | {} | | {} | | | | |",
                row.side,
                fps(row.seven_by_seven_ms),
                fps(row.low_rank_ms),
            );
        }
        for (id, reason) in &self.skipped {
            let _ = writeln!(text, "\n{id}: skipped, {reason}");
        }
        text
    }
}
