//! Python packages from the registry, in a virtual environment of their own.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::tool;

/// The Python of a folder with these packages, which are installed if it is not there yet.
///
/// # Errors
/// Names what is missing: Python, its `venv`, pip, or a way to the registry.
pub(super) fn with(wheels: &[&str], folder: &Path) -> Result<PathBuf> {
    let python = folder.join("bin/python");
    if python.is_file() {
        return Ok(python);
    }
    eprintln!("installing {} into {}", wheels.join(", "), folder.display());
    let base = tool::on_path("python3").context("this needs python3, with venv and pip")?;
    // Not into a partial folder first: the scripts of a virtual environment hold its path.
    let made = tool::run(Command::new(base).args(["-m", "venv"]).arg(folder))
        .context("python3 has no venv or pip")
        .and_then(|_| {
            let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
            tool::run(Command::new(&python).args(pip).args(wheels))
                .with_context(|| format!("pip cannot get {}", wheels.join(", ")))
        });
    match made {
        Ok(_) => Ok(python),
        Err(error) => {
            // A part of an installation would be taken for a whole one.
            let _ = std::fs::remove_dir_all(folder);
            Err(error)
        }
    }
}
