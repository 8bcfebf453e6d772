//! `cargo xtask test`: every test of the workspace, with a Vulkan driver.

use std::env;
use std::ffi::OsString;
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result};

use crate::driver::{self, Driver};
use crate::paths;

/// Run every test, doc tests included, with nextest where it is installed.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A missing executor fails the tests instead of skipping some; always so where CI=true.
    #[arg(long)]
    require_all: bool,
    /// Further arguments for the test runner: names of tests to run, for instance.
    #[arg(last = true)]
    runner: Vec<OsString>,
}

/// Find a driver and run the tests; the exit code is the runner's.
///
/// # Errors
/// If cargo cannot be started.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let driver = driver::find_or_fetch(false)?;
    let require_all = args.require_all || runs_in_ci();
    if driver.adapters.is_empty() {
        eprintln!("warning: {}", driver.description);
        eprintln!("{}", if require_all { "GPU tests will fail" } else { "GPU tests are skipped" });
    } else {
        eprintln!("Vulkan driver: {} ({})", driver.description, driver.adapters.join(", "));
    }

    // A doc test is no nextest test; cargo's own runner does both in one go.
    let runs: &[&[&str]] = if has_nextest() {
        &[&["nextest", "run", "--workspace"], &["test", "--workspace", "--doc", "--quiet"]]
    } else {
        &[&["test", "--workspace"]]
    };
    for (i, arguments) in runs.iter().enumerate() {
        let extra = if i == 0 { args.runner.as_slice() } else { &[] };
        let mut command = cargo(&driver);
        if require_all {
            command.env_remove("SPECTRAL_ALLOW_SKIP");
        } else if driver.adapters.is_empty() {
            command.env("SPECTRAL_ALLOW_SKIP", "1");
        }
        let status = command.args(*arguments).args(extra).status().context("cannot start cargo")?;
        if !status.success() {
            return Ok(ExitCode::FAILURE);
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// CI services set `CI=true`; there nothing may be skipped.
pub(crate) fn runs_in_ci() -> bool {
    env::var_os("CI").is_some_and(|value| value == "true" || value == "1")
}

fn cargo(driver: &Driver) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .current_dir(paths::workspace_root())
        .envs(driver.environment.iter().map(|(name, value)| (name, value)))
        .stdin(Stdio::null());
    command
}

fn has_nextest() -> bool {
    Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["nextest", "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
