//! `cargo xtask bench --prt`: frames of relit surfaces, spectral against RGB through the same passes, in turns (Schwenk et al. 2010
//! report 580 Hz against 1305 Hz on one model, and 2 to 4 times the time in general).

use std::fmt::Write;
use std::process::ExitCode;

use anyhow::{Context, Result};
use frame_plan::{ExecuteError, Executor};
use glam::{DMat3, DVec3};
use serde::Serialize;
use spectral_core::basis::{Optimal, SpectralBasis, Training};
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_prt::figures::{GRID, OBSERVER, lamps, power};
use spectral_prt::{
    Albedo, Bands, Exposure, IndexMap, Palette, Projection, Relighting, RelightingSettings, RelitScene,
    SceneTransfer, Shot, Sky, SpectralMap, Surface, Transfer, TransferSettings, precompute, sh,
};
use spectral_scene::{Camera, bundled};
use xtask::executors::{self, Candidate, PRT_EXECUTORS};
use xtask::frame_time::{WarmFrames, median, range};
use xtask::whole_file;

use super::Args;
use crate::driver::{self, Drivers};

/// Scenes whose objects are relit, with the ColorChecker as their albedo.
const SCENES: [&str; 2] = ["sphere", "organic"];
/// Texels across and down a map of spectra.
const MAP: [u32; 2] = [252, 168];

/// What is compared. Ratios are to the first.
const COLUMNS: [Column; 6] = [
    Column { name: "RGB", coefficients: None, mapped: false },
    Column { name: "m = 5", coefficients: Some(5), mapped: false },
    Column { name: "m = 8", coefficients: Some(8), mapped: false },
    Column { name: "RGB, maps", coefficients: None, mapped: true },
    Column { name: "m = 5, maps", coefficients: Some(5), mapped: true },
    Column { name: "m = 8, maps", coefficients: Some(8), mapped: true },
];

#[derive(Clone, Copy)]
struct Column {
    name: &'static str,
    /// Of a spectral basis; none for RGB.
    coefficients: Option<usize>,
    /// A spectrum at every texel, instead of an index map.
    mapped: bool,
}

/// Frames of one column.
#[derive(Serialize)]
struct Frames {
    column: &'static str,
    /// Milliseconds per frame: median of the rounds.
    ms: f64,
    /// Of the fastest and of the slowest round.
    range_ms: [f64; 2],
    /// Median over the rounds of this column's time by the first column's in the same round.
    ratio: f64,
    /// Milliseconds of each step, medians; empty where the device cannot measure.
    steps: Vec<(String, f64)>,
}

/// One object on one executor.
#[derive(Serialize)]
struct Row {
    executor: String,
    device: String,
    scene: &'static str,
    vertices: usize,
    triangles: usize,
    frames: Vec<Frames>,
}

#[derive(Serialize)]
struct Report {
    size: [u32; 2],
    rounds: u32,
    rows: Vec<Row>,
    skipped: Vec<(String, String)>,
}

/// Measure, write `prt.json` and `prt.md`, print the table.
pub(super) fn run(args: &Args) -> Result<ExitCode> {
    if driver::in_environment().is_none() {
        return driver::restart(Drivers::One);
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot create {}", args.out.display()))?;
    let size = [args.size.width, args.size.height];
    let mut report = Report { size, rounds: args.rounds, rows: Vec::new(), skipped: Vec::new() };
    let subjects: Vec<Subject> = SCENES.into_iter().map(Subject::new).collect::<Result<_>>()?;
    for candidate in executors::named_of(PRT_EXECUTORS, &args.executors)? {
        for subject in &subjects {
            match open(candidate) {
                Ok(mut turns) => report.rows.push(subject.measure(&mut turns, size, args.rounds)?),
                Err(ExecuteError::NoDevice { reason, .. }) => {
                    report.skipped.push((candidate.id.to_owned(), reason));
                    break;
                }
                Err(error) => return Err(error.into()),
            }
        }
    }
    let markdown = report.markdown();
    whole_file::write(&args.out.join("prt.json"), serde_json::to_string_pretty(&report)?.as_bytes())?;
    whole_file::write(&args.out.join("prt.md"), markdown.as_bytes())?;
    println!("{markdown}");
    Ok(ExitCode::SUCCESS)
}

/// One executor per column, so that columns can take turns without being prepared anew.
fn open(candidate: &Candidate) -> Result<Vec<Box<dyn Executor>>, ExecuteError> {
    COLUMNS.iter().map(|_| (candidate.open)(None)).collect()
}

/// All objects of a scene, relit.
struct Subject {
    scene: &'static str,
    surfaces: Vec<Surface>,
    transfer: Transfer,
    camera: Camera,
    chart: Vec<Vec<f64>>,
}

impl Subject {
    fn new(name: &'static str) -> Result<Self> {
        let scene = bundled(name).with_context(|| format!("no scene is named {name}"))?;
        let surfaces: Vec<Surface> = (0..scene.objects.len())
            .map(|object| Surface::of_object(&scene, object))
            .collect::<Result<_, _>>()?;
        let settings = TransferSettings { rays: 64, ..TransferSettings::default() };
        eprintln!("{name}: transfer");
        Ok(Self {
            scene: name,
            transfer: precompute(&surfaces, &settings, &mut |_| {})?,
            camera: Camera::framing(&scene).context("a scene with something in it")?,
            surfaces,
            chart: color_checker::sampled(&GRID),
        })
    }

    fn plan(&self, column: Column, size: [u32; 2], executor: &dyn Executor) -> Result<Relighting> {
        let basis = column.coefficients.map(|m| self.basis(m)).transpose()?;
        let projection = basis.as_ref().map_or(Projection::Rgb(GRID, OBSERVER), Projection::Spectral);
        let palette = Palette::new(&projection, &self.chart);
        let chart = IndexMap::new([6, 4], (0..24).collect())?;
        let spectral_maps = if column.mapped {
            let patch = |i: u32| i / MAP[0] / (MAP[1] / 4) * 6 + i % MAP[0] / (MAP[0] / 6);
            vec![SpectralMap::new(&projection, MAP, (0..MAP[0] * MAP[1]).map(patch).collect(), &self.chart)?]
        } else {
            Vec::new()
        };
        let albedo = |surface: &Surface| {
            let uvs = surface.positions().iter().map(|p| [p.x as f32, p.z as f32]).collect();
            if column.mapped { Albedo::Mapped { map: 0, uvs } } else { Albedo::Indexed { map: 0, uvs } }
        };
        let albedos: Vec<Albedo> = self.surfaces.iter().map(albedo).collect();
        let scene = RelitScene {
            surfaces: &self.surfaces,
            transfer: SceneTransfer::Direct(&self.transfer),
            gloss: None,
            palette: &palette,
            index_maps: std::slice::from_ref(&chart),
            spectral_maps: &spectral_maps,
            albedos: &albedos,
        };
        let lamp = power(Illuminant::Fl4);
        let mut shape = sh::harmonics(Bands::default(), DVec3::new(1.0, 2.0, 1.0).normalize());
        shape[0] *= 2.0;
        let sky = Sky::of_shape(Bands::default(), &shape, &projection.light(&lamp));
        let shot = Shot {
            sky: &sky,
            rotation: DMat3::IDENTITY,
            camera: &self.camera,
            exposure: Exposure::default(),
        };
        let settings = RelightingSettings { size, samples: 1 };
        Ok(Relighting::new(&scene, &shot, &settings, &executor.limits())?)
    }

    fn basis(&self, coefficients: usize) -> Result<SpectralBasis> {
        let lights = lamps();
        let training =
            Training { grid: GRID, observer: OBSERVER, reflectances: &self.chart, lights: &lights };
        Ok(training.optimal(coefficients, Optimal::default())?)
    }

    fn measure(&self, turns: &mut [Box<dyn Executor>], size: [u32; 2], rounds: u32) -> Result<Row> {
        let device = turns[0].info().clone();
        eprintln!("{}: {}", device.executor, self.scene);
        let mut warm = Vec::new();
        for (executor, column) in turns.iter_mut().zip(COLUMNS) {
            let plan = self.plan(column, size, executor.as_ref())?.plan;
            executor.prepare(&plan)?;
            WarmFrames::warm_up(&plan, executor.as_mut(), 2)?;
            warm.push(WarmFrames::of(&plan, executor.as_mut())?);
        }
        let mut ms = vec![Vec::new(); COLUMNS.len()];
        let mut steps = vec![Vec::new(); COLUMNS.len()];
        for _ in 0..rounds {
            for (i, executor) in turns.iter_mut().enumerate() {
                ms[i].push(warm[i].round_ms(executor.as_mut())?);
                steps[i].push(executor.step_times());
            }
        }
        let frames = |(i, column): (usize, &Column)| Frames {
            column: column.name,
            ms: median(ms[i].clone()),
            range_ms: range(&ms[i]),
            ratio: median(ms[i].iter().zip(&ms[0]).map(|(own, first)| own / first).collect()),
            steps: (0..steps[i][0].len())
                .map(|s| {
                    let of_step = steps[i].iter().map(|round| round[s].milliseconds);
                    (steps[i][0][s].name.clone(), median(of_step.collect()))
                })
                .collect(),
        };
        Ok(Row {
            executor: device.executor,
            device: device.device,
            scene: self.scene,
            vertices: self.surfaces.iter().map(|s| s.positions().len()).sum(),
            triangles: self.surfaces.iter().map(|s| s.triangles().len()).sum(),
            frames: COLUMNS.iter().enumerate().map(frames).collect(),
        })
    }
}

impl Report {
    fn markdown(&self) -> String {
        let names = COLUMNS.map(|c| c.name).join(" | ");
        let mut text = format!(
            "Relit frames of {} x {} pixels, 5 bands, milliseconds and their ratio to RGB by a palette; medians of {} rounds in turns. \
             Maps: {} x {} texels, each with its spectrum.\n\n| executor | object | vertices | {names} |\n|---|---|---|{}\n",
            self.size[0],
            self.size[1],
            self.rounds,
            MAP[0],
            MAP[1],
            "---|".repeat(COLUMNS.len())
        );
        for row in &self.rows {
            let times = row.frames.iter().map(|f| format!("{:.2}, {:.2}", f.ms, f.ratio)).collect::<Vec<_>>();
            let Row { executor, device, scene, vertices, .. } = row;
            let _ =
                writeln!(text, "| {executor}, {device} | `{scene}` | {vertices} | {} |", times.join(" | "));
        }
        let _ =
            writeln!(text, "\n| step, ms | object | {names} |\n|---|---|{}", "---|".repeat(COLUMNS.len()));
        for row in &self.rows {
            for (s, (step, _)) in row.frames[0].steps.iter().enumerate() {
                let times = row.frames.iter().map(|f| f.steps.get(s).map_or(0.0, |(_, ms)| *ms));
                let times = times.map(|ms| format!("{ms:.3}")).collect::<Vec<_>>().join(" | ");
                let _ = writeln!(text, "| {}: `{step}` | `{}` | {times} |", row.executor, row.scene);
            }
        }
        for (id, reason) in &self.skipped {
            let _ = writeln!(text, "\n{id}: skipped, {reason}");
        }
        text
    }
}
