//! Milliseconds of frames.

use anyhow::Result;
use asm_core::{Settings, Statistics, render_plan};
use serde::Serialize;
use spectral_scene::Scene;
use xtask::frame_time::{WarmFrames, median, range};

use super::{Args, COLUMNS, Turns};

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
        WarmFrames::warm_up(&plan.plan, executor.as_mut(), 2)?;
        let (_, statistics) = plan.read(executor.as_mut())?;
        let warm = WarmFrames::of(&plan.plan, executor.as_mut())?;
        measured.push((warm, statistics, Vec::new()));
    }
    for _ in 0..args.rounds {
        for (executor, (warm, _, rounds)) in turns.iter_mut().zip(&mut measured) {
            let ms = warm.round_ms(executor.as_mut())?;
            let times = executor.step_times();
            rounds.push(Round {
                ms,
                steps: times.into_iter().map(|step| (step.name, step.milliseconds)).collect(),
            });
        }
    }
    let first: Vec<f64> = measured[0].2.iter().map(|round: &Round| round.ms).collect();
    let frames = |(column, (_, statistics, rounds)): (&super::Column, &(_, Statistics, Vec<Round>))| {
        let ms: Vec<f64> = rounds.iter().map(|round| round.ms).collect();
        Frames {
            column: column.name,
            ms: median(ms.clone()),
            range_ms: range(&ms),
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

#[cfg(test)]
mod tests {
    use super::*;

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
