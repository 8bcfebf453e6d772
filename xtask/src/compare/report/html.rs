//! The report as one page that needs nothing beside itself.

use serde_json::Value;
use xtask::executor_entry::ExecutorEntry;
use xtask::html::{escaped, number, page_start, push};

use super::{Check, Report, SceneEntry};

/// The metrics of `docs/src/comparing.md`, for readers who have only the page.
const LEGEND: &str = "Irradiance on each scene's receiver, in its UV space, per layer. \
ΔE is CIEDE2000 over texels above 0.5 % of the reference's (b's) 99th-percentile Y, at exposure 1 / that Y, Lab relative to \
XYZ at Y = 1 of unblocked perpendicular light of the lamps. RMS is RMS(a - b) / RMS(b) of Y, also after binning to 64 × 64. \
Camera pictures: mean FLIP at 67 pixels per degree on sRGB, at the exposure stated, tone map: clip. \
A bound in brackets is asserted; between executors it is a constant times the coarser of their vertex roundings, 2^-bits texel. \
Where there is none the distance is the method's own error and only shown, with the oracle's standard error of the same \
quantity, RMS 64 of a layer and FLIP of a picture, beside it; where at least half of the squared distance is the oracle's, \
the row says that it is within the oracle's noise. \
In difference maps red is more than b, blue less. \
Relit figures, prt: against f64 and other executors the share of the pixels that differ by more than 1e-5 of the brightest Y, or by a bit on \
one driver; against sampling every 5 nm in f64 CIE94, ΔE and XYZ max, the largest difference of X, Y or Z as a share of Y, over the pixels that no \
edge is near.";

/// The whole page.
pub(super) fn page(report: &Report, skips_fail: bool) -> String {
    let failures = report.failures(skips_fail);
    let mut out = page_start("compare");
    let html = &mut out;
    let held = report.checks.iter().filter(|c| c.ok).count();
    let failed = report.controls.iter().filter(|c| c.failed).count();
    push(
        html,
        format_args!(
            "<p class=\"{}\">{held} of {} checks hold, {failed} of {} negative controls fail as they must; \
             {} × {} texels, {:.0} s</p>",
            if failures.is_empty() { "ok" } else { "bad" },
            report.checks.len(),
            report.controls.len(),
            report.map_size[0],
            report.map_size[1],
            report.seconds,
        ),
    );
    if let Some(sabotage) = report.sabotage {
        push(html, format_args!("<p class=\"bad\">Sabotaged: {}.</p>", sabotage.description()));
    }
    if !failures.is_empty() {
        push(html, format_args!("<ul>"));
        failures.iter().for_each(|f| push(html, format_args!("<li class=\"bad\">{}</li>", escaped(f))));
        push(html, format_args!("</ul>"));
    }
    executors(html, report);
    push(html, format_args!("<p class=\"note\">{LEGEND}</p>"));
    report.scenes.iter().for_each(|entry| scene(html, report, entry));
    controls(html, report);
    out
}

fn executors(html: &mut String, report: &Report) {
    ExecutorEntry::table(html, &report.executors);
    if let Some(reason) = &report.no_second_driver {
        push(html, format_args!("<p class=\"note\">No second driver: {}</p>", escaped(reason)));
    }
}

fn scene(html: &mut String, report: &Report, entry: &SceneEntry) {
    push(html, format_args!("<h2>{}</h2>", escaped(&entry.name)));
    for note in &entry.notes {
        push(html, format_args!("<p class=\"note\">{}</p>", escaped(note)));
    }
    let checks: Vec<&Check> = report.checks.iter().filter(|c| c.scene == entry.name).collect();
    let is_there = |column: &&Column| checks.iter().any(|c| !c.metrics[column.metric].is_null());
    let columns: Vec<&Column> = COLUMNS.iter().filter(is_there).collect();
    push(html, format_args!("<table><tr><th>method<th>layer<th>a<th>b"));
    columns.iter().for_each(|column| push(html, format_args!("<th class=\"number\">{}", column.title)));
    push(html, format_args!("<th class=\"number\">oracle's standard error<th>result"));
    checks.iter().for_each(|c| check(html, c, &columns));
    push(html, format_args!("</table>"));
    for row in &entry.rows {
        push(html, format_args!("<h3>{}</h3><div class=\"row\">", escaped(&row.title)));
        for (caption, png) in &row.pictures {
            let class = if png.size[0] == png.size[1] { "" } else { " class=\"wide\"" };
            push(
                html,
                format_args!(
                    "<figure><img{class} alt=\"\" src=\"{}\"><figcaption>{}</figcaption></figure>",
                    png.data_uri(),
                    escaped(caption)
                ),
            );
        }
        push(html, format_args!("</div>"));
    }
}

/// A figure of checks.
struct Column {
    metric: &'static str,
    title: &'static str,
}

/// Those that tables have where any of their checks has them.
const COLUMNS: [Column; 11] = [
    Column { metric: "delta_e_mean", title: "ΔE mean" },
    Column { metric: "delta_e_p95", title: "ΔE 95 %" },
    Column { metric: "cie94_mean", title: "CIE94 mean" },
    Column { metric: "cie94_max", title: "CIE94 max" },
    Column { metric: "xyz_max", title: "XYZ max" },
    Column { metric: "differing", title: "pixels that differ" },
    Column { metric: "largest", title: "largest difference" },
    Column { metric: "rms", title: "RMS" },
    Column { metric: "rms_64", title: "RMS 64" },
    Column { metric: "total_y", title: "total Y" },
    Column { metric: "flip_mean", title: "FLIP" },
];

fn check(html: &mut String, check: &Check, columns: &[&Column]) {
    push(
        html,
        format_args!("<tr><td>{}<td>{}<td>{}<td>{}", escaped(&check.method), check.layer, check.a, check.b),
    );
    for Column { metric, .. } in columns {
        push(html, format_args!("<td class=\"number\">{}", number(check.metrics[metric].as_f64())));
        if check.metrics[metric].is_null() {
            continue;
        }
        match &check.bound[metric] {
            Value::Null => {}
            Value::Array(ends) => {
                let [least, most] = [0, 1].map(|end| number(ends.get(end).and_then(Value::as_f64)));
                push(html, format_args!(" [{least} to {most}]"));
            }
            most => {
                let sign = if *metric == "total_y" { "1 ± " } else { "≤ " };
                push(html, format_args!(" [{sign}{}]", number(most.as_f64())));
            }
        }
    }
    push(html, format_args!("<td class=\"number\">{}", number(check.oracle_standard_error)));
    let (class, mut word) = match (check.ok, check.bound.is_null()) {
        (false, _) => ("bad", check.problems.join("; ")),
        (true, true) => ("", "shown".into()),
        (true, false) => ("ok", "holds".into()),
    };
    if check.within_oracle_noise == Some(true) {
        word += ", within the oracle's noise";
    }
    push(html, format_args!("<td class=\"{class}\">{}", escaped(&word)));
}

fn controls(html: &mut String, report: &Report) {
    push(
        html,
        format_args!(
            "<h2>Negative controls</h2><details><summary>{} comparisons of spoiled results</summary><ul>",
            report.controls.len()
        ),
    );
    for control in &report.controls {
        let (class, word) = if control.failed { ("", "failed, as it must") } else { ("bad", "passed") };
        push(html, format_args!("<li class=\"{class}\">{}: {word}</li>", escaped(&control.name)));
    }
    push(html, format_args!("</ul></details></html>"));
}
