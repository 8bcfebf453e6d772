//! The price list as one page that needs nothing beside itself.

use std::cmp::Ordering;

use anyhow::Result;
use xtask::checks::is_within_noise;
use xtask::executor_entry::ExecutorEntry;
use xtask::html::{escaped, number, page_start, push};
use xtask::metrics::Metrics;

use super::front::digits;
use super::measure::{Outcome, Problem, Row};
use super::plot::{self, Family};
use super::report::{Ladder, SceneEntry};
use super::truth::Noise;
use super::{pond, prt};

/// For readers who have only the page.
const LEGEND: &str = "Each rung's irradiance on the scene's receiver is held against the oracle's, in the layer where the caustic is. \
ΔE is CIEDE2000 over texels above 0.5 % of the oracle's 99th-percentile Y, at exposure 1 / that Y. RMS is RMS(rung - oracle) / \
RMS(oracle) of Y, also after binning to 64 × 64. FLIP is of the first camera's picture. ms is a frame of the bake, median of warm \
rounds, with the fastest and the slowest; rungs take turns. A row on the front, ●, is one that no other of its \
executor beats in both time and error: ΔE, and RMS of Y. The oracle is the mean of two independent halves; one half's distance from it, \
the first line of each table, is as large as the oracle's own error. ~ marks figures of which at least half of the square is that noise. \
Net figures are without it: squares of independent errors add up. ≤ marks those of which noise leaves nothing to see; they count as a \
quarter of it. Plots, fronts and sentences take the net figures.";

/// How the scenes' plots look.
pub(super) const FAMILY: Family = Family {
    methods: &["caustics-map", "acm", "asm", "footprint"],
    labels: "lines: what nothing beats, with its wavelengths and the side of the light's view",
};

/// The whole page.
pub(super) fn page(ladder: &Ladder) -> Result<String> {
    let mut out = page_start("ladder");
    let html = &mut out;
    let failures = ladder.failures(false);
    push(
        html,
        format_args!(
            "<p class=\"{}\">{} rungs, {} refused, {} negative controls, {} failures, {:.0} s</p>",
            if failures.is_empty() { "ok" } else { "bad" },
            ladder.rungs(),
            ladder.refused(),
            ladder.controls.len(),
            failures.len(),
            ladder.seconds
        ),
    );
    if let Some(sabotage) = ladder.sabotage {
        push(html, format_args!("<p class=\"bad\">Sabotaged: {}.</p>", sabotage.description()));
    }
    if !failures.is_empty() {
        push(html, format_args!("<ul>"));
        failures.iter().for_each(|f| push(html, format_args!("<li class=\"bad\">{}</li>", escaped(f))));
        push(html, format_args!("</ul>"));
    }
    ExecutorEntry::table(html, &ladder.executors);
    if !ladder.scenes.is_empty() {
        push(html, format_args!("<p class=\"note\">{LEGEND}</p>"));
    }
    for entry in &ladder.scenes {
        scene(html, ladder, entry)?;
    }
    pond::section(html, ladder)?;
    prt::section(html, ladder)?;
    controls(html, ladder);
    Ok(out)
}

fn scene(html: &mut String, ladder: &Ladder, entry: &SceneEntry) -> Result<()> {
    push(html, format_args!("<h2>{}</h2>", escaped(&entry.name)));
    if let Some(problem) = &entry.problem {
        push(html, format_args!("<p class=\"bad\">{}</p>", escaped(problem)));
    }
    let Some(noise) = &entry.noise else { return Ok(()) };
    for sentence in &entry.halving {
        push(html, format_args!("<p>What does halving the error cost? {}.</p>", escaped(&capital(sentence))));
    }
    push(
        html,
        format_args!(
            "<p class=\"note\">layer: {}; oracle: {} photons, {:.0} s{}; its standard error of Y at 64 × 64 is {:.1e}</p>",
            entry.layer.unwrap_or_default(),
            noise.photons,
            noise.seconds,
            if noise.kept { " in a run before" } else { "" },
            noise.standard_error
        ),
    );
    let svg = plot::svg(&[ladder.delta_e_plot(&entry.name), ladder.rms_plot(&entry.name)], 2, &FAMILY)?;
    push(html, format_args!("{svg}"));
    push(
        html,
        format_args!(
            "<table><tr><th>front ΔE<th>front RMS<th>executor<th>rung<th class=\"number\">ms<th class=\"number\">photons\
             <th class=\"number\">ΔE net<th class=\"number\">RMS net<th class=\"number\">ΔE mean<th class=\"number\">ΔE 95 %\
             <th class=\"number\">RMS<th class=\"number\">RMS 64<th class=\"number\">total Y\
             <th class=\"number\">ΔE of all light<th class=\"number\">FLIP<th class=\"number\">ms of the picture<th>problem"
        ),
    );
    oracle(html, noise);
    let mut rows: Vec<&Row> = ladder.rows_of(&entry.name).collect();
    rows.sort_by(|a, b| order(a, b));
    rows.into_iter().for_each(|r| row(html, r, noise));
    push(html, format_args!("</table>"));
    Ok(())
}

/// The front first, then by error; what has none last.
fn order(a: &Row, b: &Row) -> Ordering {
    let error = |row: &Row| {
        let outcome = row.outcome.as_ref();
        outcome.map_or(f64::MAX, |o| o.net_delta_e.map_or(o.net_rms.error, |net| net.error))
    };
    b.on_delta_e_front.cmp(&a.on_delta_e_front).then(error(a).total_cmp(&error(b)))
}

fn oracle(html: &mut String, noise: &Noise) {
    push(
        html,
        format_args!(
            "<tr><td><td><td>oracle<td>half of its photons<td><td class=\"number\">{}<td><td>",
            noise.photons
        ),
    );
    figures(html, &noise.half, None);
    let all = noise.half_all_light.as_ref().and_then(|metrics| metrics.delta_e_mean);
    push(
        html,
        format_args!(
            "<td class=\"number\">{}<td class=\"number\">{}<td><td>",
            number(all),
            number(noise.half_flip)
        ),
    );
}

fn row(html: &mut String, row: &Row, noise: &Noise) {
    let dot = |on_front: bool| if on_front { "●" } else { "" };
    push(
        html,
        format_args!(
            "<tr><td>{}<td>{}<td>{}<td>{}{}",
            dot(row.on_delta_e_front),
            dot(row.on_rms_front),
            row.executor,
            row.rung,
            if row.spoiled { " <span class=\"bad\">spoiled</span>" } else { "" }
        ),
    );
    match &row.outcome {
        None => push(html, format_args!("<td><td><td><td><td><td><td><td><td><td><td><td>")),
        Some(outcome) => measured(html, outcome, noise),
    }
    let class = if row.problem.as_ref().is_some_and(Problem::is_failure) { "bad" } else { "note" };
    let text = row.problem.as_ref().map_or("", Problem::text);
    push(html, format_args!("<td class=\"{class}\">{}", escaped(text)));
}

fn measured(html: &mut String, outcome: &Outcome, noise: &Noise) {
    let [fastest, slowest] = outcome.frame.range_ms.map(digits);
    push(
        html,
        format_args!(
            "<td class=\"number\">{} ({fastest} to {slowest})<td class=\"number\">{}",
            digits(outcome.frame.ms),
            outcome.photons
        ),
    );
    for net in [outcome.net_delta_e, Some(outcome.net_rms)] {
        let sign = if net.is_some_and(|net| net.hidden) { "≤ " } else { "" };
        push(html, format_args!("<td class=\"number\">{sign}{}", number(net.map(|net| net.error))));
    }
    figures(html, &outcome.error, Some(&noise.half));
    let of_all = |metrics: &Option<Metrics>| metrics.as_ref().and_then(|metrics| metrics.delta_e_mean);
    let (all, all_noise) = (of_all(&outcome.all_light), of_all(&noise.half_all_light));
    let picture = outcome.picture_frame.as_ref().map_or_else(|| "–".into(), |frame| digits(frame.ms));
    push(
        html,
        format_args!(
            "<td class=\"number\">{}{}<td class=\"number\">{}{}<td class=\"number\">{picture}",
            tilde(all, all_noise),
            number(all),
            tilde(outcome.flip, noise.half_flip),
            number(outcome.flip)
        ),
    );
}

fn figures(html: &mut String, metrics: &Metrics, noise: Option<&Metrics>) {
    let of = |metrics: &Metrics| {
        [metrics.delta_e_mean, metrics.delta_e_p95, Some(metrics.rms), Some(metrics.rms_64)]
    };
    let noise = noise.map_or([None; 4], of);
    for (value, noise) in of(metrics).into_iter().zip(noise) {
        push(html, format_args!("<td class=\"number\">{}{}", tilde(value, noise), number(value)));
    }
    push(html, format_args!("<td class=\"number\">{}", number(Some(metrics.total_y))));
}

/// Marks what the oracle's noise hides.
fn tilde(value: Option<f64>, noise: Option<f64>) -> &'static str {
    if value.zip(noise).is_some_and(|(value, noise)| is_within_noise(value, noise)) { "~" } else { "" }
}

fn controls(html: &mut String, ladder: &Ladder) {
    push(
        html,
        format_args!(
            "<h2>Negative controls</h2><details><summary>{} spoiled rungs</summary><ul>",
            ladder.controls.len()
        ),
    );
    for control in &ladder.controls {
        let (class, word) = if control.failed { ("", "worse, as it must be") } else { ("bad", "not worse") };
        push(
            html,
            format_args!(
                "<li class=\"{class}\">{}: {word}: {}</li>",
                escaped(&control.name),
                escaped(&control.found)
            ),
        );
    }
    push(html, format_args!("</ul></details></html>"));
}

pub(super) fn capital(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
