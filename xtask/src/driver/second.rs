//! A second Vulkan driver beside the first, where it can be had: two drivers round differently, and a comparison that sees only
//! one of them says little about the other.

use std::env;
use std::ffi::OsString;

use anyhow::{Context, Result, bail, ensure};

use super::{Driver, PrivateCopy, SWIFTSHADER, probe};
use crate::paths;
use crate::unpacked::Environment;

/// What the second driver's adapter is called, and no other's.
pub(crate) const ADAPTER: &str = "SwiftShader";

/// Variables that replace the drivers that the Vulkan loader finds; loaders before 1.3.207 know only the second.
const REPLACE: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// Adds to them, for loaders from 1.3.234 on.
const ADD: &str = "VK_ADD_DRIVER_FILES";

/// The environment in which `first` and SwiftShader both load. SwiftShader is fetched where it was not before.
///
/// # Errors
/// Why there is no second driver.
pub(super) fn beside(first: &Driver) -> Result<Environment> {
    let is_second = |adapter: &String| adapter.contains(ADAPTER);
    ensure!(!first.adapters.iter().any(is_second), "{ADAPTER} is the first already");
    let folder = paths::target().join("driver");
    let copy = PrivateCopy::open(&folder.join(SWIFTSHADER.name)).or_else(|_| SWIFTSHADER.fetch(&folder))?;
    let manifest = copy.manifest().into_os_string();
    let mut environment = first.environment.clone();
    let mut replaced = false;
    for name in REPLACE {
        let set = environment.iter().position(|(n, _)| *n == name).map(|i| environment.swap_remove(i).1);
        let Some(drivers) = set.or_else(|| env::var_os(name)) else { continue };
        let both = env::split_paths(&drivers).chain([copy.manifest()]);
        environment.push((name, env::join_paths(both).context("a driver's path has a colon in it")?));
        replaced = true;
    }
    if !replaced {
        environment.push((ADD, manifest));
    }
    let adapters = probe::adapters(&environment)?;
    if !adapters.iter().any(is_second) || !first.adapters.iter().all(|a| adapters.contains(a)) {
        bail!("{ADAPTER} does not load beside the first");
    }
    Ok(environment)
}

/// Set for a process that may have a second driver: why there is none, or empty.
const MISSING: &str = "SPECTRAL_XTASK_SECOND_DRIVER";

/// What tells a process why it has no second driver, or that it has.
pub(super) fn told(missing: &str) -> (&'static str, OsString) {
    (MISSING, missing.into())
}

/// Why this process has no second driver: empty if it has one.
pub(crate) fn in_environment() -> String {
    env::var(MISSING).unwrap_or_else(|_| "none was looked for".into())
}
