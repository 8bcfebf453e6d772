//! The relit figures' part of the page.

use anyhow::Result;
use xtask::html::{escaped, number, push};

use super::super::front::digits;
use super::super::measure::Problem;
use super::super::page::capital;
use super::super::plot;
use super::super::report::Ladder;
use super::{Entry, FAMILY, Row};

/// For readers who have only the page.
const LEGEND: &str = "Relit figures: CIE94 and CIEDE2000 of a frame from the same figure in f64, sampled every 5 nm and with ten bands, exposed so that \
white where light is strongest is the screen's. Judged are the pixels that see one triangle and paint with the points 1/16 of a pixel left, right, above and below. \
m is the number of spectral coefficients, L that of bands of spherical harmonics. ms is a whole frame; beside it, where the device tells, the parts that m and L are \
about: lighting vertices and shading pixels, of one frame. A row with ● is one that no other of its executor beats.";

/// All figures.
pub(in super::super) fn section(html: &mut String, ladder: &Ladder) -> Result<()> {
    if !ladder.figures.is_empty() {
        push(html, format_args!("<p class=\"note\">{LEGEND}</p>"));
    }
    ladder.figures.iter().try_for_each(|entry| figure(html, ladder, entry))
}

fn figure(html: &mut String, ladder: &Ladder, entry: &Entry) -> Result<()> {
    push(html, format_args!("<h2>{}</h2>", escaped(entry.name)));
    if let Some(problem) = &entry.problem {
        push(html, format_args!("<p class=\"bad\">{}</p>", escaped(problem)));
        return Ok(());
    }
    for sentence in &entry.halving {
        push(html, format_args!("<p>What does halving the error cost? {}.</p>", escaped(&capital(sentence))));
    }
    push(
        html,
        format_args!(
            "<p class=\"note\">{} × {} pixels, {:.1} % of those that show something judged; {} vertices</p>",
            entry.size[0],
            entry.size[1],
            100.0 * entry.judged_share,
            entry.vertices
        ),
    );
    push(html, format_args!("{}", plot::svg(&[ladder.figure_plot(entry.name)], 1, &FAMILY)?));
    push(html, format_args!("<table><tr><th>front<th>executor<th>basis"));
    for title in
        ["m", "L", "ms", "ms of vertices", "ms of shading", "CIE94 mean", "CIE94 max", "ΔE mean", "ΔE 95 %"]
    {
        push(html, format_args!("<th class=\"number\">{title}"));
    }
    push(html, format_args!("<th>problem"));
    ladder.figure_rows.iter().filter(|row| row.figure == entry.name).for_each(|r| row(html, r));
    push(html, format_args!("</table>"));
    Ok(())
}

fn row(html: &mut String, row: &Row) {
    push(
        html,
        format_args!(
            "<tr><td>{}<td>{}<td>{}{}<td class=\"number\">{}<td class=\"number\">{}",
            if row.on_front { "●" } else { "" },
            row.executor,
            row.rung.way.basis(),
            if row.spoiled { " <span class=\"bad\">spoiled</span>" } else { "" },
            row.rung.way.coefficients(),
            row.rung.bands.count()
        ),
    );
    match &row.outcome {
        None => push(html, format_args!("<td><td><td><td><td><td><td>")),
        Some(outcome) => {
            let [fastest, slowest] = outcome.frame.range_ms.map(digits);
            push(
                html,
                format_args!("<td class=\"number\">{} ({fastest} to {slowest})", digits(outcome.frame.ms)),
            );
            let error = &outcome.error;
            for value in [
                outcome.vertex_ms,
                outcome.shade_ms,
                Some(error.cie94_mean),
                Some(error.cie94_max),
                Some(error.delta_e_mean),
                Some(error.delta_e_p95),
            ] {
                push(html, format_args!("<td class=\"number\">{}", number(value)));
            }
        }
    }
    let class = if row.problem.as_ref().is_some_and(Problem::is_failure) { "bad" } else { "note" };
    let text = row.problem.as_ref().map_or("", Problem::text);
    push(html, format_args!("<td class=\"{class}\">{}", escaped(text)));
}
