//! Separable terms of the exact lobe: what the paper's expansion becomes if it is not about the vertical.
//!
//! The lobe of a beam depends on its *state* s, direction and height, and on the offset o to a point of the floor. A singular
//! value decomposition of K(s, o) over the states that occur gives K(s, o) ~ sum over r of c_r(s) v_r(o), the best there is in so
//! many terms (Eckart & Young 1936), and each term is one convolution: floor = sum over r of (flux c_r(s)) * v_r. Coefficients are
//! polynomials through Chebyshev nodes of a box of states, kept as a table.

mod basis;
pub(crate) mod state;
pub(crate) mod table;

use frame_plan::Executor;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::convolution::{check_same_grid, reach};
use crate::convolve::{Convolve, Sample, TermSum, Window};
use crate::error::{PondError, check_positive};
use crate::exact::{check_clear_of_floor, exact};
use crate::floor::{FloorGrid, FloorLight, floor_light, lobe_samples};
use crate::height_field::HeightField;
use crate::lobe::Lobe;
use crate::plan::{Method, PlanSettings, PondPlan};
use crate::pond::{Outside, Pond};
use crate::surface_light::SurfaceLight;
use basis::Basis;
use state::{State, states};
use table::Table;

/// Points of the floor, on a side, at which the error is measured.
const PROBES: usize = 12;
/// Narrower lobes are no functions on the grid: a sum over it is wrong by a third at this width, whatever sums it.
const MIN_LOBE_SAMPLES: f64 = 0.25;

/// How many terms, and how they are summed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LowRankSettings {
    /// Relative RMS error of the floor to stay below.
    pub target_error: f64,
    /// Most terms.
    pub max_terms: usize,
    /// In space or by FFT.
    pub convolve: Convolve,
}

impl Default for LowRankSettings {
    /// One percent, in at most 40 terms.
    fn default() -> Self {
        Self { target_error: 0.01, max_terms: 40, convolve: Convolve::Auto }
    }
}

/// What the terms are worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LowRankReport {
    /// Terms used.
    pub terms: usize,
    /// Relative RMS error against `exact`, measured at a lattice of points of the floors below the given surfaces.
    pub error: f64,
    /// The same with 1, 2, 3, ... terms, as far as they were computed.
    pub errors_by_terms: Vec<f64>,
    /// No point of any floor differs by more than this share of the mean irradiance, as far as beams have the states of
    /// the given surfaces and are no stronger: the sum over all offsets of the largest error of any beam there.
    pub bound: f64,
    /// Chebyshev nodes in the beam's two slopes and in height.
    pub nodes: [usize; 3],
    /// States of the table of coefficients.
    pub table: [usize; 3],
    /// Offsets that kernels cover, in samples.
    pub window: [usize; 2],
}

/// The method for one pond and grid, and for waves like those it was shown. `T` is what it computes in.
pub struct LowRank<T: Sample> {
    pond: Pond,
    size: [usize; 2],
    extent_m: [f64; 2],
    tiles: (i64, f64),
    table: Table<T>,
    terms: TermSum<T>,
    report: LowRankReport,
}

/// A floor by low-rank terms.
#[derive(Clone, Debug)]
pub struct LowRankFloor {
    /// The light.
    pub light: FloorLight,
    /// Samples of the surface whose state is outside of what the terms were made for; they were given the nearest state. Where
    /// there are many, make the terms anew with this surface.
    pub outside_states: usize,
}

/// A surface that terms are fitted to, with its light.
struct Example {
    states: Vec<State>,
    flux: Vec<f64>,
    /// `exact` at the probes.
    probes: FloorLight,
}

impl<T: Sample> LowRank<T> {
    /// Terms for surfaces like `examples`, which have one grid: as few as keep the target.
    ///
    /// # Errors
    /// As [`Pond::check`]; no examples, or of different grids; a surface that touches the floor or has beams upwards; a lobe
    /// narrower than a quarter of a sample; a target
    /// that `max_terms` do not reach, or that is not above 0.
    pub fn new(examples: &[HeightField], pond: &Pond, settings: LowRankSettings) -> Result<Self, PondError> {
        check_positive("target error", settings.target_error)?;
        let Some(first) = examples.first() else {
            return Err(PondError::Setting { name: "number of surfaces", got: 0.0, expected: "1 or more" });
        };
        let (size, extent_m) = (first.size, first.extent_m);
        pond.check(first)?;
        check_clear_of_floor(first, pond)?;
        let lobe_samples = lobe_samples(first.pitch_m(), pond);
        if lobe_samples < MIN_LOBE_SAMPLES {
            return Err(PondError::Unresolved { lobe_samples, min: MIN_LOBE_SAMPLES });
        }
        let mut shown = Vec::with_capacity(examples.len());
        for surface in examples {
            check_same_grid(surface, size, extent_m)?;
            shown.push(Example::new(surface, pond)?);
        }
        let deepest = shown.iter().flat_map(|e| &e.states).map(|s| s[2]).fold(0.0, f64::max);
        let tilt = shown.iter().flat_map(|e| &e.states).map(|s| s[0].hypot(s[1]).atan()).fold(0.0, f64::max);
        let (tiles, tail, radius) = reach(size, extent_m, pond, deepest, tilt);
        let all: Vec<State> = shown.iter().flat_map(|e| e.states.iter().copied()).collect();
        let basis = Basis::new(
            Lobe::new(pond),
            first.pitch_m(),
            &all,
            Window::centred(radius),
            settings.target_error,
            settings.max_terms,
        );
        let (errors_by_terms, terms) = choose(&basis, &shown, size, pond.outside, settings)?;
        let kernels = (0..terms)
            .map(|r| basis.kernels.iter().skip(r).step_by(basis.terms).map(|&x| T::rounded(x)).collect())
            .collect();
        let report = LowRankReport {
            terms,
            error: errors_by_terms[terms - 1],
            errors_by_terms,
            bound: basis.bound(terms) * strongest(&shown, first) / mean_irradiance(&shown),
            nodes: basis.nodes,
            table: basis.table.size,
            window: basis.window.size,
        };
        Ok(Self {
            pond: pond.clone(),
            size,
            extent_m,
            tiles: (tiles, tail),
            table: basis.table.truncated(terms),
            terms: TermSum::new(size, pond.outside, basis.window, kernels, settings.convolve),
            report,
        })
    }

    /// What the terms are worth.
    #[must_use]
    pub fn report(&self) -> &LowRankReport {
        &self.report
    }

    /// The method as a plan for executors.
    ///
    /// # Errors
    /// No room for impulses, or a table of fewer than 2 entries or levels.
    pub fn plan(&self, settings: &PlanSettings) -> Result<PondPlan, PondError> {
        PondPlan::new(&self.method(), settings)
    }

    /// Let a prepared plan of other terms have these, for its next frame on: the way of a sun that is dragged. Only numbers are written, so
    /// nothing is allocated or compiled; the pond may be another in all but its form, its surroundings and the kind of its illumination.
    ///
    /// # Errors
    /// [`PondError::Room`] if the plan has no room for so many terms, so large a table or so far offsets ([`PlanSettings::room`]): it is
    /// as it was, and a new one is needed. A plan of another method or grid; a pond that differs in more; those of the executor.
    pub fn refit(&self, plan: &mut PondPlan, executor: &mut dyn Executor) -> Result<(), PondError> {
        plan.refit(executor, &self.method())
    }

    fn method(&self) -> Method<'_, T> {
        Method {
            pond: &self.pond,
            extent_m: self.extent_m,
            tiles: self.tiles,
            table: Some(&self.table),
            terms: &self.terms,
        }
    }

    /// The light on the floor below `surface`.
    ///
    /// # Errors
    /// As [`Pond::check`]; a surface of another grid; one that touches the floor or has beams upwards.
    pub fn floor(&self, surface: &HeightField) -> Result<LowRankFloor, PondError> {
        check_same_grid(surface, self.size, self.extent_m)?;
        check_clear_of_floor(surface, &self.pond)?;
        let light = SurfaceLight::new(surface, &self.pond)?;
        let states = states(surface, &self.pond, &light)?;
        let terms = self.report.terms;
        let samples = states.len();
        let mut coefficients = vec![T::zero(); samples * terms];
        let outside_states = coefficients
            .par_chunks_mut(terms)
            .zip(states.par_iter().zip(&light.flux))
            .filter_map(|(of_sample, (state, &flux))| {
                (!self.table.at(*state, flux, of_sample) && flux > 0.0).then_some(())
            })
            .count();
        let sources: Vec<Vec<T>> = (0..terms)
            .into_par_iter()
            .map(|r| coefficients.iter().skip(r).step_by(terms).copied().collect())
            .collect();
        let irradiance = self.terms.sum(&sources).into_iter().map(T::widened).collect();
        let grid = FloorGrid::below(surface);
        let light = floor_light(surface.pitch_m(), &self.pond, light.report, grid, irradiance, self.tiles);
        Ok(LowRankFloor { light, outside_states })
    }
}

impl Example {
    fn new(surface: &HeightField, pond: &Pond) -> Result<Self, PondError> {
        check_clear_of_floor(surface, pond)?;
        let light = SurfaceLight::new(surface, pond)?;
        let grid = FloorGrid::below(surface).every(probe_stride(surface.size));
        Ok(Self {
            states: states(surface, pond, &light)?,
            flux: light.flux,
            probes: exact(surface, pond, grid)?,
        })
    }
}

fn probe_stride(size: [usize; 2]) -> usize {
    size[0].min(size[1]).div_ceil(PROBES)
}

/// The error at the probes with 1, 2, 3, ... terms, and how many keep the target.
fn choose(
    basis: &Basis,
    shown: &[Example],
    size: [usize; 2],
    outside: Outside,
    settings: LowRankSettings,
) -> Result<(Vec<f64>, usize), PondError> {
    let mut difference = vec![0.0; basis.terms];
    let mut power = 0.0;
    for example in shown {
        let sums = basis.at_probes(&example.states, &example.flux, size, outside, &example.probes.grid);
        for (sums, exact) in sums.chunks(basis.terms).zip(&example.probes.irradiance) {
            let mut partial = 0.0;
            for (difference, term) in difference.iter_mut().zip(sums) {
                partial += term;
                *difference += (partial - exact) * (partial - exact);
            }
            power += exact * exact;
        }
    }
    let errors: Vec<f64> =
        difference.iter().map(|d| if power > 0.0 { (d / power).sqrt() } else { 0.0 }).collect();
    match errors.iter().position(|&error| error <= settings.target_error) {
        Some(last) => Ok((errors, last + 1)),
        None => {
            let reached = errors.iter().copied().fold(f64::INFINITY, f64::min);
            Err(PondError::Terms { terms: errors.len(), reached, asked: settings.target_error })
        }
    }
}

/// The largest flux per area of any beam.
fn strongest(shown: &[Example], surface: &HeightField) -> f64 {
    let flux = shown.iter().flat_map(|e| &e.flux).copied().fold(0.0, f64::max);
    flux / surface.pitch_m().iter().product::<f64>()
}

/// Mean over all probes; 1 where all is dark and every share of it is 0.
fn mean_irradiance(shown: &[Example]) -> f64 {
    let all = || shown.iter().flat_map(|e| &e.probes.irradiance);
    let mean = all().sum::<f64>() / all().count() as f64;
    if mean > 0.0 { mean } else { 1.0 }
}
