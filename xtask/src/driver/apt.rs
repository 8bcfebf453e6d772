//! Mesa's lavapipe from the distribution's packages, as any user: apt resolves and downloads, dpkg unpacks.
//!
//! apt works on a copy of the package database in which driver and loader are not installed, so it names
//! exactly what this machine lacks, whatever the release calls it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::tool;

/// What a Vulkan program needs: the software driver and the loader.
const WANTED: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];

/// Khronos' validation layer, which lets tests check every call; releases may lack it.
const WELCOME: &str = "vulkan-validationlayers";

/// A second C library under a running dynamic linker is a crash, so an upgrade of these is not taken along.
const NEVER_PRIVATE: [&str; 3] = ["libc6", "libc-bin", "libgcc-s1"];

/// Download and unpack into `folder`.
///
/// # Errors
/// No apt or dpkg, no network, or a package that the lists do not have.
pub(super) fn fetch(folder: &Path) -> Result<()> {
    tool::run(Command::new("apt-get").arg("--version"))?;
    tool::run(Command::new("dpkg-deb").arg("--version"))?;
    let work = folder.join("apt");
    let packages = Apt::new(&work, Lists::System)
        .and_then(|apt| apt.download())
        // Lists may be missing, as in most containers, or too old for what the mirror holds.
        .or_else(|_| {
            let apt = Apt::new(&work, Lists::Own)?;
            tool::run(apt.command().arg("update")).context("package lists")?;
            apt.download()
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
        let status = work.join("status");
        fs::write(&status, without_wanted(&fs::read_to_string("/var/lib/dpkg/status").unwrap_or_default()))?;
        let mut text = format!(
            "Dir::Cache \"{}\";\nDir::State::status \"{}\";\n\
             Debug::NoLocking \"true\";\nAPT::Sandbox::User \"root\";\nAPT::Keep-Downloaded-Packages \"true\";\n\
             Acquire::Languages \"none\";\nAcquire::Retries \"1\";\nAPT::Update::Error-Mode \"any\";\n\
             #clear APT::Update::Post-Invoke;\n#clear APT::Update::Post-Invoke-Success;\n",
            work.join("cache").display(),
            status.display(),
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

    /// What is missing, as package files.
    fn download(&self) -> Result<Vec<PathBuf>> {
        let install = |more: &[&str]| {
            let mut command = self.command();
            command.args(["--yes", "--no-install-recommends", "--download-only", "install"]);
            tool::run(command.args(WANTED).args(more))
        };
        install(&[WELCOME]).or_else(|_| install(&[]))?;
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

/// The package database without the packages we want, so that apt fetches them even where it thinks they are there.
fn without_wanted(status: &str) -> String {
    let wanted = |stanza: &&str| {
        let name = stanza.lines().find_map(|line| line.strip_prefix("Package: "));
        name.is_some_and(|name| WANTED.contains(&name.trim()) || name.trim() == WELCOME)
    };
    let kept: Vec<_> = status.split("\n\n").filter(|stanza| !wanted(stanza)).collect();
    kept.join("\n\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_wanted_packages_leave_the_database() {
        let status = "Package: bash\nStatus: ok\n\nPackage: libvulkan1\nArchitecture: amd64\n\n\
                      Package: libvulkan-dev\nDepends: libvulkan1\n";
        let kept = without_wanted(status);
        assert!(kept.contains("Package: bash") && kept.contains("Package: libvulkan-dev"), "{kept}");
        assert!(!kept.contains("Package: libvulkan1"), "{kept}");
    }
}
