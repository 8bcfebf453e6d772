//! The controls, and the picture beside them: what every window has, with what its subject adds.

use egui::{
    CentralPanel, Color32, Frame, Grid, Key, Panel, Pos2, Rect, RichText, ScrollArea, Sense, Slider,
    TextureId, Ui, pos2,
};
use frame_plan::Decision;

use crate::runner::Runner;
use crate::showing::Showing;
use crate::subject::{Job, Report, Subject};
use crate::times::{PassTime, PassTimes};

/// Width of the controls, points.
const WIDTH: f32 = 390.0;
/// Length of a slider, points: a row of controls fits beside its name.
const SLIDER: f32 = 72.0;
/// Errors, readable on the dark panel and on the picture's frame.
const ERROR: Color32 = Color32::from_rgb(255, 120, 110);
/// The mark of a picture that is not yet what is set; tests in a window look for it.
const BEHIND: Color32 = Color32::from_rgb(255, 176, 0);
/// Its radius, points.
const MARK: f32 = 5.0;

/// Whose picture of what is on the screen.
#[derive(Debug, Default, PartialEq)]
pub(crate) enum Shown<J> {
    /// None, or one by a plan for something else.
    #[default]
    Nothing,
    /// That of the frame itself, which was made inside it.
    Now,
    /// One that was made beside the window.
    Of(Runner, J),
}

/// What there is to tell about the pictures.
pub(crate) struct Status<J: Job> {
    /// Whose picture of what is on the screen.
    pub(crate) shown: Shown<J>,
    /// What is known of the newest one.
    pub(crate) report: Report<J::Facts>,
    /// Its passes' times.
    pub(crate) times: PassTimes,
    /// Milliseconds from one picture to the next, a moving mean.
    pub(crate) between_ms: Option<f64>,
    /// Why there is no newer picture.
    pub(crate) error: Option<String>,
}

impl<J: Job> Default for Status<J> {
    fn default() -> Self {
        Self {
            shown: Shown::Nothing,
            report: Report::default(),
            times: PassTimes::default(),
            between_ms: None,
            error: None,
        }
    }
}

/// Lay the window out; pixels of the area that is left for the picture `picture`.
pub(crate) fn show<S: Subject>(
    ui: &mut Ui,
    subject: &mut S,
    status: &Status<S::Job>,
    picture: TextureId,
) -> [u32; 2] {
    if !ui.ctx().egui_wants_keyboard_input() {
        press_keys(ui, subject);
    }
    Panel::left("controls").exact_size(WIDTH).resizable(false).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| controls(ui, subject, status));
    });
    let area = CentralPanel::default()
        .frame(Frame::NONE.fill(Color32::BLACK))
        .show(ui, |ui| stage(ui, subject, status, picture))
        .inner;
    // Only here everything of this frame has been done.
    if status.is_behind(subject, area) {
        let corner = pos2(WIDTH - 4.0 * MARK, ui.max_rect().top() + 4.0 * MARK);
        ui.painter().circle_filled(corner, MARK, BEHIND);
    }
    area
}

fn press_keys<S: Subject>(ui: &Ui, subject: &mut S) {
    let presses = |key| ui.input(|input| input.num_presses(key));
    for key in Showing::KEYS {
        (0..presses(key)).for_each(|_| subject.showing_mut().press(key));
    }
    for &key in S::KEYS {
        (0..presses(key)).for_each(|_| subject.press(key));
    }
    if presses(Key::Home) > 0 {
        subject.reset();
    }
}

impl<J: Job> Status<J> {
    /// Whether the picture on the screen, when this frame is there, is of anything else than what is set.
    fn is_behind(&self, subject: &impl Subject<Job = J>, area: [u32; 2]) -> bool {
        let showing = subject.showing();
        let current = match &self.shown {
            Shown::Nothing => false,
            Shown::Now => subject.place().inside,
            Shown::Of(by, of) => *by == showing.runner && *of == subject.job(area),
        };
        showing.exposure.is_none() || self.error.is_some() || !current
    }
}

/// The picture, and what the hand over it does.
fn stage<S: Subject>(ui: &mut Ui, subject: &mut S, status: &Status<S::Job>, picture: TextureId) -> [u32; 2] {
    let response = ui.allocate_response(ui.available_size(), Sense::drag());
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let covered = subject.picture_in(response.rect);
    ui.painter().image(picture, covered, whole, Color32::WHITE);
    subject.paint_over(ui.painter(), covered);
    let layer = ui.layer_id();
    let on_picture = |pos: Pos2| {
        // Lists that are open may lie over it.
        response.rect.contains(pos) && ui.ctx().layer_id_at(pos).is_none_or(|top| top == layer)
    };
    for event in ui.input(|input| input.events.clone()) {
        if let Some(touch) = subject.showing_mut().hand.take(&event, on_picture) {
            subject.touch(touch, response.rect);
        }
    }
    subject.showing_mut().hand.keep(|button| ui.input(|input| input.pointer.button_down(button)));
    if response.contains_pointer() {
        let scrolled = ui.input(|input| input.smooth_scroll_delta().y);
        if scrolled != 0.0 {
            subject.scroll(scrolled.into());
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

fn controls<S: Subject>(ui: &mut Ui, subject: &mut S, status: &Status<S::Job>) {
    ui.add_space(4.0);
    ui.spacing_mut().slider_width = SLIDER;
    ui.heading(&subject.showing().name);
    let device = &status.report.device;
    ui.label(RichText::new(&device.device).weak()).on_hover_text(&device.driver);
    ui.separator();
    Grid::new("choices").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| subject.choices(ui));
    ui.separator();
    Grid::new("stage").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
        exposure(ui, subject.showing_mut());
        subject.stage_controls(ui);
    });
    ui.horizontal(|ui| {
        ui.toggle_value(&mut subject.showing_mut().paused, "Pause")
            .on_hover_text("Space: make pictures only where something changes");
        if ui.button("Reset").on_hover_text(format!("Home: {}", S::RESET_HINT)).clicked() {
            subject.reset();
        }
    });
    ui.separator();
    times(ui, status);
    subject.tell(ui, &status.report.facts);
}

fn exposure(ui: &mut Ui, showing: &mut Showing) {
    row(ui, "Exposure", "Stops", |ui| {
        ui.add(Slider::new(&mut showing.stops, -6.0..=6.0).fixed_decimals(1));
        if ui.button("auto").on_hover_text("Bring the brightest hundredth of the picture to white").clicked()
        {
            (showing.exposure, showing.stops) = (None, 0.0);
        }
        ui.toggle_value(&mut showing.soft, "soft")
            .on_hover_text("Bring highlights down instead of cutting them");
    });
}

/// A row of a subject's controls: who runs its plans.
pub(crate) fn executors(ui: &mut Ui, showing: &mut Showing) {
    row(ui, "Executor", "E", |ui| {
        for runner in Runner::ALL {
            ui.selectable_value(&mut showing.runner, runner, runner.name());
        }
    });
}

/// A row of a subject's controls.
pub(crate) fn row(ui: &mut Ui, name: &str, hint: &str, contents: impl FnOnce(&mut Ui)) {
    ui.label(name).on_hover_text(hint);
    ui.horizontal(contents);
    ui.end_row();
}

/// What a frame costs, pass by pass, and why a pass runs or not.
fn times<J: Job>(ui: &mut Ui, status: &Status<J>) {
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
pub(crate) fn number(ui: &mut Ui, text: &str, width: usize) {
    ui.monospace(format!("{text:>width$}"));
}

fn why(decision: &Decision) -> String {
    let verdict = if decision.kept { "runs" } else { "left out" };
    let lines = [format!("{verdict}: {}", decision.reason)].into_iter().chain(decision.notes.iter().cloned());
    lines.collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{View, view};
    use egui::epaint::ClippedShape;
    use egui::{Event, Modifiers, PointerButton, RawInput, Shape};

    type SceneStatus = Status<<View as Subject>::Job>;

    /// Frames with these events each, after a first one without any: what the last one draws, and the picture's area.
    fn frames(view: &mut View, status: &SceneStatus, events: &[Vec<Event>]) -> (Vec<ClippedShape>, [u32; 2]) {
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
            let eye = |view: &View| view.orbit.camera().world_from_camera.w_axis;
            let eyes = [1, 2, 3, 7].map(|events_per_frame| {
                let mut view = view("");
                let events: Vec<_> = drag(with).chunks(events_per_frame).map(<[_]>::to_vec).collect();
                frames(&mut view, &Status::default(), &events);
                eye(&view)
            });
            for eye in &eyes {
                assert!(eye.distance(eyes[0]) < 1e-9, "{with:?}: {eye}");
            }
            let begun = eye(&view(""));
            assert!(eyes[0].distance(begun) > 0.05 * begun.truncate().length(), "{with:?}: {begun}");
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
        let mut twice = self::view("--method asm");
        (0..2).for_each(|_| twice.press(Key::N));
        assert_eq!(view.choices.settings, twice.choices.settings);
        assert_ne!(view.choices.settings, self::view("--method asm").choices.settings);
    }

    #[test]
    fn a_picture_of_something_else_is_marked() {
        fn marked(view: &mut View, status: &SceneStatus) -> bool {
            let (shapes, _) = frames(view, status, &[]);
            shapes.iter().any(|s| matches!(&s.shape, Shape::Circle(circle) if circle.fill == BEHIND))
        }
        let mut view = view("--backend cpu --exposure 1");
        let (_, area) = frames(&mut view, &Status::default(), &[]);
        assert!(marked(&mut view, &Status::default()));
        let status = Status { shown: Shown::Of(Runner::Cpu, view.job(area)), ..Status::default() };
        assert!(!marked(&mut view, &status));
        view.showing.runner = Runner::Vulkan;
        assert!(marked(&mut view, &status));
        view.showing.runner = Runner::Cpu;
        view.orbit.turn(0.1, 0.0);
        assert!(marked(&mut view, &status));
        // What runs in the window's own frames is there with them.
        let status = Status { shown: Shown::Now, ..Status::default() };
        assert!(marked(&mut view, &status));
        view.showing.runner = Runner::Wgpu;
        assert!(!marked(&mut view, &status));
    }
}
