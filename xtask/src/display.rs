//! A display that nobody sees: Xvfb, found or fetched, for tests that open windows.
//!
//! Without rights, Xvfb and the libraries that windows load go into `target/display` from the distribution's packages. Xvfb starts
//! `xkbcomp` from a folder that is compiled into it, so the private copy's is made relative, as is the folder it runs in.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

use crate::apt::{self, Packages};
use crate::unpacked::{self, Environment};
use crate::{paths, tool};

/// The server, what it needs for a keyboard, and what winit loads.
const PACKAGES: Packages = Packages {
    wanted: &[
        "xvfb",
        "xkb-data",
        "x11-xkb-utils",
        "libx11-6",
        "libx11-xcb1",
        "libxcursor1",
        "libxi6",
        "libxkbcommon-x11-0",
    ],
    welcome: &[],
};

/// What winit loads, as the dynamic linker names it.
const LIBRARIES: [&str; 5] =
    ["libX11.so.6", "libX11-xcb.so.1", "libXcursor.so.1", "libXi.so.6", "libxkbcommon-x11.so.0"];

/// In the private copy.
const SERVER: &str = "usr/bin/Xvfb";
const KEYBOARDS: &str = "usr/share/X11/xkb";

/// The folder of `xkbcomp` in Xvfb, and what it becomes: relative, and as long.
const COMPILED_IN: &[u8] = b"\0/usr/bin\0";
const RELATIVE: &[u8] = b"\0usr/bin\0\0";

/// What a machine without a display is told.
const REMEDY: &str = "install xvfb libxcursor1 libxi6 libxkbcommon-x11-0 (Debian, Ubuntu), \
     xorg-x11-server-Xvfb libXcursor libXi libxkbcommon-x11 (Fedora), \
     xorg-server-xvfb libxcursor libxi libxkbcommon-x11 (Arch)";

/// A running server; it ends with this.
pub(crate) struct Display {
    server: Child,
    /// Variables of processes that are to open windows on it.
    pub(crate) environment: Environment,
}

impl Display {
    /// Start one for processes with `environment`.
    ///
    /// # Errors
    /// What is missing, and what would help.
    pub(crate) fn start(environment: &Environment) -> Result<Self> {
        if !cfg!(target_os = "linux") {
            bail!("there is Xvfb on Linux only");
        }
        if let Some(server) = tool::on_path("Xvfb")
            && has_libraries()
        {
            return Self::run(&mut Command::new(server), environment.clone());
        }
        let root = paths::target().join("display");
        if !root.join(SERVER).is_file() {
            eprintln!("fetching Xvfb into {}", root.display());
            unpacked::create(&root, fetch).with_context(|| format!("no Xvfb ({REMEDY})"))?;
        }
        let mut environment = environment.clone();
        unpacked::put_libraries_first(&root, &mut environment);
        let mut server = Command::new(root.join(SERVER));
        Self::run(server.current_dir(&root).arg("-xkbdir").arg(root.join(KEYBOARDS)), environment)
    }

    fn run(server: &mut Command, mut environment: Environment) -> Result<Self> {
        let mut server = server
            // Standard output is told which display was free.
            .args(["-displayfd", "1", "-screen", "0", "1400x1000x24", "-nolisten", "tcp", "-noreset"])
            .envs(environment.iter().map(|(name, value)| (name, value)))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .context("Xvfb cannot be started")?;
        let mut number = String::new();
        if let Some(stdout) = server.stdout.take() {
            BufReader::new(stdout).read_line(&mut number)?;
        }
        if number.trim().is_empty() {
            let _ = server.kill();
            bail!("Xvfb ended at once ({})", server.wait()?);
        }
        environment.push(("DISPLAY", format!(":{}", number.trim()).into()));
        Ok(Self { server, environment })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// Whether the system has what windows load. Where there is no `ldconfig` to ask, opening one will tell.
fn has_libraries() -> bool {
    let known =
        ["ldconfig", "/sbin/ldconfig"].into_iter().find_map(|l| tool::run(Command::new(l).arg("-p")).ok());
    known.is_none_or(|known| LIBRARIES.iter().all(|library| known.contains(library)))
}

/// Download, unpack and make it run where it lies.
fn fetch(folder: &Path) -> Result<()> {
    apt::fetch(folder, &PACKAGES)?;
    let path: PathBuf = folder.join(SERVER);
    let server = fs::read(&path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(fs::write(&path, with_relative_tools(server)?)?)
}

/// The server with the folder of its tools relative.
fn with_relative_tools(mut server: Vec<u8>) -> Result<Vec<u8>> {
    let mut places = server.windows(COMPILED_IN.len()).enumerate().filter(|(_, bytes)| *bytes == COMPILED_IN);
    let (first, second) = (places.next().map(|(at, _)| at), places.next());
    ensure!(second.is_none(), "this Xvfb names /usr/bin more than once: which one is the folder of xkbcomp?");
    let at = first.context("this Xvfb has no /usr/bin in it: where does it look for xkbcomp?")?;
    server[at..at + RELATIVE.len()].copy_from_slice(RELATIVE);
    Ok(server)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_one_folder_becomes_relative() {
        let server = b"\x7fELF\0/usr/bin/env\0/usr/bin\0/usr/share\0".to_vec();
        let changed = with_relative_tools(server.clone()).unwrap();
        assert_eq!(changed, b"\x7fELF\0/usr/bin/env\0usr/bin\0\0/usr/share\0");
        assert!(with_relative_tools(changed).is_err());
        assert!(with_relative_tools([server.clone(), server].concat()).is_err());
    }
}
