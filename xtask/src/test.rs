//! `cargo xtask test`: every test of the workspace, with a Vulkan driver, the window's under a virtual display, and the Khronos
//! validator over our glTF files.

use std::env;
use std::ffi::OsString;
use std::process::{ExitCode, Stdio};

use anyhow::{Context, Result};

use crate::driver::{self, Driver};
use crate::tool::{Outcome, cargo};
use crate::{gltf_validator, paths, window_test};

/// Run every test, doc tests included, with nextest where it is installed, and validate every scene as glTF.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A missing executor fails the tests instead of skipping some; always so where CI=true.
    #[arg(long)]
    require_all: bool,
    /// Further arguments for the test runner: names of tests to run, for instance.
    #[arg(last = true)]
    runner: Vec<OsString>,
}

/// Find a driver, run the tests and the validator; all must pass.
///
/// # Errors
/// If cargo cannot be started, or a scene not written.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let driver = driver::find_or_fetch(false)?;
    let require_all = args.require_all || runs_in_ci();
    if driver.adapters.is_empty() {
        eprintln!("warning: {}", driver.description);
        eprintln!("{}", if require_all { "GPU tests will fail" } else { "GPU tests are skipped" });
    } else {
        eprintln!("Vulkan driver: {} ({})", driver.description, driver.adapters.join(", "));
    }

    let passed = tests_pass(args, &driver, require_all)?;
    // What was left out is said last, where it is read.
    println!("tests: {}", if passed { "passed" } else { "FAILED" });
    let shown = if args.runner.is_empty() {
        window_test::run(&driver)?
    } else {
        Outcome::Skipped("only some tests were asked for".into())
    };
    let fine =
        [("window", shown), ("glTF files", gltf_validator::run()?)].map(|(what, outcome)| match outcome {
            Outcome::Passed(said) => {
                println!("{what}: passed; {said}");
                true
            }
            Outcome::Failed(said) => {
                println!("{what}: FAILED\n{said}");
                false
            }
            // No failure in CI either: what runs the tests needs Rust and nothing else.
            Outcome::Skipped(reason) => {
                println!("{what}: SKIPPED, NOT TESTED: {reason}");
                true
            }
        });
    Ok(if passed && fine == [true; 2] { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Run cargo's tests with the driver.
fn tests_pass(args: &Args, driver: &Driver, require_all: bool) -> Result<bool> {
    // A doc test is no nextest test; cargo's own runner does both in one go. One failure does not hide the others.
    let runs: &[&[&str]] = if has_nextest() {
        &[&["nextest", "run", "--workspace", "--no-fail-fast"], &["test", "--workspace", "--doc", "--quiet"]]
    } else {
        &[&["test", "--workspace", "--no-fail-fast"]]
    };
    for (i, arguments) in runs.iter().enumerate() {
        let extra = if i == 0 { args.runner.as_slice() } else { &[] };
        let mut command = cargo();
        command
            .current_dir(paths::workspace_root())
            .envs(driver.environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null());
        if require_all {
            command.env_remove("SPECTRAL_ALLOW_SKIP");
        } else if driver.adapters.is_empty() {
            command.env("SPECTRAL_ALLOW_SKIP", "1");
        }
        let status = command.args(*arguments).args(extra).status().context("cannot start cargo")?;
        if !status.success() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// CI services set `CI=true`; there nothing may be skipped.
pub(crate) fn runs_in_ci() -> bool {
    env::var_os("CI").is_some_and(|value| value == "true" || value == "1")
}

fn has_nextest() -> bool {
    cargo()
        .args(["nextest", "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
