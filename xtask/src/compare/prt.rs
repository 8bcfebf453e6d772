//! Relit figures: frames in spectra and in RGB on every executor, held against each other, against the same colours in f64, and against
//! sampling every 5 nm in f64.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use frame_plan::{DeviceInfo, Executor};
use serde_json::{Map as JsonMap, Value, json};
use spectral_core::illuminant::Illuminant;
use spectral_prt::{Bands, Relighting, RelightingError};
use xtask::executors::PRT_EXECUTORS;
use xtask::metrics::Map;
use xtask::prt::{
    ColourDistance, Colours, Fault, Lit, PixelDistance, PrtSubject, Reference, SkyShape, Stage, Way,
    colour_map, something_to_compare, spoiled,
};
use xtask::sabotage::Sabotage;

use super::report::{Check, Control, PictureRow, Png, Report, SceneEntry, shown};

/// How far two pixels may be apart where the same is seen: f32 rounds some hundred products; a share of the brightest Y.
const ROUNDING: f64 = 1e-5;
/// Names of those that are no executors: the same colours in f64, and spectra.
const F64: &str = "f64";
const SAMPLED: &str = "sampled";
/// The CIE94 difference that maps show white.
const WHITE: f64 = 2.0;

/// An executor that relights.
pub(super) struct PrtContender {
    name: &'static str,
    info: DeviceInfo,
    executor: Box<dyn Executor>,
}

/// Those of the executors that ran so far, by their names, started anew for relighting.
pub(super) fn contenders(names: &[&str], report: &mut Report) -> Vec<PrtContender> {
    let mut contenders = Vec::new();
    for candidate in PRT_EXECUTORS.iter().filter(|candidate| names.contains(&candidate.name)) {
        match (candidate.open)(None) {
            Ok(executor) => {
                let info = executor.info().clone();
                contenders.push(PrtContender { name: candidate.name, info, executor });
            }
            Err(error) => report.checks.push(failed("prt", "all", candidate.name, error.to_string())),
        }
    }
    contenders
}

/// What a figure of a check may be.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Accepted {
    metric: &'static str,
    least: f64,
    most: f64,
}

impl Accepted {
    /// A number is the most; two are the least and the most, and null is without end.
    fn json(&self) -> (String, Value) {
        let Self { metric, least, most } = *self;
        (metric.into(), if least > 0.0 { json!([least, most]) } else { json!(most) })
    }
}

const fn at_most(metric: &'static str, most: f64) -> Accepted {
    Accepted { metric, least: 0.0, most }
}

const fn between(metric: &'static str, least: f64, most: f64) -> Accepted {
    Accepted { metric, least, most }
}

/// Of the pixels that show something, no fewer are judged.
const LEAST_JUDGED: f64 = 0.3;

/// What is asked of pictures that show the same.
const NONE_DIFFERS: [Accepted; 1] = [at_most("differing", 0.0)];

/// What is asked of a way's colours on a figure, under a lamp.
fn accepted(subject: &PrtSubject, way: Way, lamp: Illuminant) -> Vec<Accepted> {
    let colours = |mean, max| vec![at_most("cie94_mean", mean), at_most("cie94_max", max)];
    match (subject.name, way) {
        ("prt-furnace", _) => vec![at_most("xyz_max", 1e-5)],
        (_, Way::Optimal(5)) => colours(0.1, 0.5),
        ("prt-patches", Way::Optimal(_)) => colours(0.1, 0.1),
        (_, Way::Optimal(_)) => colours(0.1, 0.5),
        (_, Way::Peercy(_)) => colours(0.5, 1.2),
        // That these are what RGB makes of the chart shows that lights, chart and white balance are right.
        ("prt-patches", Way::Rgb) => {
            vec![between("cie94_mean", 8.1, 8.3), between("cie94_max", 28.5, 29.1)]
        }
        // What metamers are: the same by daylight and not under lamps, where RGB knows nothing of it.
        ("prt-metacow", Way::Rgb) if lamp == Illuminant::D65 => colours(0.1, 0.5),
        ("prt-metacow", Way::Rgb) => vec![between("cie94_max", 10.0, f64::INFINITY)],
        (_, Way::Rgb) => vec![between("cie94_mean", 5.0, f64::INFINITY)],
    }
}

/// What a figure is shown in.
fn ways(subject: &PrtSubject) -> &'static [Way] {
    match subject.name {
        "prt-furnace" => &[Way::Optimal(5)],
        "prt-patches" => &[Way::Optimal(5), Way::Optimal(8), Way::Peercy(8), Way::Rgb],
        // Metamers are not the smooth spectra that five are enough for.
        "prt-metacow" => &[Way::Optimal(8), Way::Rgb],
        _ => &[Way::Optimal(5), Way::Rgb],
    }
}

/// Faults that are some on this figure: an even sky has no direction, and white is white at every wavelength.
fn faults(subject: &PrtSubject) -> impl Iterator<Item = Fault> {
    let (even, white) = (subject.sky == SkyShape::Even, subject.name == "prt-furnace");
    Fault::ALL.into_iter().filter(move |fault| match fault {
        Fault::Sky => !even,
        Fault::Reflectances => !white,
        Fault::Light | Fault::Lamp => true,
    })
}

/// Compare everything on one figure; whatever goes wrong becomes a check that fails. Transfer is kept in `folder`.
pub(super) fn compare(
    subject: &'static PrtSubject,
    size: [u32; 2],
    folder: &Path,
    sabotage: Option<Sabotage>,
    contenders: &mut [PrtContender],
    report: &mut Report,
) {
    let start = Instant::now();
    let mut entry = SceneEntry { name: subject.name.into(), notes: Vec::new(), rows: Vec::new() };
    match Stage::open(subject, Bands::default(), folder) {
        Ok(stage) => {
            let reference = stage.reference(size);
            let judged = reference.certain_share();
            if judged.is_nan() || judged < LEAST_JUDGED {
                let problem = format!("of what shows something only {:.1} % is judged", 100.0 * judged);
                report.checks.push(failed(subject.name, "all", F64, problem));
                return;
            }
            let figure = Compared { stage: &stage, reference: &reference, sabotage };
            for &way in ways(subject) {
                match figure.compare(way, contenders, report) {
                    Ok(rows) => entry.rows.extend(rows),
                    Err(error) => {
                        report.checks.push(failed(subject.name, &way.to_string(), F64, format!("{error:#}")));
                    }
                }
            }
            entry.notes.push(format!(
                "{} x {} pixels; judged are {:.1} % of those that show something: they see one triangle and paint, and so do the points \
                 1/16 of a pixel to the left, the right, above and below",
                size[0],
                size[1],
                100.0 * judged
            ));
        }
        Err(error) => report.checks.push(failed(subject.name, "all", F64, format!("{error:#}"))),
    }
    let note = format!("all of it: {:.1} s", start.elapsed().as_secs_f64());
    eprintln!("  {note}");
    entry.notes.push(note);
    report.scenes.push(entry);
}

/// A figure while it is compared.
struct Compared<'a> {
    stage: &'a Stage,
    reference: &'a Reference,
    sabotage: Option<Sabotage>,
}

/// An executor's frames under all lamps.
struct Frames {
    name: &'static str,
    /// Executors on one driver have one.
    device: String,
    /// Of each lamp, XYZ.
    xyz: Vec<Vec<[f32; 3]>>,
    /// The same with each fault.
    spoiled: Vec<(Fault, Vec<Vec<[f32; 3]>>)>,
}

/// A way's colours in f64 under a lamp.
struct Truth {
    lamp: Illuminant,
    factor: f64,
    /// Of spectra.
    sampled: Vec<[f64; 3]>,
    /// Of the way.
    own: Vec<[f64; 3]>,
}

impl Compared<'_> {
    fn compare(
        &self,
        way: Way,
        contenders: &mut [PrtContender],
        report: &mut Report,
    ) -> Result<Vec<PictureRow>> {
        let subject = self.stage.subject;
        let colours = self.stage.colours(way)?;
        let truth = |lamp: &Illuminant| {
            let paints = self.stage.paints(*lamp, None);
            let factor = self.reference.exposure();
            let sampled = self.reference.xyz(&paints, factor);
            let own = self.reference.xyz(&self.stage.paints(*lamp, Some(&colours)), factor);
            Truth { lamp: *lamp, factor, sampled, own }
        };
        let truths: Vec<Truth> = subject.lamps.iter().map(truth).collect();
        let mut frames = Vec::new();
        let last = contenders.len().saturating_sub(1);
        for (i, contender) in contenders.iter_mut().enumerate() {
            let sabotage = self.sabotage.filter(|_| i == last);
            // A spoiled executor is no measure for controls.
            let with_faults = self.sabotage.is_none();
            match self.frames(&colours, &truths, contender, sabotage, with_faults, report) {
                Ok(made) => frames.push(made),
                Err(error) => report.checks.push(failed(
                    subject.name,
                    &way.to_string(),
                    contender.name,
                    error.to_string(),
                )),
            }
        }
        for (lamp, truth) in truths.iter().enumerate() {
            self.check_lamp(way, lamp, truth, &frames, report);
        }
        Ok(truths.iter().enumerate().map(|(lamp, truth)| self.pictures(way, lamp, truth, &frames)).collect())
    }

    fn frames(
        &self,
        colours: &Colours,
        truths: &[Truth],
        contender: &mut PrtContender,
        sabotage: Option<Sabotage>,
        with_faults: bool,
        report: &mut Report,
    ) -> Result<Frames, RelightingError> {
        let Stage { figure, transfer, .. } = self.stage;
        let executor = contender.executor.as_mut();
        let relighting = |reflectances: &[Vec<f64>], executor: &dyn Executor| {
            let size = self.reference.size;
            self.stage.relighting(colours, reflectances, transfer, size, &executor.limits())
        };
        let plan = relighting(&figure.reflectances, executor)?;
        let given = sabotage.map_or_else(|| plan.plan.clone(), |sabotage| spoiled(&plan.plan, sabotage));
        report.spoiled_plans += usize::from(given != plan.plan);
        let under_all = |plan: &Relighting, executor: &mut dyn Executor, fault: Option<Fault>| {
            let frame = |truth: &Truth| {
                let lit = Lit { lamp: truth.lamp, bands: transfer.bands(), factor: truth.factor };
                self.stage.frame(plan, executor, colours, lit, fault)
            };
            truths.iter().map(frame).collect::<Result<Vec<_>, _>>()
        };
        executor.prepare(&given)?;
        let xyz = under_all(&plan, executor, None)?;
        let mut spoiled = Vec::new();
        for fault in faults(self.stage.subject).filter(|_| with_faults) {
            if fault == Fault::Reflectances {
                let plan = relighting(&fault.reflectances(&figure.reflectances), executor)?;
                executor.prepare(&plan.plan)?;
                spoiled.push((fault, under_all(&plan, executor, None)?));
                executor.prepare(&given)?;
            } else {
                spoiled.push((fault, under_all(&plan, executor, Some(fault))?));
            }
        }
        Ok(Frames { name: contender.name, device: contender.info.to_string(), xyz, spoiled })
    }

    fn check_lamp(&self, way: Way, lamp: usize, truth: &Truth, frames: &[Frames], report: &mut Report) {
        let bound = accepted(self.stage.subject, way, truth.lamp);
        let check = Checked { subject: self.stage.subject.name, way, lamp: truth.lamp };
        // What a fault does to a colour is more than an error only if it is more than what is accepted.
        let (tiny, must_err) =
            (bound.iter().any(|b| b.metric == "xyz_max"), bound.iter().any(|b| b.least > 0.0));
        let seen_in_colours =
            |fault: Fault| !must_err && (tiny || matches!(fault, Fault::Reflectances | Fault::Lamp));
        for (i, a) in frames.iter().enumerate() {
            let spoiled = |seen: &dyn Fn(Fault) -> bool| -> Vec<(&'static str, Vec<[f32; 3]>)> {
                let seen = a.spoiled.iter().filter(|(fault, _)| seen(*fault));
                seen.map(|(fault, xyz)| (fault.words(), xyz[lamp].clone())).collect()
            };
            let picture = &a.xyz[lamp];
            for b in &frames[i + 1..] {
                let same = a.device == b.device;
                let (rounding, pixels): (_, Vec<usize>) = if same {
                    (0.0, (0..picture.len()).collect())
                } else {
                    (ROUNDING, self.reference.certain_pixels().collect())
                };
                let other: Vec<[f64; 3]> = b.xyz[lamp].iter().map(|xyz| xyz.map(f64::from)).collect();
                let distance = |xyz: &[[f32; 3]]| {
                    json!(PixelDistance::of(xyz, &other, pixels.iter().copied(), rounding))
                };
                let controls =
                    if same { vec![("one bit of one pixel", one_bit(picture))] } else { spoiled(&|_| true) };
                check.record([a.name, b.name], picture, controls, &distance, &NONE_DIFFERS, report);
            }
            let distance = |xyz: &[[f32; 3]]| {
                json!(PixelDistance::of(xyz, &truth.own, self.reference.certain_pixels(), ROUNDING))
            };
            check.record([a.name, F64], picture, spoiled(&|_| true), &distance, &NONE_DIFFERS, report);
            let distance = |xyz: &[[f32; 3]]| json!(ColourDistance::of(xyz, &truth.sampled, self.reference));
            let mut controls = spoiled(&seen_in_colours);
            if must_err {
                let sampled = truth.sampled.iter().map(|xyz| xyz.map(|v| v as f32)).collect();
                controls.push(("spectra in place of RGB", sampled));
            }
            check.record([a.name, SAMPLED], picture, controls, &distance, &bound, report);
        }
    }

    /// Sampled, by every executor, and what is wrong with the first of these.
    fn pictures(&self, way: Way, lamp: usize, truth: &Truth, frames: &[Frames]) -> PictureRow {
        let size = self.reference.size.map(|side| side as usize);
        let sampled: Vec<[f32; 3]> = truth.sampled.iter().map(|xyz| xyz.map(|v| v as f32)).collect();
        let mut pictures = vec![(SAMPLED.to_owned(), shown(&Map { size, xyz: &sampled }, 1.0))];
        pictures
            .extend(frames.iter().map(|f| (f.name.to_owned(), shown(&Map { size, xyz: &f.xyz[lamp] }, 1.0))));
        if let Some(first) = frames.first() {
            let map = colour_map(&first.xyz[lamp], &truth.sampled, WHITE);
            let caption = format!("CIE94 of {} from {SAMPLED}, white is {WHITE}", first.name);
            pictures.push((caption, Png::encode(size, &map)));
        }
        PictureRow { title: format!("{way}, {}", truth.lamp.name()), pictures }
    }
}

/// The picture with the last bit of its brightest pixel's Y turned over.
fn one_bit(picture: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let mut spoiled = picture.to_vec();
    if let Some(pixel) = spoiled.iter_mut().max_by(|a, b| a[1].total_cmp(&b[1])) {
        pixel[1] = f32::from_bits(pixel[1].to_bits() ^ 1);
    }
    spoiled
}

/// The figures of a picture's distance, and what is wrong with them or with the picture.
fn judge(picture: &[[f32; 3]], distance: &Distance<'_>, accepted: &[Accepted]) -> (Value, Vec<String>) {
    if let Err(problem) = something_to_compare(picture) {
        return (Value::Null, vec![format!("nothing to compare, a: {problem}")]);
    }
    let metrics = distance(picture);
    let problem = |Accepted { metric, least, most }: &Accepted| {
        // What is no number is none in JSON.
        let value = metrics[metric].as_f64().unwrap_or(f64::NAN);
        let accepts = (*least..=*most).contains(&value);
        (!accepts).then(|| format!("{metric} is {value:.3e}, accepted is {least:.1e} to {most:.1e}"))
    };
    let problems = accepted.iter().filter_map(problem).collect();
    (metrics, problems)
}

/// The figures of a picture's distance from what it is held against.
type Distance<'a> = dyn Fn(&[[f32; 3]]) -> Value + 'a;

/// What a check is about.
struct Checked {
    subject: &'static str,
    way: Way,
    lamp: Illuminant,
}

impl Checked {
    /// A check of a picture with its controls: spoiled pictures, each of which must be found.
    fn record(
        &self,
        [a, b]: [&'static str; 2],
        picture: &[[f32; 3]],
        mut controls: Vec<(&'static str, Vec<[f32; 3]>)>,
        distance: &Distance<'_>,
        accepted: &[Accepted],
        report: &mut Report,
    ) {
        let Self { subject, way, lamp } = self;
        let (metrics, problems) = judge(picture, distance, accepted);
        if problems.is_empty() {
            let mut not_finite = picture.to_vec();
            not_finite[0][1] = f32::NAN;
            controls.push(("one NaN", not_finite));
            controls.push(("black", vec![[0.0; 3]; picture.len()]));
            for (fault, spoiled) in controls {
                let name = format!("{subject} {way}, {}: {a} against {b}: {fault}", lamp.name());
                report
                    .controls
                    .push(Control { name, failed: !judge(&spoiled, distance, accepted).1.is_empty() });
            }
        }
        report.checks.push(Check {
            metrics,
            bound: accepted.iter().map(Accepted::json).collect::<JsonMap<_, _>>().into(),
            ok: problems.is_empty(),
            problems,
            ..unjudged(subject, &way.to_string(), lamp.name(), [a, b])
        });
    }
}

/// Something that should have given a picture gave an error.
fn failed(scene: &str, method: &str, who: &'static str, problem: String) -> Check {
    eprintln!("  {who}: {problem}");
    Check { problems: vec![problem], ..unjudged(scene, method, "camera", [who; 2]) }
}

fn unjudged(scene: &str, method: &str, layer: &'static str, [a, b]: [&'static str; 2]) -> Check {
    Check {
        scene: scene.into(),
        method: method.into(),
        layer,
        a,
        b,
        metrics: Value::Null,
        bound: Value::Null,
        oracle_standard_error: None,
        within_oracle_noise: None,
        ok: false,
        problems: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_not_accepted_and_bounds_hold_at_their_ends() {
        let picture = [[0.0; 3], [1.0; 3]];
        let problems = |value: f64, accepted: Accepted| {
            judge(&picture, &|_| json!({ "differing": value }), &[accepted]).1.len()
        };
        for (value, expected) in [(0.0, 0), (0.5, 0), (0.6, 1), (f64::NAN, 1)] {
            assert_eq!(problems(value, at_most("differing", 0.5)), expected, "{value}");
        }
        let rgb = between("differing", 5.0, f64::INFINITY);
        assert_eq!([4.0, 5.0, 50.0].map(|value| problems(value, rgb)), [1, 0, 0]);
        assert_eq!(rgb.json(), ("differing".to_owned(), json!([5.0, null])));
    }

    #[test]
    fn pictures_of_nothing_are_not_compared() {
        let lit = [[0.0, 0.0, 0.0], [0.9, 1.0, 1.1]];
        let accepted = |picture: &[[f32; 3]]| judge(picture, &|_| json!({}), &[]).1.is_empty();
        assert!(accepted(&lit));
        assert!(!accepted(&[[0.0; 3]; 2]) && !accepted(&[[1.0; 3]; 2]), "black, constant");
        assert!(!accepted(&[lit[0], [1.0, f32::NAN, 1.0]]) && !accepted(&[lit[0], [9.0; 3]]));
        assert_eq!(one_bit(&lit)[0], lit[0]);
        assert_ne!(one_bit(&lit), lit);
    }
}
