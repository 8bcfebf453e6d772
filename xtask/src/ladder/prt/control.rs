//! Negative controls of relit figures: a spoiled plan, or a frame with a fault, must be farther from the reference.

use xtask::prt::{self, ColourDistance, Fault, spoiled};
use xtask::sabotage::Sabotage;

use super::super::control::Control;
use super::super::measure::{Climber, Problem};
use super::{Course, Made, Row};

/// Spoil the most accurate rung of an executor in every way that its plan has a place for, and give its frames every fault. They are held
/// against the figure in the rung's own colours, in f64: next to spectra, RGB is so far off that a fault may bring it nearer.
pub(super) fn of_figure(course: &Course, rows: &[Row], made: &[Made], climber: &mut Climber) -> Vec<Control> {
    let own = rows.iter().filter(|row| row.executor == climber.entry.name).zip(made);
    let measured = own.filter_map(|(row, made)| Some((row, made, row.outcome.as_ref()?.error)));
    let Some((row, made, _)) = measured.min_by(|a, b| a.2.cie94_mean.total_cmp(&b.2.cie94_mean)) else {
        return Vec::new();
    };
    let Ok((relighting, colours)) = climber.relighting(course, made, None) else { return Vec::new() };
    let lamp = course.lit(made.rung.bands).lamp;
    let truth = course.reference.xyz(&course.stage.paints(lamp, Some(colours)), course.factor);
    let distance = |xyz: Vec<[f32; 3]>| ColourDistance::of(&xyz, &truth, &course.reference);
    let plain = climber.prt_frame(course, made, colours, &relighting, &relighting.plan, None).map(distance);
    let mut controls = Vec::new();
    let mut note = |what: &str, (failed, found): (bool, String)| {
        let name = format!("{} {} {}: {what}", row.figure, row.executor, row.rung);
        controls.push(Control { name, failed, found });
    };
    let plain = match plain {
        Ok(plain) => plain,
        Err(problem) => {
            note("unspoiled", (false, problem.text().to_owned()));
            return controls;
        }
    };
    for sabotage in Sabotage::ALL {
        let plan = spoiled(&relighting.plan, sabotage);
        if plan != relighting.plan {
            let found = climber.prt_frame(course, made, colours, &relighting, &plan, None).map(distance);
            note(prt::fault(sabotage), verdict(plain, found));
        }
    }
    for fault in Fault::ALL {
        let found = climber.relighting(course, made, Some(fault)).and_then(|(relighting, colours)| {
            climber.prt_frame(course, made, colours, &relighting, &relighting.plan, Some(fault))
        });
        // A frame with a fault is a picture all the same.
        let refused = |problem: Problem| (false, problem.text().to_owned());
        note(fault.words(), found.map(distance).map_or_else(refused, |found| verdict(plain, Ok(found))));
    }
    controls
}

/// A row that was spoiled on purpose, against the same plan as it was on the same executor.
pub(super) fn of_spoiled(course: &Course, row: &Row, made: &Made, climber: &mut Climber) -> Option<Control> {
    let (relighting, colours) = climber.relighting(course, made, None).ok()?;
    let plain = climber.prt_frame(course, made, colours, &relighting, &relighting.plan, None).ok()?;
    let plain = course.distance(&plain);
    let spoiled = match (&row.outcome, &row.problem) {
        (Some(outcome), _) => Ok(outcome.error),
        (None, problem) => Err(problem.clone()?),
    };
    let (failed, found) = verdict(plain, spoiled);
    Some(Control { name: format!("{} {} {}", row.figure, row.executor, row.rung), failed, found })
}

/// Whether a spoiled picture is told from the plain one, and by what. A black one cannot be compared: noticed as well.
fn verdict(plain: ColourDistance, spoiled: Result<ColourDistance, Problem>) -> (bool, String) {
    match spoiled {
        Err(problem) => (true, problem.text().to_owned()),
        Ok(spoiled) => (
            spoiled.cie94_mean > plain.cie94_mean,
            format!("mean CIE94 {:.4}, unspoiled {:.4}", spoiled.cie94_mean, plain.cie94_mean),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spoiled_picture_must_be_farther_away() {
        let at = |cie94_mean| ColourDistance {
            cie94_mean,
            cie94_p95: 0.0,
            cie94_max: 0.0,
            delta_e_mean: 0.0,
            delta_e_p95: 0.0,
            rms: 0.0,
            xyz_max: 0.0,
        };
        assert!(verdict(at(0.1), Ok(at(0.2))).0 && verdict(at(0.1), Err(Problem::Failed("black".into()))).0);
        assert!(!verdict(at(0.1), Ok(at(0.1))).0, "the same");
        assert!(!verdict(at(0.1), Ok(at(0.05))).0, "nearer");
    }
}
