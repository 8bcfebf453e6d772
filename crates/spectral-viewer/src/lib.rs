//! The window of `spectral view`: a scene that one can turn, light and switch, with the time of every pass.
//!
//! Without a window, and so tested without one: what every window has set (`showing`), the pointer that drags (`hand`), who runs
//! plans (`runner`), the camera (`orbit`), times (`times`), and threads (`worker`). With one: the device and what it shows (`graphics`), the picture in it
//! (`screen`), who makes it (`maker`) and brings it to the host (`copy`), the controls (`panel`) and the window itself (`window`). What
//! is shown stands behind one seam (`subject`): a `scene`, the `pond`, or surfaces that are `relit`.
//!
//! A frame in which something moved only writes numbers; a change of method, wavelengths, sizes or executor prepares a new plan. The
//! wgpu executor runs on the window's device and inside its frames; the CPU's and Vulkan's pictures come from a thread of their own.

mod copy;
mod graphics;
mod hand;
mod maker;
mod orbit;
mod panel;
mod pond;
mod relit;
mod runner;
mod scene;
mod screen;
mod showing;
mod subject;
mod times;
mod window;
mod worker;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use spectral_cli::CliError;
use spectral_cli::view::{Subject, ViewArgs};

/// Show a scene in a window: orbit, drag the lamp, move the glass, switch methods; or the pond, or relit surfaces.
///
/// Scenes: drag turns the view, with Shift or the middle button it shifts it; Ctrl or the right button drags the lamp; the wheel zooms.
/// Keys: M method, N wavelengths, F gap filling, E executor, G glass moves, Space pause, Home back to the beginning.
/// The pond: a click drops a pebble; Ctrl or the right button drags the sun. Keys: M method, P precision, N wavelengths, E executor, Space, Home.
/// With --environment: drag turns the sky; Ctrl or the right button turns the view. Keys: L illuminant, M coefficients, N RGB, E executor, Space, Home.
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
    spectral_cli::run_program(&args, |cli: &Cli| show(&cli.args).map(|()| ExitCode::SUCCESS))
}

fn show(args: &ViewArgs) -> Result<(), CliError> {
    match args.subject()? {
        Subject::Scene(settings) => {
            let scene = spectral_cli::open(&args.scene)?.scene;
            let title = scene.name.clone();
            window::show(args, &title, |device, _| scene::View::new(scene, *settings, args, device))
        }
        Subject::Pond(pond) => {
            window::show(args, "pond", |device, wake| Ok(pond::View::new(*pond, args, device, wake)))
        }
        Subject::Relit(request) => {
            let stage = request.open()?;
            let title = stage.name.clone();
            window::show(args, &title, |device, wake| Ok(relit::View::new(stage, args, device, wake)))
        }
    }
}
