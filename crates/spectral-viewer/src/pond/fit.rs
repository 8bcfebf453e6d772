//! What a method is made for, and when it has to be made anew.

use caustic_heightfield::{
    HeightField, HeightSource, Impulse, LowRank, LowRankSettings, PlanSettings, PondError, PondPlan,
    impulse_heights,
};
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
}

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
    match lobe.terms() {
        Some(terms) => of_terms(terms, job).map(Method::of),
        None => Ok(Method::Host(lobe.into(), "splatted, lobe by lobe: no plan".into())),
    }
}

/// The method of a job that is one of the pond's plans, as a plan, whatever it costs.
///
/// # Errors
/// Those of the method.
pub(super) fn plan(job: &FloorJob) -> Result<Planned, PondError> {
    let (choice, pond) = (&job.choices.floor, &job.pond);
    if choice.method == PondMethod::Convolution {
        let plan = choice.convolution::<f32>(&job.surface()?, pond)?.plan(&settings(job))?;
        return Ok(Planned { plan, fit: "the paper's three terms".into() });
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
    of_terms(&terms, job)
}

fn of_terms(terms: &LowRank<f32>, job: &FloorJob) -> Result<Planned, PondError> {
    let report = terms.report();
    let fit = format!("{} terms for {:.2} % of such waves", report.terms, 100.0 * report.error);
    Ok(Planned { plan: terms.plan(&settings(job))?, fit })
}

/// Plans with heights of impulses, and a picture.
fn settings(job: &FloorJob) -> PlanSettings {
    let heights = HeightSource::Impulses { capacity: job.basin.capacity, distance_levels: None };
    PlanSettings { heights, picture: true, ..PlanSettings::default() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pond::view::tests::view;
    use crate::subject::Subject;

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
