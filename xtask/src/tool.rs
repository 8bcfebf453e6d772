//! Programs that other people wrote.

use std::process::Command;

use anyhow::{Result, anyhow, bail};

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
