//! Milliseconds per pass, as a person can read them.

use frame_plan::StepTime;

/// Share of the newest frame in what is shown.
const NEW: f64 = 0.2;

/// Times of a pass, over all its steps in a frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PassTime {
    /// The pass, or what else the step is.
    pub(crate) name: String,
    /// Steps in a frame.
    pub(crate) steps: usize,
    /// Milliseconds in a frame, a moving mean.
    pub(crate) milliseconds: f64,
}

/// Moving means per pass, in the order in which passes first run.
#[derive(Clone, Debug, Default)]
pub(crate) struct PassTimes(Vec<PassTime>);

impl PassTimes {
    /// Take in a frame's times. Where its steps are others than before, the means begin anew.
    pub(crate) fn add(&mut self, steps: &[StepTime]) {
        let mut frame: Vec<PassTime> = Vec::new();
        for step in steps {
            let name = pass_of(&step.name);
            match frame.iter_mut().find(|pass| pass.name == name) {
                Some(pass) => {
                    pass.steps += 1;
                    pass.milliseconds += step.milliseconds;
                }
                None => {
                    frame.push(PassTime { name: name.into(), steps: 1, milliseconds: step.milliseconds });
                }
            }
        }
        let same = frame.len() == self.0.len()
            && frame.iter().zip(&self.0).all(|(a, b)| (&a.name, a.steps) == (&b.name, b.steps));
        if same {
            for (mean, new) in self.0.iter_mut().zip(frame) {
                mean.milliseconds = moving_mean(mean.milliseconds, new.milliseconds);
            }
        } else {
            self.0 = frame;
        }
    }

    /// The passes.
    pub(crate) fn passes(&self) -> &[PassTime] {
        &self.0
    }

    /// The time of a pass by its name, if it runs and was measured.
    pub(crate) fn of(&self, pass: &str) -> Option<&PassTime> {
        self.0.iter().find(|time| time.name == pass)
    }

    /// All of a frame's steps, milliseconds.
    pub(crate) fn total(&self) -> f64 {
        self.0.iter().map(|pass| pass.milliseconds).sum()
    }
}

/// A mean that follows `new`.
pub(crate) fn moving_mean(mean: f64, new: f64) -> f64 {
    mean + NEW * (new - mean)
}

/// The pass of a step, whose name has a label in parentheses; clears and copies are put together by their first word.
fn pass_of(step: &str) -> &str {
    match step.split_once(' ') {
        Some((first, _)) => first,
        None => step,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(times: &[(&str, f64)]) -> Vec<StepTime> {
        times.iter().map(|&(name, milliseconds)| StepTime { name: name.into(), milliseconds }).collect()
    }

    #[test]
    fn steps_of_one_pass_are_added_up() {
        let mut times = PassTimes::default();
        times.add(&steps(&[
            ("clear map", 1.0),
            ("shade (lamp 0)", 2.0),
            ("clear picture", 3.0),
            ("shade (lamp 1)", 5.0),
        ]));
        let shade = times.of("shade").expect("measured");
        assert_eq!((shade.steps, shade.milliseconds), (2, 7.0));
        assert_eq!(times.passes()[0].name, "clear");
        assert_eq!(times.total(), 11.0);
        assert_eq!(times.of("gap_fill"), None);
    }

    #[test]
    fn means_follow_until_the_passes_change() {
        let mut times = PassTimes::default();
        times.add(&steps(&[("shade", 10.0)]));
        times.add(&steps(&[("shade", 20.0)]));
        assert!((times.total() - 12.0).abs() < 1e-12);
        times.add(&steps(&[("shade", 20.0), ("gap_fill", 1.0)]));
        assert_eq!(times.total(), 21.0);
        times.add(&[]);
        assert!(times.passes().is_empty());
    }
}
