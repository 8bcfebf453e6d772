//! A figure's rung on one executor: its distance from the reference and what a frame takes.

use frame_plan::Plan;
use serde::Serialize;
use spectral_prt::{Relighting, RelightingError};
use xtask::prt::{ColourDistance, Colours, Fault, something_to_compare, spoiled};
use xtask::sabotage::Sabotage;

use super::super::front::Price;
use super::super::measure::{Climber, FrameTime, Problem};
use super::{Course, Made, Rung};

/// A rung's place in the price list.
#[derive(Clone, Debug, Serialize)]
pub(in super::super) struct Row {
    pub(in super::super) figure: &'static str,
    /// `cpu`, `wgpu` or `vulkan`.
    pub(in super::super) executor: &'static str,
    pub(in super::super) rung: Rung,
    /// What it gives and takes; null where that is not known.
    pub(in super::super) outcome: Option<Outcome>,
    /// Why it is not.
    pub(in super::super) problem: Option<Problem>,
    /// Its plan was spoiled on purpose.
    pub(in super::super) spoiled: bool,
    /// No rung of this figure and executor is both faster and nearer to the reference.
    pub(in super::super) on_front: bool,
}

/// What a rung gives and takes.
#[derive(Clone, Debug, Serialize)]
pub(in super::super) struct Outcome {
    /// From the reference.
    #[serde(flatten)]
    pub(in super::super) error: ColourDistance,
    /// The whole of a frame.
    pub(in super::super) frame: FrameTime,
    /// Milliseconds in which vertices are lit and pixels shaded, the parts that m and L are about; null where the device does not tell.
    pub(in super::super) vertex_ms: Option<f64>,
    pub(in super::super) shade_ms: Option<f64>,
}

impl Row {
    /// Milliseconds and mean CIE94. A spoiled rung has no price.
    pub(super) fn price(&self) -> Option<Price> {
        let outcome = self.outcome.as_ref().filter(|_| !self.spoiled)?;
        Some(Price { ms: outcome.frame.ms, error: outcome.error.cie94_mean })
    }
}

impl Climber {
    /// Measure a rung, its time for one round; whatever goes wrong stands in the row. `sabotage` spoils its plan.
    pub(super) fn climb_prt(&mut self, course: &Course, made: &Made, sabotage: Option<Sabotage>) -> Row {
        let mut row = Row {
            figure: course.stage.subject.name,
            executor: self.entry.name,
            rung: made.rung,
            outcome: None,
            problem: None,
            spoiled: false,
            on_front: false,
        };
        let (relighting, colours) = match self.relighting(course, made, None) {
            Ok(plan) => plan,
            Err(problem) => return Row { problem: Some(problem), ..row },
        };
        let plan = sabotage.map_or_else(|| relighting.plan.clone(), |s| spoiled(&relighting.plan, s));
        row.spoiled = plan != relighting.plan;
        match self.measure(course, made, colours, &relighting, &plan) {
            Ok(outcome) => row.outcome = Some(outcome),
            Err(problem) => row.problem = Some(problem),
        }
        row
    }

    /// The plan of a rung for this executor's device, with a fault of the reflectances if one is asked for.
    pub(super) fn relighting<'a>(
        &self,
        course: &Course,
        made: &'a Made,
        fault: Option<Fault>,
    ) -> Result<(Relighting, &'a Colours), Problem> {
        let colours = made.colours.as_ref().map_err(Clone::clone)?;
        let own = &course.stage.figure.reflectances;
        let reflectances = fault.map_or(own.into(), |fault| fault.reflectances(own));
        let size = course.reference.size;
        course
            .stage
            .relighting(colours, &reflectances, &made.transfer, size, &self.limits())
            .map(|relighting| (relighting, colours))
            .map_err(|error| Problem::Refused(error.to_string()))
    }

    fn measure(
        &mut self,
        course: &Course,
        made: &Made,
        colours: &Colours,
        relighting: &Relighting,
        plan: &Plan,
    ) -> Result<Outcome, Problem> {
        let xyz = self.prt_frame(course, made, colours, relighting, plan, None)?;
        let error = course.distance(&xyz);
        let frame = self.time(plan)?;
        let steps = self.ask(|executor| Ok::<_, RelightingError>(executor.step_times()))?;
        let ms = |pass: &str| steps.iter().find(|step| step.name == pass).map(|step| step.milliseconds);
        Ok(Outcome { error, frame, vertex_ms: ms("prt_vertex"), shade_ms: ms("prt_shade") })
    }

    /// A frame by `plan`, XYZ, or why there is nothing to compare.
    pub(super) fn prt_frame(
        &mut self,
        course: &Course,
        made: &Made,
        colours: &Colours,
        relighting: &Relighting,
        plan: &Plan,
        fault: Option<Fault>,
    ) -> Result<Vec<[f32; 3]>, Problem> {
        let lit = course.lit(made.rung.bands);
        let xyz = self.ask(|executor| -> Result<_, RelightingError> {
            executor.prepare(plan)?;
            course.stage.frame(relighting, executor, colours, lit, fault)
        })?;
        something_to_compare(&xyz).map_err(Problem::Failed)?;
        Ok(xyz)
    }

    /// Another round of a rung that has a price.
    pub(super) fn time_prt_again(&mut self, course: &Course, made: &Made, row: &mut Row) {
        let Some(outcome) = row.outcome.as_mut().filter(|_| !row.spoiled) else { return };
        let again = self.relighting(course, made, None).and_then(|(Relighting { plan, .. }, _)| {
            self.add_round(&plan, &mut outcome.frame, |executor| executor.prepare(&plan))
        });
        if let Err(problem) = again {
            row.problem.get_or_insert(problem);
        }
    }
}
