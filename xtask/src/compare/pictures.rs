//! One scene through its camera: every executor's picture and the oracle's, by FLIP.

use std::rc::Rc;
use std::time::Instant;

use frame_plan::DeviceInfo;
use serde_json::{Value, json};
use spectral_reference::RenderSettings;
use xtask::checks::{Snapping, is_within_noise};
use xtask::executors;
use xtask::metrics::{Map, exposure};
use xtask::oracle_picture::OraclePicture;
use xtask::picture_distance::{flip_map, mean_flip};
use xtask::terminal_percent::percent_on_terminal;

use super::bakes::{Comparison, ORACLE, common_limits, contents};
use super::report::{Check, PictureRow, Png, shown};
use super::{Contender, MethodName, taking};

/// What was found about two pictures; equal contents under an equal bound are judged once.
pub(super) struct Answer {
    contents: [u64; 2],
    bound: Option<f64>,
    metrics: Value,
    problems: Vec<String>,
    /// Each fault put into the first picture, and whether it was found; none for a check that fails: it has shown that it can.
    controls: Vec<(&'static str, bool)>,
}

/// A picture.
#[derive(Clone)]
struct Made {
    /// Who made it.
    id: &'static str,
    /// None for the oracle.
    device: Option<DeviceInfo>,
    /// Texels across its lights' views; 0 for the oracle.
    emission_size: u32,
    xyz: Vec<[f32; 3]>,
}

/// The oracle's picture.
struct Oracle {
    /// The mean of two independent halves.
    made: Made,
    /// One of them: its distance from the mean has the variance of the mean's own error.
    half: Vec<[f32; 3]>,
}

impl Comparison<'_> {
    /// Compare camera pictures, if the scene has a camera.
    pub(super) fn compare_pictures(&mut self, methods: &[MethodName], contenders: &mut [Contender]) {
        if self.subject.scene.cameras.is_empty() {
            return self.note("no camera, no pictures".into());
        }
        let oracle = self.render_oracle();
        let noise = oracle.as_ref().map(|oracle| self.flip_of(&oracle.half, &oracle.made));
        if let Some(noise) = noise {
            self.note(format!("{ORACLE}, picture: its own noise has a mean FLIP of {noise:.1e}"));
        }
        for &method in methods {
            let name = method.name();
            let mut made = self.render_all(method, contenders);
            let executors = made.len();
            made.extend(oracle.as_ref().map(|oracle| oracle.made.clone()));
            for i in 0..executors {
                for j in i + 1..made.len() {
                    self.check_pictures(&name, &made[i], &made[j], noise);
                }
            }
            self.show_pictures(&name, &made);
        }
    }

    /// Two halves of the effort, with a seed of its own each.
    fn render_oracle(&mut self) -> Option<Oracle> {
        let settings = RenderSettings {
            size: self.effort.picture_size,
            samples_per_pixel: self.effort.oracle_samples,
            photons: self.picture_photons,
            ..RenderSettings::default()
        };
        let start = Instant::now();
        match OraclePicture::render(&self.subject.scene, &settings, &percent_on_terminal(ORACLE)) {
            Ok(OraclePicture { xyz, half }) => {
                self.note(format!("{ORACLE}, picture: {:.1} s", start.elapsed().as_secs_f64()));
                Some(Oracle { made: Made { id: ORACLE, device: None, emission_size: 0, xyz }, half })
            }
            Err(error) => {
                self.fail("", ORACLE, format!("picture: {error}"));
                None
            }
        }
    }

    fn render_all(&mut self, method: MethodName, contenders: &mut [Contender]) -> Vec<Made> {
        let contenders = taking(contenders, self.subject, method);
        let Some(limits) = common_limits(contenders) else { return Vec::new() };
        let settings = method.settings();
        let size = self.effort.picture_size;
        let plan = match asm_core::render_plan(&self.subject.scene, 0, size, &settings, &limits) {
            Ok(plan) => plan,
            Err(error) => {
                self.fail(&method.name(), "plan", format!("picture: {error}"));
                return Vec::new();
            }
        };
        let mut made = Vec::new();
        for contender in contenders {
            let Some(executor) = contender.executor.as_deref_mut() else { continue };
            match executors::render(&plan, executor) {
                Ok(xyz) => {
                    let (id, device) = (contender.entry.name, Some(contender.info.clone()));
                    made.push(Made { id, device, emission_size: settings.emission_size, xyz });
                }
                Err(error) => contender.fail(format!("{} picture: {error}", self.subject.name)),
            }
        }
        made
    }

    /// Parity is asserted; against the oracle the method's error is shown.
    fn check_pictures(&mut self, method: &str, a: &Made, b: &Made, noise: Option<f64>) {
        let snapping = a.device.as_ref().zip(b.device.as_ref()).map(|(a, b)| Snapping::between(a, b));
        let bound =
            snapping.map(|snapping| snapping.parity_flip(self.effort.picture_size[0], a.emission_size));
        let answer = self.picture_answer(a, b, bound);
        let Answer { metrics, problems, controls, .. } = &*answer;
        let name = format!("{} {method} camera: {} against {}", self.subject.name, a.id, b.id);
        let noise = noise.filter(|_| b.device.is_none());
        let distance = metrics["flip_mean"].as_f64();
        self.note_controls(&name, controls);
        self.checks.push(Check {
            scene: self.subject.name.clone(),
            method: method.into(),
            layer: "camera",
            a: a.id,
            b: b.id,
            metrics: metrics.clone(),
            bound: bound.map_or(Value::Null, |b| json!({ "flip_mean": b })),
            oracle_standard_error: noise,
            within_oracle_noise: distance.zip(noise).map(|(d, n)| is_within_noise(d, n)),
            ok: problems.is_empty(),
            problems: problems.clone(),
        });
    }

    /// The judgement of two pictures with its controls, made where these contents were not judged before.
    fn picture_answer(&mut self, a: &Made, b: &Made, bound: Option<f64>) -> Rc<Answer> {
        let contents = [a, b].map(|made| contents(&made.xyz));
        let before =
            self.picture_answers.iter().find(|answer| (answer.contents, answer.bound) == (contents, bound));
        if let Some(answer) = before {
            return answer.clone();
        }
        let exposure = exposure(&self.map(b)).unwrap_or(1.0);
        let (metrics, problems) = self.judge_pictures(&a.xyz, b, exposure, bound);
        let controls =
            if problems.is_empty() { self.picture_controls(a, b, exposure, bound) } else { Vec::new() };
        let answer = Rc::new(Answer { contents, bound, metrics, problems, controls });
        self.picture_answers.push(answer.clone());
        answer
    }

    /// The same comparison with `a` spoiled.
    fn picture_controls(
        &self,
        a: &Made,
        b: &Made,
        exposure: f64,
        bound: Option<f64>,
    ) -> Vec<(&'static str, bool)> {
        let mut not_finite = a.xyz.clone();
        not_finite[0][1] = f32::NAN;
        let mut spoiled = vec![("one NaN", not_finite)];
        // Without a bound only what is no picture at all can be refused.
        if bound.is_some() {
            let mut dark = a.xyz.clone();
            // Where there is something to lose.
            let band = dark.len().div_ceil(5);
            let light = |rows: &[[f32; 3]]| rows.iter().map(|xyz| xyz[1]).sum::<f32>();
            if let Some(rows) = dark.chunks_mut(band).max_by(|a, b| light(a).total_cmp(&light(b))) {
                rows.fill([0.0; 3]);
            }
            spoiled.push(("the brightest fifth of the rows dark", dark));
        }
        let found = |(fault, spoiled): (_, Vec<_>)| {
            (fault, !self.judge_pictures(&spoiled, b, exposure, bound).1.is_empty())
        };
        spoiled.into_iter().map(found).collect()
    }

    fn judge_pictures(
        &self,
        a: &[[f32; 3]],
        b: &Made,
        exposure: f64,
        bound: Option<f64>,
    ) -> (Value, Vec<String>) {
        let a = Map { xyz: a, ..self.map(b) };
        for (name, map) in [("a", &a), ("b", &self.map(b))] {
            // What a lamp may put on a pixel has no bound: a caustic may be as bright as it likes.
            if let Err(error) = map.check_light(f64::INFINITY).and_then(|()| map.check_varies()) {
                return (Value::Null, vec![format!("nothing to compare, {name}: {error}")]);
            }
        }
        let mean = mean_flip(&a, &self.map(b), exposure);
        let over = bound.filter(|&bound| mean.is_nan() || mean > bound);
        let problems = over.map(|bound| format!("mean FLIP is {mean:.3e}, at most {bound:.1e} is accepted"));
        (json!({ "flip_mean": mean, "exposure": exposure }), problems.into_iter().collect())
    }

    fn show_pictures(&mut self, method: &str, made: &[Made]) {
        let Some(reference) = made.last() else { return };
        let exposure = exposure(&self.map(reference)).unwrap_or(1.0);
        let mut pictures: Vec<(String, Png)> =
            made.iter().map(|m| (m.id.to_owned(), shown(&self.map(m), exposure))).collect();
        let (first, last) = (&made[0], reference);
        if first.id != last.id {
            let map = flip_map(&self.map(first), &self.map(last), exposure);
            let grey: Vec<[u8; 3]> = map.iter().map(|v| [(v * 255.0).round() as u8; 3]).collect();
            pictures.push((
                format!("FLIP of {} against {}, white is 1", first.id, last.id),
                Png::encode(self.effort.picture_size.map(|n| n as usize), &grey),
            ));
        }
        let title = format!("{method}, camera, exposure {exposure:.3e} per cd/m^2, tone map: clip");
        self.entry.rows.push(PictureRow { title, pictures });
    }

    /// Mean FLIP of a picture against a reference, at the reference's exposure.
    fn flip_of(&self, xyz: &[[f32; 3]], reference: &Made) -> f64 {
        let reference = self.map(reference);
        let exposure = exposure(&reference).unwrap_or(1.0);
        mean_flip(&Map { xyz, ..reference }, &reference, exposure)
    }

    fn map<'a>(&self, made: &'a Made) -> Map<'a> {
        Map { size: self.effort.picture_size.map(|n| n as usize), xyz: &made.xyz }
    }
}
