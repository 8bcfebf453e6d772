//! `spectral view`: it starts the window's program beside it, and ends as that does.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::program::run;

/// The program alone in a folder of its own.
fn alone(folder: &Path) -> PathBuf {
    let program = folder.join(format!("spectral{}", std::env::consts::EXE_SUFFIX));
    fs::copy(env!("CARGO_BIN_EXE_spectral"), &program).expect("copied");
    program
}

#[test]
fn without_its_window_it_says_how_to_build_it() {
    let folder = tempfile::tempdir().expect("folder");
    run(Command::new(alone(folder.path())).args(["view", "sphere"])).failed(&[
        "spectral-viewer",
        "cargo build",
        "-p spectral-viewer",
    ]);
}

#[test]
fn a_command_line_that_makes_no_sense_starts_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let program = alone(folder.path());
    let view = |args: &str| run(Command::new(&program).arg("view").args(args.split_whitespace()));
    view("").bad_usage(&["SCENE", "spectral view --help"]);
    view("sphere --frames 0").bad_usage(&["--frames"]);
    view("sphere --screenshot a.png").bad_usage(&["--frames"]);
    view("sphere --map 0").bad_usage(&["--map"]);
    view("pond --precision fixed99").bad_usage(&["--precision", "fixed8"]);
}

#[cfg(unix)]
#[test]
fn arguments_and_status_are_passed_on() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("folder");
    let program = alone(folder.path());
    let window = folder.path().join("spectral-viewer");
    fs::write(&window, "#!/bin/sh\necho \"$@\"\nexit 7\n").expect("written");
    fs::set_permissions(&window, fs::Permissions::from_mode(0o755)).expect("executable");
    let run = run(Command::new(program).args(["view", "sphere", "--method", "acm", "--frames=3"]));
    assert_eq!((run.status, run.stdout.as_str()), (Some(7), "sphere --method acm --frames=3\n"));
}
