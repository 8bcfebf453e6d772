//! The pond's part of the price list: every method on every executor, against the integral in f64.
//!
//! The paper's convolutions and low-rank terms are held against [`exact`] of the same lobe. Light through a mesh of water scatters nothing, so
//! it is held against [`exact_over_facets`] of nearly clear water, on a part of the floor, and has a front of its own.

mod control;
mod measure;
mod page;

use std::fmt;
use std::time::Instant;

use anyhow::Result;
use caustic_heightfield::{
    Convolution, ConvolutionSettings, FloorGrid, HeightField, LowRank, LowRankSettings, Photon,
    PhotonSettings, PlanSettings, Pond, PondError, exact, exact_over_facets,
};
use frame_plan::Limits;
use serde::Serialize;
use xtask::executor_entry::Status;
use xtask::executors::POND_EXECUTORS;
use xtask::ponds::{EXTENT_M, FloorPlan, PondSubject, white, window};

use super::front::{Halving, Price, front};
use super::measure::{Climber, Problem};
use super::plot::{Family, Plot, Point};
use super::report::Ladder;

pub(super) use measure::Row;
pub(super) use page::section;

/// What a caller would set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "method", rename_all = "kebab-case")]
pub(super) enum Rung {
    /// The paper's three convolutions.
    Convolution {
        /// Samples across the kernels; null for as far as the pond goes.
        kernel_samples: Option<usize>,
    },
    /// Low-rank terms of the exact lobe.
    LowRank {
        /// Relative RMS error that is asked for.
        target_error: f64,
    },
    /// The water as a refractor.
    Photon {
        /// Cells of the light's view along each side, at least.
        emission_size: u32,
    },
}

/// From cheap to accurate, method by method.
const RUNGS: [Rung; 9] = [
    Rung::Convolution { kernel_samples: Some(7) },
    Rung::Convolution { kernel_samples: Some(31) },
    Rung::Convolution { kernel_samples: Some(63) },
    Rung::Convolution { kernel_samples: None },
    Rung::LowRank { target_error: 0.1 },
    Rung::LowRank { target_error: 0.01 },
    Rung::LowRank { target_error: 0.001 },
    Rung::Photon { emission_size: 128 },
    Rung::Photon { emission_size: 256 },
];

/// Names of the methods, in the order of their colours.
pub(super) const METHODS: [&str; 3] = ["convolution", "low-rank", "photon"];

/// How the pond's plots look.
pub(super) const FAMILY: Family = Family {
    methods: &METHODS,
    labels: "lines: what nothing beats, with the kernel's side, the terms, or the cells of the light's view",
};

/// What a floor is held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Reference {
    /// The integral of the pond's lobe.
    Exact,
    /// The integral of nearly clear water over the surface between its samples.
    ExactOverFacets,
}

impl Rung {
    /// As in `--method`.
    pub(super) const fn method(self) -> &'static str {
        match self {
            Self::Convolution { .. } => METHODS[0],
            Self::LowRank { .. } => METHODS[1],
            Self::Photon { .. } => METHODS[2],
        }
    }

    const fn reference(self) -> Reference {
        match self {
            Self::Photon { .. } => Reference::ExactOverFacets,
            _ => Reference::Exact,
        }
    }
}

impl fmt::Display for Rung {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Convolution { kernel_samples: Some(side) } => write!(f, "convolution {side} x {side}"),
            Self::Convolution { kernel_samples: None } => write!(f, "convolution, whole pond"),
            Self::LowRank { target_error } => write!(f, "low-rank for {} %", 100.0 * target_error),
            Self::Photon { emission_size } => write!(f, "photon, {emission_size} x {emission_size} cells"),
        }
    }
}

/// Those of these methods, or of all; a quick run has one photon rung and no kernels between the smallest and the largest.
pub(super) fn rungs(methods: &[String], quick: bool) -> Vec<Rung> {
    let is_quick = |rung: &Rung| {
        !matches!(
            rung,
            Rung::Convolution { kernel_samples: Some(31 | 63) } | Rung::Photon { emission_size: 256 }
        )
    };
    let is_wanted = |rung: &Rung| methods.is_empty() || methods.iter().any(|m| m == rung.method());
    RUNGS.into_iter().filter(|rung| is_wanted(rung) && (!quick || is_quick(rung))).collect()
}

/// A pond's integral and what its fronts say.
#[derive(Serialize)]
pub(super) struct Entry {
    pub(super) name: &'static str,
    /// Samples of the surface, and of the floor of the sums, along each side.
    pub(super) samples: usize,
    /// Milliseconds of the integral, f64 on all threads.
    pub(super) exact_ms: Option<f64>,
    /// The same of nearly clear water, on a quarter of the floor.
    pub(super) exact_over_facets_ms: Option<f64>,
    /// What halving the error of the sums costs, one sentence an executor.
    pub(super) halving: Vec<String>,
    /// Why there is nothing to hold floors against.
    pub(super) problem: Option<String>,
}

/// A rung's plan, which every executor is given, or why there is none.
struct Made<'a> {
    rung: Rung,
    /// Of the surface along each side.
    samples: usize,
    plan: Result<FloorPlan<'a>, Problem>,
    /// Low-rank terms or kernels.
    terms: Option<usize>,
    /// Milliseconds that the host took for it.
    make_ms: f64,
}

/// What floors are held against.
struct Truth {
    exact: Option<Vec<f64>>,
    over_facets: Option<Vec<f64>>,
}

impl Truth {
    fn of(&self, reference: Reference) -> &[f64] {
        let floor = match reference {
            Reference::Exact => &self.exact,
            Reference::ExactOverFacets => &self.over_facets,
        };
        floor.as_deref().unwrap_or_default()
    }
}

/// The executors of one kind, for the pond's passes and for those of scenes.
pub(super) struct Pair<'a> {
    sums: Climber,
    scenes: &'a mut Climber,
}

impl<'a> Pair<'a> {
    /// Of all executors that run; `missing` says why there may be no device, or is empty.
    pub(super) fn of(climbers: &'a mut [Climber], missing: &str) -> Vec<Self> {
        let running = climbers.iter_mut().filter(|climber| climber.runs());
        let pair = |scenes: &'a mut Climber| {
            let candidate = POND_EXECUTORS.iter().find(|candidate| candidate.id == scenes.entry.id)?;
            Some(Self { sums: Climber::new(candidate, missing), scenes })
        };
        running.filter_map(pair).collect()
    }

    /// What became of the one for the pond's passes is said of the executor.
    pub(super) fn settle(self) {
        if self.sums.entry.status != Status::Ran {
            self.scenes.entry.status = self.sums.entry.status;
            self.scenes.entry.reason = self.sums.entry.reason;
        }
    }

    fn name(&self) -> &'static str {
        self.scenes.entry.name
    }

    fn climber_for(&mut self, plan: &FloorPlan<'_>) -> &mut Climber {
        match plan {
            FloorPlan::Sums(..) => &mut self.sums,
            FloorPlan::Photon(_) => self.scenes,
        }
    }
}

impl Ladder {
    /// Every rung of a pond on every executor.
    pub(super) fn climb_pond(
        &mut self,
        subject: &PondSubject,
        samples: usize,
        rungs: &[Rung],
        pairs: &mut [Pair<'_>],
    ) {
        let mut entry = Entry {
            name: subject.name,
            samples,
            exact_ms: None,
            exact_over_facets_ms: None,
            halving: Vec::new(),
            problem: None,
        };
        if let Err(error) = self.climb_rungs(subject, rungs, pairs, &mut entry) {
            entry.problem = Some(error.to_string());
        }
        self.ponds.push(entry);
    }

    fn climb_rungs(
        &mut self,
        subject: &PondSubject,
        rungs: &[Rung],
        pairs: &mut [Pair<'_>],
        entry: &mut Entry,
    ) -> Result<(), PondError> {
        let (surface, pond) = (subject.surface([entry.samples; 2])?, subject.pond());
        let clear = subject.nearly_clear(entry.samples);
        let held_against = |reference| rungs.iter().any(|rung| rung.reference() == reference);
        let mut truth = Truth { exact: None, over_facets: None };
        if held_against(Reference::Exact) {
            let (floor, ms) = timed(|| exact(&surface, &pond, FloorGrid::below(&surface)));
            (truth.exact, entry.exact_ms) = (Some(floor?.irradiance), Some(ms));
        }
        if held_against(Reference::ExactOverFacets) {
            let (floor, ms) = timed(|| exact_over_facets(&surface, &clear, window(entry.samples), 2.0));
            (truth.over_facets, entry.exact_over_facets_ms) = (Some(white(&floor?.irradiance)), Some(ms));
        }
        let made: Vec<Made<'_>> =
            rungs.iter().map(|rung| Made::new(*rung, &surface, &pond, &clear)).collect();

        let spoiled = self.sabotage.map(|sabotage| (pairs.len().saturating_sub(1), sabotage));
        let (mut rows, mut controls) = (Vec::new(), Vec::new());
        for (i, pair) in pairs.iter_mut().enumerate() {
            let start = Instant::now();
            let sabotage = spoiled.filter(|(last, _)| *last == i).map(|(_, sabotage)| sabotage);
            let first = rows.len();
            for made in &made {
                let row = pair.climb(subject, &truth, made, sabotage);
                if row.spoiled {
                    controls.extend(control::of_spoiled(&truth, &row, made, pair));
                }
                rows.push(row);
            }
            for _ in 1..self.effort.rounds {
                for (row, made) in rows[first..].iter_mut().zip(&made) {
                    pair.time_again(made, row);
                }
            }
            let seconds = start.elapsed().as_secs_f64();
            eprintln!("  {}: {} rungs in {seconds:.0} s", pair.name(), made.len());
        }
        if let (None, Some(pair)) = (self.sabotage, pairs.first_mut()) {
            controls = control::of_pond(&truth, &rows, &made, pair);
        }
        for same in rows.chunk_by_mut(|a, b| a.executor == b.executor && a.reference == b.reference) {
            let on_front = front(&same.iter().map(Row::price).collect::<Vec<_>>());
            same.iter_mut().zip(on_front).for_each(|(row, on_front)| row.on_front = on_front);
        }
        entry.halving = halving(&rows);
        self.pond_rows.extend(rows);
        self.controls.extend(controls);
        Ok(())
    }

    /// A pond's prices.
    pub(super) fn pond_plot(&self, pond: &str) -> Plot {
        let point = |row: &Row| {
            let (method, executor) = (row.rung.method(), row.executor);
            Some(Point { price: row.price()?, method, executor, on_front: row.on_front, label: row.label() })
        };
        let rows = self.pond_rows.iter().filter(|row| row.pond == pond);
        Plot { title: pond.to_owned(), error: "relative RMS", points: rows.filter_map(point).collect() }
    }
}

/// Of the sums, executor by executor.
fn halving(rows: &[Row]) -> Vec<String> {
    let of = |rows: &[Row]| {
        let prices: Vec<Price> = rows.iter().filter(|row| row.on_front).filter_map(Row::price).collect();
        format!("on {}, {}", rows[0].executor, Halving::along(&prices).sentence("RMS"))
    };
    let sums: Vec<Row> = rows.iter().filter(|row| row.reference == Reference::Exact).cloned().collect();
    sums.chunk_by(|a, b| a.executor == b.executor).map(of).collect()
}

fn timed<T>(what: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let done = what();
    (done, 1e3 * start.elapsed().as_secs_f64())
}

impl<'a> Made<'a> {
    /// For a surface, the pond below it, and the same with nearly clear water.
    fn new(rung: Rung, surface: &'a HeightField, pond: &Pond, clear: &Pond) -> Self {
        let (plan, make_ms) = timed(|| plan(rung, surface, pond, clear));
        let (plan, terms) = match plan {
            Ok((plan, terms)) => (Ok(plan), terms),
            Err(error) => (Err(Problem::Refused(error.to_string())), None),
        };
        Self { rung, samples: surface.size[0], plan, terms, make_ms }
    }
}

/// A rung's plan, and how many terms it sums.
fn plan<'a>(
    rung: Rung,
    surface: &'a HeightField,
    pond: &Pond,
    clear: &Pond,
) -> Result<(FloorPlan<'a>, Option<usize>), PondError> {
    let settings = PlanSettings::default();
    Ok(match rung {
        Rung::Convolution { kernel_samples } => {
            let how = ConvolutionSettings { kernel_samples, ..ConvolutionSettings::default() };
            let method = Convolution::<f32>::new(surface.size, EXTENT_M, pond, how)?;
            (FloorPlan::Sums(Box::new(method.plan(&settings)?), surface), Some(PAPERS_TERMS))
        }
        Rung::LowRank { target_error } => {
            let how = LowRankSettings { target_error, max_terms: MOST_TERMS, ..LowRankSettings::default() };
            let method = LowRank::<f32>::new(std::slice::from_ref(surface), pond, how)?;
            let terms = method.report().terms;
            (FloorPlan::Sums(Box::new(method.plan(&settings)?), surface), Some(terms))
        }
        Rung::Photon { emission_size } => {
            let footprints = asm_core::Settings { emission_size, ..PhotonSettings::default().footprints };
            let mut method = Photon::new(clear, PhotonSettings { footprints, ..PhotonSettings::default() })?;
            let floor = window(surface.size[0]);
            (FloorPlan::Photon(Box::new(method.plan(surface, floor, &Limits::default())?)), None)
        }
    })
}

/// Convolutions of the paper.
const PAPERS_TERMS: usize = 3;
/// Steep waves under a low sun need many for 0.1 %.
const MOST_TERMS: usize = 64;
