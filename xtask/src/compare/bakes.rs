//! One scene: the oracle's bake, every executor's with every method, and what is asserted about them.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::rc::Rc;
use std::sync::OnceLock;
use std::time::Instant;

use asm_core::BakePlan;
use frame_plan::{DeviceInfo, Limits};
use spectral_reference::{Bake, BakeSettings, Effort as Photons};
use spectral_scene::IrradianceMaps;
use xtask::checks::{Bound, CONVEX, DIRECT, Expected, Judgement, MIRRORED, Snapping, is_within_noise, judge};
use xtask::executors;
use xtask::layers::{Layer, size, total};
use xtask::metrics::{Map, exposure};
use xtask::sabotage::Sabotage;
use xtask::subject::Subject;
use xtask::terminal_percent::percent_on_terminal;

use super::report::{Check, Control, PictureRow, Report, SceneEntry, difference, shown};
use super::{Contender, Effort, MethodName, controls, pictures, taking};

/// Name of the oracle in checks.
pub(super) const ORACLE: &str = "oracle";

/// Scenes whose glass leaves image space nothing to guess, see [`CONVEX`].
const CONVEX_SCENES: [&str; 3] = ["sphere", "sphere-fine", "water"];

/// Scenes whose light is reflected once by a mirror and then lands, see [`MIRRORED`].
const MIRROR_SCENES: [&str; 1] = ["metal-ring"];

/// Shadow rays of the oracle per texel: its bound is far above the noise that this leaves.
const DIRECT_SAMPLES: u32 = 16;

/// Photons of the bake that tells how fast the oracle is on a scene.
const PILOT_PHOTONS: u64 = 1 << 15;

/// What the oracle's photons may take, seconds a bake and a picture; the number is rounded down to a power of two, so three
/// quarters of that on average: 12 s a scene. Three methods on three software executors, with controls and pictures, took 50 s of
/// CPU on `sphere`, 25 s on two cores, so ten scenes are six to seven minutes of the nine that a cold build leaves of fifteen.
const ORACLE_SECONDS: f64 = 10.0;
const ORACLE_PICTURE_SECONDS: f64 = 6.0;

/// What one executor, or the oracle, made of a scene.
struct Baked<'a> {
    id: &'static str,
    maps: &'a IrradianceMaps,
    /// None for the oracle.
    device: Option<&'a DeviceInfo>,
    /// Texels across its lights' views; 0 for the oracle.
    emission_size: u32,
}

/// What was asked about two maps; equal questions have equal answers. Methods share their direct light, and executors on one
/// driver all they make.
#[derive(PartialEq)]
struct Question {
    layer: Layer,
    contents: [u64; 2],
    bound: Option<Bound>,
}

/// What was found.
struct Answer {
    judgement: Judgement,
    /// Each fault put into the first map, and whether it was found; none for a check that fails: it has shown that it can.
    controls: Vec<(&'static str, bool)>,
}

/// A scene while it is compared.
pub(super) struct Comparison<'a> {
    pub(super) subject: &'a Subject,
    pub(super) effort: &'a Effort,
    oracle: Option<Rc<Bake>>,
    /// Photons that the oracle can afford for a picture here.
    pub(super) picture_photons: u64,
    answers: Vec<(Question, Rc<Answer>)>,
    pub(super) picture_answers: Vec<Rc<pictures::Answer>>,
    spoiled_plans: usize,
    pub(super) entry: SceneEntry,
    pub(super) checks: Vec<Check>,
    pub(super) controls: Vec<Control>,
}

/// Compare everything on one scene; whatever goes wrong becomes a check that fails.
pub(super) fn compare(
    subject: &Subject,
    methods: &[MethodName],
    effort: &Effort,
    sabotage: Option<Sabotage>,
    contenders: &mut [Contender],
    report: &mut Report,
) {
    let start = Instant::now();
    let entry = SceneEntry { name: subject.name.clone(), notes: Vec::new(), rows: Vec::new() };
    let mut comparison = Comparison {
        subject,
        effort,
        oracle: None,
        picture_photons: PILOT_PHOTONS,
        answers: Vec::new(),
        picture_answers: Vec::new(),
        spoiled_plans: 0,
        entry,
        checks: Vec::new(),
        controls: Vec::new(),
    };
    comparison.bake_oracle();
    for &method in methods {
        comparison.compare_method(method, sabotage, contenders);
    }
    comparison.compare_pictures(methods, contenders);
    comparison.note(format!("all of it: {:.1} s", start.elapsed().as_secs_f64()));
    report.spoiled_plans += comparison.spoiled_plans;
    report.scenes.push(comparison.entry);
    report.checks.extend(comparison.checks);
    report.controls.extend(comparison.controls);
}

impl Comparison<'_> {
    fn bake_oracle(&mut self) {
        let mut settings = BakeSettings {
            size: [64, 64],
            effort: Photons::Photons(PILOT_PHOTONS),
            direct_samples: DIRECT_SAMPLES,
            ..BakeSettings::default()
        };
        let (scene, receiver) = (&self.subject.scene, self.subject.receiver);
        // The first share of work above 0 is reported when everything but the photons is done.
        let prepared = OnceLock::new();
        let progress = |share| {
            if share > 0.0 {
                prepared.get_or_init(Instant::now);
            }
        };
        if let Err(error) = spectral_reference::bake(scene, receiver, &settings, &progress) {
            return self.fail("", ORACLE, error.to_string());
        }
        let seconds = prepared.get().map_or(0.0, |start| start.elapsed().as_secs_f64());
        let affordable = |budget: f64| {
            let photons = PILOT_PHOTONS as f64 * budget / seconds.max(1e-3);
            // Powers of two, so that machines of about one speed do the same work.
            (1 << photons.log2() as u32).clamp(PILOT_PHOTONS, self.effort.oracle_photons)
        };
        self.picture_photons = affordable(ORACLE_PICTURE_SECONDS);
        settings.effort = Photons::Photons(affordable(ORACLE_SECONDS));
        settings.size = self.effort.map_size;
        let start = Instant::now();
        let progress = percent_on_terminal("oracle");
        match spectral_reference::bake(scene, receiver, &settings, &progress) {
            Ok(bake) => {
                let error = bake.standard_error;
                self.note(format!(
                    "oracle: {} photons in {:.1} s; standard error of Y at 64 x 64: direct {:.1e}, refracted {:.1e}, \
                     reflected {:.1e}",
                    bake.photons,
                    start.elapsed().as_secs_f64(),
                    error.direct,
                    error.refracted,
                    error.reflected
                ));
                self.oracle = Some(Rc::new(bake));
            }
            Err(error) => self.fail("", ORACLE, error.to_string()),
        }
    }

    fn compare_method(
        &mut self,
        method: MethodName,
        sabotage: Option<Sabotage>,
        contenders: &mut [Contender],
    ) {
        let contenders = taking(contenders, self.subject, method);
        let name = method.name();
        let settings = method.settings();
        let (scene, receiver) = (&self.subject.scene, self.subject.receiver);
        let Some(limits) = common_limits(contenders) else { return };
        let plan = match asm_core::bake_plan(scene, receiver, self.effort.map_size, &settings, &limits) {
            Ok(plan) => plan,
            Err(error) => return self.fail(&name, "plan", error.to_string()),
        };
        let spoiled = contenders.iter().rposition(|c| c.executor.is_some());
        let mut maps = Vec::new();
        for (i, contender) in contenders.iter_mut().enumerate() {
            let plan = match sabotage {
                Some(sabotage) if spoiled == Some(i) => {
                    let spoiled = sabotage.spoil(&plan);
                    self.spoiled_plans += usize::from(spoiled != plan);
                    spoiled
                }
                _ => plan.clone(),
            };
            if let Some(baked) = self.bake(&plan, contender, &name) {
                maps.push((contender.entry.name, contender.info.clone(), baked));
            }
        }
        // An executor alone is held against itself, and a spoiled one against what it makes of the plan as it was.
        if let [(id, ..)] = maps[..]
            && let Some(alone) = contenders.iter_mut().find(|c| c.entry.name == id)
        {
            let again = self.bake(&plan, alone, &name);
            maps.extend(again.map(|again| (id, alone.info.clone(), again)));
        }
        let results: Vec<_> = maps
            .iter()
            .map(|(id, device, maps)| Baked {
                id,
                maps,
                device: Some(device),
                emission_size: settings.emission_size,
            })
            .collect();
        for (i, a) in results.iter().enumerate() {
            for b in &results[i + 1..] {
                let bound = parity(a, b);
                self.check_layers(&name, a, b, |_| bound);
            }
        }
        let convex = CONVEX_SCENES.contains(&self.subject.name.as_str());
        let mirrored = MIRROR_SCENES.contains(&self.subject.name.as_str()) && settings.wavelength_count() > 1;
        if let Some(oracle) = self.oracle.clone() {
            let b = oracle_baked(&oracle.maps);
            for a in &results {
                self.check_layers(&name, a, &b, |layer| match layer {
                    Layer::Direct => Some(DIRECT),
                    Layer::Refracted if convex => Some(CONVEX),
                    Layer::Reflected if mirrored => Some(MIRRORED),
                    Layer::Refracted | Layer::Reflected => None,
                });
            }
        }
        // A spoiled executor is no measure for controls.
        if let (None, Some(first)) = (sabotage, results.first()) {
            self.control_plans(&name, &plan, first, contenders);
        }
        self.show(&name, &results);
    }

    /// Run a plan; an executor that fails is not asked again.
    fn bake(&mut self, plan: &BakePlan, contender: &mut Contender, method: &str) -> Option<IrradianceMaps> {
        let executor = contender.executor.as_deref_mut()?;
        let start = Instant::now();
        match executors::bake(plan, executor) {
            Ok((maps, _)) => {
                let (id, seconds) = (contender.entry.name, start.elapsed().as_secs_f64());
                self.note(format!("{id}, {method}: {seconds:.2} s, pipelines and transfers included"));
                Some(maps)
            }
            Err(error) => {
                contender.fail(format!("{} {method}: {error}", self.subject.name));
                None
            }
        }
    }

    /// One check a layer, with its controls.
    fn check_layers(&mut self, method: &str, a: &Baked, b: &Baked, bound: impl Fn(Layer) -> Option<Bound>) {
        for layer in Layer::ALL {
            let absent = [a, b].map(|baked| layer.is_negligible(baked.maps));
            // What is in neither cannot be compared, nor what few photons reflect, unless there is a bound for it.
            let bound = bound(layer);
            if absent == [true, true] || (absent[0] && layer == Layer::Reflected && bound.is_none()) {
                continue;
            }
            let (map_a, map_b) = (layer.of(a.maps), layer.of(b.maps));
            let answer = self.answer(layer, &map_a, &map_b, bound);
            let Answer { judgement, controls } = &*answer;
            let noise = self.oracle_error(layer).filter(|_| b.id == ORACLE);
            let distance = judgement.metrics.as_ref().map(|m| m.rms_64);
            let name = format!("{} {method} {}: {} against {}", self.subject.name, layer.name(), a.id, b.id);
            self.note_controls(&name, controls);
            self.checks.push(Check {
                scene: self.subject.name.clone(),
                method: method.into(),
                layer: layer.name(),
                a: a.id,
                b: b.id,
                metrics: serde_json::to_value(&judgement.metrics).unwrap_or_default(),
                bound: serde_json::to_value(bound).unwrap_or_default(),
                oracle_standard_error: noise,
                within_oracle_noise: distance.zip(noise).map(|(d, n)| is_within_noise(d, n)),
                ok: judgement.problems.is_empty(),
                problems: judgement.problems.clone(),
            });
        }
    }

    /// Note, for each fault that a check's controls put in, whether it was found.
    pub(super) fn note_controls(&mut self, check: &str, faults: &[(&str, bool)]) {
        let control =
            |(fault, found): &(&str, bool)| Control { name: format!("{check}: {fault}"), failed: *found };
        self.controls.extend(faults.iter().map(control));
    }

    /// The judgement of two maps with its controls, made where these contents were not judged before.
    fn answer(&mut self, layer: Layer, a: &Map<'_>, b: &Map<'_>, bound: Option<Bound>) -> Rc<Answer> {
        let question = Question { layer, contents: [a, b].map(|map| contents(map.xyz)), bound };
        if let Some((_, answer)) = self.answers.iter().find(|(asked, _)| *asked == question) {
            return answer.clone();
        }
        let expected = self.expected(layer);
        let judgement = judge(a, b, expected, bound);
        let controls = if judgement.problems.is_empty() {
            controls::with_spoiled_maps(a, b, expected, bound)
        } else {
            Vec::new()
        };
        let answer = Rc::new(Answer { judgement, controls });
        self.answers.push((question, answer.clone()));
        answer
    }

    /// The oracle's standard error of Y at 64 x 64, relative as the distances are.
    fn oracle_error(&self, layer: Layer) -> Option<f64> {
        let error = self.oracle.as_ref()?.standard_error;
        Some(match layer {
            Layer::Direct => error.direct,
            Layer::Refracted => error.refracted,
            Layer::Reflected => error.reflected,
        })
    }

    fn expected(&self, layer: Layer) -> Expected {
        let unshadowed =
            self.oracle.as_ref().is_some_and(|o| Layer::Direct.of(&o.maps).check_varies().is_err());
        self.subject.expected(layer, !unshadowed)
    }

    /// Spoil the plan in every way, run it again where `good` was made, and ask for parity: it must not hold.
    fn control_plans(&mut self, method: &str, plan: &BakePlan, good: &Baked, contenders: &mut [Contender]) {
        let Some(contender) = contenders.iter_mut().find(|c| c.entry.name == good.id) else { return };
        for sabotage in Sabotage::ALL {
            let Some(executor) = contender.executor.as_deref_mut() else { return };
            let spoiled = sabotage.spoil(plan);
            if spoiled == *plan {
                self.note(format!(
                    "{method}: no control with {}, the plan has no place for it",
                    sabotage.description()
                ));
                continue;
            }
            let failed = match executors::bake(&spoiled, executor) {
                Ok((maps, _)) => Layer::ALL.into_iter().any(|layer| {
                    let absent = layer.is_negligible(&maps) && layer.is_negligible(good.maps);
                    let (a, b) = (layer.of(&maps), layer.of(good.maps));
                    !absent && !judge(&a, &b, self.expected(layer), parity(good, good)).problems.is_empty()
                }),
                // A plan without one of its passes may be refused: noticed as well.
                Err(_) => true,
            };
            let name = format!("{} {method}: {}", self.subject.name, sabotage.description());
            self.controls.push(Control { name, failed });
        }
    }

    /// Everyone's pictures side by side, all light and then what has been in glass, with differences.
    fn show(&mut self, method: &str, results: &[Baked]) {
        let oracle = self.oracle.as_ref().map(|bake| oracle_baked(&bake.maps));
        let everyone: Vec<&Baked> = results.iter().chain(&oracle).collect();
        let Some(reference) = everyone.last() else { return };
        let size = size(reference.maps);
        for (title, pick) in [
            ("all light", total as fn(&IrradianceMaps) -> Vec<[f32; 3]>),
            ("refracted", |maps| maps.refracted.clone()),
        ] {
            let layers: Vec<_> = everyone.iter().map(|baked| pick(baked.maps)).collect();
            let maps: Vec<_> = layers.iter().map(|xyz| Map { size, xyz }).collect();
            let exposure = maps.last().and_then(exposure).unwrap_or(1.0);
            let mut pictures: Vec<_> =
                everyone.iter().zip(&maps).map(|(b, m)| (b.id.to_owned(), shown(m, exposure))).collect();
            for j in 1..maps.len() {
                let (a, b) = (&maps[0], &maps[j]);
                let scale = difference_scale(a, b);
                let caption = format!(
                    "{} - {}: red +{scale:.1e}, blue -{scale:.1e} lux",
                    everyone[0].id, everyone[j].id
                );
                pictures.push((caption, difference(a, b, scale)));
            }
            let title = format!("{method}, {title}, exposure {exposure:.3e} / lux");
            self.entry.rows.push(PictureRow { title, pictures });
        }
    }

    /// Tell the terminal and the report.
    pub(super) fn note(&mut self, note: String) {
        eprintln!("  {note}");
        self.entry.notes.push(note);
    }

    /// Something that should have given a result gave an error.
    pub(super) fn fail(&mut self, method: &str, what: &'static str, problem: String) {
        eprintln!("  {what}: {problem}");
        self.checks.push(Check {
            scene: self.subject.name.clone(),
            method: method.into(),
            layer: "all",
            a: what,
            b: what,
            metrics: serde_json::Value::Null,
            bound: serde_json::Value::Null,
            oracle_standard_error: None,
            within_oracle_noise: None,
            ok: false,
            problems: vec![problem],
        });
    }
}

/// A number that differs where any bit does.
pub(super) fn contents(xyz: &[[f32; 3]]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytemuck::cast_slice::<_, u8>(xyz).hash(&mut hasher);
    hasher.finish()
}

fn oracle_baked(maps: &IrradianceMaps) -> Baked<'_> {
    Baked { id: ORACLE, maps, device: None, emission_size: 0 }
}

/// What may lie between two executors' bakes by one plan; none if one is the oracle's.
fn parity(a: &Baked, b: &Baked) -> Option<Bound> {
    let snapping = Snapping::between(a.device?, b.device?);
    Some(snapping.parity(a.emission_size))
}

/// What every executor can hold: parity means one plan for all. None if there is no executor.
pub(super) fn common_limits(contenders: &[Contender]) -> Option<Limits> {
    let limits = contenders.iter().filter_map(|c| c.executor.as_ref()).map(|e| e.limits());
    limits.reduce(Limits::common)
}

/// Four times the RMS of the differences of Y: a few texels may be farther off, most are not. 1 where there is none.
fn difference_scale(a: &Map<'_>, b: &Map<'_>) -> f64 {
    let squares = a.xyz.iter().zip(b.xyz).map(|(a, b)| f64::from(a[1] - b[1]).powi(2));
    let rms = (squares.sum::<f64>() / a.xyz.len() as f64).sqrt();
    if rms > 0.0 { 4.0 * rms } else { 1.0 }
}
