//! Why a command ended early, and with which exit status.

use std::io;
use std::path::Path;

use asm_core::PlanError;

/// A command that did not do what it was asked.
///
/// Messages are one or two lines: what was wrong, where, and what would be right.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The command line asks for something that does not exist or makes no sense; exit status 2.
    #[error("{0}")]
    Usage(String),
    /// The command line is fine and the work failed; exit status 1.
    #[error("{0}")]
    Failed(String),
    /// Whoever read our standard output has seen enough; not a failure.
    #[error("standard output was closed")]
    OutputClosed,
}

impl CliError {
    /// A usage error from anything that can say what was wrong.
    pub(crate) fn usage(problem: impl ToString) -> Self {
        Self::Usage(problem.to_string())
    }

    /// A failure from anything that can say what was wrong.
    pub(crate) fn failed(problem: impl ToString) -> Self {
        Self::Failed(without_error_number(&problem.to_string()))
    }

    /// What to say about a scene, settings or device that a plan was not built for.
    pub(crate) fn plan(error: PlanError) -> Self {
        match error {
            PlanError::Setting { .. } | PlanError::Wavelengths(_) => Self::usage(error),
            _ => Self::failed(error),
        }
    }

    /// A failure to write `path`, with what would help.
    pub(crate) fn write(path: &Path, error: &io::Error) -> Self {
        Self::Failed(format!("cannot write {}: {}", path.display(), reason(error)))
    }
}

/// The operating system's words for an error.
fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    let words = without_error_number(&text);
    if words == text { words } else { words.to_lowercase() }
}

/// A message without Rust's ` (os error 2)`.
fn without_error_number(text: &str) -> String {
    match text.split_once(" (os error ") {
        Some((before, after)) => {
            format!(
                "{before}{}",
                after.trim_start_matches(|c: char| c.is_ascii_digit()).trim_start_matches(')')
            )
        }
        None => text.to_owned(),
    }
}
