//! The panel's part of what is relit.

use egui::{RichText, Ui};
use spectral_cli::Basis;
use spectral_core::illuminant::Illuminant;

use super::View;
use super::choices::{COEFFICIENTS, SAMPLES};
use super::gauge::Measured;
use crate::panel::{executors, row};

/// Illuminants in a row of buttons.
const IN_A_ROW: usize = 6;

/// How pictures are made.
pub(super) fn choices(ui: &mut Ui, view: &mut View) {
    row(ui, "Colours", "N", |ui| {
        ui.selectable_value(&mut view.choices.is_spectral, true, "spectra");
        ui.selectable_value(&mut view.choices.is_spectral, false, "RGB");
    });
    if view.choices.is_spectral {
        row(ui, "Coefficients", "M: of light and albedo in the spectral basis", |ui| {
            let chosen = &mut view.choices.coefficients;
            for count in COEFFICIENTS {
                ui.selectable_value(chosen, count, count.to_string());
            }
        });
        row(ui, "Basis", "Trained on the surfaces' reflectances, all lamps and the sky", |ui| {
            for (name, basis) in Basis::ALL {
                ui.selectable_value(&mut view.choices.basis, basis, name);
            }
        });
    }
    executors(ui, &mut view.showing);
    row(ui, "Samples", "Along each side of a pixel", |ui| {
        for samples in SAMPLES {
            ui.selectable_value(&mut view.choices.samples, samples, samples.to_string());
        }
    });
}

/// In whose light the sky is.
pub(super) fn light(ui: &mut Ui, view: &mut View) {
    let all = view.lamps();
    for (i, lamps) in all.chunks(IN_A_ROW).enumerate() {
        row(ui, if i == 0 { "Illuminant" } else { "" }, "L: the sky in this lamp's light", |ui| {
            for &lamp in lamps {
                ui.selectable_value(&mut view.lamp, lamp, lamp.map_or("file", Illuminant::name));
            }
        });
    }
}

/// How far the picture's colours are from the right ones.
pub(super) fn error(ui: &mut Ui, view: &View) {
    ui.separator();
    match view.gauge.newest(view.choices.colors(), view.lamp) {
        None => drop(ui.label(RichText::new("error: being measured").strong())),
        Some(Err(reason)) => drop(ui.label(format!("no error: {reason}"))),
        Some(Ok(Measured { differences, size: [width, height], ms })) => {
            let (mean, max) = (differences.mean, differences.max);
            let text = format!("CIE94 {mean:.2} mean, {max:.2} largest, from 5 nm");
            ui.label(RichText::new(text).strong()).on_hover_text(format!(
                "the same view at {width} x {height}, and sampled every 5 nm, by the CPU executor in {ms:.0} ms; newest, not of every frame"
            ));
        }
    }
}
