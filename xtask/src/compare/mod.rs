//! `cargo xtask compare`: every executor on every scene with every method, against each other and the oracle.

mod bakes;
mod controls;
mod pictures;
mod ponds;
mod prt;
mod report;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use asm_core::{Method, Settings};
use clap::ValueEnum;
use frame_plan::{DeviceInfo, Executor};
use xtask::executor_entry::{ExecutorEntry, Status};
use xtask::executors::{Candidate, EXECUTORS, ON_SECOND_DRIVER, Opened};
use xtask::ponds::{PONDS, is_pond, named_ponds};
use xtask::prt::{PRT, is_prt, named_prt};
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;

use crate::driver::{self, Drivers, second};
use crate::{paths, test};
use report::Report;

/// Compare all executors with each other and with the oracle; writes report.html and report.json.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// A bundled scene, `bunny-glass`, a glTF file, `pond` or `prt`; all of them by default. May be repeated.
    #[arg(long = "scene", value_name = "SCENE")]
    scenes: Vec<String>,
    /// A method of scenes; all of them by default. May be repeated.
    #[arg(long = "method", value_name = "METHOD")]
    methods: Vec<MethodName>,
    /// Smaller maps, less oracle, and three scenes, one pond and one figure unless others are named.
    #[arg(long)]
    quick: bool,
    /// Spoil one executor's plan: the comparison must notice and end with status 1.
    #[arg(long)]
    sabotage: Option<Sabotage>,
    /// Where the report goes.
    #[arg(long, value_name = "DIR", default_value_os_t = paths::target().join("compare"))]
    out: PathBuf,
}

/// Methods by the names that `spectral --method` takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum MethodName {
    CausticsMap,
    Acm,
    Asm,
    Footprint,
}

impl MethodName {
    const fn method(self) -> Method {
        match self {
            Self::CausticsMap => Method::CausticsMap,
            Self::Acm => Method::Acm,
            Self::Asm => Method::Asm,
            Self::Footprint => Method::Footprint,
        }
    }

    /// Its defaults, but a quarter of the cells for footprints: what two executors may do differently they do with these too, and
    /// all scenes take a third of the time.
    fn settings(self) -> Settings {
        let settings = Settings::of(self.method());
        match self {
            Self::Footprint => Settings { emission_size: FOOTPRINT_CELLS, ..settings },
            _ => settings,
        }
    }

    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned())
    }
}

/// Cells along each side of a light's view, and one.
const FOOTPRINT_CELLS: u32 = 64;

/// Scenes of a quick run: one each with flat faces, smooth normals and total reflection.
const QUICK_SCENES: [&str; 3] = ["prism", "sphere", "gem"];

/// Scenes that a second driver takes: flat faces and smooth normals.
const SECOND_DRIVER_SCENES: [&str; 2] = ["prism", "sphere"];

/// What a run costs.
struct Effort {
    /// Texels across and down a bake.
    map_size: [u32; 2],
    /// Most photons of the oracle, per scene.
    oracle_photons: u64,
    /// Pixels across and down a camera picture, or a relit figure.
    picture_size: [u32; 2],
    /// Eye paths of the oracle, per pixel and lamp.
    oracle_samples: u32,
}

impl Effort {
    const FULL: Self =
        Self { map_size: [256, 256], oracle_photons: 1 << 23, picture_size: [320, 180], oracle_samples: 4 };
    const QUICK: Self =
        Self { map_size: [128, 128], oracle_photons: 1 << 20, picture_size: [160, 90], oracle_samples: 2 };
}

/// An executor and what became of it.
struct Contender {
    entry: ExecutorEntry,
    /// It is not asked everything, see [`taking`].
    on_second_driver: bool,
    /// Empty if it never started.
    info: DeviceInfo,
    /// None once it is skipped or has failed.
    executor: Option<Box<dyn Executor>>,
}

impl Contender {
    /// With what became of opening its executor; `missing` says why there may be no device, or is empty.
    fn new(candidate: &Candidate, on_second_driver: bool, opened: Opened, missing: &str) -> Self {
        let (entry, info, executor) = ExecutorEntry::of(candidate, opened, missing);
        Self { entry, on_second_driver, info, executor }
    }

    /// It is not asked again.
    fn fail(&mut self, reason: String) {
        self.entry.status = Status::Failed;
        self.entry.reason = Some(reason);
        self.executor = None;
    }
}

/// Find a driver, compare, write the report.
///
/// # Errors
/// Unknown scenes, an unwritable folder. What the comparison itself finds is the report's, and the exit code's.
pub(crate) fn run(args: &Args) -> Result<ExitCode> {
    let Some(missing) = driver::in_environment() else {
        return driver::restart(if args.quick { Drivers::One } else { Drivers::Two });
    };
    let start = Instant::now();
    let subjects = subjects(args)?;
    let methods =
        if args.methods.is_empty() { MethodName::value_variants() } else { args.methods.as_slice() };
    // Before minutes of work, not after.
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot create {}", args.out.display()))?;
    let effort = if args.quick { Effort::QUICK } else { Effort::FULL };
    let no_second = if args.quick { "not in a quick run".into() } else { second::in_environment() };
    let mut contenders = contenders(&missing, no_second.is_empty());
    let mut report = Report {
        executors: Vec::new(),
        no_second_driver: Some(no_second).filter(|reason| !reason.is_empty()),
        sabotage: args.sabotage,
        spoiled_plans: 0,
        controls: Vec::new(),
        checks: Vec::new(),
        map_size: effort.map_size,
        scenes: Vec::new(),
        seconds: 0.0,
    };
    for (i, subject) in subjects.iter().enumerate() {
        eprintln!("[{}/{}] {}", i + 1, subjects.len(), subject.name);
        bakes::compare(subject, methods, &effort, args.sabotage, &mut contenders, &mut report);
    }
    let started: Vec<&str> =
        contenders.iter().filter(|c| c.executor.is_some()).map(|c| c.entry.name).collect();
    let ponds = named_ponds(&PONDS, &args.scenes, args.quick);
    if !ponds.is_empty() {
        let mut contenders = ponds::contenders(&started, &mut report);
        let side = if args.quick { 64 } else { 128 };
        for (i, pond) in ponds.iter().enumerate() {
            eprintln!("[{}/{}] {}", i + 1, ponds.len(), pond.name);
            ponds::compare(pond, side, args.sabotage, &mut contenders, &mut report);
        }
    }
    let figures = named_prt(&PRT, &args.scenes, args.quick);
    if !figures.is_empty() {
        let mut contenders = prt::contenders(&started, &mut report);
        let folder = paths::target().join("compare/transfer");
        for (i, figure) in figures.iter().enumerate() {
            eprintln!("[{}/{}] {}", i + 1, figures.len(), figure.name);
            prt::compare(figure, effort.picture_size, &folder, args.sabotage, &mut contenders, &mut report);
        }
    }
    report.executors = contenders.into_iter().map(|c| c.entry).collect();
    report.seconds = start.elapsed().as_secs_f64();
    finish(&report, args)
}

/// Write the report and say in a few lines what is in it.
fn finish(report: &Report, args: &Args) -> Result<ExitCode> {
    let skips_fail = test::runs_in_ci();
    let page = report.write(&args.out, skips_fail)?;
    for executor in &report.executors {
        println!("{}", executor.line());
    }
    if let Some(reason) = &report.no_second_driver {
        println!("no second driver: {reason}");
    }
    let failures = report.failures(skips_fail);
    failures.iter().for_each(|failure| println!("failed: {failure}"));
    println!(
        "{} checks, {} negative controls, {} failures, {:.0} s; {}",
        report.checks.len(),
        report.controls.len(),
        failures.len(),
        report.seconds,
        page.display()
    );
    Ok(if failures.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn subjects(args: &Args) -> Result<Vec<Subject>> {
    let names: Vec<&str> = match (args.scenes.as_slice(), args.quick) {
        ([], false) => Subject::names().collect(),
        ([], true) => QUICK_SCENES.to_vec(),
        (named, _) => {
            let others = |name: &&str| is_pond(&PONDS, name) || is_prt(&PRT, name);
            named.iter().map(String::as_str).filter(|name| !others(name)).collect()
        }
    };
    let root = paths::workspace_root();
    let subjects: Vec<_> = names
        .into_iter()
        .map(|name| Subject::open(name, &root).with_context(|| format!("--scene {name}")))
        .collect::<Result<_>>()?;
    let ponds = named_ponds(&PONDS, &args.scenes, args.quick);
    if subjects.is_empty() && ponds.is_empty() && named_prt(&PRT, &args.scenes, args.quick).is_empty() {
        bail!("there is no scene to compare");
    }
    Ok(subjects)
}

/// Those that take a scene with a method. On a second driver, which is SwiftShader, all scenes with all methods would take an
/// hour; `asm` has nearly all passes.
fn taking<'a>(contenders: &'a mut [Contender], subject: &Subject, method: MethodName) -> &'a mut [Contender] {
    let all = method == MethodName::Asm && SECOND_DRIVER_SCENES.contains(&subject.name.as_str());
    let on_first = contenders.iter().take_while(|c| !c.on_second_driver).count();
    let count = if all { contenders.len() } else { on_first };
    &mut contenders[..count]
}

/// Start every executor that can be started; `missing` says why there may be no device, or is empty.
fn contenders(missing: &str, second: bool) -> Vec<Contender> {
    // Named, because of two software drivers either may come first.
    let others: Vec<String> = if second {
        let adapters = asm_wgpu::adapters().into_iter().map(|info| info.device);
        adapters.filter(|device| !device.contains(second::ADAPTER)).collect()
    } else {
        Vec::new()
    };
    let first = EXECUTORS.iter().map(|candidate| {
        let open = || match (candidate.open)(None) {
            Ok(executor) if second && executor.info().device.contains(second::ADAPTER) => {
                (candidate.open)(others.first().map(String::as_str))
            }
            opened => opened,
        };
        Contender::new(candidate, false, open(), missing)
    });
    let second = ON_SECOND_DRIVER.iter().filter(|_| second);
    let second = second
        .map(|candidate| Contender::new(candidate, true, (candidate.open)(Some(second::ADAPTER)), missing));
    first.chain(second).collect()
}
