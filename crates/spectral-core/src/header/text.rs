//! Matrices as a table to read.

use alloc::format;
use alloc::string::String;

use super::{Content, nine_digits};

pub(super) fn write(content: &Content<'_>) -> String {
    let mut out = content.provenance().join("\n");
    out += "\n\n";
    let xyz = content.matrices.weights_xyz.as_deref();
    out += &format!("{:>4} {:>10} {:>14}", "n", "nm", "IOR offset");
    if xyz.is_some() {
        out += &format!(" {:>13} {:>13} {:>13}", "X weight", "Y weight", "Z weight");
    }
    out += &format!(" {:>13} {:>13} {:>13}\n", "R weight", "G weight", "B weight");
    for (i, ((nm, offset), rgb)) in content
        .set
        .wavelengths_nm
        .iter()
        .zip(content.ior_offsets())
        .zip(&content.matrices.weights_rgb)
        .enumerate()
    {
        out += &format!("{i:>4} {:>10?} {:>14?}", *nm as f32, offset as f32);
        for v in xyz.and_then(|weights| weights.get(i)).into_iter().chain([rgb]).flatten() {
            out += &format!(" {:>13?}", *v as f32);
        }
        out += "\n";
    }
    for (i, k) in content.matrices.matrices.iter().enumerate() {
        out += &format!("\nK_{i}\n");
        for row in k {
            let numbers = row.map(|v| format!("{:>14}", nine_digits(v)));
            out += &numbers.join(" ");
            out += "\n";
        }
    }
    out
}
