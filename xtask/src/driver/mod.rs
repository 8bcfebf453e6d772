//! `cargo xtask driver`: a Vulkan driver for `compare` and `test`, found or fetched, asking for nothing.
//!
//! The system's drivers come first. Where none loads, a private copy of a software driver goes into
//! `target/driver`: Mesa's lavapipe through the distribution's own packages ([`crate::apt`]), or SwiftShader
//! through npm ([`npm`]). Whatever was found is tried in a child process before it counts, because the
//! Vulkan loader reads its environment once and a broken driver may take its process down.

mod npm;
mod private_copy;
mod probe;
pub(crate) mod second;

use std::env;
use std::path::Path;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result};

use crate::apt::{self, Packages};
use crate::paths;
use crate::unpacked::Environment;
use private_copy::PrivateCopy;

/// What a machine without any driver is told.
const REMEDY: &str = "install a Vulkan driver and loader: mesa-vulkan-drivers libvulkan1 (Debian, Ubuntu), \
     mesa-vulkan-drivers vulkan-loader (Fedora), vulkan-swrast vulkan-icd-loader (Arch, Alpine)";

/// Set for a process that has a driver's variables from its start: why there is no driver, or empty.
const MISSING: &str = "SPECTRAL_XTASK_DRIVER";

/// Find a Vulkan driver, or fetch Mesa's software driver into target/driver.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Fetch the private copy even where the system has a driver, and use that.
    #[arg(long)]
    fetch: bool,
    /// List the adapters that load in this very environment, for the parent process.
    #[arg(long, hide = true)]
    probe: bool,
}

/// What the machine has.
pub(crate) struct Driver {
    /// Where the driver comes from, or why there is none: one line.
    pub(crate) description: String,
    /// Adapters that answered, as the driver names them; empty if there is no driver.
    pub(crate) adapters: Vec<String>,
    /// What processes that use it must have in their environment.
    pub(crate) environment: Environment,
}

/// Print what was found or done.
///
/// # Errors
/// Only where this program cannot start itself; a machine without a driver is an exit code.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    if args.probe {
        probe::print_adapters();
        return Ok(ExitCode::SUCCESS);
    }
    let driver = find_or_fetch(args.fetch)?;
    if driver.adapters.is_empty() {
        eprintln!("error: {}", driver.description);
        return Ok(ExitCode::FAILURE);
    }
    println!("driver: {}", driver.description);
    for adapter in &driver.adapters {
        println!("adapter: {adapter}");
    }
    for (name, value) in &driver.environment {
        println!("environment: {name}={}", value.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// Why this process, which [`restart`] started, has no driver: empty if it has one. None if nobody has looked for one yet.
pub(crate) fn in_environment() -> Option<String> {
    env::var(MISSING).ok()
}

/// How many drivers a process is to have.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Drivers {
    /// Only the first.
    One,
    /// A second beside it, where it can be had.
    Two,
}

/// Start this program again with drivers in its environment: the Vulkan loader reads that once.
///
/// # Errors
/// Only where this program cannot start itself.
pub(crate) fn restart(drivers: Drivers) -> Result<ExitCode> {
    let mut driver = find_or_fetch(false)?;
    let available = !driver.adapters.is_empty();
    eprintln!("{}: {}", if available { "Vulkan driver" } else { "warning" }, driver.description);
    if drivers == Drivers::Two && available {
        let missing = match second::beside(&driver) {
            Ok(environment) => {
                driver.environment = environment;
                String::new()
            }
            Err(error) => format!("{error:#}"),
        };
        driver.environment.push(second::told(&missing));
    }
    let program = env::current_exe().context("where this program lies is unknown")?;
    let status = Command::new(&program)
        .args(env::args_os().skip(1))
        .envs(driver.environment.iter().map(|(name, value)| (name, value)))
        .env(MISSING, if available { "" } else { driver.description.as_str() })
        .status()
        .with_context(|| format!("cannot start {}", program.display()))?;
    Ok(match status.code() {
        Some(0) => ExitCode::SUCCESS,
        // Usage errors keep their code; whatever took the process down is a failure.
        Some(2) => ExitCode::from(2),
        _ => ExitCode::FAILURE,
    })
}

/// Find a driver that loads; with `fetch`, or where there is none, get a private copy.
///
/// # Errors
/// Only where this program cannot start itself. Not finding a driver is an answer, not an error.
pub(crate) fn find_or_fetch(fetch: bool) -> Result<Driver> {
    let folder = paths::target().join("driver");
    if !fetch {
        if let Some(driver) = loaded("the system's".into(), Vec::new())? {
            return Ok(driver);
        }
        for source in &SOURCES {
            if let Ok(copy) = PrivateCopy::open(&folder.join(source.name))
                && let Some(driver) = loaded(source.description(&copy), copy.environment())?
            {
                return Ok(driver);
            }
        }
    }
    let mut problems = Vec::new();
    for source in &SOURCES {
        match source.fetch(&folder) {
            Ok(copy) => match loaded(source.description(&copy), copy.environment())? {
                Some(driver) => return Ok(driver),
                None => problems.push(format!("{} was fetched but does not load", source.name)),
            },
            Err(error) => problems.push(format!("{}: {error:#}", source.name)),
        }
    }
    let description = format!("no Vulkan driver ({}); {REMEDY}", problems.join("; "));
    Ok(Driver { description, adapters: Vec::new(), environment: quiet() })
}

/// The driver that processes with these variables have, if one loads.
fn loaded(description: String, mut environment: Environment) -> Result<Option<Driver>> {
    environment.extend(quiet());
    let adapters = probe::adapters(&environment)?;
    Ok((!adapters.is_empty()).then_some(Driver { description, adapters, environment }))
}

/// Mesa's device-select layer prints errors about desktops that are not there.
fn quiet() -> Environment {
    vec![("NODEVICE_SELECT", "1".into())]
}

/// A software driver that can be fetched without rights.
struct Source {
    /// Name in messages, and of its folder.
    name: &'static str,
    /// Downloads and unpacks into an empty folder.
    fetch: fn(&Path) -> Result<()>,
}

/// What a Vulkan program needs: the software driver and the loader. Khronos' validation layer lets tests check every call.
const LAVAPIPE: Packages =
    Packages { wanted: &["mesa-vulkan-drivers", "libvulkan1"], welcome: &["vulkan-validationlayers"] };

const SWIFTSHADER: Source = Source { name: "swiftshader", fetch: npm::fetch };

const SOURCES: [Source; 2] =
    [Source { name: "lavapipe", fetch: |folder| apt::fetch(folder, &LAVAPIPE) }, SWIFTSHADER];

impl Source {
    /// A new private copy.
    fn fetch(&self, folder: &Path) -> Result<PrivateCopy> {
        if !cfg!(target_os = "linux") {
            anyhow::bail!("can be fetched on Linux only");
        }
        let root = folder.join(self.name);
        eprintln!("fetching {} into {}", self.name, root.display());
        PrivateCopy::create(&root, self.fetch)
    }

    fn description(&self, copy: &PrivateCopy) -> String {
        format!("{}, private copy in {}", self.name, copy.root().display())
    }
}
