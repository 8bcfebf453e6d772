//! Negative controls: a price list that finds no fault with a spoiled rung would find none with any.

use serde::Serialize;
use xtask::metrics::Metrics;
use xtask::sabotage::Sabotage;

use super::measure::{Climber, Course, Problem, Row};

/// A rung with its plan spoiled, which must be farther from the oracle than the plan as it was.
#[derive(Serialize)]
pub(super) struct Control {
    /// Scene, executor and rung, and what was spoiled.
    pub(super) name: String,
    /// It was found, as it must be.
    pub(super) failed: bool,
    /// How, or how not.
    pub(super) found: String,
}

/// Spoil the most accurate rung of an executor in every way that its plan has a place for.
pub(super) fn of_scene(course: &Course<'_>, rows: &[Row], climbers: &mut [Climber]) -> Vec<Control> {
    let Some(climber) = climbers.iter_mut().find(|climber| climber.runs()) else { return Vec::new() };
    let own = rows.iter().filter(|row| row.executor == climber.entry.name);
    let measured = own.filter_map(|row| Some((row, &row.outcome.as_ref()?.error)));
    let Some((row, plain)) = measured.min_by(|a, b| a.1.rms_64.total_cmp(&b.1.rms_64)) else {
        return Vec::new();
    };
    let Ok(plan) = climber.plan(course, &row.rung) else { return Vec::new() };
    let faults = Sabotage::ALL.map(|sabotage| (sabotage, sabotage.spoil(&plan)));
    let control = |(sabotage, spoiled): (Sabotage, _)| {
        let spoiled =
            climber.bake(&spoiled).and_then(|(maps, _)| course.error(&maps).map_err(Problem::Failed));
        let (failed, found) = verdict(plain, spoiled);
        let name = format!("{} {} {}: {}", row.scene, row.executor, row.rung, sabotage.description());
        Control { name, failed, found }
    };
    faults.into_iter().filter(|(_, spoiled)| *spoiled != plan).map(control).collect()
}

/// A row that was spoiled on purpose, against the same plan as it was on the same executor.
pub(super) fn of_spoiled(course: &Course<'_>, row: &Row, climber: &mut Climber) -> Option<Control> {
    let plain = climber.plan(course, &row.rung).and_then(|plan| climber.bake(&plan));
    let plain = plain.and_then(|(maps, _)| course.error(&maps).map_err(Problem::Failed)).ok()?;
    let spoiled = match (&row.outcome, &row.problem) {
        (Some(outcome), _) => Ok(outcome.error.clone()),
        (None, problem) => Err(problem.clone()?),
    };
    let (failed, found) = verdict(&plain, spoiled);
    Some(Control { name: format!("{} {} {}", row.scene, row.executor, row.rung), failed, found })
}

/// Whether a spoiled result is told from the plain one, and by what. A plan without one of its passes may be refused, and light of
/// which nothing is left cannot be compared: noticed as well.
fn verdict(plain: &Metrics, spoiled: Result<Metrics, Problem>) -> (bool, String) {
    let spoiled = match spoiled {
        Ok(spoiled) => spoiled,
        Err(problem) => return (true, problem.text().to_owned()),
    };
    let figures = [
        ("mean CIEDE2000", plain.delta_e_mean, spoiled.delta_e_mean),
        ("RMS of Y at 64 x 64", Some(plain.rms_64), Some(spoiled.rms_64)),
        ("RMS of Y", Some(plain.rms), Some(spoiled.rms)),
    ];
    let pairs = figures.into_iter().filter_map(|(name, plain, spoiled)| Some((name, plain?, spoiled?)));
    let worse = pairs.clone().find(|(_, plain, spoiled)| spoiled > plain);
    let shown =
        |(name, plain, spoiled): (&str, f64, f64)| format!("{name} {spoiled:.4}, unspoiled {plain:.4}");
    match worse {
        Some(worse) => (true, shown(worse)),
        None => (false, pairs.map(shown).collect::<Vec<_>>().join("; ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metrics(delta_e: f64, rms: f64) -> Metrics {
        Metrics {
            delta_e_mean: Some(delta_e),
            delta_e_p95: Some(delta_e),
            delta_e_rms: Some(delta_e),
            rms,
            rms_64: rms,
            total_y: 1.0,
        }
    }

    #[test]
    fn a_spoiled_rung_must_be_worse_in_something() {
        let plain = metrics(1.0, 0.1);
        assert!(verdict(&plain, Ok(metrics(2.0, 0.1))).0, "colour alone");
        assert!(verdict(&plain, Ok(metrics(1.0, 0.2))).0, "place alone");
        assert!(verdict(&plain, Err(Problem::Failed("black".into()))).0, "nothing left");
        assert!(!verdict(&plain, Ok(plain.clone())).0, "the same");
        assert!(!verdict(&plain, Ok(metrics(0.5, 0.05))).0, "better");
    }
}
