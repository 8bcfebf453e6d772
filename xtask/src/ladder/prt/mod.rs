//! Relit figures in the price list: what spectral coefficients and bands of directions cost, on every executor.
//!
//! Frames are held against the figure in f64, sampled every 5 nm and with [`Bands::MAX`]. Pixels that rasterisers may see differently
//! are left out: these are no error of m or L.

mod control;
mod measure;
mod page;

use std::fmt;
use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use serde::Serialize;
use spectral_prt::{Bands, Transfer};
use xtask::executor_entry::Status;
use xtask::executors::PRT_EXECUTORS;
use xtask::prt::{ColourDistance, Colours, Lit, PrtSubject, Reference, Stage, Way};

use super::front::{Halving, Price, front};
use super::measure::{Climber, Problem};
use super::plot::{Family, Plot, Point};
use super::report::Ladder;

pub(super) use measure::Row;
pub(super) use page::section;

/// What a caller would set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Rung {
    /// Basis and coefficients.
    #[serde(flatten)]
    pub(super) way: Way,
    /// Bands of spherical harmonics.
    pub(super) bands: Bands,
}

impl fmt::Display for Rung {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { way, bands } = self;
        write!(f, "{} m = {}, L = {}", way.basis(), way.coefficients(), bands.count())
    }
}

/// Names of the methods, in the order of their colours.
pub(super) const METHODS: [&str; 3] = ["optimal", "peercy", "rgb"];

/// How the figures' plots look.
pub(super) const FAMILY: Family =
    Family { methods: &METHODS, labels: "lines: what nothing beats, with its coefficients and bands" };

/// From cheap to accurate. Coefficients go in blocks of four, so three cost what four do, and five what eight do.
const WAYS: [Way; 10] = [
    Way::Rgb,
    Way::Optimal(3),
    Way::Optimal(4),
    Way::Optimal(5),
    Way::Optimal(8),
    Way::Optimal(12),
    Way::Peercy(3),
    Way::Peercy(5),
    Way::Peercy(8),
    Way::Peercy(12),
];
const BANDS: [u8; 5] = [2, 3, 5, 8, 10];
/// Of a quick run.
const QUICK_WAYS: [Way; 6] =
    [Way::Rgb, Way::Optimal(3), Way::Optimal(5), Way::Optimal(8), Way::Peercy(5), Way::Peercy(8)];
const QUICK_BANDS: [u8; 3] = [3, 5, 8];

/// Those of these methods, or of all.
pub(super) fn rungs(methods: &[String], quick: bool) -> Vec<Rung> {
    let (ways, bands): (&[Way], &[u8]) = if quick { (&QUICK_WAYS, &QUICK_BANDS) } else { (&WAYS, &BANDS) };
    let wanted = |way: &&Way| methods.is_empty() || methods.iter().any(|m| m == way.basis());
    let bands = || bands.iter().filter_map(|bands| Bands::new(*bands).ok());
    ways.iter().filter(wanted).flat_map(|&way| bands().map(move |bands| Rung { way, bands })).collect()
}

/// What a figure's rungs are held against, and what its fronts say.
#[derive(Serialize)]
pub(super) struct Entry {
    pub(super) name: &'static str,
    /// Pixels across and down.
    pub(super) size: [u32; 2],
    /// Bands of the reference.
    pub(super) truth_bands: Bands,
    /// Share of the pixels that show something which is judged.
    pub(super) judged_share: f64,
    pub(super) vertices: usize,
    /// What halving the error costs, one sentence an executor.
    pub(super) halving: Vec<String>,
    /// Why there is nothing to hold frames against.
    pub(super) problem: Option<String>,
}

/// A figure while it is climbed.
struct Course {
    stage: Stage,
    reference: Reference,
    /// Sampled every 5 nm, exposed.
    truth: Vec<[f64; 3]>,
    factor: f64,
}

impl Course {
    fn new(subject: &'static PrtSubject, size: [u32; 2], folder: &Path) -> Result<Self> {
        let stage = Stage::open(subject, Bands::MAX, folder)?;
        let reference = stage.reference(size);
        let factor = reference.exposure();
        let truth = reference.xyz(&stage.paints(subject.lamps[0], None), factor);
        Ok(Self { stage, reference, truth, factor })
    }

    /// Of a frame from the truth.
    fn distance(&self, xyz: &[[f32; 3]]) -> ColourDistance {
        ColourDistance::of(xyz, &self.truth, &self.reference)
    }

    fn lit(&self, bands: Bands) -> Lit {
        Lit { lamp: self.stage.subject.lamps[0], bands, factor: self.factor }
    }
}

/// What a rung's plans are made of, or why there are none.
struct Made {
    rung: Rung,
    colours: Result<Colours, Problem>,
    transfer: Transfer,
}

impl Made {
    fn new(course: &Course, rung: Rung) -> Self {
        let colours = course.stage.colours(rung.way).map_err(|error| Problem::Refused(format!("{error:#}")));
        Self { rung, colours, transfer: course.stage.transfer.with_bands(rung.bands) }
    }
}

/// The executors that run, started for relighting; `missing` says why there may be no device, or is empty.
pub(super) fn climbers(running: &[Climber], missing: &str) -> Vec<Climber> {
    let ids = running.iter().filter(|climber| climber.runs()).map(|climber| climber.entry.id);
    let candidates = ids.filter_map(|id| PRT_EXECUTORS.iter().find(|candidate| candidate.id == id));
    candidates.map(|candidate| Climber::new(candidate, missing)).collect()
}

/// What became of them is said of the executors.
pub(super) fn settle(relighting: Vec<Climber>, climbers: &mut [Climber]) {
    for Climber { entry, .. } in relighting.into_iter().filter(|c| c.entry.status != Status::Ran) {
        if let Some(climber) = climbers.iter_mut().find(|climber| climber.entry.id == entry.id) {
            (climber.entry.status, climber.entry.reason) = (entry.status, entry.reason);
        }
    }
}

impl Ladder {
    /// Every rung of a figure on every executor. Transfer is kept in `folder`.
    pub(super) fn climb_prt(
        &mut self,
        subject: &'static PrtSubject,
        rungs: &[Rung],
        folder: &Path,
        climbers: &mut [Climber],
    ) {
        let size = self.effort.picture_size;
        let mut entry = Entry {
            name: subject.name,
            size,
            truth_bands: Bands::MAX,
            judged_share: 0.0,
            vertices: 0,
            halving: Vec::new(),
            problem: None,
        };
        match Course::new(subject, size, folder) {
            Ok(course) => {
                entry.judged_share = course.reference.certain_share();
                entry.vertices = course.stage.figure.surfaces.iter().map(|s| s.positions().len()).sum();
                entry.halving = self.climb_course(&course, rungs, climbers);
            }
            Err(error) => entry.problem = Some(format!("{error:#}")),
        }
        self.figures.push(entry);
    }

    /// What halving the error costs.
    fn climb_course(&mut self, course: &Course, rungs: &[Rung], climbers: &mut [Climber]) -> Vec<String> {
        let made: Vec<Made> = rungs.iter().map(|rung| Made::new(course, *rung)).collect();
        let spoiled = self.sabotage.map(|sabotage| (climbers.len().saturating_sub(1), sabotage));
        let (mut rows, mut controls) = (Vec::new(), Vec::new());
        for (i, climber) in climbers.iter_mut().enumerate() {
            let start = Instant::now();
            let sabotage = spoiled.filter(|(last, _)| *last == i).map(|(_, sabotage)| sabotage);
            let first = rows.len();
            for made in &made {
                let row = climber.climb_prt(course, made, sabotage);
                if row.spoiled {
                    controls.extend(control::of_spoiled(course, &row, made, climber));
                }
                rows.push(row);
            }
            for _ in 1..self.effort.rounds {
                for (row, made) in rows[first..].iter_mut().zip(&made) {
                    climber.time_prt_again(course, made, row);
                }
            }
            let seconds = start.elapsed().as_secs_f64();
            eprintln!("  {}: {} rungs in {seconds:.0} s", climber.entry.name, made.len());
        }
        if let (None, Some(climber)) = (self.sabotage, climbers.first_mut()) {
            controls = control::of_figure(course, &rows, &made, climber);
        }
        for same in rows.chunk_by_mut(|a, b| a.executor == b.executor) {
            let on_front = front(&same.iter().map(Row::price).collect::<Vec<_>>());
            same.iter_mut().zip(on_front).for_each(|(row, on_front)| row.on_front = on_front);
        }
        let halving = rows.chunk_by(|a, b| a.executor == b.executor).map(halving).collect();
        self.figure_rows.extend(rows);
        self.controls.extend(controls);
        halving
    }

    /// A figure's prices.
    pub(super) fn figure_plot(&self, figure: &str) -> Plot {
        let point = |row: &Row| {
            let (method, executor) = (row.rung.way.basis(), row.executor);
            let label = format!("{}, {}", row.rung.way.coefficients(), row.rung.bands.count());
            Some(Point { price: row.price()?, method, executor, on_front: row.on_front, label })
        };
        let rows = self.figure_rows.iter().filter(|row| row.figure == figure);
        Plot { title: figure.to_owned(), error: "mean CIE94", points: rows.filter_map(point).collect() }
    }
}

/// Of an executor's rows.
fn halving(rows: &[Row]) -> String {
    let prices: Vec<Price> = rows.iter().filter(|row| row.on_front).filter_map(Row::price).collect();
    format!("on {}, {}", rows[0].executor, Halving::along(&prices).sentence("mean CIE94"))
}
