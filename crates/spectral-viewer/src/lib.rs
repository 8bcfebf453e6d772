//! The window of `spectral view`: a scene that one can turn, light and switch, with the time of every pass.
//!
//! Without a window, and so tested without one: the camera (`orbit`), `lamps`, `glass`, the pointer that drags them (`hand`),
//! what the user has chosen (`choices`), all of it together (`view`), a picture to be made (`job`, with the `pose` that changes from frame to frame), its
//! times (`times`) and what became of its light (`fates`). With one: the device and what it shows (`graphics`), the picture in it
//! (`screen`) and who makes it (`maker`, and `worker` for executors with devices of their own), the controls (`panel`) and the
//! window itself (`window`).
//!
//! A frame in which something moved only writes numbers; a change of method, wavelengths, sizes or executor prepares a new plan. The
//! wgpu executor runs on the window's device and inside its frames; the CPU's and Vulkan's pictures come from a thread of their own.

mod choices;
mod fates;
mod glass;
mod graphics;
mod hand;
mod job;
mod lamps;
mod maker;
mod orbit;
mod panel;
mod pose;
mod screen;
mod times;
mod view;
mod window;
mod worker;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use spectral_cli::view::ViewArgs;

/// Show a scene in a window: orbit, drag the lamp, move the glass, switch methods.
///
/// Drag turns the view, with Shift or the middle button it shifts it; Ctrl or the right button drags the lamp; the wheel zooms.
/// Keys: M method, N wavelengths, F gap filling, E executor, G glass moves, Space pause, Home back to the beginning.
#[derive(Debug, Parser)]
#[command(name = "spectral-viewer", version)]
struct Cli {
    #[command(flatten)]
    args: ViewArgs,
}

/// Run the program until its window closes: 0 done, 1 failed, 2 bad usage. Failures are one or two lines on standard error.
#[must_use]
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    spectral_cli::run_program(&args, |cli: &Cli| window::show(&cli.args).map(|()| ExitCode::SUCCESS))
}
