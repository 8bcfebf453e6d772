//! The controls, and the picture beside them.

use asm_core::{Method, Refraction, Statistics};
use egui::{
    CentralPanel, Color32, ComboBox, Frame, Grid, Key, Panel, Pos2, Rect, RichText, ScrollArea, Sense,
    Slider, TextureId, Ui, pos2,
};
use frame_plan::Decision;
use spectral_cli::GAP_FILLINGS;

use crate::choices::{COARSENESSES, Runner, SAMPLES, SIDES, WAVELENGTHS, methods, take_method};
use crate::fates::fates;
use crate::job::{Job, Report};
use crate::times::{PassTime, PassTimes};
use crate::view::View;

/// Width of the controls, points.
const WIDTH: f32 = 390.0;
/// Length of a slider, points: a row of controls fits beside its name.
const SLIDER: f32 = 72.0;
/// Keys that the window knows; [`View::press`] says what they do.
const KEYS: [Key; 7] = [Key::Space, Key::Home, Key::G, Key::M, Key::N, Key::E, Key::F];
/// Errors, readable on the dark panel and on the picture's frame.
const ERROR: Color32 = Color32::from_rgb(255, 120, 110);
/// The mark of a picture that is not yet what is set; tests in a window look for it.
const BEHIND: Color32 = Color32::from_rgb(255, 176, 0);
/// Its radius, points.
const MARK: f32 = 5.0;

/// What there is to tell about the pictures.
#[derive(Debug, Default)]
pub(crate) struct Status {
    /// Whose picture of what is on the screen.
    pub(crate) shown: Option<(Runner, Job)>,
    /// What is known of the newest one.
    pub(crate) report: Report,
    /// Its passes' times.
    pub(crate) times: PassTimes,
    /// Milliseconds from one picture to the next, a moving mean.
    pub(crate) between_ms: Option<f64>,
    /// Why there is no newer picture.
    pub(crate) error: Option<String>,
}

/// Lay the window out; pixels of the area that is left for the picture `picture`.
pub(crate) fn show(ui: &mut Ui, view: &mut View, status: &Status, picture: TextureId) -> [u32; 2] {
    if !ui.ctx().egui_wants_keyboard_input() {
        for key in KEYS {
            for _ in 0..ui.input(|input| input.num_presses(key)) {
                view.press(key);
            }
        }
    }
    Panel::left("controls").exact_size(WIDTH).resizable(false).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| controls(ui, view, status));
    });
    let area = CentralPanel::default()
        .frame(Frame::NONE.fill(Color32::BLACK))
        .show(ui, |ui| stage(ui, view, status, picture))
        .inner;
    // Only here everything of this frame has been done.
    if status.is_behind(view, area) {
        let corner = pos2(WIDTH - 4.0 * MARK, ui.max_rect().top() + 4.0 * MARK);
        ui.painter().circle_filled(corner, MARK, BEHIND);
    }
    area
}

impl Status {
    /// Whether the picture on the screen, when this frame is there, is of anything else than what is set.
    fn is_behind(&self, view: &View, area: [u32; 2]) -> bool {
        let runner = view.choices.runner;
        let shown = || self.shown.as_ref().is_some_and(|(by, of)| *by == runner && *of == view.job(area));
        // What runs inside the window's frames is never late.
        let current = runner == Runner::Wgpu || shown();
        view.exposure.is_none() || self.error.is_some() || !current
    }
}

/// The picture, and what dragging over it does.
fn stage(ui: &mut Ui, view: &mut View, status: &Status, picture: TextureId) -> [u32; 2] {
    let response = ui.allocate_response(ui.available_size(), Sense::drag());
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(picture, response.rect, whole, Color32::WHITE);
    let layer = ui.layer_id();
    let on_picture = |pos: Pos2| {
        // Lists that are open may lie over it.
        response.rect.contains(pos) && ui.ctx().layer_id_at(pos).is_none_or(|top| top == layer)
    };
    for event in ui.input(|input| input.events.clone()) {
        if let Some((grip, by)) = view.hand.take(&event, on_picture) {
            let by = by / response.rect.height();
            view.drag(grip, [by.x.into(), by.y.into()]);
        }
    }
    view.hand.keep(|button| ui.input(|input| input.pointer.button_down(button)));
    if response.contains_pointer() {
        let scrolled = ui.input(|input| input.smooth_scroll_delta().y);
        if scrolled != 0.0 {
            view.scroll(scrolled.into());
        }
    }
    if let Some(error) = &status.error {
        let rect = response.rect.shrink(16.0);
        let galley =
            ui.painter().layout(error.clone(), egui::FontId::proportional(16.0), ERROR, rect.width());
        let text = Rect::from_min_size(rect.min, galley.size());
        ui.painter().rect_filled(text.expand(8.0), 4.0, Color32::from_black_alpha(200));
        ui.painter().galley(rect.min, galley, ERROR);
    }
    let size = response.rect.size() * ui.ctx().pixels_per_point();
    [size.x.round() as u32, size.y.round() as u32]
}

fn controls(ui: &mut Ui, view: &mut View, status: &Status) {
    ui.add_space(4.0);
    ui.spacing_mut().slider_width = SLIDER;
    ui.heading(&view.name);
    let device = &status.report.device;
    ui.label(RichText::new(&device.device).weak()).on_hover_text(&device.driver);
    ui.separator();
    Grid::new("choices").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| choices(ui, view));
    ui.separator();
    Grid::new("stage").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| light_and_glass(ui, view));
    ui.horizontal(|ui| {
        ui.toggle_value(&mut view.paused, "Pause")
            .on_hover_text("Space: make pictures only where something changes");
        if ui
            .button("Reset view")
            .on_hover_text("Home: camera, lamps and glass as the scene has them")
            .clicked()
        {
            view.reset();
        }
    });
    ui.separator();
    times(ui, status);
    if let Some(statistics) = &status.report.statistics {
        ui.separator();
        counts(ui, statistics);
    }
}

fn choices(ui: &mut Ui, view: &mut View) {
    let choices = &mut view.choices;
    row(ui, "Method", "M", |ui| {
        for (name, method) in methods() {
            let mut chosen = choices.settings.method;
            if ui.selectable_value(&mut chosen, method, name).changed() {
                take_method(&mut choices.settings, method);
            }
        }
    });
    row(ui, "Wavelengths", "N", |ui| {
        for count in WAVELENGTHS {
            let name = count.map_or_else(|| "auto".into(), |n| n.to_string());
            ui.selectable_value(&mut choices.settings.wavelengths, count, name);
        }
    });
    row(ui, "Executor", "E", |ui| {
        for runner in Runner::ALL {
            ui.selectable_value(&mut choices.runner, runner, runner.name());
        }
    });
    row(ui, "Refraction", "How light finds its way through glass", |ui| {
        let ways = Refraction::ALL.into_iter();
        let of_method =
            |way: &Refraction| choices.settings.method != Method::Footprint || *way == Refraction::Traced;
        for way in ways.filter(of_method).collect::<Vec<_>>() {
            let mut chosen = choices.settings.refraction();
            if ui.selectable_value(&mut chosen, way, way.name()).changed() {
                choices.settings.refraction = Some(way);
            }
        }
    });
    row(ui, "Gap filling", "F", |ui| {
        let mut rule = choices.settings.gap_filling();
        let before = rule;
        let named = |rule| GAP_FILLINGS.iter().find(|(_, r)| *r == rule).map_or("", |(name, _)| name);
        ComboBox::from_id_salt("gaps").selected_text(named(rule)).show_ui(ui, |ui| {
            for (name, one) in GAP_FILLINGS {
                ui.selectable_value(&mut rule, one, name);
            }
        });
        if rule != before {
            choices.settings.gap_filling = Some(rule);
        }
    });
    row(ui, "Light's view", "Photons start in its texels", |ui| {
        let side = &mut choices.settings.emission_size;
        ComboBox::from_id_salt("emission").selected_text(texels(*side)).show_ui(ui, |ui| {
            for one in SIDES {
                ui.selectable_value(side, one, texels(one));
            }
        });
    });
    row(ui, "Map", "Texels that photons land in", |ui| {
        let side = &mut choices.settings.map_size;
        let named = |side: Option<u32>| side.map_or_else(|| "auto".into(), texels);
        ComboBox::from_id_salt("map").selected_text(named(*side)).show_ui(ui, |ui| {
            for one in [None].into_iter().chain(SIDES.map(Some)) {
                ui.selectable_value(side, one, named(one));
            }
        });
    });
    row(ui, "Samples", "Along each side of a pixel", |ui| {
        for samples in SAMPLES {
            ui.selectable_value(&mut choices.settings.picture_samples, samples, samples.to_string());
        }
    });
    row(ui, "Pixels", "Screen pixels along a pixel of the picture", |ui| {
        for coarseness in COARSENESSES {
            let name = if coarseness == 1 { "all".into() } else { format!("1/{coarseness}") };
            ui.selectable_value(&mut choices.coarseness, coarseness, name);
        }
    });
}

fn texels(side: u32) -> String {
    format!("{side} x {side}")
}

fn light_and_glass(ui: &mut Ui, view: &mut View) {
    row(ui, "Exposure", "Stops", |ui| {
        ui.add(Slider::new(&mut view.stops, -6.0..=6.0).fixed_decimals(1));
        if ui.button("auto").on_hover_text("Bring the brightest hundredth of the picture to white").clicked()
        {
            (view.exposure, view.stops) = (None, 0.0);
        }
        ui.toggle_value(&mut view.soft, "soft")
            .on_hover_text("Bring highlights down instead of cutting them");
    });
    row(ui, "Lamp", "Drag it with the right button, or with Ctrl", |ui| {
        let chosen = view.lamps.chosen;
        match view.lamp_names.get(chosen) {
            None => drop(ui.label("none")),
            Some(name) if view.lamp_names.len() == 1 => drop(ui.label(name)),
            Some(name) => {
                ComboBox::from_id_salt("lamp").selected_text(name).show_ui(ui, |ui| {
                    for (i, name) in view.lamp_names.iter().enumerate() {
                        ui.selectable_value(&mut view.lamps.chosen, i, name);
                    }
                });
            }
        }
    });
    if !view.glass.exists() {
        return;
    }
    for (axis, name) in ["Glass x", "Glass y", "Glass z"].into_iter().enumerate() {
        row(ui, name, "In radii of the glass", |ui| {
            ui.add(Slider::new(&mut view.glass.offset[axis], -2.0..=2.0).fixed_decimals(2));
        });
    }
    row(ui, "Glass turned", "G", |ui| {
        ui.add(Slider::new(&mut view.glass.turn_deg, -180.0..=180.0).fixed_decimals(0).suffix("°"));
        ui.toggle_value(&mut view.glass.moving, "moves");
    });
}

fn row(ui: &mut Ui, name: &str, hint: &str, contents: impl FnOnce(&mut Ui)) {
    ui.label(name).on_hover_text(hint);
    ui.horizontal(contents);
    ui.end_row();
}

/// What a frame costs, pass by pass, and why a pass runs or not.
fn times(ui: &mut Ui, status: &Status) {
    let Report { decisions, made, .. } = &status.report;
    if let Some(between_ms) = status.between_ms {
        let text = format!("{between_ms:.1} ms per picture, {:.1} a second", 1e3 / between_ms);
        let made = format!(
            "made by this executor so far: {} pipelines, {} buffers, {} textures, {:.1} MiB",
            made.pipelines,
            made.buffers,
            made.textures,
            made.bytes as f64 / f64::from(1 << 20)
        );
        ui.label(RichText::new(text).strong()).on_hover_text(made);
    }
    let times = &status.times;
    let without_decision = |time: &&PassTime| decisions.iter().all(|d| d.pass != time.name);
    Grid::new("times").num_columns(3).striped(true).show(ui, |ui| {
        ui.label(RichText::new("pass").weak());
        number(ui, "ms", 9);
        number(ui, "steps", 6);
        ui.end_row();
        for decision in decisions {
            let name = RichText::new(&decision.pass);
            let name = if decision.kept { name } else { name.weak().strikethrough() };
            ui.label(name).on_hover_text(why(decision));
            time(ui, times.of(&decision.pass));
        }
        for other in times.passes().iter().filter(without_decision) {
            ui.label(&other.name);
            time(ui, Some(other));
        }
        if !times.passes().is_empty() {
            ui.label(RichText::new("all").strong());
            number(ui, &format!("{:.2}", times.total()), 9);
            ui.end_row();
        }
    });
}

fn time(ui: &mut Ui, time: Option<&PassTime>) {
    if let Some(PassTime { steps, milliseconds, .. }) = time {
        number(ui, &format!("{milliseconds:.2}"), 9);
        number(ui, &steps.to_string(), 6);
    }
    ui.end_row();
}

/// Numbers stand below each other.
fn number(ui: &mut Ui, text: &str, width: usize) {
    ui.monospace(format!("{text:>width$}"));
}

fn why(decision: &Decision) -> String {
    let verdict = if decision.kept { "runs" } else { "left out" };
    let lines = [format!("{verdict}: {}", decision.reason)].into_iter().chain(decision.notes.iter().cloned());
    lines.collect::<Vec<_>>().join("\n")
}

fn counts(ui: &mut Ui, statistics: &Statistics) {
    ui.label(RichText::new(format!("{} photons met glass", statistics.photons)).strong());
    Grid::new("fates").num_columns(2).striped(true).show(ui, |ui| {
        for (name, share) in fates(statistics) {
            ui.label(name);
            number(ui, &format!("{:.2} %", 100.0 * share), 9);
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::tests::view;
    use egui::epaint::ClippedShape;
    use egui::{Event, Modifiers, PointerButton, RawInput, Shape};

    /// Frames with these events each, after a first one without any: what the last one draws, and the picture's area.
    fn frames(view: &mut View, status: &Status, events: &[Vec<Event>]) -> (Vec<ClippedShape>, [u32; 2]) {
        let context = egui::Context::default();
        let (mut shapes, mut area) = (Vec::new(), [0, 0]);
        for events in std::iter::once(&Vec::new()).chain(events) {
            let input = RawInput {
                screen_rect: Some(Rect::from_min_max(pos2(0.0, 0.0), pos2(640.0, 360.0))),
                events: events.clone(),
                ..RawInput::default()
            };
            let mut output = context.run_ui(input, |ui| area = show(ui, view, status, TextureId::default()));
            // egui insists: there is no device to give them to.
            output.textures_delta.clear();
            shapes = output.shapes;
        }
        (shapes, area)
    }

    fn button(x: f32, y: f32, button: PointerButton, pressed: bool) -> Event {
        Event::PointerButton { pos: pos2(x, y), button, pressed, modifiers: Modifiers::NONE }
    }

    /// The pointer comes from afar, drags and goes elsewhere.
    fn drag(with: PointerButton) -> Vec<Event> {
        let moved = |x, y| Event::PointerMoved(pos2(x, y));
        vec![
            moved(600.0, 20.0),
            moved(450.0, 180.0),
            button(450.0, 180.0, with, true),
            moved(480.0, 185.0),
            moved(520.0, 200.0),
            button(530.0, 205.0, with, false),
            moved(400.0, 100.0),
        ]
    }

    #[test]
    fn a_drag_does_the_same_however_many_frames_it_takes() {
        for with in [PointerButton::Primary, PointerButton::Middle] {
            let poses: Vec<_> = [1, 2, 3, 7]
                .map(|events_per_frame| {
                    let mut view = view("");
                    let events: Vec<_> = drag(with).chunks(events_per_frame).map(<[_]>::to_vec).collect();
                    let (_, area) = frames(&mut view, &Status::default(), &events);
                    view.job(area).pose
                })
                .into();
            let eye = |pose: &crate::pose::Pose| pose.camera.world_from_camera.w_axis;
            for pose in &poses {
                assert!(eye(pose).distance(eye(&poses[0])) < 1e-9, "{with:?}: {}", eye(pose));
            }
            let begun = eye(&view("").job([1, 1]).pose);
            assert!(eye(&poses[0]).distance(begun) > 0.05 * begun.truncate().length(), "{with:?}: {begun}");
        }
    }

    #[test]
    fn a_drag_over_the_controls_moves_nothing() {
        let mut view = view("");
        let over_controls = vec![
            Event::PointerMoved(pos2(315.0, 180.0)),
            button(315.0, 180.0, PointerButton::Secondary, true),
            Event::PointerMoved(pos2(500.0, 180.0)),
        ];
        let (_, area) = frames(&mut view, &Status::default(), &[over_controls]);
        assert_eq!(view.job(area).pose, self::view("").job(area).pose);
    }

    #[test]
    fn no_name_in_the_controls_is_cut_off() {
        let (shapes, _) = frames(&mut view(""), &Status::default(), &[]);
        let cut = |clipped: &egui::epaint::ClippedShape| match &clipped.shape {
            Shape::Text(text) => {
                let right = text.visual_bounding_rect().right();
                (right > clipped.clip_rect.right()).then(|| text.galley.text().to_owned())
            }
            _ => None,
        };
        assert!(shapes.iter().any(|s| matches!(&s.shape, Shape::Text(t) if t.galley.text() == "footprint")));
        assert_eq!(shapes.iter().filter_map(cut).collect::<Vec<_>>(), [""; 0]);
    }

    #[test]
    fn keys_count_as_often_as_they_are_pressed_in_a_frame() {
        let mut view = view("--method asm");
        let key = |pressed| Event::Key {
            key: Key::N,
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        frames(&mut view, &Status::default(), &[vec![key(true), key(false), key(true), key(false)]]);
        assert_eq!(view.choices.settings.wavelengths, WAVELENGTHS[2]);
    }

    #[test]
    fn a_picture_of_something_else_is_marked() {
        fn marked(view: &mut View, status: &Status) -> bool {
            let (shapes, _) = frames(view, status, &[]);
            shapes.iter().any(|s| matches!(&s.shape, Shape::Circle(circle) if circle.fill == BEHIND))
        }
        let mut view = view("--backend cpu --exposure 1");
        let (_, area) = frames(&mut view, &Status::default(), &[]);
        assert!(marked(&mut view, &Status::default()));
        let status = Status { shown: Some((Runner::Cpu, view.job(area))), ..Status::default() };
        assert!(!marked(&mut view, &status));
        view.choices.runner = Runner::Vulkan;
        assert!(marked(&mut view, &status));
        view.choices.runner = Runner::Cpu;
        view.orbit.turn(0.1, 0.0);
        assert!(marked(&mut view, &status));
        // What runs in the window's own frames is there with them.
        view.choices.runner = Runner::Wgpu;
        assert!(!marked(&mut view, &status));
    }
}
