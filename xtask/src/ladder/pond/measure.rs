//! A pond's rung on one executor: its distance from the integral and what a frame takes.

use caustic_heightfield::PondError;
use serde::Serialize;
use xtask::ponds::{FloorDistance, FloorPlan, PondSubject};
use xtask::sabotage::Sabotage;

use super::super::front::Price;
use super::super::measure::{FrameTime, Problem};
use super::{Made, Pair, Reference, Rung, Truth};

/// A rung's place in the price list.
#[derive(Clone, Debug, Serialize)]
pub(in super::super) struct Row {
    pub(in super::super) pond: &'static str,
    /// Of the surface along each side.
    pub(in super::super) samples: usize,
    /// `cpu`, `wgpu` or `vulkan`.
    pub(in super::super) executor: &'static str,
    pub(in super::super) rung: Rung,
    /// What its floor is held against.
    pub(in super::super) reference: Reference,
    /// Convolutions that are summed; null of photons.
    pub(in super::super) terms: Option<usize>,
    /// Milliseconds in which the host made the plan: kernels, terms or the mesh.
    pub(in super::super) make_ms: f64,
    /// What it gives and takes; null where that is not known.
    pub(in super::super) outcome: Option<Outcome>,
    /// Why it is not.
    pub(in super::super) problem: Option<Problem>,
    /// Its plan was spoiled on purpose.
    pub(in super::super) spoiled: bool,
    /// No rung of this pond, executor and reference is both faster and nearer to the integral.
    pub(in super::super) on_front: bool,
}

/// What a rung gives and takes.
#[derive(Clone, Debug, Serialize)]
pub(in super::super) struct Outcome {
    /// From the integral.
    #[serde(flatten)]
    pub(in super::super) error: FloorDistance,
    /// A frame, from heights on the device to the floor on the device.
    pub(in super::super) frame: FrameTime,
}

impl Row {
    /// Milliseconds and relative RMS. A spoiled rung has no price.
    pub(super) fn price(&self) -> Option<Price> {
        let outcome = self.outcome.as_ref().filter(|_| !self.spoiled)?;
        Some(Price { ms: outcome.frame.ms, error: outcome.error.rms })
    }

    /// What tells it from others of its method.
    pub(super) fn label(&self) -> String {
        match self.rung {
            Rung::Convolution { kernel_samples } => kernel_samples.map_or("whole".into(), |n| n.to_string()),
            Rung::LowRank { .. } => self.terms.map_or_else(String::new, |terms| format!("{terms} terms")),
            Rung::Photon { emission_size } => emission_size.to_string(),
        }
    }
}

impl Pair<'_> {
    /// Measure a rung, its time for one round; whatever goes wrong stands in the row. `sabotage` spoils its plan.
    pub(super) fn climb(
        &mut self,
        subject: &PondSubject,
        truth: &Truth,
        made: &Made<'_>,
        sabotage: Option<Sabotage>,
    ) -> Row {
        let mut row = Row {
            pond: subject.name,
            samples: made.samples,
            executor: self.name(),
            rung: made.rung,
            reference: made.rung.reference(),
            terms: made.terms,
            make_ms: made.make_ms,
            outcome: None,
            problem: None,
            spoiled: sabotage.is_some(),
            on_front: false,
        };
        let plan = match (&made.plan, sabotage) {
            (Ok(plan), None) => plan.clone(),
            (Ok(plan), Some(sabotage)) => plan.spoiled(sabotage),
            (Err(problem), _) => return Row { problem: Some(problem.clone()), spoiled: false, ..row },
        };
        match self.measure(truth, made.rung, &plan) {
            Ok(outcome) => row.outcome = Some(outcome),
            Err(problem) => row.problem = Some(problem),
        }
        row
    }

    fn measure(&mut self, truth: &Truth, rung: Rung, plan: &FloorPlan<'_>) -> Result<Outcome, Problem> {
        let error = self.error(truth, rung, plan)?;
        let frame = self.climber_for(plan).time(plan.plan())?;
        Ok(Outcome { error, frame })
    }

    /// Distance from the integral, or why there is nothing to compare.
    pub(super) fn error(
        &mut self,
        truth: &Truth,
        rung: Rung,
        plan: &FloorPlan<'_>,
    ) -> Result<FloorDistance, Problem> {
        let floor = self.climber_for(plan).ask(|executor| plan.floor(executor))?;
        FloorDistance::of(&floor, truth.of(rung.reference()))
            .map_err(|problems| Problem::Failed(problems.join("; ")))
    }

    /// Another round of a rung that has a price.
    pub(super) fn time_again(&mut self, made: &Made<'_>, row: &mut Row) {
        let (Some(outcome), Ok(plan)) = (row.outcome.as_mut().filter(|_| !row.spoiled), &made.plan) else {
            return;
        };
        let start =
            |executor: &mut dyn frame_plan::Executor| -> Result<(), PondError> { plan.start(executor) };
        if let Err(problem) = self.climber_for(plan).add_round(plan.plan(), &mut outcome.frame, start) {
            row.problem.get_or_insert(problem);
        }
    }
}
