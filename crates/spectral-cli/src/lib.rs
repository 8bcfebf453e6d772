//! The `spectral` program: scenes in; wavelength sets, baked irradiance, pictures and plans out.
//!
//! [`run`] is the whole program. [`output`] writes its files and is public so that reports can write the same ones;
//! [`values`] parses the command line's values. The window of `spectral view` is a program of its own, which takes its
//! [`view::ViewArgs`], its scenes and its ways to fail from here.

mod args;
pub mod backend;
mod bake;
mod caustics;
mod choices;
mod devices;
mod error;
mod export;
pub mod frame_time;
pub mod kept;
pub mod lamps;
pub mod layers;
mod matrices;
mod messages;
pub mod metrics;
pub mod net_error;
pub mod output;
pub mod picture;
mod plan;
mod pond;
mod prices;
mod progress;
mod prt;
mod reference;
mod render;
mod run_options;
mod scene_argument;
mod stats;
mod targets;
pub mod values;
pub mod view;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

pub use choices::{Backend, Basis, GAP_FILLINGS, Method, PondMethod, Precision};
pub use error::CliError;
pub use pond::floors::{Floor, FloorChoice, Floors};
pub use prt::differences::{Differences, differences};
pub use prt::environment::Environment;
pub use prt::relit_view::{RelitRequest, RelitView};
pub use scene_argument::{Opened, open};

use args::{Cli, Command};

/// Exit status of a command line that makes no sense.
const BAD_USAGE: u8 = 2;

/// Run the program: 0 done, 1 failed, 2 bad usage. Failures are one or two lines on standard error.
#[must_use]
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    run_program(&args, |cli: &Cli| dispatch(&cli.command, &args))
}

/// Run a program with the command line `P`: what its `work` returns, 1 if that failed, 2 for bad usage. Failures are one or two
/// lines on standard error.
#[must_use]
pub fn run_program<P: Parser>(
    args: &[OsString],
    work: impl FnOnce(&P) -> Result<ExitCode, CliError>,
) -> ExitCode {
    let cli = match P::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return report_parse_error::<P>(&error, args.get(1)),
    };
    match work(&cli) {
        Ok(status) => status,
        Err(CliError::OutputClosed) => ExitCode::SUCCESS,
        Err(error @ CliError::Usage(_)) => report(&error, BAD_USAGE),
        Err(error @ CliError::Failed(_)) => report(&error, 1),
    }
}

fn dispatch(command: &Command, arguments: &[OsString]) -> Result<ExitCode, CliError> {
    match command {
        Command::Matrices(args) => matrices::run(args),
        Command::Bake(args) => bake::run(args),
        Command::Devices(args) => devices::run(args),
        Command::Export(args) => export::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Pond(args) => pond::run(args),
        Command::Prt(args) => prt::run(args),
        Command::Render(args) => render::run(args),
        Command::View(_) => return view::start(&arguments[2..]),
    }
    .map(|()| ExitCode::SUCCESS)
}

fn report(error: &CliError, status: u8) -> ExitCode {
    messages::complain(&format!("error: {error}"));
    ExitCode::from(status)
}

/// Help and version as clap prints them; errors as one line, and a second that says where to read on.
fn report_parse_error<P: Parser>(error: &clap::Error, command: Option<&OsString>) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = error.print();
            return ExitCode::from(BAD_USAGE);
        }
        _ => {}
    }
    let text = error.render().to_string();
    let problem = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect::<Vec<_>>()
        .join(" ");
    let program = P::command();
    let command =
        command.and_then(|name| name.to_str()).filter(|name| program.find_subcommand(name).is_some());
    let words: Vec<&str> = [program.get_name()].into_iter().chain(command).chain(["--help"]).collect();
    let help = words.join(" ");
    messages::complain(&format!("{problem}\nsee: {help}"));
    ExitCode::from(BAD_USAGE)
}
