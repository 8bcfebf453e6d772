//! What the user sees and has set: the state behind the panel, without a window.

use std::f64::consts::PI;

use asm_core::Settings;
use asm_wgpu::wgpu;
use egui::{Key, Rect, Ui};
use frame_plan::DeviceInfo;
use glam::DVec3;
use spectral_cli::view::ViewArgs;
use spectral_cli::{CliError, GAP_FILLINGS};
use spectral_scene::{Camera, Scene};

use super::choices::{Choices, WAVELENGTHS, methods, take_method};
use super::controls;
use super::glass::Glass;
use super::job::{PictureJob, SceneFacts};
use super::lamps::Lamps;
use super::making;
use super::pose::Pose;
use crate::graphics::Graphics;
use crate::hand::{Grip, Touch};
use crate::maker::Maker;
use crate::orbit::Orbit;
use crate::showing::{Showing, after};
use crate::subject::Subject;
use crate::worker::Wake;

/// A drag over the picture's height turns by this angle, radians.
const TURN_RAD: f64 = PI;
/// A scroll by a point zooms by e to the power of this.
const ZOOM_PER_POINT: f64 = 1.0 / 400.0;

/// Everything that the user can change.
#[derive(Clone, Debug)]
pub(crate) struct View {
    /// What every window has.
    pub(crate) showing: Showing,
    /// The scene as it was opened.
    scene: Scene,
    /// Names of its lights.
    pub(crate) lamp_names: Vec<String>,
    /// Method, sizes.
    pub(crate) choices: Choices,
    /// The camera.
    pub(crate) orbit: Orbit,
    /// The lights.
    pub(crate) lamps: Lamps,
    /// The refractors.
    pub(crate) glass: Glass,
}

impl View {
    /// What the command line asks for, of `scene`, in a window on the device `window`.
    ///
    /// # Errors
    /// A scene without cameras or anything to look at.
    pub(crate) fn new(
        scene: Scene,
        settings: Settings,
        args: &ViewArgs,
        window: &DeviceInfo,
    ) -> Result<Self, CliError> {
        let Some(camera) = scene.cameras.first().cloned().or_else(|| Camera::framing(&scene)) else {
            return Err(CliError::Failed(format!("{}: the scene has nothing to look at", args.scene)));
        };
        let glass = Glass::new(&scene);
        let centre = if glass.exists() { glass.centre() } else { middle(&scene) };
        let lights = scene.lights.iter().map(|light| light.shape).collect();
        Ok(Self {
            showing: Showing::new(&scene.name, args, window),
            lamp_names: scene.lights.iter().map(|light| light.name.clone()).collect(),
            choices: Choices { settings, coarseness: 1 },
            orbit: Orbit::new(camera, centre),
            lamps: Lamps::new(lights, centre),
            glass,
            scene,
        })
    }

    /// Drag over the picture by these parts of its height.
    pub(crate) fn drag(&mut self, grip: Grip, [right, down]: [f64; 2]) {
        match grip {
            Grip::Main => self.orbit.turn(right * TURN_RAD, down * TURN_RAD),
            Grip::Shift => self.orbit.shift(right, down),
            Grip::Lamp => self.lamps.drag(right * TURN_RAD, down * TURN_RAD, self.orbit.camera()),
        }
    }
}

impl Subject for View {
    type Job = PictureJob;
    const KEYS: &'static [Key] = &[Key::G, Key::M, Key::N, Key::F];
    const FILTER: wgpu::FilterMode = wgpu::FilterMode::Nearest;
    const RESET_HINT: &'static str = "camera, lamps and glass as the scene has them";

    fn showing(&self) -> &Showing {
        &self.showing
    }

    fn showing_mut(&mut self) -> &mut Showing {
        &mut self.showing
    }

    fn maker(&self, graphics: &Graphics, wake: Wake) -> Maker<PictureJob> {
        making::maker(self.showing.runner, self.scene.clone(), graphics, wake)
    }

    fn job(&self, area: [u32; 2]) -> PictureJob {
        PictureJob {
            pose: Pose {
                camera: self.orbit.camera().clone(),
                lights: self.lamps.shapes().to_vec(),
                objects: self.glass.placements(),
            },
            size: self.choices.picture_size(area),
            settings: self.choices.settings.clone(),
        }
    }

    fn advance(&mut self, seconds: f64) {
        self.glass.advance(self.showing.step_s(seconds));
    }

    fn reset(&mut self) {
        self.orbit.reset();
        self.lamps.reset();
        self.glass.reset();
    }

    fn press(&mut self, key: Key) {
        let settings = &mut self.choices.settings;
        match key {
            Key::G => self.glass.moving = !self.glass.moving,
            Key::M => {
                let all: Vec<_> = methods().map(|(_, method)| method).collect();
                let next = after(&all, &settings.method);
                take_method(settings, next);
            }
            Key::N => settings.wavelengths = after(&WAVELENGTHS, &settings.wavelengths),
            Key::F => {
                let all = GAP_FILLINGS.map(|(_, rule)| rule);
                settings.gap_filling = Some(after(&all, &settings.gap_filling()));
            }
            _ => {}
        }
    }

    fn touch(&mut self, touch: Touch, stage: Rect) {
        if let Touch::Drag(grip, by) = touch {
            let by = by / stage.height();
            self.drag(grip, [by.x.into(), by.y.into()]);
        }
    }

    fn scroll(&mut self, points: f64) {
        self.orbit.zoom((-points * ZOOM_PER_POINT).exp());
    }

    fn choices(&mut self, ui: &mut Ui) {
        controls::choices(ui, self);
    }

    fn stage_controls(&mut self, ui: &mut Ui) {
        controls::light_and_glass(ui, self);
    }

    fn tell(&self, ui: &mut Ui, facts: &SceneFacts) {
        if let Some(statistics) = facts {
            ui.separator();
            controls::counts(ui, statistics);
        }
    }
}

/// The middle of everything.
fn middle(scene: &Scene) -> DVec3 {
    let (low, high) = scene.bounds(0..scene.objects.len()).unwrap_or_default();
    (low + high) / 2.0
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::runner::Runner;
    use asm_core::{GapFilling, Method};
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: ViewArgs,
    }

    const AREA: [u32; 2] = [640, 360];

    fn settings(args: &ViewArgs) -> Result<Settings, CliError> {
        match args.subject()? {
            spectral_cli::view::Subject::Scene(settings) => Ok(*settings),
            _ => panic!("a scene"),
        }
    }

    fn view_of(scene: &Scene, arguments: &str) -> Result<View, CliError> {
        let words = ["spectral-viewer", "scene"].into_iter().chain(arguments.split_whitespace());
        let cli = Cli::try_parse_from(words).expect("arguments");
        View::new(scene.clone(), settings(&cli.args)?, &cli.args, &DeviceInfo::default())
    }

    pub(crate) fn view(arguments: &str) -> View {
        view_of(&spectral_scene::bundled("sphere").expect("bundled"), arguments).expect("a view")
    }

    #[test]
    fn options_are_where_it_begins() {
        let view =
            view("--method acm --wavelengths 3 --backend vulkan --exposure 2 --map 1024 --gap-filling paper");
        let settings = &view.choices.settings;
        assert_eq!(
            (settings.method, settings.wavelengths, settings.map_size),
            (Method::Acm, Some(3), Some(1024))
        );
        assert_eq!(settings.gap_filling, Some(GapFilling::Paper));
        assert_eq!((view.showing.runner, view.showing.exposure), (Runner::Vulkan, Some(2.0)));
        assert_eq!(view.showing.display().exposure, 2.0);
    }

    #[test]
    fn the_reference_is_refused() {
        let scene = spectral_scene::bundled("sphere").expect("bundled");
        assert!(matches!(view_of(&scene, "--method reference"), Err(CliError::Usage(_))));
        assert!(matches!(view_of(&Scene::default(), ""), Err(CliError::Failed(_))));
    }

    #[test]
    fn a_view_that_nobody_touches_shows_the_scene_as_it_is() {
        for name in spectral_scene::BUNDLED {
            let scene = spectral_scene::bundled(name).expect("bundled");
            let mut posed = scene.clone();
            view_of(&scene, "").expect("a view").job(AREA).pose.apply(&mut posed);
            assert_eq!(posed, scene, "{name}");
        }
    }

    #[test]
    fn each_grip_moves_its_own_part() {
        let still = view("").job(AREA).pose;
        for (grip, moves) in
            [(Grip::Main, [true, false]), (Grip::Shift, [true, false]), (Grip::Lamp, [false, true])]
        {
            let mut view = view("");
            view.drag(grip, [0.1, 0.05]);
            let pose = view.job(AREA).pose;
            assert_eq!([pose.camera != still.camera, pose.lights != still.lights], moves, "{grip:?}");
            assert_eq!(pose.objects, still.objects);
            view.reset();
            assert_eq!(view.job(AREA).pose, still);
        }
    }

    #[test]
    fn scrolling_up_goes_nearer() {
        let mut view = view("");
        let height = |view: &View| view.orbit.camera().world_from_camera.w_axis.y;
        let before = height(&view);
        view.scroll(100.0);
        assert!(height(&view) < before);
    }

    #[test]
    fn keys_go_round_the_choices_and_change_the_job() {
        let mut view = view("--method asm");
        let begun = view.job(AREA);
        for key in [Key::M, Key::N, Key::F] {
            let before = view.job(AREA);
            view.press(key);
            assert_ne!(view.job(AREA), before, "{key:?}");
        }
        // Leaving footprints takes back their own number of wavelengths: there are five to go round.
        for (key, times) in [(Key::M, 3), (Key::N, 5), (Key::F, 3)] {
            (0..times).for_each(|_| view.press(key));
        }
        assert_eq!(view.job(AREA).settings.method, begun.settings.method);
        assert_eq!(view.job(AREA).settings.wavelengths, begun.settings.wavelengths);
        let runner = view.showing.runner;
        view.showing.press(Key::E);
        assert_ne!(view.showing.runner, runner);
    }

    #[test]
    fn paused_glass_stands_still_and_a_hitch_is_no_leap() {
        let mut view = view("");
        view.press(Key::G);
        view.showing.press(Key::Space);
        let still = view.job(AREA);
        view.advance(0.1);
        assert_eq!(view.job(AREA), still);
        view.showing.press(Key::Space);
        view.advance(1000.0);
        assert_ne!(view.job(AREA), still);
        assert!(view.glass.turn_deg < 10.0, "{}", view.glass.turn_deg);
    }
}
