//! The six programming languages: one table of syntax each, one writer for all.

use alloc::string::String;
use alloc::vec::Vec;

use super::{Content, nine_digits};

/// How a language declares an array of constants.
pub(super) struct Language {
    /// Before the comment.
    prologue: &'static str,
    /// The count; `{n}` stands for it.
    count: &'static str,
    /// Start of an array; `{type}` is the element's type, `{dims}` its C-style dimensions, `{name}` and `{n}` the array's.
    array: &'static str,
    array_end: &'static str,
    scalar: Element,
    vector: Element,
    matrix: Element,
    /// Around each column or row of a matrix.
    matrix_part: (&'static str, &'static str),
    /// Whether matrices are written column by column.
    column_major: bool,
    /// After each number.
    suffix: &'static str,
    epilogue: &'static str,
}

/// How an array's elements are declared and written.
struct Element {
    name: &'static str,
    dims: &'static str,
    open: &'static str,
    close: &'static str,
}

const fn element(name: &'static str, dims: &'static str, open: &'static str, close: &'static str) -> Element {
    Element { name, dims, open, close }
}

pub(super) static GLSL: Language = Language {
    prologue: "",
    count: "const int SPECTRAL_COUNT = {n};",
    array: "const {type} {name}[{n}] = {type}[{n}](",
    array_end: ");",
    scalar: element("float", "", "", ""),
    vector: element("vec3", "", "vec3(", ")"),
    matrix: element("mat3", "", "mat3(", ")"),
    matrix_part: ("", ""),
    column_major: true,
    suffix: "",
    epilogue: "",
};

pub(super) static HLSL: Language = Language {
    prologue: "",
    count: "static const uint SPECTRAL_COUNT = {n};",
    array: "static const {type} {name}[{n}] = {",
    array_end: "};",
    scalar: element("float", "", "", ""),
    vector: element("float3", "", "float3(", ")"),
    matrix: element("float3x3", "", "float3x3(", ")"),
    matrix_part: ("", ""),
    column_major: false,
    suffix: "",
    epilogue: "",
};

pub(super) static WGSL: Language = Language {
    prologue: "",
    count: "const SPECTRAL_COUNT: u32 = {n}u;",
    array: "const {name}: array<{type}, {n}> = array<{type}, {n}>(",
    array_end: ");",
    scalar: element("f32", "", "", ""),
    vector: element("vec3<f32>", "", "vec3<f32>(", ")"),
    matrix: element("mat3x3<f32>", "", "mat3x3<f32>(", ")"),
    matrix_part: ("", ""),
    column_major: true,
    suffix: "",
    epilogue: "",
};

pub(super) static MSL: Language = Language {
    prologue: "#pragma once\n#include <metal_stdlib>\n\n",
    count: "constant uint SPECTRAL_COUNT = {n};",
    array: "constant {type} {name}[{n}] = {",
    array_end: "};",
    scalar: element("float", "", "", ""),
    vector: element("metal::float3", "", "metal::float3(", ")"),
    matrix: element("metal::float3x3", "", "metal::float3x3(", ")"),
    matrix_part: ("metal::float3(", ")"),
    column_major: true,
    suffix: "f",
    epilogue: "",
};

pub(super) static C: Language = Language {
    prologue: "#ifndef SPECTRAL_MATRICES_H\n#define SPECTRAL_MATRICES_H\n\n",
    count: "#define SPECTRAL_COUNT {n}",
    array: "static const float {name}[{n}]{dims} = {",
    array_end: "};",
    scalar: element("float", "", "", ""),
    vector: element("float", "[3]", "{", "}"),
    matrix: element("float", "[3][3]", "{", "}"),
    matrix_part: ("{", "}"),
    column_major: false,
    suffix: "f",
    epilogue: "\n#endif\n",
};

pub(super) static RUST: Language = Language {
    prologue: "",
    count: "pub const SPECTRAL_COUNT: usize = {n};",
    array: "#[allow(clippy::excessive_precision)]\npub static {name}: [{type}; {n}] = [",
    array_end: "];",
    scalar: element("f32", "", "", ""),
    vector: element("[f32; 3]", "", "[", "]"),
    matrix: element("[[f32; 3]; 3]", "", "[", "]"),
    matrix_part: ("[", "]"),
    column_major: false,
    suffix: "",
    epilogue: "",
};

/// The header in one language.
pub(super) fn write(content: &Content<'_>, language: &Language) -> String {
    let n = alloc::format!("{}", content.set.len());
    let mut out = String::from(language.prologue);
    for line in content.provenance() {
        out += "// ";
        out += &line;
        out += "\n";
    }
    out += "\n";
    out += &language.count.replace("{n}", &n);
    out += "\n";
    let shortest = |v: f64| alloc::format!("{:?}{}", v as f32, language.suffix);
    let scalars = |values: &mut dyn Iterator<Item = f64>| values.map(shortest).collect::<Vec<_>>();
    let vectors = |values: &[[f64; 3]]| values.iter().map(|v| v.map(shortest).join(", ")).collect::<Vec<_>>();
    let mut array = |comment: &str, name: &str, element: &Element, items: &[String]| {
        out += "\n// ";
        out += comment;
        out += "\n";
        out += &language
            .array
            .replace("{type}", element.name)
            .replace("{dims}", element.dims)
            .replace("{name}", name)
            .replace("{n}", &n);
        for (i, item) in items.iter().enumerate() {
            out += if i == 0 { "\n    " } else { ",\n    " };
            out += element.open;
            out += item;
            out += element.close;
        }
        out += "\n";
        out += language.array_end;
        out += "\n";
    };

    array(
        "Vacuum wavelengths, nm.",
        "SPECTRAL_WAVELENGTHS_NM",
        &language.scalar,
        &scalars(&mut content.set.wavelengths_nm.iter().copied()),
    );
    if let Some(weights) = &content.matrices.weights_xyz {
        array("XYZ weights W_n.", "SPECTRAL_WEIGHTS_XYZ", &language.vector, &vectors(weights));
    }
    array("RGB weights.", "SPECTRAL_WEIGHTS_RGB", &language.vector, &vectors(&content.matrices.weights_rgb));
    array("IOR offsets.", "SPECTRAL_IOR_OFFSETS", &language.scalar, &scalars(&mut content.ior_offsets()));
    let matrices: Vec<String> = content.matrices.matrices.iter().map(|k| matrix(k, language)).collect();
    let order =
        if language.column_major { "Matrices K_n, column by column." } else { "Matrices K_n, row by row." };
    array(order, "SPECTRAL_MATRICES", &language.matrix, &matrices);
    out += language.epilogue;
    out
}

/// The nine numbers of a row-major matrix in the language's order, without what goes around a matrix.
fn matrix(k: &[[f32; 3]; 3], language: &Language) -> String {
    let part = |i: usize| {
        let numbers = [0, 1, 2].map(|j| {
            let value = if language.column_major { k[j][i] } else { k[i][j] };
            nine_digits(value) + language.suffix
        });
        let (open, close) = language.matrix_part;
        String::from(open) + &numbers.join(", ") + close
    };
    [part(0), part(1), part(2)].join(", ")
}
