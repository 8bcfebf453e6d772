//! A scene's part of the panel.

use asm_core::{Method, Refraction, Statistics};
use egui::{ComboBox, Grid, RichText, Slider, Ui};
use spectral_cli::GAP_FILLINGS;

use super::View;
use super::choices::{COARSENESSES, SAMPLES, SIDES, WAVELENGTHS, methods, take_method};
use super::fates::fates;
use crate::panel::{executors, number, row};

/// How pictures are made.
pub(super) fn choices(ui: &mut Ui, view: &mut View) {
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
    executors(ui, &mut view.showing);
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

/// Where lamps and glass are.
pub(super) fn light_and_glass(ui: &mut Ui, view: &mut View) {
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

/// What became of the light.
pub(super) fn counts(ui: &mut Ui, statistics: &Statistics) {
    ui.label(RichText::new(format!("{} photons met glass", statistics.photons)).strong());
    Grid::new("fates").num_columns(2).striped(true).show(ui, |ui| {
        for (name, share) in fates(statistics) {
            ui.label(name);
            number(ui, &format!("{:.2} %", 100.0 * share), 9);
            ui.end_row();
        }
    });
}
