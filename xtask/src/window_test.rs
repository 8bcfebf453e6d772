//! The tests that open windows, under a display that nobody sees.

use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use crate::display::Display;
use crate::driver::Driver;
use crate::paths;
use crate::tool::{Outcome, cargo};

/// Run them with the driver.
///
/// # Errors
/// If cargo cannot be started.
pub(crate) fn run(driver: &Driver) -> Result<Outcome> {
    if driver.adapters.is_empty() {
        return Ok(Outcome::Skipped("there is no Vulkan driver to draw with".into()));
    }
    let display = match Display::start(&driver.environment) {
        Ok(display) => display,
        Err(problem) => return Ok(Outcome::Skipped(format!("{problem:#}"))),
    };
    // The whole workspace's features: another set would build wgpu anew. One at a time: there is one pointer.
    let mut command: Command = cargo();
    command
        .args(["test", "--workspace", "--test", "window", "--", "--ignored", "--test-threads=1"])
        .current_dir(paths::workspace_root())
        .envs(display.environment.iter().map(|(name, value)| (name, value)))
        .stdin(Stdio::null());
    let status = command.status().context("cannot start cargo")?;
    let said = format!("drawn by {}", driver.adapters.join(", "));
    Ok(if status.success() { Outcome::Passed(said) } else { Outcome::Failed(said) })
}
