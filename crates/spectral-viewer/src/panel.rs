//! The controls, and the picture beside them.

use asm_core::Statistics;
use egui::{
    CentralPanel, Color32, ComboBox, Frame, Grid, Key, Panel, PointerButton, Rect, Response, RichText,
    ScrollArea, Sense, Slider, TextureId, Ui, pos2,
};
use frame_plan::Decision;
use spectral_cli::GAP_FILLINGS;

use crate::choices::{COARSENESSES, Runner, SAMPLES, SIDES, WAVELENGTHS, methods};
use crate::fates::fates;
use crate::job::Report;
use crate::times::{PassTime, PassTimes};
use crate::view::{Grip, View};

/// Width of the controls, points.
const WIDTH: f32 = 330.0;
/// Length of a slider, points: a row of controls fits beside its name.
const SLIDER: f32 = 72.0;
/// Keys that the window knows; [`View::press`] says what they do.
const KEYS: [Key; 7] = [Key::Space, Key::Home, Key::G, Key::M, Key::N, Key::E, Key::F];
/// Errors, readable on the dark panel and on the picture's frame.
const ERROR: Color32 = Color32::from_rgb(255, 120, 110);

/// What there is to tell about the pictures.
#[derive(Debug, Default)]
pub(crate) struct Status {
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
            if ui.input(|input| input.key_pressed(key)) {
                view.press(key);
            }
        }
    }
    Panel::left("controls").exact_size(WIDTH).resizable(false).show(ui, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| controls(ui, view, status));
    });
    CentralPanel::default()
        .frame(Frame::NONE.fill(Color32::BLACK))
        .show(ui, |ui| stage(ui, view, status, picture))
        .inner
}

/// The picture, and what dragging over it does.
fn stage(ui: &mut Ui, view: &mut View, status: &Status, picture: TextureId) -> [u32; 2] {
    let response = ui.allocate_response(ui.available_size(), Sense::drag());
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    ui.painter().image(picture, response.rect, whole, Color32::WHITE);
    if let Some(grip) = grip(ui, &response) {
        let by = response.drag_delta() / response.rect.height();
        view.drag(grip, [by.x.into(), by.y.into()]);
    }
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

fn grip(ui: &Ui, response: &Response) -> Option<Grip> {
    let modifiers = ui.input(|input| input.modifiers);
    if response.dragged_by(PointerButton::Secondary) {
        Some(Grip::Lamp)
    } else if response.dragged_by(PointerButton::Middle) {
        Some(Grip::Shift)
    } else if response.dragged_by(PointerButton::Primary) {
        Some(match modifiers {
            m if m.command || m.ctrl => Grip::Lamp,
            m if m.shift => Grip::Shift,
            _ => Grip::Orbit,
        })
    } else {
        None
    }
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
            ui.selectable_value(&mut choices.settings.method, method, name);
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
