//! Programs that other people wrote.

use std::env;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Result, anyhow, bail};

/// What came of a check that other people's programs are needed for.
pub(crate) enum Outcome {
    /// Nothing was wrong; what was said about it.
    Passed(String),
    /// Something was; what.
    Failed(String),
    /// The machine lacks what it takes; what.
    Skipped(String),
}

/// A program's path, if the shell would find it.
pub(crate) fn on_path(program: &str) -> Option<PathBuf> {
    // npm is a script on Windows.
    let endings: &[&str] = if cfg!(windows) { &[".exe", ".cmd"] } else { &[""] };
    let folders = env::var_os("PATH")?;
    let candidates = env::split_paths(&folders)
        .flat_map(|folder| endings.iter().map(move |ending| folder.join(format!("{program}{ending}"))));
    candidates.into_iter().find(|path| path.is_file())
}

/// The cargo that runs this program.
pub(crate) fn cargo() -> Command {
    Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Run a tool to its end and return what it printed.
///
/// # Errors
/// If it is missing or fails; the message carries the last line it printed.
pub(crate) fn run(command: &mut Command) -> Result<String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|e| anyhow!("{name} cannot be started ({e})"))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let stderr = String::from_utf8_lossy(&output.stderr);
    let last = stderr.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no message");
    bail!("{name} failed: {}", last.trim())
}
