//! The pond: the plans of its methods on every executor, held against each other and against the integral in f64.

use std::time::Instant;

use caustic_heightfield::{
    Convolution, ConvolutionSettings, FloorGrid, HeightField, LowRank, LowRankSettings, Photon,
    PhotonSettings, PlanSettings, Pond, PondError, PondPlan, exact, exact_over_facets,
};
use frame_plan::{DeviceInfo, Executor, Limits};
use serde_json::{Value, json};
use spectral_core::rgb::D65_WHITE_XYZ;
use xtask::executors::{EXECUTORS, POND_EXECUTORS};
use xtask::metrics::Map;
use xtask::ponds::{EXTENT_M, FloorDistance, FloorPlan, PondSubject, white, window};
use xtask::sabotage::Sabotage;

use super::report::{Check, Control, PictureRow, Report, SceneEntry, difference, shown};

/// Most relative RMS of two executors on different devices: f32 rounds sums of some thousand products.
const PARITY: f64 = 1e-5;
/// Most relative RMS of low-rank terms, which are asked for 1 %, against the integral.
const LOW_RANK: f64 = 0.011;
/// Most relative RMS of light through a mesh of water against the integral of nearly clear water, in texel means.
const PHOTON: f64 = 0.05;
/// Name of the integral in checks.
const EXACT: &str = "exact";

/// An executor that runs the pond's passes.
pub(super) struct PondContender {
    name: &'static str,
    info: DeviceInfo,
    executor: Box<dyn Executor>,
    /// The same with the passes of scenes.
    of_scenes: Box<dyn Executor>,
}

/// Those of the executors that ran so far, by their names, started anew for the pond.
pub(super) fn contenders(names: &[&str], report: &mut Report) -> Vec<PondContender> {
    let mut contenders = Vec::new();
    for candidate in POND_EXECUTORS.iter().filter(|candidate| names.contains(&candidate.name)) {
        let scenes = EXECUTORS.iter().find(|scenes| scenes.id == candidate.id).unwrap_or(candidate);
        match (candidate.open)(None).and_then(|executor| Ok((executor, (scenes.open)(None)?))) {
            Ok((executor, of_scenes)) => {
                let info = executor.info().clone();
                contenders.push(PondContender { name: candidate.name, info, executor, of_scenes });
            }
            Err(error) => report.checks.push(failed("pond", "all", candidate.name, error.to_string())),
        }
    }
    contenders
}

/// A floor and who made it; no device for the integral.
struct Floor {
    name: &'static str,
    device: Option<DeviceInfo>,
    irradiance: Vec<f64>,
}

/// Compare everything on one pond; whatever goes wrong becomes a check that fails.
pub(super) fn compare(
    subject: &PondSubject,
    side: usize,
    sabotage: Option<Sabotage>,
    contenders: &mut [PondContender],
    report: &mut Report,
) {
    let start = Instant::now();
    let mut entry = SceneEntry { name: subject.name.into(), notes: Vec::new(), rows: Vec::new() };
    match compare_methods(subject, side, sabotage, contenders, report) {
        Ok(rows) => entry.rows = rows,
        Err(error) => report.checks.push(failed(subject.name, "all", EXACT, error.to_string())),
    }
    let note = format!("{side} x {side} samples; all of it: {:.1} s", start.elapsed().as_secs_f64());
    eprintln!("  {note}");
    entry.notes.push(note);
    report.scenes.push(entry);
}

fn compare_methods(
    subject: &PondSubject,
    side: usize,
    sabotage: Option<Sabotage>,
    contenders: &mut [PondContender],
    report: &mut Report,
) -> Result<Vec<PictureRow>, PondError> {
    let (surface, pond) = (subject.surface([side; 2])?, subject.pond());
    let integral = Floor {
        name: EXACT,
        device: None,
        irradiance: exact(&surface, &pond, FloorGrid::below(&surface))?.irradiance,
    };
    let mut rows = Vec::new();
    for (method, plan, bound) in plans(&surface, &pond)? {
        let plan = FloorPlan::Sums(Box::new(plan), &surface);
        let held = Held { method, plan, bound, side };
        rows.push(held.compare(subject, &integral, sabotage, contenders, report));
    }
    let (half, clear) = (window(side), subject.nearly_clear(side));
    let irradiance = exact_over_facets(&surface, &clear, half, 2.0)?.irradiance;
    let integral = Floor { irradiance: white(&irradiance), ..integral };
    let limits = Limits::default();
    let plan = Photon::new(&clear, PhotonSettings::default())?.plan(&surface, half, &limits)?;
    let plan = FloorPlan::Photon(Box::new(plan));
    let held = Held { method: "photon", plan, bound: Some(PHOTON), side: side / 2 };
    rows.push(held.compare(subject, &integral, sabotage, contenders, report));
    Ok(rows)
}

impl PondContender {
    /// The executor for this plan's passes.
    fn executor_of(&mut self, plan: &FloorPlan<'_>) -> &mut dyn Executor {
        match plan {
            FloorPlan::Sums(..) => self.executor.as_mut(),
            FloorPlan::Photon(_) => self.of_scenes.as_mut(),
        }
    }
}

/// A method's plan, and what it is held to.
struct Held<'a> {
    method: &'static str,
    plan: FloorPlan<'a>,
    bound: Option<f64>,
    /// Texels across the floor.
    side: usize,
}

impl Held<'_> {
    fn compare(
        &self,
        subject: &PondSubject,
        integral: &Floor,
        sabotage: Option<Sabotage>,
        contenders: &mut [PondContender],
        report: &mut Report,
    ) -> PictureRow {
        let Self { method, plan, bound, side } = self;
        let mut floors = Vec::new();
        let last = contenders.len().saturating_sub(1);
        for (i, contender) in contenders.iter_mut().enumerate() {
            let fault = sabotage.filter(|_| i == last);
            report.spoiled_plans += usize::from(fault.is_some());
            let given = fault.map_or_else(|| plan.clone(), |fault| plan.spoiled(fault));
            match given.floor(contender.executor_of(&given)) {
                Ok(irradiance) => floors.push(Floor {
                    name: contender.name,
                    device: Some(contender.info.clone()),
                    irradiance,
                }),
                Err(error) => {
                    report.checks.push(failed(subject.name, method, contender.name, error.to_string()));
                }
            }
        }
        for (i, a) in floors.iter().enumerate() {
            for b in &floors[i + 1..] {
                check(subject, method, a, b, Some(parity(a, b)), *side, report);
            }
            check(subject, method, a, integral, *bound, *side, report);
        }
        // A spoiled executor is no measure for controls.
        if let (None, Some(contender), Some(good)) = (sabotage, contenders.first_mut(), floors.first()) {
            control_plans(subject, method, plan, good, contender, report);
        }
        pictures(method, &floors, integral, *side)
    }
}

/// A method's name, its plan, and the most that it may be from the integral, if anything.
type Named = (&'static str, PondPlan, Option<f64>);

/// Both methods' plans.
fn plans(surface: &HeightField, pond: &Pond) -> Result<[Named; 2], PondError> {
    let settings = PlanSettings::default();
    let terms = LowRank::<f32>::new(std::slice::from_ref(surface), pond, LowRankSettings::default())?;
    let paper = Convolution::<f32>::new(surface.size, EXTENT_M, pond, ConvolutionSettings::default())?;
    Ok([("low-rank", terms.plan(&settings)?, Some(LOW_RANK)), ("convolution", paper.plan(&settings)?, None)])
}

/// What may lie between two executors: nothing on one driver.
fn parity(a: &Floor, b: &Floor) -> f64 {
    let driver = |floor: &Floor| floor.device.as_ref().map(ToString::to_string);
    if driver(a) == driver(b) { 0.0 } else { PARITY }
}

/// The distance of two floors, and what is wrong with it or with them.
fn judge(a: &[f64], b: &[f64], bound: Option<f64>) -> (Value, Vec<String>) {
    let distance = match FloorDistance::of(a, b) {
        Ok(distance) => distance,
        Err(problems) => return (Value::Null, problems),
    };
    let rms = distance.rms;
    let above = bound.filter(|&bound| rms > bound).map(|bound| format!("RMS {rms:.2e} is above {bound:.2e}"));
    (json!(distance), above.into_iter().collect())
}

/// A check with its controls: faults put into `a`, each of which must be found.
fn check(
    subject: &PondSubject,
    method: &str,
    a: &Floor,
    b: &Floor,
    bound: Option<f64>,
    side: usize,
    report: &mut Report,
) {
    let (metrics, problems) = judge(&a.irradiance, &b.irradiance, bound);
    let name = format!("{} {method}: {} against {}", subject.name, a.name, b.name);
    if problems.is_empty() && bound.is_some() {
        for (fault, spoil) in FAULTS {
            let mut spoiled = a.irradiance.clone();
            spoil(&mut spoiled, side);
            let failed = !judge(&spoiled, &b.irradiance, bound).1.is_empty();
            report.controls.push(Control { name: format!("{name}: {fault}"), failed });
        }
    }
    report.checks.push(Check {
        scene: subject.name.into(),
        method: method.into(),
        layer: "floor",
        a: a.name,
        b: b.name,
        metrics,
        bound: bound.map_or(Value::Null, |rms| json!({ "rms": rms })),
        oracle_standard_error: None,
        within_oracle_noise: None,
        ok: problems.is_empty(),
        problems,
    });
}

/// Spoils a floor of so many samples on a side.
type Spoil = fn(&mut Vec<f64>, usize);

/// Faults put into a finished floor.
const FAULTS: [(&str, Spoil); 4] = [
    ("every eighth row dark", |floor, side| {
        floor.chunks_mut(side).step_by(8).for_each(|row| row.fill(0.0));
    }),
    ("moved by 1/32", |floor, side| floor.chunks_mut(side).for_each(|row| row.rotate_right(side / 32))),
    ("one NaN", |floor, _| floor[0] = f64::NAN),
    ("black", |floor, _| floor.fill(0.0)),
];

/// Spoil the plan in every way, run it again where `good` was made, and ask for the same bits: they must not come.
fn control_plans(
    subject: &PondSubject,
    method: &str,
    plan: &FloorPlan<'_>,
    good: &Floor,
    contender: &mut PondContender,
    report: &mut Report,
) {
    for sabotage in Sabotage::ALL {
        let spoiled = plan.spoiled(sabotage);
        let failed = match spoiled.floor(contender.executor_of(&spoiled)) {
            Ok(floor) => !judge(&floor, &good.irradiance, Some(PARITY)).1.is_empty(),
            // A plan without one of its passes may be refused: noticed as well.
            Err(_) => true,
        };
        report
            .controls
            .push(Control { name: format!("{} {method}: {}", subject.name, plan.fault(sabotage)), failed });
    }
}

/// Everyone's floors side by side, with what the first lacks to the integral.
fn pictures(method: &str, floors: &[Floor], integral: &Floor, side: usize) -> PictureRow {
    let texels = side * side;
    // The only plane, or Y of three.
    let y_of =
        |floor: &Floor| floor.irradiance.chunks(texels).take(2).next_back().unwrap_or_default().to_vec();
    let brightest = y_of(integral).into_iter().fold(0.0, f64::max);
    let white = |floor: &Floor| -> Vec<[f32; 3]> {
        y_of(floor).into_iter().map(|y| D65_WHITE_XYZ.map(|w| (w * y) as f32)).collect()
    };
    let size = [side; 2];
    let reference = white(integral);
    let reference = Map { size, xyz: &reference };
    let mut pictures = vec![(EXACT.to_owned(), shown(&reference, 1.0 / brightest))];
    for floor in floors {
        let xyz = white(floor);
        let map = Map { size, xyz: &xyz };
        pictures.push((floor.name.to_owned(), shown(&map, 1.0 / brightest)));
        let scale = 0.02 * brightest;
        let caption = format!("{} - {EXACT}: red +{scale:.1e}, blue -{scale:.1e} lux", floor.name);
        pictures.push((caption, difference(&map, &reference, scale)));
    }
    PictureRow { title: format!("{method}, floor, exposure {:.3e} / lux", 1.0 / brightest), pictures }
}

/// Something that should have given a floor gave an error.
fn failed(scene: &str, method: &str, who: &'static str, problem: String) -> Check {
    eprintln!("  {who}: {problem}");
    Check {
        scene: scene.into(),
        method: method.into(),
        layer: "floor",
        a: who,
        b: who,
        metrics: Value::Null,
        bound: Value::Null,
        oracle_standard_error: None,
        within_oracle_noise: None,
        ok: false,
        problems: vec![problem],
    }
}
