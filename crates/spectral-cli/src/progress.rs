//! A progress bar for long work: on a terminal, and silent in a pipe.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Steps of a bar: fine enough for the widest terminal.
const STEPS: u64 = 1_000;

/// Shows how far a task is; goes away when dropped.
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A task that reports its share done.
    pub(crate) fn bar(task: &str) -> Self {
        // Draws on standard error, and only where that is a terminal.
        let bar = ProgressBar::new(STEPS);
        let style = ProgressStyle::with_template("{msg} [{wide_bar}] {percent:>3} % {eta_precise}")
            .expect("the template is constant");
        bar.set_style(style.progress_chars("=> "));
        bar.set_message(task.to_owned());
        Self { bar }
    }

    /// A task that cannot say how far it is.
    pub(crate) fn spinner(task: &str) -> Self {
        let bar = ProgressBar::new_spinner();
        bar.set_message(task.to_owned());
        bar.enable_steady_tick(Duration::from_millis(100));
        Self { bar }
    }

    /// `done` of the task, 0 to 1, is done.
    pub(crate) fn set(&self, done: f64) {
        self.bar.set_position((done * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
