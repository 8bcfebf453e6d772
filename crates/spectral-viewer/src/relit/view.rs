//! What the user sees of what is relit and has set: the state behind the panel, without a window.

use std::f64::consts::PI;
use std::sync::Arc;

use asm_core::Picture;
use asm_wgpu::wgpu;
use egui::{Key, Rect, Ui};
use frame_plan::DeviceInfo;
use glam::{DQuat, DVec3};
use spectral_cli::RelitView;
use spectral_cli::view::ViewArgs;
use spectral_core::illuminant::Illuminant;

use super::choices::{COEFFICIENTS, Choices};
use super::gauge::Gauge;
use super::job::RelitJob;
use super::{controls, making};
use crate::graphics::Graphics;
use crate::hand::{Grip, Touch};
use crate::maker::Maker;
use crate::orbit::{Orbit, axes};
use crate::showing::{Showing, after};
use crate::subject::Subject;
use crate::worker::Wake;

/// A drag over the picture's height turns by this angle, radians.
const TURN_RAD: f64 = PI;
/// A scroll by a point zooms by e to the power of this.
const ZOOM_PER_POINT: f64 = 1.0 / 400.0;

/// Everything that the user can change, and what measures it.
pub(crate) struct View {
    pub(super) showing: Showing,
    pub(super) stage: Arc<RelitView>,
    pub(super) choices: Choices,
    /// In whose light the sky is; none for its own.
    pub(super) lamp: Option<Illuminant>,
    /// How the sky is turned.
    turn: DQuat,
    orbit: Orbit,
    pub(super) gauge: Gauge,
}

impl View {
    /// What the command line asks for, in a window on the device `window` that `wake` wakes.
    pub(crate) fn new(stage: RelitView, args: &ViewArgs, window: &DeviceInfo, wake: Wake) -> Self {
        let stage = Arc::new(stage);
        Self {
            showing: Showing::new(&stage.name, args, window),
            choices: Choices {
                basis: stage.basis,
                coefficients: stage.coefficients,
                is_spectral: true,
                samples: 1,
            },
            lamp: stage.lamp,
            turn: DQuat::IDENTITY,
            orbit: Orbit::new(stage.figure.camera.clone(), middle(&stage)),
            gauge: Gauge::new(Arc::clone(&stage), wake),
            stage,
        }
    }

    /// Lights to choose from: a file's own, which is none, and all illuminants.
    pub(super) fn lamps(&self) -> Vec<Option<Illuminant>> {
        let own = self.stage.lamp.is_none().then_some(None);
        own.into_iter().chain(Illuminant::ALL.map(Some)).collect()
    }

    /// Drag the sky: what lights from the front goes where the pointer goes.
    fn turn(&mut self, right_rad: f64, down_rad: f64) {
        let [right, _, _] = axes(self.orbit.camera());
        let by = DQuat::from_rotation_y(right_rad) * DQuat::from_axis_angle(right, down_rad);
        self.turn = (by * self.turn).normalize();
    }
}

impl Subject for View {
    type Job = RelitJob;
    const KEYS: &'static [Key] = &[Key::L, Key::M, Key::N];
    const FILTER: wgpu::FilterMode = wgpu::FilterMode::Nearest;
    const RESET_HINT: &'static str = "sky, illuminant and camera as they began";

    fn showing(&self) -> &Showing {
        &self.showing
    }

    fn showing_mut(&mut self) -> &mut Showing {
        &mut self.showing
    }

    fn maker(&self, graphics: &Graphics, wake: Wake) -> Maker<RelitJob> {
        making::maker(self.showing.runner, Arc::clone(&self.stage), graphics, wake)
    }

    fn job(&self, area: [u32; 2]) -> RelitJob {
        RelitJob {
            colors: self.choices.colors(),
            samples: self.choices.samples,
            size: area.map(|side| side.max(1)),
            lamp: self.lamp,
            turn: self.turn,
            camera: self.orbit.camera().clone(),
        }
    }

    fn advance(&mut self, _: f64) {
        self.gauge.collect();
    }

    fn reset(&mut self) {
        (self.turn, self.lamp) = (DQuat::IDENTITY, self.stage.lamp);
        self.orbit.reset();
    }

    fn press(&mut self, key: Key) {
        match key {
            Key::L => self.lamp = after(&self.lamps(), &self.lamp),
            Key::M => self.choices.coefficients = after(&COEFFICIENTS, &self.choices.coefficients),
            Key::N => self.choices.is_spectral = !self.choices.is_spectral,
            _ => {}
        }
    }

    fn touch(&mut self, touch: Touch, stage: Rect) {
        let Touch::Drag(grip, by) = touch else { return };
        let [right, down] = [by.x, by.y].map(|by| f64::from(by / stage.height()));
        match grip {
            Grip::Main => self.turn(right * TURN_RAD, down * TURN_RAD),
            Grip::Lamp => self.orbit.turn(right * TURN_RAD, down * TURN_RAD),
            Grip::Shift => self.orbit.shift(right, down),
        }
    }

    fn scroll(&mut self, points: f64) {
        self.orbit.zoom((-points * ZOOM_PER_POINT).exp());
    }

    fn wants(&self, job: &RelitJob) -> bool {
        self.gauge.wants(job)
    }

    fn take(&mut self, job: &RelitJob, _: &Picture) {
        self.gauge.take(job);
    }

    fn choices(&mut self, ui: &mut Ui) {
        controls::choices(ui, self);
    }

    fn stage_controls(&mut self, ui: &mut Ui) {
        controls::light(ui, self);
    }

    fn tell(&self, ui: &mut Ui, (): &()) {
        controls::error(ui, self);
    }
}

/// The middle of all surfaces' bounds.
fn middle(stage: &RelitView) -> DVec3 {
    let positions = stage.figure.surfaces.iter().flat_map(|surface| surface.positions());
    let bounds = positions.fold(None, |bounds: Option<(DVec3, DVec3)>, p| {
        Some(bounds.map_or((*p, *p), |(low, high)| (low.min(*p), high.max(*p))))
    });
    bounds.map_or(DVec3::ZERO, |(low, high)| (low + high) / 2.0)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use clap::Parser;
    use egui::{Pos2, vec2};
    use spectral_cli::view::Subject as Asked;
    use spectral_cli::{Basis, CliError};

    use crate::relit::choices::Colors;
    use crate::runner::Runner;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: ViewArgs,
    }

    const STAGE: Rect = Rect { min: Pos2 { x: 390.0, y: 0.0 }, max: Pos2 { x: 1280.0, y: 800.0 } };
    const AREA: [u32; 2] = [890, 800];

    fn opened(arguments: &str) -> Result<View, CliError> {
        let words = ["spectral-viewer"].into_iter().chain(arguments.split_whitespace());
        let args = Cli::try_parse_from(words).expect("arguments").args;
        let Asked::Relit(request) = args.subject()? else { panic!("{arguments} is not relit") };
        Ok(View::new(request.open()?, &args, &DeviceInfo::default(), Arc::new(|| ())))
    }

    pub(in crate::relit) fn view(arguments: &str) -> View {
        opened(arguments).expect("something to relight")
    }

    #[test]
    fn options_are_where_it_begins() {
        let view = view("glass --environment FL4 --coefficients 8 --basis peercy --bands 2 --backend vulkan");
        let job = view.job(AREA);
        assert_eq!((job.colors, job.lamp), (Colors::Spectral(Basis::Peercy, 8), Some(Illuminant::Fl4)));
        assert_eq!(view.showing.runner, Runner::Vulkan);
        for wrong in [
            "glass --environment FL4 --method asm",
            "glass --environment FL4 --wavelengths 7",
            "glass --environment FL4 --coefficients 60 --bands 1",
            "glass --environment moonlight",
            "color-checker --precision f16",
        ] {
            assert!(matches!(opened(wrong), Err(CliError::Usage(_))), "{wrong}");
        }
    }

    #[test]
    fn each_grip_and_key_moves_its_own_part() {
        let still = view("glass --environment D65 --bands 2").job(AREA);
        let after_ = |change: &dyn Fn(&mut View)| {
            let mut view = view("glass --environment D65 --bands 2");
            change(&mut view);
            let job = view.job(AREA);
            view.reset();
            (job, view.job(AREA))
        };
        let drag = |grip| move |view: &mut View| view.touch(Touch::Drag(grip, vec2(40.0, -20.0)), STAGE);
        let (sky, back) = after_(&drag(Grip::Main));
        assert_eq!((RelitJob { turn: still.turn, ..sky.clone() }, back), (still.clone(), still.clone()));
        assert_ne!(sky.turn, still.turn);
        for grip in [Grip::Lamp, Grip::Shift] {
            let (seen, _) = after_(&drag(grip));
            assert_ne!(seen.camera, still.camera, "{grip:?}");
            assert_eq!(RelitJob { camera: still.camera.clone(), ..seen }, still);
        }
        let (lamp, _) = after_(&|view| view.press(Key::L));
        assert_eq!((lamp.lamp, lamp.colors), (Some(Illuminant::E), still.colors));
        let (rgb, _) = after_(&|view| view.press(Key::N));
        assert_eq!((rgb.lamp, rgb.colors), (still.lamp, Colors::Rgb));
        let (more, _) = after_(&|view| view.press(Key::M));
        assert_eq!(more.colors, Colors::Spectral(Basis::Optimal, 8));
    }

    /// What lights from the front is dragged to the right: a light from behind the eye comes from the right of it then.
    #[test]
    fn the_sky_follows_the_pointer() {
        let mut view = view("glass --environment D65 --bands 2");
        let [right, _, backward] = axes(view.orbit.camera());
        view.touch(Touch::Drag(Grip::Main, vec2(80.0, 0.0)), STAGE);
        assert!((view.turn * backward).dot(right) > 0.1);
    }
}
