//! What a method is made for, and when it has to be made anew.

use caustic_heightfield::{
    HeightField, HeightSource, Impulse, LowRank, LowRankSettings, PlanSettings, PondError, PondPlan, Room,
    impulse_heights,
};
use frame_plan::Executor;
use spectral_cli::{Floors, PondMethod};

use super::choices::Choices;
use super::job::FloorJob;

/// Ages at which a pebble's waves stand for those to come, seconds over the time that its front takes through the pond.
const AGES: [f64; 2] = [0.15, 0.5];
/// Waves that meet are higher than one pebble's.
const MEETING: f64 = 2.0;
/// The share of values unlike those it was fitted to from which on a method is fitted anew.
const TOO_MANY: f64 = 0.02;

/// A plan for executors of the pond's passes.
pub(super) struct Planned {
    pub(super) plan: PondPlan,
    /// What it was fitted with, in a sentence.
    pub(super) fit: String,
    /// The terms, for a plan that is there already; none of the paper's method, which is fitted to nothing.
    terms: Option<LowRank<f32>>,
}

impl Planned {
    /// Have `executor` run it: by numbers alone where `running`, which it runs so far, has room for the terms. Whether the plan is still that
    /// one, or one that was prepared.
    ///
    /// # Errors
    /// Those of the executor.
    pub(super) fn start(
        self,
        running: Option<PondPlan>,
        executor: &mut dyn Executor,
    ) -> Result<(Self, bool), PondError> {
        if let (Some(terms), Some(mut plan)) = (&self.terms, running) {
            match terms.refit(&mut plan, executor) {
                Ok(()) => return Ok((Self { plan, ..self }, true)),
                Err(
                    PondError::Room { .. } | PondError::OtherKernels { .. } | PondError::OtherGrid { .. },
                ) => {}
                Err(error) => return Err(error),
            }
        }
        executor.prepare(&self.plan.plan)?;
        Ok((self, false))
    }
}

/// Room for states and offsets of other light, which is memory and no time.
const STATES: usize = 1 << 16;
const OFFSETS: usize = 1 << 12;

/// What is asked of terms that do not reach what they were to, by what they reached: it depends a little on what is asked.
const WITH_ROOM: f64 = 1.1;

/// A method, made for what a job has.
pub(super) enum Method {
    /// A plan.
    Plan(Box<Planned>),
    /// No plan: computed by this program; and why, if it could have been one.
    Host(Floors, String),
}

impl Method {
    fn of(planned: Planned) -> Self {
        Self::Plan(Box::new(planned))
    }
}

/// What a method was made for, which another job may or may not share.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MadeFor {
    choices: Choices,
    /// Of methods that take no other light afterwards.
    light_direction: Option<[f64; 3]>,
}

impl MadeFor {
    /// What a method for this job is made for.
    pub(super) fn of(job: &FloorJob) -> Self {
        // Plans and photons are told of the light, frame by frame.
        let takes_light = job.choices.floor.is_plan();
        let light_direction = (!takes_light).then_some(job.pond.light_direction);
        Self { choices: job.choices, light_direction }
    }
}

/// Whether so many values unlike those that a method was fitted to are too many, by their share.
pub(super) fn is_unlike(outside: f64) -> bool {
    outside > TOO_MANY
}

/// The job's surface, and what the next pebbles may make of it.
fn examples(job: &FloorJob) -> Result<Vec<HeightField>, PondError> {
    let basin = &job.basin;
    let extent_m = basin.extent_m;
    let through_s = extent_m[0].hypot(extent_m[1]) / basin.ripple.front_m_s;
    let highest_m = job.waves.impulses.iter().fold(job.amplitude_m, |m, i| m.max(i.amplitude_m.abs()));
    let splash = Impulse {
        position_m: extent_m.map(|side| side / 2.0),
        start_s: 0.0,
        amplitude_m: (MEETING * highest_m).min(0.5 * job.pond.depth_m),
    };
    let to_come = AGES.iter().map(|age| {
        impulse_heights(job.samples(), extent_m, &basin.ripple, &[splash], basin.walls, age * through_s)
    });
    std::iter::once(job.surface()).chain(to_come).collect()
}

/// The method of a job that is no `photon`, in whichever way costs this processor less.
///
/// # Errors
/// Those of the method.
pub(super) fn method(job: &FloorJob) -> Result<Method, PondError> {
    let choice = &job.choices.floor;
    if !choice.is_plan() {
        let floors = choice.without_plan(&examples(job)?, &job.pond, false)?;
        return Ok(Method::Host(floors, String::new()));
    }
    if choice.method == PondMethod::Convolution {
        return plan(job).map(Method::of);
    }
    let lobe = choice.lobe_sum::<f32>(&examples(job)?, &job.pond)?;
    match lobe.into_terms() {
        Ok(terms) => of_terms(terms, job).map(Method::of),
        Err(lobe) => Ok(Method::Host((*lobe).into(), "splatted, lobe by lobe: no plan".into())),
    }
}

/// The method of a job that is one of the pond's plans, as a plan, whatever it costs.
///
/// # Errors
/// Those of the method.
pub(super) fn plan(job: &FloorJob) -> Result<Planned, PondError> {
    let (choice, pond) = (&job.choices.floor, &job.pond);
    if choice.method == PondMethod::Convolution {
        let plan = choice.convolution::<f32>(&job.surface()?, pond)?.plan(&settings(job, Room::default()))?;
        return Ok(Planned { plan, fit: "the paper's three terms".into(), terms: None });
    }
    let examples = examples(job)?;
    let mut settings = LowRankSettings::default();
    let terms = loop {
        match LowRank::new(&examples, pond, settings) {
            // A low sun: as near as that many terms come. The panel says how near that is.
            Err(PondError::Terms { reached, .. }) if reached < 1.0 => {
                settings.target_error = WITH_ROOM * reached.max(settings.target_error);
            }
            terms => break terms?,
        }
    };
    of_terms(terms, job)
}

fn of_terms(terms: LowRank<f32>, job: &FloorJob) -> Result<Planned, PondError> {
    let report = terms.report();
    let fit = format!("{} terms for {:.2} % of such waves", report.terms, 100.0 * report.error);
    // For the next fits. Room for terms takes time in each frame, every other one next to none: they are transformed in pairs.
    let room = Room { terms: (report.terms + 1).next_multiple_of(2), states: STATES, offsets: OFFSETS };
    Ok(Planned { plan: terms.plan(&settings(job, room))?, fit, terms: Some(terms) })
}

/// Plans with heights of impulses, and a picture.
fn settings(job: &FloorJob, room: Room) -> PlanSettings {
    let heights = HeightSource::Impulses { capacity: job.basin.capacity, distance_levels: None };
    PlanSettings { heights, picture: Some(job.basin.white_xyz), room, ..PlanSettings::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustic_heightfield::{FloorGrid, exact, relative_rms};
    use frame_plan::cpu::CpuExecutor;

    use crate::pond::pebbles::Waves;
    use crate::pond::view::tests::view;
    use crate::subject::Subject;

    impl Planned {
        fn terms(&self) -> usize {
            self.terms.as_ref().expect("low-rank").report().terms
        }
    }

    fn job_under(sun: [f64; 2]) -> FloorJob {
        let mut view = view("--map 64");
        view.pebbles.drop_at([0.4, 0.6]);
        view.pebbles.advance(0.6);
        view.sun.drag(sun);
        view.job([1, 1])
    }

    fn terms(job: &FloorJob) -> Result<LowRank<f32>, PondError> {
        LowRank::new(&examples(job).expect("waves"), &job.pond, LowRankSettings::default())
    }

    /// A sun that moves a little: its terms go into the plan that runs, and nothing is made. One that moves far needs more than there is
    /// room for.
    #[test]
    fn a_dragged_sun_is_numbers_in_the_plan_that_runs() {
        let mut cpu = CpuExecutor::new(caustic_heightfield::PASSES, Some(2)).expect("a CPU");
        let high = job_under([0.0, 0.0]);
        let planned = plan(&high).expect("a plan");
        let of_high = planned.terms();
        let (running, kept) = planned.start(None, &mut cpu).expect("prepared");
        assert!(!kept);
        let made = cpu.made();
        let near = job_under([0.1, 0.0]);
        let (running, kept) =
            plan(&near).expect("a plan").start(Some(running.plan), &mut cpu).expect("numbers");
        assert!(kept && cpu.made() == made, "{} terms after {}", running.terms(), of_high);
        let mut error = |job: &FloorJob| {
            let Waves { impulses, time_s } = &job.waves;
            let (ripple, walls) = (&job.basin.ripple, job.basin.walls);
            running.plan.write_impulses(&mut cpu, ripple, impulses, walls, *time_s).expect("written");
            cpu.execute().expect("a frame");
            let surface = near.surface().expect("waves");
            let expected = exact(&surface, &near.pond, FloorGrid::below(&surface)).expect("a floor");
            let frame = running.plan.read(&mut cpu).expect("a floor");
            relative_rms(&frame.light.irradiance, &expected.irradiance)
        };
        assert!(error(&near) < 0.015, "{}", error(&near));
        // Control: another moment's waves.
        let later = FloorJob {
            waves: Waves { time_s: near.waves.time_s + 0.1, ..near.waves.clone() },
            ..near.clone()
        };
        assert!(error(&later) > 0.02, "{}", error(&later));
        let low = job_under([-5.0, 0.0]);
        let (_, kept) = plan(&low).expect("a plan").start(Some(running.plan), &mut cpu).expect("prepared");
        assert!(!kept && cpu.made() != made);
    }

    #[test]
    fn a_low_sun_has_the_terms_there_may_be() {
        let high = job_under([0.0, 0.0]);
        let of_high = terms(&high).expect("few terms").report().terms;
        assert!(plan(&high).expect("a plan").fit.starts_with(&format!("{of_high} terms")));
        let low = job_under([-5.0, 0.0]);
        assert!(matches!(terms(&low), Err(PondError::Terms { .. })), "this sun asks for too little");
        let fit = plan(&low).expect("a plan").fit;
        assert!(fit.contains(" terms for 1.") || fit.contains(" terms for 2."), "{fit}");
    }
}
