//! Which adapters load, asked in a child process: the loader reads its environment once.

use std::env;
use std::process::Command;

use anyhow::{Context, Result};

use crate::unpacked::Environment;

/// Adapters that a process with `environment` sees; empty if none loads, or if the driver takes its process down.
///
/// # Errors
/// If this program cannot start itself.
pub(super) fn adapters(environment: &Environment) -> Result<Vec<String>> {
    let program = env::current_exe().context("where this program lies is unknown")?;
    let output = Command::new(&program)
        .args(["driver", "--probe"])
        .envs(environment.iter().map(|(name, value)| (name, value)))
        .output()
        .with_context(|| format!("cannot start {}", program.display()))?;
    if !output.status.success() {
        return Ok(Vec::new());
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect())
}

/// The child's side: one line an adapter.
pub(super) fn print_adapters() {
    for adapter in asm_wgpu::adapters() {
        println!("{adapter}");
    }
}
