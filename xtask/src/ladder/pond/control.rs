//! Negative controls of the pond: a spoiled plan must be farther from the integral than the plan as it was.

use xtask::ponds::FloorDistance;
use xtask::sabotage::Sabotage;

use super::super::control::Control;
use super::super::measure::Problem;
use super::{Made, Pair, Reference, Row, Truth};

/// Spoil the most accurate rung against each reference in every way, on the executor of `pair`.
pub(super) fn of_pond(truth: &Truth, rows: &[Row], made: &[Made<'_>], pair: &mut Pair<'_>) -> Vec<Control> {
    let name = pair.name();
    let own: Vec<(&Row, &Made<'_>)> = rows.iter().filter(|row| row.executor == name).zip(made).collect();
    let mut controls = Vec::new();
    for reference in [Reference::Exact, Reference::ExactOverFacets] {
        let measured = own.iter().filter_map(|(row, made)| {
            let outcome = row.outcome.as_ref().filter(|_| row.reference == reference)?;
            Some((row, made, outcome.error))
        });
        let Some((row, made, plain)) = measured.min_by(|a, b| a.2.rms.total_cmp(&b.2.rms)) else { continue };
        let Ok(plan) = &made.plan else { continue };
        for sabotage in Sabotage::ALL {
            let spoiled = pair.error(truth, made.rung, &plan.spoiled(sabotage));
            let (failed, found) = verdict(plain, spoiled);
            let name = format!("{} {name} {}: {}", row.pond, row.rung, plan.fault(sabotage));
            controls.push(Control { name, failed, found });
        }
    }
    controls
}

/// A row that was spoiled on purpose, against the same plan as it was on the same executor.
pub(super) fn of_spoiled(truth: &Truth, row: &Row, made: &Made<'_>, pair: &mut Pair<'_>) -> Option<Control> {
    let plain = pair.error(truth, made.rung, made.plan.as_ref().ok()?).ok()?;
    let spoiled = match (&row.outcome, &row.problem) {
        (Some(outcome), _) => Ok(outcome.error),
        (None, problem) => Err(problem.clone()?),
    };
    let (failed, found) = verdict(plain, spoiled);
    Some(Control { name: format!("{} {} {}", row.pond, row.executor, row.rung), failed, found })
}

/// Whether a spoiled floor is told from the plain one, and by what. A plan without one of its passes may be refused, and a floor that is
/// black cannot be compared: noticed as well.
fn verdict(plain: FloorDistance, spoiled: Result<FloorDistance, Problem>) -> (bool, String) {
    match spoiled {
        Err(problem) => (true, problem.text().to_owned()),
        Ok(spoiled) => {
            (spoiled.rms > plain.rms, format!("RMS {:.4}, unspoiled {:.4}", spoiled.rms, plain.rms))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spoiled_floor_must_be_farther_away() {
        let at = |rms| FloorDistance { rms, total_y: 1.0 };
        assert!(
            verdict(at(0.01), Ok(at(0.02))).0 && verdict(at(0.01), Err(Problem::Failed("black".into()))).0
        );
        assert!(!verdict(at(0.01), Ok(at(0.01))).0, "the same");
        assert!(!verdict(at(0.01), Ok(at(0.005))).0, "nearer");
    }
}
