//! `cargo xtask bench`: the tables 2 and 3 of Blanchette & Agu 2013, and moving frames, measured here on every executor;
//! with `--peers` the race against other renderers, with `--pond` table 1 of Trendall & Stewart 2000, with `--pond-scipy` the
//! race of the pond against SciPy, with `--prt` spectral against RGB frames of relit surfaces.
//!
//! What is compared is measured in turns, in one run, on one device: shared machines slow down and speed up, ratios stay.

mod coverage;
mod frames;
mod moving;
mod objects;
mod peers;
mod pond;
mod prt;
mod python;
mod report;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use asm_core::{Method, Settings};
use frame_plan::{ExecuteError, Executor};
use spectral_cli::values::Size;
use xtask::executors::{self, Candidate};

use crate::driver::{self, Drivers};
use crate::paths;
use report::{ExecutorTables, Report};

/// Measure milliseconds per frame: five objects by three methods, cost against the share of the light's view, 300 moving frames.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// An executor: cpu, wgpu or vulkan; all of them by default. May be repeated.
    #[arg(long = "executor", value_name = "ID")]
    executors: Vec<String>,
    /// An object of the first table, by its scene's name; all five by default. May be repeated.
    #[arg(long = "object", value_name = "SCENE")]
    objects: Vec<String>,
    /// Pixels across and down a frame.
    #[arg(long, default_value = "640x360")]
    size: Size,
    /// How often each is measured; the median counts.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Where the report goes.
    #[arg(long, value_name = "DIR", default_value_os_t = paths::target().join("bench"))]
    out: PathBuf,
    /// Instead: race Mitsuba 3 and LuxCore to equal error; they are installed from the package registries into target/peers.
    #[arg(long)]
    peers: bool,
    /// Instead: frames per second of the pond per executor.
    #[arg(long, conflicts_with_all = ["peers", "pond_scipy"])]
    pond: bool,
    /// Samples of the pond on a side, 128 and 256 by default. May be repeated.
    #[arg(long = "pond-size", value_name = "N", requires = "pond", default_values_t = [128, 256],
          value_parser = clap::value_parser!(u32).range(8..=8192))]
    pond_sizes: Vec<u32>,
    /// Instead: race SciPy's fftconvolve on the pond; it is installed from the package registry into target/peers.
    #[arg(long, conflicts_with = "peers")]
    pond_scipy: bool,
    /// Instead: frames of relit surfaces, spectral against RGB.
    #[arg(long, conflicts_with_all = ["peers", "pond", "pond_scipy"])]
    prt: bool,
    /// Most seconds of a peer's picture; what takes longer is extrapolated.
    #[arg(long, default_value_t = 60.0, value_name = "SECONDS", requires = "peers")]
    peer_seconds: f64,
}

/// A method with a number of wavelengths: a column.
#[derive(Clone, Copy)]
struct Column {
    name: &'static str,
    method: Method,
    wavelengths: u32,
}

/// The columns of the paper's Table 2. Ratios are to the first.
const COLUMNS: [Column; 3] = [
    Column { name: "ACM", method: Method::Acm, wavelengths: 1 },
    Column { name: "ASM 7", method: Method::Asm, wavelengths: 7 },
    Column { name: "ASM 21", method: Method::Asm, wavelengths: 21 },
];

impl Column {
    fn settings(self) -> Settings {
        Settings { wavelengths: Some(self.wavelengths), ..Settings::of(self.method) }
    }
}

/// Measure, write `bench.json` and `bench.md`, print the tables.
///
/// # Errors
/// Unknown names, an unwritable folder, an executor that fails on the way.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    if args.pond {
        return pond::table_1::run(args);
    }
    if args.prt {
        return prt::run(args);
    }
    if args.peers {
        return peers::run(args);
    }
    if args.pond_scipy {
        return pond::run(args);
    }
    let Some(missing) = driver::in_environment() else {
        return driver::restart(Drivers::One);
    };
    let objects = objects::named(&args.objects)?;
    let candidates = executors::named(&args.executors)?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot create {}", args.out.display()))?;
    let mut report =
        Report { size: args.size, rounds: args.rounds, executors: Vec::new(), skipped: Vec::new() };
    for candidate in candidates {
        match open(candidate) {
            Ok(turns) => report.executors.push(tables(turns, &objects, args).context(candidate.id)?),
            Err(ExecuteError::NoDevice { reason, .. }) => {
                let hint = if missing.is_empty() { String::new() } else { format!("; {missing}") };
                eprintln!("{}: skipped: {reason}{hint}", candidate.id);
                report.skipped.push((candidate.id.to_owned(), reason));
            }
            Err(error) => bail!(error),
        }
    }
    println!("{}", report.write(&args.out)?);
    Ok(ExitCode::SUCCESS)
}

/// One executor per column, so that columns can take turns without being prepared anew.
type Turns = [Box<dyn Executor>; COLUMNS.len()];

fn open(candidate: &Candidate) -> Result<Turns, ExecuteError> {
    Ok([(candidate.open)(None)?, (candidate.open)(None)?, (candidate.open)(None)?])
}

fn tables(mut turns: Turns, objects: &[objects::Subject], args: &Args) -> Result<ExecutorTables> {
    let device = turns[0].info().clone();
    eprintln!("{}: {}, {}", device.executor, device.device, device.driver);
    let objects = objects::measure(&mut turns, objects, args)?;
    let coverage = coverage::measure(&mut turns, args)?;
    let moving = moving::measure(&mut turns)?;
    Ok(ExecutorTables { device, objects, coverage, moving })
}
