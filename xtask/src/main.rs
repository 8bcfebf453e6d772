//! The project's own commands: `cargo xtask compare`, `ladder`, `bench`, `test`, `driver` and `gallery`, one file or folder each.

mod apt;
mod bench;
mod compare;
mod display;
mod driver;
mod gallery;
mod gltf_validator;
mod ladder;
mod paths;
mod test;
mod tool;
mod unpacked;
mod window_test;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Checks, comparisons and drivers of this workspace.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Bench(bench::Args),
    Compare(compare::Args),
    Driver(driver::Args),
    Gallery(gallery::Args),
    Ladder(ladder::Args),
    Test(test::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Bench(args) => bench::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Driver(args) => driver::run(&args),
        Command::Gallery(args) => gallery::run(&args),
        Command::Ladder(args) => ladder::run(&args),
        Command::Test(args) => test::run(&args),
    };
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        ExitCode::FAILURE
    })
}
