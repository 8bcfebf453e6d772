//! The `spectral` program: scenes in; wavelength sets, baked irradiance, pictures and plans out.
//!
//! [`run`] is the whole program. [`output`] writes its files and is public so that reports can write the same ones;
//! [`values`] parses the command line's values.

mod args;
mod backend;
mod bake;
mod caustics;
mod choices;
mod devices;
mod error;
mod export;
mod matrices;
mod messages;
pub mod output;
mod picture;
mod plan;
mod progress;
mod reference;
mod render;
mod run_options;
mod scene_argument;
mod stats;
mod targets;
pub mod values;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};

pub use error::CliError;

use args::{Cli, Command};

/// Exit status of a command line that makes no sense.
const BAD_USAGE: u8 = 2;

/// Run the program: 0 done, 1 failed, 2 bad usage. Failures are one or two lines on standard error.
#[must_use]
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(error) => return report_parse_error(&error, args.get(1)),
    };
    match dispatch(&cli.command) {
        Ok(()) | Err(CliError::OutputClosed) => ExitCode::SUCCESS,
        Err(error @ CliError::Usage(_)) => report(&error, BAD_USAGE),
        Err(error @ CliError::Failed(_)) => report(&error, 1),
    }
}

fn dispatch(command: &Command) -> Result<(), CliError> {
    match command {
        Command::Matrices(args) => matrices::run(args),
        Command::Bake(args) => bake::run(args),
        Command::Devices(args) => devices::run(args),
        Command::Export(args) => export::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Render(args) => render::run(args),
    }
}

fn report(error: &CliError, status: u8) -> ExitCode {
    messages::complain(&format!("error: {error}"));
    ExitCode::from(status)
}

/// Help and version as clap prints them; errors as one line, and a second that says where to read on.
fn report_parse_error(error: &clap::Error, command: Option<&OsString>) -> ExitCode {
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
    let command =
        command.and_then(|name| name.to_str()).filter(|name| Cli::command().find_subcommand(name).is_some());
    let help = command.map_or_else(|| "spectral --help".into(), |name| format!("spectral {name} --help"));
    messages::complain(&format!("{problem}\nsee: {help}"));
    ExitCode::from(BAD_USAGE)
}
