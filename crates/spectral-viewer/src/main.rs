//! The `spectral-viewer` program, which `spectral view` starts; see the library for what it does.

use std::env;
use std::process::ExitCode;

fn main() -> ExitCode {
    spectral_viewer::run(env::args_os())
}
