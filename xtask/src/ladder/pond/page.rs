//! The pond's part of the page.

use anyhow::Result;
use xtask::html::{escaped, number, push};

use super::super::front::digits;
use super::super::measure::Problem;
use super::super::page::capital;
use super::super::plot;
use super::super::report::Ladder;
use super::{Entry, FAMILY, Reference, Row};

/// For readers who have only the page.
const LEGEND: &str = "Ponds: RMS is RMS(rung - integral) / RMS(integral) of the light on the floor. Convolutions and low-rank terms are held \
against the integral of the same lobe, in f64, sample by sample. Photons scatter nothing: they are held against the integral of nearly clear water over the \
surface between the samples, in texel means of a quarter of the floor, as X, Y and Z. ms is a frame from heights on the device to the floor on the device; for \
photons, from the mesh. Beside it stands what the host takes to make the plan: kernels, terms, or the mesh. A row with ● is one that no other of its executor \
and reference beats.";

/// All ponds.
pub(in super::super) fn section(html: &mut String, ladder: &Ladder) -> Result<()> {
    if !ladder.ponds.is_empty() {
        push(html, format_args!("<p class=\"note\">{LEGEND}</p>"));
    }
    ladder.ponds.iter().try_for_each(|entry| pond(html, ladder, entry))
}

fn pond(html: &mut String, ladder: &Ladder, entry: &Entry) -> Result<()> {
    push(html, format_args!("<h2>{}</h2>", escaped(entry.name)));
    if let Some(problem) = &entry.problem {
        push(html, format_args!("<p class=\"bad\">{}</p>", escaped(problem)));
        return Ok(());
    }
    for sentence in &entry.halving {
        push(html, format_args!("<p>What does halving the error cost? {}.</p>", escaped(&capital(sentence))));
    }
    push(html, format_args!("<p class=\"note\">{0} × {0} samples</p>", entry.samples));
    push(html, format_args!("{}", plot::svg(&[ladder.pond_plot(entry.name)], 1, &FAMILY)?));
    push(
        html,
        format_args!(
            "<table><tr><th>front<th>executor<th>rung<th>against<th class=\"number\">terms<th class=\"number\">ms\
             <th class=\"number\">RMS<th class=\"number\">total Y<th class=\"number\">ms of the plan<th>problem"
        ),
    );
    for (name, ms) in [("exact", entry.exact_ms), ("exact, facets", entry.exact_over_facets_ms)] {
        if let Some(ms) = ms {
            push(
                html,
                format_args!(
                    "<tr><td><td>f64<td>{name}<td><td><td class=\"number\">{}<td class=\"number\">0<td><td><td>",
                    digits(ms)
                ),
            );
        }
    }
    ladder.pond_rows.iter().filter(|row| row.pond == entry.name).for_each(|r| row(html, r));
    push(html, format_args!("</table>"));
    Ok(())
}

fn row(html: &mut String, row: &Row) {
    let against = match row.reference {
        Reference::Exact => "exact",
        Reference::ExactOverFacets => "exact, facets",
    };
    push(
        html,
        format_args!(
            "<tr><td>{}<td>{}<td>{}{}<td>{against}<td class=\"number\">{}",
            if row.on_front { "●" } else { "" },
            row.executor,
            row.rung,
            if row.spoiled { " <span class=\"bad\">spoiled</span>" } else { "" },
            row.terms.map_or_else(|| "–".into(), |terms| terms.to_string())
        ),
    );
    match &row.outcome {
        None => push(html, format_args!("<td><td><td>")),
        Some(outcome) => {
            let [fastest, slowest] = outcome.frame.range_ms.map(digits);
            push(
                html,
                format_args!(
                    "<td class=\"number\">{} ({fastest} to {slowest})<td class=\"number\">{}<td class=\"number\">{}",
                    digits(outcome.frame.ms),
                    number(Some(outcome.error.rms)),
                    number(Some(outcome.error.total_y))
                ),
            );
        }
    }
    let class = if row.problem.as_ref().is_some_and(Problem::is_failure) { "bad" } else { "note" };
    let text = row.problem.as_ref().map_or("", Problem::text);
    push(
        html,
        format_args!("<td class=\"number\">{}<td class=\"{class}\">{}", digits(row.make_ms), escaped(text)),
    );
}
