//! The peers, from the package registries into `target/peers`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::apt::{self, Packages};
use crate::bench::python;
use crate::{paths, unpacked};

/// As they were raced.
const WHEELS: [&str; 3] = ["mitsuba==3.9.*", "pyluxcore==2.11.*", "numpy"];

/// Dr.Jit compiles with it; its Debian versions 14 and 15 abort.
const LLVM: Packages = Packages { wanted: &["libllvm19"], welcome: &[] };

/// What tells Dr.Jit which LLVM to take.
const LLVM_PATH: &str = "DRJIT_LIBLLVM_PATH";

/// An installation.
pub(super) struct Peers {
    python: PathBuf,
    llvm: OsString,
}

impl Peers {
    /// Install what is not there yet.
    ///
    /// # Errors
    /// Names what is missing: Python, its `venv`, pip, an LLVM, or a way to the registries.
    pub(super) fn install() -> Result<Self> {
        let folder = paths::target().join("peers");
        let python = python::with(&WHEELS, &folder.join("python"))?;
        let llvm = match std::env::var_os(LLVM_PATH) {
            Some(set) => set,
            None => llvm(&folder.join("llvm"))?.into(),
        };
        Ok(Self { python, llvm })
    }

    /// A script of ours under the peers' Python.
    pub(super) fn command(&self, script: &Path) -> Command {
        let mut command = Command::new(&self.python);
        command.arg("-u").arg(script).env(LLVM_PATH, &self.llvm);
        command
    }
}

fn llvm(folder: &Path) -> Result<PathBuf> {
    let library = || {
        let is_it = |path: &PathBuf| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("libLLVM.so."))
        };
        unpacked::files_under(folder).into_iter().find(is_it)
    };
    if library().is_none() {
        eprintln!("fetching {} into {}", LLVM.wanted.join(", "), folder.display());
        unpacked::create(folder, |partial| apt::fetch(partial, &LLVM)).with_context(|| {
            format!("Mitsuba needs an LLVM of version 16 or later: set {LLVM_PATH} to its library")
        })?;
    }
    library().context("the LLVM package holds no libLLVM.so")
}
