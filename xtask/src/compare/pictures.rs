//! One scene through its camera: every executor's picture and the oracle's, by FLIP.

use std::time::Instant;

use asm_core::{RenderPlan, Settings};
use frame_plan::{ExecuteError, Executor};
use serde_json::{Value, json};
use spectral_core::display::{Display, ToneMap, srgb_from_linear};
use spectral_reference::RenderSettings;
use xtask::flip::{PIXELS_PER_DEGREE, Picture, flip};
use xtask::metrics::{Map, exposure};

use super::bakes::{Comparison, ORACLE, common_limits, percent_on_terminal};
use super::report::{Check, Control, PictureRow, Png, Status, shown};
use super::{Contender, MethodName};

/// Executors on the same plan: a silhouette may fall to the other side of a pixel's samples here and there.
/// docs/src/comparing.md has what was measured.
const PARITY_FLIP: f64 = 4e-3;

/// Who made a picture, and its XYZ.
type Made = (&'static str, Vec<[f32; 3]>);

impl Comparison<'_> {
    /// Compare camera pictures, if the scene has a camera.
    pub(super) fn compare_pictures(&mut self, methods: &[MethodName], contenders: &mut [Contender]) {
        if self.subject.scene.cameras.is_empty() {
            return self.note("no camera, no pictures".into());
        }
        let oracle = self.render_oracle();
        for &method in methods {
            let name = method.name();
            let mut made = self.render_all(method, contenders);
            let executors = made.len();
            made.extend(oracle.clone());
            for i in 0..executors {
                for j in i + 1..made.len() {
                    self.check_pictures(&name, &made[i], &made[j]);
                }
            }
            self.show_pictures(&name, &made);
        }
    }

    fn render_oracle(&mut self) -> Option<Made> {
        let settings = RenderSettings {
            size: self.effort.picture_size,
            samples_per_pixel: self.effort.oracle_samples,
            photons: self.oracle_photons,
            ..RenderSettings::default()
        };
        let start = Instant::now();
        match spectral_reference::render(&self.subject.scene, &settings, &percent_on_terminal(ORACLE)) {
            Ok(picture) => {
                self.note(format!("{ORACLE}, picture: {:.1} s", start.elapsed().as_secs_f64()));
                Some((ORACLE, picture.xyz))
            }
            Err(error) => {
                self.fail("", ORACLE, format!("picture: {error}"));
                None
            }
        }
    }

    fn render_all(&mut self, method: MethodName, contenders: &mut [Contender]) -> Vec<Made> {
        let Some(limits) = common_limits(contenders) else { return Vec::new() };
        let settings = Settings { method: method.method(), ..Settings::default() };
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
            match run(&plan, executor) {
                Ok(xyz) => made.push((contender.entry.id, xyz)),
                Err(error) => {
                    contender.entry.status = Status::Failed;
                    contender.entry.reason = Some(format!("{} picture: {error}", self.subject.name));
                    contender.executor = None;
                }
            }
        }
        made
    }

    /// Parity is asserted; against the oracle the method's error is shown.
    fn check_pictures(&mut self, method: &str, a: &Made, b: &Made) {
        let bound = (b.0 != ORACLE).then_some(PARITY_FLIP);
        let exposure = exposure(&self.map(b)).unwrap_or(1.0);
        let (metrics, problems) = self.judge_pictures(&a.1, b, exposure, bound);
        let name = format!("{} {method} camera: {} against {}", self.subject.name, a.0, b.0);
        // A check that fails has shown that it can.
        if problems.is_empty() {
            self.control_pictures(&name, a, b, exposure, bound);
        }
        self.checks.push(Check {
            scene: self.subject.name.clone(),
            method: method.into(),
            layer: "camera",
            a: a.0,
            b: b.0,
            metrics,
            bound: bound.map_or(Value::Null, |b| json!({ "flip_mean": b })),
            ok: problems.is_empty(),
            problems,
        });
    }

    /// The same comparison with `a` spoiled.
    fn control_pictures(&mut self, check: &str, a: &Made, b: &Made, exposure: f64, bound: Option<f64>) {
        let mut not_finite = a.1.clone();
        not_finite[0][1] = f32::NAN;
        let mut spoiled = vec![("one NaN", not_finite)];
        // Without a bound only what is no picture at all can be refused.
        if bound.is_some() {
            let mut dark = a.1.clone();
            let count = dark.len();
            dark[count * 2 / 5..count * 3 / 5].fill([0.0; 3]);
            spoiled.push(("a fifth of the rows dark", dark));
        }
        for (fault, spoiled) in spoiled {
            let (_, problems) = self.judge_pictures(&spoiled, b, exposure, bound);
            self.controls.push(Control { name: format!("{check}: {fault}"), failed: !problems.is_empty() });
        }
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
        let [srgb_a, srgb_b] = [&a, &self.map(b)].map(|map| encoded(map, exposure));
        let [a, b] = [&srgb_a, &srgb_b].map(|srgb| Picture { size: a.size, srgb });
        let map = flip(&a, &b, PIXELS_PER_DEGREE);
        let mean = map.iter().sum::<f64>() / map.len() as f64;
        let over = bound.filter(|&bound| mean.is_nan() || mean > bound);
        let problems = over.map(|bound| format!("mean FLIP is {mean:.3e}, at most {bound:.1e} is accepted"));
        (json!({ "flip_mean": mean, "exposure": exposure }), problems.into_iter().collect())
    }

    fn show_pictures(&mut self, method: &str, made: &[Made]) {
        let Some(reference) = made.last() else { return };
        let exposure = exposure(&self.map(reference)).unwrap_or(1.0);
        let mut pictures: Vec<(String, Png)> =
            made.iter().map(|m| (m.0.to_owned(), shown(&self.map(m), exposure))).collect();
        let (first, last) = (&made[0], reference);
        if first.0 != last.0 {
            let [a, b] = [first, last].map(|m| encoded(&self.map(m), exposure));
            let size = self.effort.picture_size.map(|n| n as usize);
            let map = flip(&Picture { size, srgb: &a }, &Picture { size, srgb: &b }, PIXELS_PER_DEGREE);
            let grey: Vec<[u8; 3]> = map.iter().map(|v| [(v * 255.0).round() as u8; 3]).collect();
            pictures.push((
                format!("FLIP of {} against {}, white is 1", first.0, last.0),
                Png::encode(size, &grey),
            ));
        }
        let title = format!("{method}, camera, exposure {exposure:.3e} per cd/m^2, tone map: clip");
        self.entry.rows.push(PictureRow { title, pictures });
    }

    fn map<'a>(&self, made: &'a Made) -> Map<'a> {
        Map { size: self.effort.picture_size.map(|n| n as usize), xyz: &made.1 }
    }
}

/// Display sRGB at an exposure: everything above white cut, one gamut map.
fn encoded(map: &Map<'_>, exposure: f64) -> Vec<[f64; 3]> {
    let display = Display { exposure, tone_map: ToneMap::Clip };
    map.xyz.iter().map(|xyz| display.linear_srgb_from_xyz(xyz.map(f64::from)).map(srgb_from_linear)).collect()
}

/// One frame.
fn run(plan: &RenderPlan, executor: &mut dyn Executor) -> Result<Vec<[f32; 3]>, ExecuteError> {
    executor.prepare(&plan.plan)?;
    executor.execute()?;
    Ok(plan.read(executor)?.0.xyz)
}
