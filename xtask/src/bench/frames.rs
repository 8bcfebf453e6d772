//! Milliseconds of frames.

use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use asm_core::{RenderPlan, Settings, Statistics, render_plan};
use frame_plan::{ExecuteError, Executor, ResourceId};
use serde::Serialize;
use spectral_scene::Scene;

use super::{Args, COLUMNS, Turns};

/// A batch is at least so long, so that waiting for its end and reading a few bytes does not count.
const BATCH: Duration = Duration::from_millis(300);

/// Most frames of a batch.
const MOST_FRAMES: u32 = 256;

/// How long a column's frames of one scene took.
#[derive(Serialize)]
pub(super) struct Frames {
    /// The column's name.
    pub(super) column: &'static str,
    /// Milliseconds per frame: median of the rounds.
    pub(super) ms: f64,
    /// Of the fastest and of the slowest round.
    pub(super) range_ms: [f64; 2],
    /// Median over the rounds of this column's time by the first column's in the same round.
    pub(super) ratio: f64,
    /// Photons that met glass.
    pub(super) photons: u64,
    /// Share of the light's view that shows glass first.
    pub(super) share: f64,
    /// Milliseconds of each pass in a frame, of all its steps together; empty where the device cannot measure.
    pub(super) passes: Vec<PassTime>,
}

#[derive(Serialize)]
pub(super) struct PassTime {
    pub(super) pass: String,
    pub(super) ms: f64,
}

/// Every column's frames of a scene's first camera, in turns; `adjust` changes the settings of a column.
pub(super) fn measure(
    turns: &mut Turns,
    scene: &Scene,
    args: &Args,
    adjust: impl Fn(Settings) -> Settings,
) -> Result<Vec<Frames>> {
    let size = [args.size.width, args.size.height];
    let mut measured = Vec::new();
    for (executor, column) in turns.iter_mut().zip(COLUMNS) {
        let plan = render_plan(scene, 0, size, &adjust(column.settings()), &executor.limits())?;
        executor.prepare(&plan.plan)?;
        // The first frames of a device load shaders and touch memory.
        let wait = smallest_readable(&plan).context("a picture's plan can be read")?;
        batch(executor.as_mut(), wait, 2)?;
        let (_, statistics) = plan.read(executor.as_mut())?;
        let once = batch(executor.as_mut(), wait, 1)?;
        let frames =
            (BATCH.as_secs_f64() / once.as_secs_f64().max(1e-6)).ceil().clamp(1.0, f64::from(MOST_FRAMES));
        measured.push((wait, frames as u32, statistics, Vec::new()));
    }
    for _ in 0..args.rounds {
        for (executor, (wait, frames, _, rounds)) in turns.iter_mut().zip(&mut measured) {
            let ms = 1e3 * batch(executor.as_mut(), *wait, *frames)?.as_secs_f64() / f64::from(*frames);
            let times = executor.step_times();
            rounds.push(Round {
                ms,
                steps: times.into_iter().map(|step| (step.name, step.milliseconds)).collect(),
            });
        }
    }
    let first: Vec<f64> = measured[0].3.iter().map(|round: &Round| round.ms).collect();
    let frames = |(column, (_, _, statistics, rounds)): (&super::Column, &(_, _, Statistics, Vec<Round>))| {
        let ms: Vec<f64> = rounds.iter().map(|round| round.ms).collect();
        Frames {
            column: column.name,
            ms: median(ms.clone()),
            range_ms: [ms.iter().copied().fold(f64::MAX, f64::min), ms.iter().copied().fold(0.0, f64::max)],
            ratio: median(ms.iter().zip(&first).map(|(own, first)| own / first).collect()),
            photons: statistics.photons,
            share: share(statistics, column.settings().emission_size),
            passes: passes(rounds),
        }
    };
    Ok(COLUMNS.iter().zip(&measured).map(frames).collect())
}

/// One column's part of a round.
struct Round {
    ms: f64,
    /// Name and milliseconds of each step of its last frame.
    steps: Vec<(String, f64)>,
}

/// Time of so many frames, to the end of the last.
fn batch(executor: &mut dyn Executor, wait: ResourceId, frames: u32) -> Result<Duration, ExecuteError> {
    let start = Instant::now();
    for _ in 0..frames {
        executor.execute()?;
    }
    executor.read(wait)?;
    Ok(start.elapsed())
}

/// What is quickest to wait for.
fn smallest_readable(plan: &RenderPlan) -> Option<ResourceId> {
    let resources = plan.plan.resources.iter().enumerate().filter(|(_, r)| r.readable);
    resources.min_by_key(|(_, r)| r.kind.bytes()).map(|(i, _)| ResourceId(i as u32))
}

/// Photons that met glass, by texels of the light's view, mean over lights and wavelengths.
fn share(statistics: &Statistics, emission_size: u32) -> f64 {
    let ledgers: Vec<_> = statistics.lights.iter().flat_map(|light| &light.ledgers).collect();
    let photons: u64 = ledgers.iter().map(|ledger| u64::from(ledger.emitted.photons)).sum();
    photons as f64 / f64::from(emission_size).powi(2) / ledgers.len().max(1) as f64
}

/// Each pass's milliseconds per frame, median over the rounds, in the order of the frame.
fn passes(rounds: &[Round]) -> Vec<PassTime> {
    let mut names: Vec<&str> = Vec::new();
    for (step, _) in rounds.iter().flat_map(|round| &round.steps) {
        if !names.contains(&pass(step)) {
            names.push(pass(step));
        }
    }
    let in_round = |name: &str, round: &Round| {
        round.steps.iter().filter(|(step, _)| pass(step) == name).map(|(_, ms)| ms).sum::<f64>()
    };
    let time = |name: &str| PassTime {
        pass: name.to_owned(),
        ms: median(rounds.iter().map(|round| in_round(name, round)).collect()),
    };
    names.into_iter().map(time).collect()
}

/// The pass of a step, `pass (label)`; clears and copies each count as one.
fn pass(step: &str) -> &str {
    let pass = step.split_once(" (").map_or(step, |(pass, _)| pass);
    ["clear", "copy"].into_iter().find(|kind| pass.starts_with(kind)).unwrap_or(pass)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_stand_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(Vec::new()), 0.0);
    }

    #[test]
    fn steps_of_a_pass_are_one() {
        let step = |name: &str, ms| (name.to_owned(), ms);
        let rounds = [1.0, 2.0, 9.0].map(|ms| Round {
            ms,
            steps: vec![
                step("clear map", ms),
                step("shade (sun)", 2.0 * ms),
                step("shade (lamp)", ms),
                step("clear ledger", ms),
            ],
        });
        let passes = passes(&rounds);
        let found: Vec<_> = passes.iter().map(|p| (p.pass.as_str(), p.ms)).collect();
        assert_eq!(found, [("clear", 4.0), ("shade", 6.0)]);
    }
}
