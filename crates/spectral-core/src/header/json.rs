//! Matrices as JSON. Written by hand, since the matrices' nine digits are part of the format.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::{Content, nine_digits};

pub(super) fn write(content: &Content<'_>) -> String {
    let (set, matrices) = (content.set, content.matrices);
    let vectors = |values: &[[f64; 3]]| rows(values.iter().map(|v| list(v.map(number))));
    let weights_xyz = matrices.weights_xyz.as_deref().map_or("null".into(), vectors);
    let weights_rgb = vectors(&matrices.weights_rgb);
    let wavelengths = list(set.wavelengths_nm.iter().copied().map(number));
    let range = list([set.range_nm.0, set.range_nm.1].map(number));
    let k = rows(matrices.matrices.iter().map(|k| list(k.map(|row| list(row.map(nine_digits))))));
    let offsets = list(content.ior_offsets().map(number));
    let edge =
        content.edge.iter().map(|(px, e)| format!("\"{px}\": {}", number(e))).collect::<Vec<_>>().join(", ");
    let members = [
        ("n", format!("{}", set.len())),
        ("scheme", format!("\"{}\"", set.scheme)),
        ("cmf", format!("\"{}\"", set.observer)),
        ("range_nm", range),
        ("wavelengths_nm", wavelengths),
        ("weights_xyz", weights_xyz),
        ("weights_rgb", weights_rgb),
        ("matrices", k),
        ("offsets", format!("\"{}\"", content.offsets)),
        ("ior_offsets", offsets),
        ("sum_residual", number(f64::from(matrices.sum_residual()))),
        ("edge_delta_e", format!("{{{edge}}}")),
    ];
    let members: Vec<String> = members.iter().map(|(key, value)| format!("  \"{key}\": {value}")).collect();
    format!("{{\n{}\n}}\n", members.join(",\n"))
}

/// The shortest digits that identify an f64; JSON has no NaN or infinity.
fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { "null".into() }
}

fn list(items: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", items.into_iter().collect::<Vec<_>>().join(", "))
}

/// A list with a line for each item.
fn rows(items: impl Iterator<Item = String>) -> String {
    format!("[\n    {}\n  ]", items.collect::<Vec<_>>().join(",\n    "))
}
