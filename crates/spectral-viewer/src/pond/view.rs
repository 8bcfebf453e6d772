//! What the user sees of the pond and has set: the state behind the panel, without a window.

use std::sync::Arc;

use asm_core::Picture;
use asm_wgpu::wgpu;
use caustic_heightfield::Pond;
use egui::{Key, Painter, Rect, Ui};
use frame_plan::DeviceInfo;
use spectral_cli::PondMethod;
use spectral_cli::view::{PondView, ViewArgs};
use spectral_core::observer::Observer;

use super::choices::{Choices, precisions};
use super::frames::Frames;
use super::gauge::Gauge;
use super::job::{Basin, FloorFacts, FloorJob};
use super::pebbles::Pebbles;
use super::sun::Sun;
use super::{beside, controls, plan_view};
use crate::graphics::Graphics;
use crate::hand::{Grip, Touch};
use crate::maker::Maker;
use crate::runner::{Place, Runner};
use crate::showing::{Showing, after};
use crate::subject::Subject;
use crate::worker::Wake;

/// A drag over the pond's height moves the sun so many times the way from the zenith to the horizon.
const SUN_PER_HEIGHT: f32 = 2.0;

/// Everything that the user can change, and what measures it.
pub(crate) struct View {
    pub(super) showing: Showing,
    pub(super) choices: Choices,
    pub(super) pebbles: Pebbles,
    pub(super) sun: Sun,
    basin: Arc<Basin>,
    /// Its light is the sun's.
    pond: Pond,
    pub(super) gauge: Gauge,
}

impl View {
    /// What the command line asks for, in a window on the device `window` that `wake` wakes.
    pub(crate) fn new(begin: PondView, args: &ViewArgs, window: &DeviceInfo, wake: Wake) -> Self {
        let PondView { extent_m, pond, spectrum, pebbles, choice, samples } = begin;
        let (ripple, walls) = (pebbles.ripple, pebbles.walls);
        let pebbles = Pebbles::new(pebbles, extent_m);
        let white_xyz = spectrum.unit_xyz(Observer::default());
        let basin = Basin { extent_m, ripple, walls, capacity: pebbles.capacity(), spectrum, white_xyz };
        Self {
            showing: Showing::new("pond", args, window),
            choices: Choices { floor: choice, samples, dispersion: true },
            sun: Sun::new(pond.unit_light_direction()),
            pebbles,
            basin: Arc::new(basin),
            pond,
            gauge: Gauge::new(wake),
        }
    }

    pub(super) fn take_method(&mut self, method: PondMethod) {
        self.choices.take_method(method);
    }
}

impl Subject for View {
    type Job = FloorJob;
    const KEYS: &'static [Key] = &[Key::M, Key::P, Key::N];
    // Texels are larger than pixels here, and light does not end at their edges.
    const FILTER: wgpu::FilterMode = wgpu::FilterMode::Linear;
    const RESET_HINT: &'static str = "water, sun and time as they began";

    fn showing(&self) -> &Showing {
        &self.showing
    }

    fn showing_mut(&mut self) -> &mut Showing {
        &mut self.showing
    }

    /// What is no plan of the pond's own passes is made beside the window, whoever makes it.
    fn place(&self) -> Place {
        let is_plan = self.choices.floor.is_plan() && !self.choices.is_spectral();
        let runner = self.showing.runner;
        Place { runner, inside: runner == Runner::Wgpu && is_plan }
    }

    fn maker(&self, graphics: &Graphics, wake: Wake) -> Maker<FloorJob> {
        let Place { runner, inside } = self.place();
        if inside {
            Maker::inside(Frames::new(graphics, wake))
        } else {
            Maker::beside(beside::worker(runner, graphics, wake))
        }
    }

    fn job(&self, _area: [u32; 2]) -> FloorJob {
        FloorJob {
            basin: Arc::clone(&self.basin),
            pond: Pond { light_direction: self.sun.light_direction(), ..self.pond.clone() },
            waves: self.pebbles.waves(),
            amplitude_m: self.pebbles.amplitude_m,
            choices: self.choices,
        }
    }

    fn advance(&mut self, seconds: f64) {
        self.pebbles.advance(self.showing.step_s(seconds));
        self.gauge.collect();
    }

    fn reset(&mut self) {
        self.pebbles.reset();
        self.sun.reset();
    }

    fn press(&mut self, key: Key) {
        match key {
            Key::M => self.take_method(after(&PondMethod::ALL, &self.choices.floor.method)),
            Key::P => {
                let all = precisions(self.choices.floor.method);
                self.choices.floor.precision = after(&all, &self.choices.floor.precision);
            }
            Key::N => self.choices.dispersion = !self.choices.dispersion,
            _ => {}
        }
    }

    fn picture_in(&self, stage: Rect) -> Rect {
        plan_view::covered(stage, self.basin.extent_m)
    }

    fn touch(&mut self, touch: Touch, stage: Rect) {
        let covered = self.picture_in(stage);
        match touch {
            Touch::Press(Grip::Main, at) => {
                if let Some(position_m) = plan_view::water_at(covered, self.basin.extent_m, at) {
                    self.pebbles.drop_at(position_m);
                }
            }
            Touch::Drag(Grip::Lamp, by) => {
                let by = SUN_PER_HEIGHT * by / stage.height();
                self.sun.drag([by.x.into(), by.y.into()]);
            }
            _ => {}
        }
    }

    fn wants(&self, job: &FloorJob) -> bool {
        self.gauge.wants(job)
    }

    fn take(&mut self, job: &FloorJob, picture: &Picture) {
        self.gauge.take(job, picture);
    }

    fn choices(&mut self, ui: &mut Ui) {
        controls::choices(ui, self);
    }

    fn stage_controls(&mut self, ui: &mut Ui) {
        controls::pebble_and_sun(ui, self);
    }

    fn tell(&self, ui: &mut Ui, facts: &FloorFacts) {
        controls::error(ui, self, facts);
    }

    fn paint_over(&self, painter: &Painter, picture: Rect) {
        controls::dial(painter, picture, &self.sun);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use clap::Parser;
    use egui::{Pos2, vec2};
    use spectral_cli::CliError;
    use spectral_cli::view;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: ViewArgs,
    }

    const STAGE: Rect = Rect { min: Pos2 { x: 390.0, y: 0.0 }, max: Pos2 { x: 1280.0, y: 800.0 } };
    const AREA: [u32; 2] = [890, 800];

    fn opened(arguments: &str) -> Result<View, CliError> {
        let words = ["spectral-viewer", "pond"].into_iter().chain(arguments.split_whitespace());
        let args = Cli::try_parse_from(words).expect("arguments").args;
        let view::Subject::Pond(pond) = args.subject()? else { panic!("the pond is no scene") };
        Ok(View::new(*pond, &args, &DeviceInfo::default(), Arc::new(|| ())))
    }

    pub(in crate::pond) fn view(arguments: &str) -> View {
        opened(arguments).expect("a pond")
    }

    #[test]
    fn options_are_where_it_begins() {
        let view = view("--method convolution --precision fixed12 --map 64 --backend vulkan --exposure 2");
        let job = view.job(AREA);
        assert_eq!((job.choices.floor.method, job.choices.samples), (PondMethod::Convolution, 64));
        assert_eq!(job.choices.floor.precision.to_string(), "fixed12");
        assert_eq!((view.showing.runner, view.showing.exposure), (Runner::Vulkan, Some(2.0)));
        for wrong in ["--method asm", "--precision fixed12", "--emission 64", "--levels 2"] {
            assert!(matches!(opened(wrong), Err(CliError::Usage(_))), "{wrong}");
        }
    }

    #[test]
    fn a_click_drops_a_pebble_where_it_is_on_the_water() {
        let mut view = view("");
        let covered = view.picture_in(STAGE);
        let still = view.job(AREA);
        for nothing in [
            Touch::Press(Grip::Main, STAGE.min + vec2(1.0, 1.0)),
            Touch::Press(Grip::Shift, covered.center()),
            Touch::Press(Grip::Lamp, covered.center()),
            Touch::Drag(Grip::Main, vec2(30.0, 0.0)),
        ] {
            view.touch(nothing, STAGE);
            view.advance(0.1);
            assert_eq!(view.job(AREA), still, "{nothing:?}");
        }
        let at = covered.min + vec2(0.25, 0.75) * covered.size();
        view.touch(Touch::Press(Grip::Main, at), STAGE);
        let [pebble] = *view.job(AREA).waves.impulses else { panic!("one pebble") };
        let [x, y] = pebble.position_m;
        assert!((x - 0.25).abs() < 1e-6 && (y - 0.75).abs() < 1e-6, "{x}, {y}");
        assert!((pebble.start_s - 0.4).abs() < 1e-12, "now: {}", pebble.start_s);
        view.reset();
        assert_eq!(view.job(AREA), still);
    }

    #[test]
    fn time_runs_unless_it_is_paused() {
        let mut view = view("");
        let middle = view.picture_in(STAGE).center();
        view.touch(Touch::Press(Grip::Main, middle), STAGE);
        let fallen = view.job(AREA);
        view.showing.press(Key::Space);
        view.advance(0.1);
        assert_eq!(view.job(AREA), fallen);
        view.showing.press(Key::Space);
        view.advance(0.1);
        assert!((view.job(AREA).waves.time_s - fallen.waves.time_s - 0.1).abs() < 1e-12);
        // A hitch is no leap.
        view.advance(100.0);
        assert!(view.job(AREA).waves.time_s < 1.0);
    }

    #[test]
    fn dragging_the_sun_turns_the_light_and_nothing_else() {
        let mut view = view("");
        let before = view.job(AREA);
        view.touch(Touch::Drag(Grip::Lamp, vec2(80.0, 0.0)), STAGE);
        let after = view.job(AREA);
        // The sun goes to the right, so its light comes from there.
        assert!(after.pond.light_direction[0] < before.pond.light_direction[0] - 0.1);
        let same = Pond { light_direction: before.pond.light_direction, ..after.pond.clone() };
        assert_eq!(FloorJob { pond: same, ..after }, before);
    }

    #[test]
    fn plans_are_made_inside_the_window_and_all_else_beside_it() {
        let mut view = view("--backend wgpu --method convolution");
        let mut places = Vec::new();
        for _ in PondMethod::ALL {
            places.push((view.choices.floor.method.name(), view.place().inside));
            view.press(Key::M);
        }
        let expected = [("convolution", true), ("low-rank", true), ("exact", false), ("photon", false)];
        assert_eq!(places, expected);
        view.press(Key::P);
        assert!(!view.place().inside, "{}", view.choices.floor.precision);
        view.press(Key::M);
        view.showing.runner = Runner::Cpu;
        assert!(!view.place().inside);
    }
}
