//! One rung on one executor: its distance from the oracle and what a frame takes.

use std::fmt::Display;

use asm_core::{BakePlan, RenderPlan, Rung, bake_plan, render_plan};
use frame_plan::{ExecuteError, Executor, Limits, Plan};
use serde::Serialize;
use spectral_scene::IrradianceMaps;
use xtask::checks::judge;
use xtask::executor_entry::{ExecutorEntry, Status};
use xtask::executors::{self, Candidate};
use xtask::frame_time::{WarmFrames, median, range};
use xtask::metrics::{Metrics, exposure};
use xtask::net_error::{self, Net};
use xtask::picture_distance::mean_flip;
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

use super::Effort;
use super::truth::{Truth, all_light, picture_map};

/// An executor while it climbs.
pub(super) struct Climber {
    pub(super) entry: ExecutorEntry,
    candidate: &'static Candidate,
    /// None where it cannot be started, and once it has failed for good.
    executor: Option<Box<dyn Executor>>,
}

/// What is measured on a scene, and how.
pub(super) struct Course<'a> {
    pub(super) subject: &'a Subject,
    pub(super) truth: &'a Truth,
    pub(super) effort: &'a Effort,
}

/// A rung's place in the price list.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub(super) scene: String,
    /// `cpu`, `wgpu` or `vulkan`.
    pub(super) executor: &'static str,
    pub(super) rung: Rung,
    /// What it gives and takes; null where that is not known.
    pub(super) outcome: Option<Outcome>,
    /// Why it is not, or what is missing in it.
    pub(super) problem: Option<Problem>,
    /// Its plan was spoiled on purpose.
    pub(super) spoiled: bool,
    /// No rung of this scene and executor is both faster and nearer to the oracle by mean CIEDE2000.
    pub(super) on_delta_e_front: bool,
    /// The same by RMS of Y.
    pub(super) on_rms_front: bool,
}

/// What went wrong with a rung.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", content = "message", rename_all = "kebab-case")]
pub(super) enum Problem {
    /// The device or the method cannot do it: a fact about the rung.
    Refused(String),
    /// Something broke.
    Failed(String),
}

/// What a rung gives and takes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Outcome {
    /// Distance from the oracle in the layer where the caustic is.
    pub(super) error: Metrics,
    /// Its mean CIEDE2000 without the oracle's noise.
    pub(super) net_delta_e: Option<Net>,
    /// Its RMS of Y likewise.
    pub(super) net_rms: Net,
    /// Of all light on the receiver.
    pub(super) all_light: Option<Metrics>,
    /// Mean FLIP of the picture.
    pub(super) flip: Option<f64>,
    /// Photons that met glass or a mirror.
    pub(super) photons: u64,
    /// A frame of the bake.
    pub(super) frame: FrameTime,
    /// A frame of the picture.
    pub(super) picture_frame: Option<FrameTime>,
}

/// Milliseconds of a frame.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FrameTime {
    /// Median of the rounds.
    pub(super) ms: f64,
    /// Of the fastest and of the slowest.
    pub(super) range_ms: [f64; 2],
    /// Each of them.
    rounds_ms: Vec<f64>,
    /// Frames of a round.
    batch: u32,
}

impl FrameTime {
    fn new(round_ms: f64, batch: u32) -> Self {
        Self { ms: round_ms, range_ms: [round_ms; 2], rounds_ms: vec![round_ms], batch }
    }

    fn add(&mut self, round_ms: f64) {
        self.rounds_ms.push(round_ms);
        self.range_ms = range(&self.rounds_ms);
        self.ms = median(self.rounds_ms.clone());
    }
}

impl Climber {
    /// Start an executor; `missing` says why there may be no device, or is empty.
    pub(super) fn new(candidate: &'static Candidate, missing: &str) -> Self {
        let (entry, _, executor) = ExecutorEntry::of(candidate, (candidate.open)(None), missing);
        Self { entry, candidate, executor }
    }

    /// It can be asked.
    pub(super) fn runs(&self) -> bool {
        self.executor.is_some()
    }

    /// A bake with this plan, spoiled or not.
    pub(super) fn bake(&mut self, plan: &BakePlan) -> Result<(IrradianceMaps, u64), Problem> {
        self.ask(|executor| executors::bake(plan, executor))
            .map(|(maps, statistics)| (maps, statistics.photons))
    }

    /// The plan of a rung for this executor's device.
    pub(super) fn plan(&self, course: &Course<'_>, rung: &Rung) -> Result<BakePlan, Problem> {
        let limits = self.limits();
        let Subject { scene, receiver, .. } = course.subject;
        bake_plan(scene, *receiver, course.effort.receiver_size, &rung.settings(), &limits)
            .map_err(|error| Problem::Refused(error.to_string()))
    }

    fn picture_plan(&self, course: &Course<'_>, rung: &Rung) -> Result<RenderPlan, Problem> {
        let size = course.effort.picture_size;
        render_plan(&course.subject.scene, 0, size, &rung.settings(), &self.limits())
            .map_err(|error| Problem::Refused(format!("picture: {error}")))
    }

    pub(super) fn limits(&self) -> Limits {
        self.executor.as_ref().map(|executor| executor.limits()).unwrap_or_default()
    }

    /// Measure a rung, its time for one round; whatever goes wrong stands in the row. `sabotage` spoils its plan.
    pub(super) fn climb(&mut self, course: &Course<'_>, rung: &Rung, sabotage: Option<Sabotage>) -> Row {
        let mut row = Row {
            scene: course.subject.name.clone(),
            executor: self.entry.name,
            rung: rung.clone(),
            outcome: None,
            problem: None,
            spoiled: false,
            on_delta_e_front: false,
            on_rms_front: false,
        };
        let mut plan = match self.plan(course, rung) {
            Ok(plan) => plan,
            Err(problem) => return Row { problem: Some(problem), ..row },
        };
        if let Some(sabotage) = sabotage {
            let spoiled = sabotage.spoil(&plan);
            row.spoiled = spoiled != plan;
            plan = spoiled;
        }
        match self.receiver(course, &plan) {
            Ok(outcome) => row.outcome = Some(outcome),
            Err(problem) => return Row { problem: Some(problem), ..row },
        }
        // A bake's sabotage knows no pictures.
        if let (Some(outcome), false) = (&mut row.outcome, row.spoiled)
            && let Err(problem) = self.picture(course, rung, outcome)
        {
            row.problem = Some(problem);
        }
        row
    }

    fn receiver(&mut self, course: &Course<'_>, plan: &BakePlan) -> Result<Outcome, Problem> {
        let (maps, photons) = self.bake(plan)?;
        let error = course.error(&maps).map_err(Problem::Failed)?;
        let all_light = all_light(&maps, &course.truth.maps, course.subject.white_xyz());
        let frame = self.time(&plan.plan)?;
        let noise = &course.truth.noise.half;
        let (net_delta_e, net_rms) = (net_error::delta_e_mean(&error, noise), net_error::rms(&error, noise));
        Ok(Outcome {
            error,
            net_delta_e,
            net_rms,
            all_light,
            flip: None,
            photons,
            frame,
            picture_frame: None,
        })
    }

    fn picture(&mut self, course: &Course<'_>, rung: &Rung, outcome: &mut Outcome) -> Result<(), Problem> {
        let Some(oracle) = &course.truth.picture else { return Ok(()) };
        let plan = self.picture_plan(course, rung)?;
        let xyz = self.ask(|executor| executors::render(&plan, executor))?;
        let [picture, oracle] = [&xyz, &oracle.xyz].map(|xyz| picture_map(course.effort, xyz));
        picture
            .check_light(f64::INFINITY)
            .and_then(|()| picture.check_varies())
            .map_err(|error| Problem::Failed(format!("picture: nothing to compare: {error}")))?;
        outcome.flip = Some(mean_flip(&picture, &oracle, exposure(&oracle).unwrap_or(1.0)));
        outcome.picture_frame = Some(self.time(&plan.plan)?);
        Ok(())
    }

    /// Another round of a rung that has a price. What takes turns shares a machine's good and bad minutes.
    pub(super) fn time_again(&mut self, course: &Course<'_>, row: &mut Row) {
        let Some(outcome) = row.outcome.as_mut().filter(|_| !row.spoiled) else { return };
        if let Err(problem) = self.another_round(course, &row.rung, outcome) {
            row.problem.get_or_insert(problem);
        }
    }

    fn another_round(
        &mut self,
        course: &Course<'_>,
        rung: &Rung,
        outcome: &mut Outcome,
    ) -> Result<(), Problem> {
        let plan = self.plan(course, rung)?.plan;
        self.add_round(&plan, &mut outcome.frame, |executor| executor.prepare(&plan))?;
        if let Some(frame) = &mut outcome.picture_frame {
            let plan = self.picture_plan(course, rung)?.plan;
            self.add_round(&plan, frame, |executor| executor.prepare(&plan))?;
        }
        Ok(())
    }

    /// Another round of a plan, which `start` prepares.
    pub(super) fn add_round<E: Display + From<ExecuteError>>(
        &mut self,
        plan: &Plan,
        frame: &mut FrameTime,
        start: impl FnOnce(&mut dyn Executor) -> Result<(), E>,
    ) -> Result<(), Problem> {
        let round_ms = self.ask(|executor| -> Result<f64, E> {
            start(executor)?;
            WarmFrames::warm_up(plan, executor, 1)?;
            Ok(WarmFrames::with_batch(plan, frame.batch)?.round_ms(executor)?)
        })?;
        frame.add(round_ms);
        Ok(())
    }

    /// One round of a plan that has run once.
    pub(super) fn time(&mut self, plan: &Plan) -> Result<FrameTime, Problem> {
        self.ask(|executor| -> Result<_, ExecuteError> {
            let warm = WarmFrames::of(plan, executor)?;
            Ok(FrameTime::new(warm.round_ms(executor)?, warm.batch()))
        })
    }

    /// Ask the executor; one that fails is started anew, so that one rung does not take the others with it.
    pub(super) fn ask<T, E: Display>(
        &mut self,
        what: impl FnOnce(&mut dyn Executor) -> Result<T, E>,
    ) -> Result<T, Problem> {
        let executor = self.executor.as_deref_mut();
        let executor =
            executor.ok_or_else(|| Problem::Failed("the executor could not be started again".into()))?;
        what(executor).map_err(|error| {
            // The old one gives its device back first.
            self.executor = None;
            match (self.candidate.open)(None) {
                Ok(executor) => self.executor = Some(executor),
                Err(again) => {
                    self.entry.status = Status::Failed;
                    self.entry.reason = Some(format!("{error}; and then it did not start: {again}"));
                }
            }
            Problem::Failed(error.to_string())
        })
    }
}

impl Course<'_> {
    /// Distance from the oracle, or why there is nothing to compare.
    pub(super) fn error(&self, maps: &IrradianceMaps) -> Result<Metrics, String> {
        let layer = self.truth.layer;
        let oracle = layer.of(&self.truth.maps);
        let expected = self.subject.expected(layer, oracle.check_varies().is_ok());
        let judgement = judge(&layer.of(maps), &oracle, expected, None);
        judgement.metrics.ok_or_else(|| judgement.problems.join("; "))
    }
}

impl Problem {
    /// For people.
    pub(super) fn text(&self) -> &str {
        match self {
            Self::Refused(text) | Self::Failed(text) => text,
        }
    }

    /// Something broke.
    pub(super) fn is_failure(&self) -> bool {
        matches!(self, Self::Failed(_))
    }
}
