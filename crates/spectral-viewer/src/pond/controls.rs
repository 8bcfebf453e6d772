//! The pond's part of the panel, and the sun's dial.

use egui::{Align2, Color32, FontId, Painter, Rect, RichText, Slider, Stroke, Ui, pos2, vec2};
use spectral_cli::PondMethod;

use super::View;
use super::choices::{SIDES, precisions};
use super::gauge::Measured;
use super::job::FloorFacts;
use super::sun::Sun;
use crate::panel::{executors, row};

/// The dial, points: its radius and its distance from the picture's corner.
const DIAL: f32 = 26.0;
const DIAL_MARGIN: f32 = 10.0;
const SUN_COLOR: Color32 = Color32::from_rgb(255, 226, 120);

/// How floors are computed.
pub(super) fn choices(ui: &mut Ui, view: &mut View) {
    row(ui, "Method", "M", |ui| {
        for method in PondMethod::ALL {
            let mut chosen = view.choices.floor.method;
            if ui.selectable_value(&mut chosen, method, method.name()).changed() {
                view.take_method(method);
            }
        }
    });
    let floor = &mut view.choices.floor;
    row(ui, "Precision", "P", |ui| {
        for precision in precisions(floor.method) {
            ui.selectable_value(&mut floor.precision, precision, precision.to_string());
        }
    });
    executors(ui, &mut view.showing);
    row(ui, "Samples", "Of the surface and of the floor", |ui| {
        for side in SIDES {
            ui.selectable_value(&mut view.choices.samples, side, format!("{side}²"));
        }
    });
    if view.choices.is_spectral() {
        row(ui, "Wavelengths", "N", |ui| {
            ui.selectable_value(&mut view.choices.dispersion, true, "all")
                .on_hover_text("Each has its own index of refraction");
            ui.selectable_value(&mut view.choices.dispersion, false, "one");
        });
    }
}

/// The next pebble and the sun.
pub(super) fn pebble_and_sun(ui: &mut Ui, view: &mut View) {
    row(ui, "Pebble", "Click on the water; height of its waves", |ui| {
        let mut millimetres = 1e3 * view.pebbles.amplitude_m;
        if ui.add(Slider::new(&mut millimetres, 0.5..=10.0).fixed_decimals(1).suffix(" mm")).changed() {
            view.pebbles.amplitude_m = 1e-3 * millimetres;
        }
    });
    row(ui, "Sun", "Drag it with the right button, or with Ctrl", |ui| {
        ui.label(format!("{:.0}° from above", view.sun.tilt_deg()));
    });
}

/// How far the picture is from the right one.
pub(super) fn error(ui: &mut Ui, view: &View, facts: &FloorFacts) {
    ui.separator();
    match view.gauge.newest(&view.choices) {
        None => drop(ui.label(RichText::new("error: being measured").strong())),
        Some(Err(reason)) => drop(ui.label(format!("no error: {reason}"))),
        Some(Ok(Measured { error, points: [width, height], exact_ms })) => {
            let text = RichText::new(format!("error {} of exact", percent(*error))).strong();
            ui.label(text).on_hover_text(format!(
                "relative RMS at {width} x {height} points of the floor, which took {exact_ms:.0} ms by exact; newest, not of every frame"
            ));
        }
    }
    if view.choices.is_spectral() {
        ui.label(RichText::new("clear water: scattering is left out").weak());
    }
    if !facts.fit.is_empty() {
        ui.label(RichText::new(&facts.fit).weak());
    }
    if facts.outside > 0.0 {
        ui.label(RichText::new(format!("{} of values unlike those", percent(facts.outside))).weak());
    }
}

/// Two digits or more.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.01 {
        format!("{percent:.4} %")
    } else if percent < 1.0 {
        format!("{percent:.2} %")
    } else {
        format!("{percent:.1} %")
    }
}

/// Where the sun is, in the picture's upper right corner: the rim is the horizon.
pub(super) fn dial(painter: &Painter, picture: Rect, sun: &Sun) {
    let inset = DIAL + DIAL_MARGIN;
    let centre = pos2(picture.right() - inset, picture.top() + inset);
    let [x, y] = sun.on_dial().map(|part| part as f32);
    painter.circle(
        centre,
        DIAL,
        Color32::from_black_alpha(120),
        Stroke::new(1.0, Color32::from_white_alpha(160)),
    );
    painter.circle_filled(centre + DIAL * vec2(x, y), 5.0, SUN_COLOR);
    let tilt = format!("{:.0}°", sun.tilt_deg());
    painter.text(
        centre + vec2(0.0, DIAL + 2.0),
        Align2::CENTER_TOP,
        tilt,
        FontId::proportional(11.0),
        Color32::WHITE,
    );
}
