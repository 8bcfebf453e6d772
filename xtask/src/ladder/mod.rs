//! `cargo xtask ladder`: the price list of accuracy against time.
//!
//! Every rung ([`asm_core::rungs`]) of every scene on every executor, its distance from the oracle ([`truth`]) and the time of its frames
//! ([`measure`]), in one run; which of them nothing beats ([`front`]), and what halving the error costs. The same of [`pond`]s and of relit figures ([`prt`]).

mod control;
mod front;
mod measure;
mod oracle_version;
mod page;
mod plot;
mod pond;
mod prt;
mod report;
mod truth;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use asm_core::{LADDER, Rung};
use spectral_cli::values;
use spectral_reference::Effort as Photons;
use xtask::executor_entry::ExecutorEntry;
use xtask::executors::{self, Candidate};
use xtask::kept::Kept;
use xtask::net_error::Net;
use xtask::ponds::{PRICED_PONDS, PondSubject, is_pond, named_ponds};
use xtask::prt::{PRICED_PRT, PrtSubject, is_prt, named_prt};
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

use crate::driver::{self, Drivers};
use crate::{paths, test};
use control::Control;
use front::{Price, front};
use measure::{Climber, Course, Outcome, Row};
use report::{Ladder, SceneEntry};

/// Measure what accuracy costs in time: every rung's distance from the oracle and milliseconds per frame; writes ladder.html,
/// ladder.json, ladder.csv and ladder.svg.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A bundled scene, `bunny-glass`, a glTF file, `pond` or `prt`; all of them by default. May be repeated, or take several.
    #[arg(long = "scene", value_name = "SCENE", num_args = 1..)]
    scenes: Vec<String>,
    /// An executor: cpu, wgpu or vulkan; all of them by default. May be repeated, or take several.
    #[arg(long = "executor", value_name = "ID", num_args = 1..)]
    executors: Vec<String>,
    /// A method of scenes or of ponds, or a spectral basis of relit figures; all of them by default. May be repeated, or take several.
    #[arg(long = "method", value_name = "METHOD", num_args = 1..)]
    methods: Vec<String>,
    /// Fewer and smaller rungs, maps of 128 x 128, less oracle, and three scenes, one pond and one figure unless others are named.
    #[arg(long)]
    quick: bool,
    /// Photons of the oracle per scene.
    #[arg(long, value_name = "P", value_parser = values::photons, conflicts_with = "noise")]
    photons: Option<u64>,
    /// Photons of the oracle until its standard error of Y at 64 x 64 is this share, such as 0.002.
    #[arg(long, value_name = "X", value_parser = values::noise)]
    noise: Option<f64>,
    /// How often each frame time is taken; the median counts.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Spoil every plan of the last executor: the ladder must notice and end with status 1.
    #[arg(long)]
    sabotage: Option<Sabotage>,
    /// Where the price list goes. The oracle's results are kept in target/ladder/oracle.
    #[arg(long, value_name = "DIR", default_value_os_t = paths::target().join("ladder"))]
    out: PathBuf,
}

/// Scenes of a quick run: one each with flat faces, smooth normals and total reflection.
const QUICK_SCENES: [&str; 3] = ["prism", "sphere", "gem"];

/// Of a quick run: no finer than this.
fn is_quick(rung: &Rung) -> bool {
    rung.wavelengths <= 7 && rung.emission_size <= 256 && rung.map_size <= 256
}

/// What a run costs.
struct Effort {
    /// Texels across and down a receiver.
    receiver_size: [u32; 2],
    /// Samples of a pond along each side.
    pond_samples: usize,
    /// Pixels across and down a camera picture.
    picture_size: [u32; 2],
    /// The oracle's, for both halves of a bake.
    oracle: Photons,
    /// Eye paths of the oracle's picture, per pixel and lamp, both halves.
    oracle_samples: u32,
    /// Photons of the oracle's picture, both halves.
    oracle_picture_photons: u64,
    /// Of each frame time.
    rounds: u32,
}

impl Effort {
    fn of(args: &Args) -> Self {
        let full = !args.quick;
        let photons = args.photons.unwrap_or(if full { 1 << 25 } else { 1 << 21 });
        Self {
            receiver_size: if full { [256, 256] } else { [128, 128] },
            pond_samples: if full { 128 } else { 64 },
            picture_size: if full { [320, 180] } else { [160, 90] },
            oracle: args.noise.map_or(Photons::Photons(photons), Photons::noise),
            oracle_samples: if full { 16 } else { 4 },
            oracle_picture_photons: if full { 1 << 22 } else { 1 << 19 },
            rounds: args.rounds,
        }
    }
}

/// Measure, write, say in a few lines what was found.
///
/// # Errors
/// An unwritable folder. Unknown names are an exit code, and what goes wrong on the way is the price list's.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let Named { subjects, candidates, rungs, ponds, pond_rungs, figures, prt_rungs } = match named(args) {
        Ok(named) => named,
        Err(error) => {
            eprintln!("error: {error:#}");
            return Ok(ExitCode::from(2));
        }
    };
    let Some(missing) = driver::in_environment() else {
        return driver::restart(Drivers::One);
    };
    let start = Instant::now();
    // Before minutes of work, not after.
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot create {}", args.out.display()))?;
    let mut climbers: Vec<_> = candidates.into_iter().map(|c| Climber::new(c, &missing)).collect();
    let program = oracle_version::oracle_version(&paths::workspace_root())?;
    let mut ladder = Ladder::new(Effort::of(args), args.sabotage);
    let kept = Kept::in_folder(paths::target().join("ladder/oracle"));
    let count = subjects.len() + ponds.len() + figures.len();
    for (i, subject) in subjects.iter().enumerate() {
        eprintln!("[{}/{count}] {}", i + 1, subject.name);
        match truth::of(subject, &ladder.effort, &kept, &program) {
            Ok(truth) => ladder.climb(subject, &truth, &rungs, &mut climbers),
            Err(error) => ladder.scenes.push(SceneEntry::without_truth(subject, format!("{error:#}"))),
        }
    }
    if !ponds.is_empty() {
        let mut pairs = pond::Pair::of(&mut climbers, &missing);
        for (i, subject) in ponds.iter().enumerate() {
            eprintln!("[{}/{count}] {}", subjects.len() + i + 1, subject.name);
            ladder.climb_pond(subject, ladder.effort.pond_samples, &pond_rungs, &mut pairs);
        }
        pairs.into_iter().for_each(pond::Pair::settle);
    }
    if !figures.is_empty() {
        let mut relighting = prt::climbers(&climbers, &missing);
        let folder = paths::target().join("ladder/transfer");
        for (i, subject) in figures.iter().enumerate() {
            eprintln!("[{}/{count}] {}", subjects.len() + ponds.len() + i + 1, subject.name);
            ladder.climb_prt(subject, &prt_rungs, &folder, &mut relighting);
        }
        prt::settle(relighting, &mut climbers);
    }
    ladder.executors = climbers.into_iter().map(|climber| climber.entry).collect();
    ladder.seconds = start.elapsed().as_secs_f64();
    finish(&ladder, args)
}

/// What was asked for.
struct Named {
    subjects: Vec<Subject>,
    candidates: Vec<&'static Candidate>,
    rungs: Vec<Rung>,
    ponds: Vec<&'static PondSubject>,
    pond_rungs: Vec<pond::Rung>,
    figures: Vec<&'static PrtSubject>,
    prt_rungs: Vec<prt::Rung>,
}

fn named(args: &Args) -> Result<Named> {
    check_methods(&args.methods)?;
    let names: Vec<&str> = match (args.scenes.as_slice(), args.quick) {
        ([], false) => Subject::names().collect(),
        ([], true) => QUICK_SCENES.to_vec(),
        (named, _) => {
            let others = |name: &&str| is_pond(&PRICED_PONDS, name) || is_prt(&PRICED_PRT, name);
            named.iter().map(String::as_str).filter(|name| !others(name)).collect()
        }
    };
    let candidates = executors::named(&args.executors)?;
    let root = paths::workspace_root();
    let open = |name| Subject::open(name, &root).with_context(|| format!("--scene {name}"));
    let mut subjects: Vec<_> = names.into_iter().map(open).collect::<Result<_>>()?;
    let mut ponds = named_ponds(&PRICED_PONDS, &args.scenes, args.quick);
    let mut figures = named_prt(&PRICED_PRT, &args.scenes, args.quick);
    let (rungs, pond_rungs) = (rungs(&args.methods, args.quick), pond::rungs(&args.methods, args.quick));
    let prt_rungs = prt::rungs(&args.methods, args.quick);
    // What no method that was named is for.
    subjects.retain(|_| !rungs.is_empty());
    ponds.retain(|_| !pond_rungs.is_empty());
    figures.retain(|_| !prt_rungs.is_empty());
    if subjects.is_empty() && ponds.is_empty() && figures.is_empty() {
        bail!("--scene, --method: no scene, pond or figure is left that any of these methods is for");
    }
    Ok(Named { subjects, candidates, rungs, ponds, pond_rungs, figures, prt_rungs })
}

/// Whether scenes, ponds or figures have methods of these names.
fn check_methods(methods: &[String]) -> Result<()> {
    let known: Vec<_> =
        LADDER.iter().map(|axes| axes.method.name()).chain(pond::METHODS).chain(prt::METHODS).collect();
    match methods.iter().find(|name| !known.contains(&name.as_str())) {
        Some(unknown) => bail!("--method {unknown}: no such method; there are {}", known.join(", ")),
        None => Ok(()),
    }
}

/// Those of the methods, or of all.
fn rungs(methods: &[String], quick: bool) -> Vec<Rung> {
    let is_wanted = |rung: &Rung| methods.is_empty() || methods.iter().any(|m| m == rung.method.name());
    let wanted = asm_core::rungs().into_iter().filter(is_wanted);
    wanted.filter(|rung| !quick || is_quick(rung)).collect()
}

impl Ladder {
    /// Every rung of a scene on every executor.
    fn climb(&mut self, subject: &Subject, truth: &truth::Truth, rungs: &[Rung], climbers: &mut [Climber]) {
        let noise = &truth.noise;
        eprintln!(
            "  oracle: {} photons, {:.0} s{}; standard error of Y at 64 x 64 {:.1e}",
            noise.photons,
            noise.seconds,
            if noise.kept { " in a run before" } else { "" },
            noise.standard_error
        );
        let course = Course { subject, truth, effort: &self.effort };
        let spoiled = climbers.iter().rposition(Climber::runs).filter(|_| self.sabotage.is_some());
        let mut rows = Vec::new();
        let mut controls = Vec::new();
        for (i, climber) in climbers.iter_mut().enumerate().filter(|(_, climber)| climber.runs()) {
            let start = Instant::now();
            let sabotage = self.sabotage.filter(|_| spoiled == Some(i));
            for rung in rungs {
                let row = climber.climb(&course, rung, sabotage);
                if row.spoiled {
                    controls.extend(control::of_spoiled(&course, &row, climber));
                }
                rows.push(row);
            }
            let first = rows.len() - rungs.len();
            for _ in 1..course.effort.rounds {
                rows[first..].iter_mut().for_each(|row| climber.time_again(&course, row));
            }
            let (name, seconds) = (climber.entry.name, start.elapsed().as_secs_f64());
            eprintln!("  {name}: {} rungs in {seconds:.0} s", rungs.len());
        }
        if self.sabotage.is_none() {
            controls = control::of_scene(&course, &rows, climbers);
        }
        mark_fronts(&mut rows);
        self.scenes.push(SceneEntry::new(subject, truth, &rows));
        self.rows.extend(rows);
        self.controls.extend(controls);
    }
}

/// Mark what nothing beats, executor by executor; the rows are of one scene. A spoiled rung has no price.
fn mark_fronts(rows: &mut [Row]) {
    for same in rows.chunk_by_mut(|a, b| a.executor == b.executor) {
        let delta_e = front(&same.iter().map(Row::delta_e_price).collect::<Vec<_>>());
        let rms = front(&same.iter().map(Row::rms_price).collect::<Vec<_>>());
        for (row, (delta_e, rms)) in same.iter_mut().zip(delta_e.into_iter().zip(rms)) {
            (row.on_delta_e_front, row.on_rms_front) = (delta_e, rms);
        }
    }
}

impl Row {
    fn price(&self, error: impl Fn(&Outcome) -> Option<Net>) -> Option<Price> {
        let outcome = self.outcome.as_ref().filter(|_| !self.spoiled)?;
        Some(Price { ms: outcome.frame.ms, error: error(outcome)?.error })
    }

    /// Milliseconds and mean CIEDE2000, without the oracle's noise.
    fn delta_e_price(&self) -> Option<Price> {
        self.price(|outcome| outcome.net_delta_e)
    }

    /// Milliseconds and RMS of Y, likewise.
    fn rms_price(&self) -> Option<Price> {
        self.price(|outcome| Some(outcome.net_rms))
    }
}

fn finish(ladder: &Ladder, args: &Args) -> Result<ExitCode> {
    let page = ladder.write(&args.out)?;
    ladder.executors.iter().map(ExecutorEntry::line).for_each(|line| println!("{line}"));
    let scenes = ladder.scenes.iter().map(|scene| (scene.name.as_str(), &scene.halving));
    let ponds = ladder.ponds.iter().map(|pond| (pond.name, &pond.halving));
    let figures = ladder.figures.iter().map(|figure| (figure.name, &figure.halving));
    for (name, halving) in scenes.chain(ponds).chain(figures) {
        halving.iter().for_each(|sentence| println!("{name}: {sentence}"));
    }
    let failures = ladder.failures(test::runs_in_ci());
    failures.iter().for_each(|failure| println!("failed: {failure}"));
    let controls: &[Control] = &ladder.controls;
    println!(
        "{} rungs, {} refused, {} negative controls, {} failures, {:.0} s; {}",
        ladder.rungs(),
        ladder.refused(),
        controls.len(),
        failures.len(),
        ladder.seconds,
        page.display()
    );
    Ok(if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

#[cfg(test)]
mod tests;
