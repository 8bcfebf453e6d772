//! Packages of the distribution in a folder of ours, as any user: apt resolves and downloads, dpkg unpacks.
//!
//! What we ask for is downloaded even where it is installed, for there it does not work; what that depends on, where it is missing.
//! So apt names exactly what this machine lacks, whatever the release calls it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::tool;

/// What to fetch.
pub(crate) struct Packages {
    /// Without these there is no point.
    pub(crate) wanted: &'static [&'static str],
    /// Taken along where the release has them.
    pub(crate) welcome: &'static [&'static str],
}

/// A second C library under a running dynamic linker is a crash, so an upgrade of these is not taken along.
const NEVER_PRIVATE: [&str; 3] = ["libc6", "libc-bin", "libgcc-s1"];

/// Download and unpack into `folder`.
///
/// # Errors
/// No apt or dpkg, no network, or a package that the lists do not have.
pub(crate) fn fetch(folder: &Path, asked: &Packages) -> Result<()> {
    tool::run(Command::new("apt-get").arg("--version"))?;
    tool::run(Command::new("dpkg-deb").arg("--version"))?;
    let work = folder.join("apt");
    let packages = Apt::new(&work, Lists::System)
        .and_then(|apt| apt.download(asked))
        // Lists may be missing, as in most containers, or too old for what the mirror holds.
        .or_else(|_| {
            let apt = Apt::new(&work, Lists::Own)?;
            tool::run(apt.command().arg("update")).context("package lists")?;
            apt.download(asked)
        })?;
    for package in &packages {
        tool::run(Command::new("dpkg-deb").arg("-x").arg(package).arg(folder))?;
    }
    fs::remove_dir_all(&work)?;
    Ok(())
}

/// Which package lists to resolve with.
enum Lists {
    System,
    Own,
}

/// apt with its state in a folder of ours.
struct Apt {
    config: PathBuf,
    archives: PathBuf,
}

impl Apt {
    fn new(work: &Path, lists: Lists) -> Result<Self> {
        let archives = work.join("cache/archives");
        fs::create_dir_all(archives.join("partial"))?;
        fs::create_dir_all(work.join("lists/partial"))?;
        let mut text = format!(
            "Dir::Cache \"{}\";\n\
             Debug::NoLocking \"true\";\nAPT::Sandbox::User \"root\";\nAPT::Keep-Downloaded-Packages \"true\";\n\
             Acquire::Languages \"none\";\nAcquire::Retries \"1\";\nAPT::Update::Error-Mode \"any\";\n\
             #clear APT::Update::Post-Invoke;\n#clear APT::Update::Post-Invoke-Success;\n",
            work.join("cache").display(),
        );
        if let Lists::Own = lists {
            text += &format!("Dir::State::Lists \"{}\";\n", work.join("lists").display());
        }
        let config = work.join("apt.conf");
        fs::write(&config, text)?;
        Ok(Self { config, archives })
    }

    fn command(&self) -> Command {
        let mut command = Command::new("apt-get");
        command.arg("--quiet=2").arg("--config-file").arg(&self.config).env("LC_ALL", "C");
        command
    }

    /// What was asked for and what that lacks, as package files.
    fn download(&self, asked: &Packages) -> Result<Vec<PathBuf>> {
        let install = |more: &[&str]| {
            let mut command = self.command();
            command.args(["--yes", "--no-install-recommends", "--reinstall", "--download-only", "install"]);
            tool::run(command.args(asked.wanted).args(more))
        };
        install(asked.welcome).or_else(|_| install(&[]))?;
        let mut packages = Vec::new();
        for entry in fs::read_dir(&self.archives)? {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let package = name.split('_').next().unwrap_or_default();
            if name.ends_with(".deb") && !NEVER_PRIVATE.contains(&package) {
                packages.push(path);
            }
        }
        packages.sort();
        anyhow::ensure!(!packages.is_empty(), "apt-get downloaded nothing");
        Ok(packages)
    }
}
