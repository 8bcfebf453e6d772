//! One reader per format.
//!
//! GLSL and WGSL are parsed and validated by naga, C and Rust compiled and run, HLSL parsed by a grammar of the language,
//! JSON by `serde_json`. MSL has no free compiler: its text is parsed as C++ by the same grammar (HLSL's extends C++'s), and
//! compiled as C++ with a few stand-in types where the machine has a C++ compiler.

use std::fs;
use std::path::Path;
use std::process::Command;

use spectral_core::dispersion::OffsetConvention;
use spectral_core::header::Format;
use spectral_core::matrices::SpectralMatrices;
use spectral_core::wavelengths::WavelengthSet;

/// What a header says, as its language understands it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Contents {
    wavelengths_nm: Vec<f32>,
    weights_xyz: Option<Vec<[f32; 3]>>,
    weights_rgb: Vec<[f32; 3]>,
    ior_offsets: Vec<f32>,
    /// Row-major.
    matrices: Vec<[[f32; 3]; 3]>,
}

const ARRAYS: [&str; 5] = [
    "SPECTRAL_WAVELENGTHS_NM",
    "SPECTRAL_WEIGHTS_XYZ",
    "SPECTRAL_WEIGHTS_RGB",
    "SPECTRAL_IOR_OFFSETS",
    "SPECTRAL_MATRICES",
];

impl Contents {
    /// From the numbers of each of [`ARRAYS`] in the order of the text; `None` for arrays that it lacks.
    fn from_numbers(numbers: [Option<Vec<f32>>; 5], column_major: bool) -> Result<Self, String> {
        let [wavelengths_nm, weights_xyz, weights_rgb, ior_offsets, matrices] = numbers;
        let missing = |name: &str| format!("{name} is missing");
        let vectors = |flat: Vec<f32>| flat.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect::<Vec<_>>();
        let parts = vectors(matrices.ok_or_else(|| missing(ARRAYS[4]))?);
        let matrix = |p: &[[f32; 3]]| {
            if column_major { [0, 1, 2].map(|i| [p[0][i], p[1][i], p[2][i]]) } else { [p[0], p[1], p[2]] }
        };
        Ok(Self {
            wavelengths_nm: wavelengths_nm.ok_or_else(|| missing(ARRAYS[0]))?,
            weights_xyz: weights_xyz.map(vectors),
            weights_rgb: vectors(weights_rgb.ok_or_else(|| missing(ARRAYS[2]))?),
            ior_offsets: ior_offsets.ok_or_else(|| missing(ARRAYS[3]))?,
            matrices: parts.chunks_exact(3).map(matrix).collect(),
        })
    }

    pub(crate) fn of(set: &WavelengthSet, matrices: &SpectralMatrices, offsets: OffsetConvention) -> Self {
        let vectors = |v: &Vec<[f64; 3]>| v.iter().map(|v| v.map(|x| x as f32)).collect();
        Self {
            wavelengths_nm: set.wavelengths_nm.iter().map(|&nm| nm as f32).collect(),
            weights_xyz: matrices.weights_xyz.as_ref().map(vectors),
            weights_rgb: vectors(&matrices.weights_rgb),
            ior_offsets: set.wavelengths_nm.iter().map(|&nm| offsets.ior_offset(nm) as f32).collect(),
            matrices: matrices.matrices.clone(),
        }
    }

    pub(crate) fn sum_f32(&self) -> [[f32; 3]; 3] {
        let mut sum = [[0.0_f32; 3]; 3];
        for k in &self.matrices {
            for i in 0..3 {
                for j in 0..3 {
                    sum[i][j] += k[i][j];
                }
            }
        }
        sum
    }
}

/// Checks a header with its language's tool and reads it back.
pub(crate) fn read_back(format: Format, text: &str) -> Result<Contents, String> {
    match format {
        Format::Glsl => glsl(text),
        Format::Wgsl => wgsl(text),
        Format::Hlsl => Contents::from_numbers(grammar_numbers(text)?, false),
        Format::Msl => msl(text),
        Format::C => c(text),
        Format::Rust => rust(text),
        Format::Json => json(text),
        Format::Text => table(text),
    }
}

fn validated(module: &naga::Module) -> Result<(), String> {
    naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
        .validate(module)
        .map(|_| ())
        .map_err(|e| format!("{e:?}"))
}

fn wgsl(text: &str) -> Result<Contents, String> {
    let shader = format!(
        "{text}\n@fragment fn main(@location(0) @interpolate(flat) n: u32, @location(1) c: vec3<f32>) -> @location(0) vec4<f32> {{\n\
         let k = SPECTRAL_MATRICES[n % SPECTRAL_COUNT];\n\
         return vec4<f32>(k * c * SPECTRAL_WEIGHTS_RGB[0], SPECTRAL_IOR_OFFSETS[n] + SPECTRAL_WAVELENGTHS_NM[n]);\n}}\n"
    );
    let module = naga::front::wgsl::parse_str(&shader).map_err(|e| e.emit_to_string(&shader))?;
    validated(&module)?;
    Contents::from_numbers(naga_numbers(&module)?, true)
}

fn glsl(text: &str) -> Result<Contents, String> {
    let shader = format!(
        "#version 450\n{text}\nlayout(location = 0) in vec3 c;\nlayout(location = 0) out vec4 colour;\n\
         void main() {{\n\
         vec3 sum = vec3(0.0);\n\
         for (int n = 0; n < SPECTRAL_COUNT; n++) {{ sum += SPECTRAL_MATRICES[n] * c * SPECTRAL_WEIGHTS_RGB[n]; }}\n\
         colour = vec4(sum, SPECTRAL_IOR_OFFSETS[0] + SPECTRAL_WAVELENGTHS_NM[0]);\n}}\n"
    );
    let options = naga::front::glsl::Options::from(naga::ShaderStage::Fragment);
    let module = naga::front::glsl::Frontend::default()
        .parse(&options, &shader)
        .map_err(|e| e.emit_to_string(&shader))?;
    validated(&module)?;
    Contents::from_numbers(naga_numbers(&module)?, true)
}

/// The numbers of the module's constant arrays, in the order of their constructors: columns of matrices.
fn naga_numbers(module: &naga::Module) -> Result<[Option<Vec<f32>>; 5], String> {
    fn flatten(
        module: &naga::Module,
        handle: naga::Handle<naga::Expression>,
        out: &mut Vec<f32>,
    ) -> Result<(), String> {
        match &module.global_expressions[handle] {
            naga::Expression::Literal(naga::Literal::F32(v)) => out.push(*v),
            naga::Expression::Compose { components, .. } => {
                for &component in components {
                    flatten(module, component, out)?;
                }
            }
            naga::Expression::Constant(constant) => flatten(module, module.constants[*constant].init, out)?,
            naga::Expression::ZeroValue(ty) => {
                let zeros = match module.types[*ty].inner {
                    naga::TypeInner::Scalar(_) => 1,
                    naga::TypeInner::Vector { .. } => 3,
                    naga::TypeInner::Matrix { .. } => 9,
                    ref other => return Err(format!("zero value of {other:?}")),
                };
                out.extend(std::iter::repeat_n(0.0, zeros));
            }
            naga::Expression::Splat { value, .. } => {
                for _ in 0..3 {
                    flatten(module, *value, out)?;
                }
            }
            other => return Err(format!("unexpected constant expression {other:?}")),
        }
        Ok(())
    }
    let mut numbers: [Option<Vec<f32>>; 5] = Default::default();
    for (name, numbers) in ARRAYS.iter().zip(&mut numbers) {
        let constant = module.constants.iter().find(|(_, c)| c.name.as_deref() == Some(name));
        if let Some((_, constant)) = constant {
            flatten(module, constant.init, numbers.insert(Vec::new()))?;
        }
    }
    Ok(numbers)
}

/// Parses HLSL, or C++ that it extends, and collects the number literals of each array.
fn grammar_numbers(text: &str) -> Result<[Option<Vec<f32>>; 5], String> {
    fn collect(node: tree_sitter::Node<'_>, text: &str, out: &mut Vec<f32>) -> Result<(), String> {
        if node.kind() == "number_literal" {
            let number = node.utf8_text(text.as_bytes()).map_err(|e| e.to_string())?.trim_end_matches('f');
            // The sign is an operator of its own.
            let negative = node.parent().is_some_and(|p| p.kind() == "unary_expression");
            let value: f32 = number.parse().map_err(|e| format!("{number}: {e}"))?;
            out.push(if negative { -value } else { value });
        }
        let mut cursor = node.walk();
        node.children(&mut cursor).try_for_each(|child| collect(child, text, out))
    }
    let mut parser = tree_sitter::Parser::new();
    parser.set_language(&tree_sitter_hlsl::LANGUAGE_HLSL.into()).map_err(|e| e.to_string())?;
    let tree = parser.parse(text, None).ok_or("no tree")?;
    let root = tree.root_node();
    if root.has_error() {
        return Err(format!("syntax error in {}", root.to_sexp()));
    }
    let mut numbers: [Option<Vec<f32>>; 5] = Default::default();
    let mut stack = vec![root];
    while let Some(node) = stack.pop() {
        if node.kind() == "init_declarator" {
            let part =
                |field: &str| node.child_by_field_name(field).ok_or(format!("declaration without {field}"));
            let declarator = part("declarator")?.utf8_text(text.as_bytes()).map_err(|e| e.to_string())?;
            let name = declarator.split('[').next().unwrap_or_default();
            if let Some(i) = ARRAYS.iter().position(|&array| array == name) {
                collect(part("value")?, text, numbers[i].insert(Vec::new()))?;
            }
        }
        let mut cursor = node.walk();
        stack.extend(node.children(&mut cursor));
    }
    Ok(numbers)
}

fn msl(text: &str) -> Result<Contents, String> {
    // `constant` is Metal's address space of constants at program scope.
    let contents =
        Contents::from_numbers(grammar_numbers(&text.replace("\nconstant ", "\nstatic const "))?, true)?;
    let Ok(version) = Command::new("c++").arg("--version").output() else {
        eprintln!("no c++ on this machine: MSL was parsed, not compiled");
        return Ok(contents);
    };
    assert!(version.status.success());
    let shim = "#pragma once\n#define constant static const\ntypedef unsigned int uint;\nnamespace metal {\n\
        struct float3 { float v[3]; float3(float a, float b, float c) : v{a, b, c} {} };\n\
        struct float3x3 { float3 columns[3]; float3x3(float3 a, float3 b, float3 c) : columns{a, b, c} {} };\n}\n";
    // Metal indexes columns first: m[column][row].
    let main = program(
        contents.weights_xyz.is_some(),
        "SPECTRAL_WEIGHTS_XYZ[n].v[i]",
        "SPECTRAL_WEIGHTS_RGB[n].v[i]",
        "SPECTRAL_MATRICES[n].columns[j].v[i]",
    );
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).map_err(|e| e.to_string());
    write("metal_stdlib", shim)?;
    write("spectral.h", text)?;
    write("main.cpp", &format!("#include \"spectral.h\"\n{main}"))?;
    let args = ["-std=c++14", "-Wall", "-Wextra", "-Werror", "-I.", "main.cpp", "-o", "main"];
    let compiled = compile_and_run(folder.path(), "c++", &args, contents.weights_xyz.is_some())?;
    if compiled == contents { Ok(compiled) } else { Err("the grammar and the compiler disagree".into()) }
}

fn c(text: &str) -> Result<Contents, String> {
    let with_xyz = text.contains("SPECTRAL_WEIGHTS_XYZ");
    let main = program(
        with_xyz,
        "SPECTRAL_WEIGHTS_XYZ[n][i]",
        "SPECTRAL_WEIGHTS_RGB[n][i]",
        "SPECTRAL_MATRICES[n][i][j]",
    );
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).map_err(|e| e.to_string());
    write("spectral.h", text)?;
    // Twice: the guard must hold.
    write("main.c", &format!("#include \"spectral.h\"\n#include \"spectral.h\"\n{main}"))?;
    let args = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "main.c", "-o", "main"];
    compile_and_run(folder.path(), "cc", &args, with_xyz)
}

/// A C and C++ program that prints the bits of every number, then those of the f32 sum of the matrices.
fn program(with_xyz: bool, xyz: &str, rgb: &str, matrix: &str) -> String {
    let xyz = if with_xyz { format!("for (i = 0; i < 3; i++) bits({xyz});") } else { String::new() };
    format!(
        "#include <stdio.h>\n#include <string.h>\n\
         static void bits(float f) {{ unsigned u; memcpy(&u, &f, 4); printf(\"%08x\\n\", u); }}\n\
         int main(void) {{\n\
         int n, i, j;\n\
         volatile float sum[3][3] = {{{{0}}}};\n\
         for (n = 0; n < (int)SPECTRAL_COUNT; n++) {{\n\
         bits(SPECTRAL_WAVELENGTHS_NM[n]); bits(SPECTRAL_IOR_OFFSETS[n]);\n\
         {xyz}\n\
         for (i = 0; i < 3; i++) bits({rgb});\n\
         for (i = 0; i < 3; i++) for (j = 0; j < 3; j++) {{ bits({matrix}); sum[i][j] += {matrix}; }}\n\
         }}\n\
         for (i = 0; i < 3; i++) for (j = 0; j < 3; j++) bits(sum[i][j]);\n\
         return 0; }}\n"
    )
}

fn rust(text: &str) -> Result<Contents, String> {
    let with_xyz = text.contains("SPECTRAL_WEIGHTS_XYZ");
    let xyz = if with_xyz { "for v in SPECTRAL_WEIGHTS_XYZ[n] { bits(v); }" } else { "" };
    let main = format!(
        "#![deny(warnings)]\nmod spectral;\nuse spectral::*;\nfn bits(v: f32) {{ println!(\"{{:08x}}\", v.to_bits()); }}\n\
         fn main() {{\nlet mut sum = [[0.0_f32; 3]; 3];\n\
         for n in 0..SPECTRAL_COUNT {{\n\
         bits(SPECTRAL_WAVELENGTHS_NM[n]); bits(SPECTRAL_IOR_OFFSETS[n]);\n{xyz}\n\
         for v in SPECTRAL_WEIGHTS_RGB[n] {{ bits(v); }}\n\
         for i in 0..3 {{ for j in 0..3 {{ bits(SPECTRAL_MATRICES[n][i][j]); sum[i][j] += SPECTRAL_MATRICES[n][i][j]; }} }}\n}}\n\
         for v in sum.iter().flatten() {{ bits(*v); }}\n}}\n"
    );
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).map_err(|e| e.to_string());
    write("spectral.rs", text)?;
    write("main.rs", &main)?;
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
    compile_and_run(folder.path(), &rustc, &["--edition=2024", "main.rs", "-o", "main"], with_xyz)
}

/// Compiles in a folder, runs `main` and reads the bits that it prints; the sum it took must be the sum of what it printed.
fn compile_and_run(folder: &Path, compiler: &str, args: &[&str], with_xyz: bool) -> Result<Contents, String> {
    let compiled = Command::new(compiler)
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap_or_else(|e| panic!("this check needs `{compiler}`: {e}"));
    if !compiled.status.success() {
        return Err(String::from_utf8_lossy(&compiled.stderr).into_owned());
    }
    let run = Command::new(folder.join("main")).output().map_err(|e| e.to_string())?;
    let printed = String::from_utf8_lossy(&run.stdout);
    let numbers: Vec<f32> = printed
        .lines()
        .map(|line| u32::from_str_radix(line, 16).map(f32::from_bits).map_err(|e| format!("{line}: {e}")))
        .collect::<Result<_, _>>()?;
    let (numbers, sum) =
        numbers.split_at_checked(numbers.len().saturating_sub(9)).ok_or("nothing printed")?;
    let mut contents = Contents { weights_xyz: with_xyz.then(Vec::new), ..Contents::default() };
    for record in numbers.chunks_exact(if with_xyz { 17 } else { 14 }) {
        let three = |at: usize| [record[at], record[at + 1], record[at + 2]];
        contents.wavelengths_nm.push(record[0]);
        contents.ior_offsets.push(record[1]);
        let mut at = 2;
        if let Some(weights) = &mut contents.weights_xyz {
            weights.push(three(at));
            at += 3;
        }
        contents.weights_rgb.push(three(at));
        contents.matrices.push([three(at + 3), three(at + 6), three(at + 9)]);
    }
    if contents.sum_f32().as_flattened() == sum {
        Ok(contents)
    } else {
        Err(format!("the program's sum is {sum:?}"))
    }
}

fn json(text: &str) -> Result<Contents, String> {
    let value: serde_json::Value = serde_json::from_str(text).map_err(|e| e.to_string())?;
    let array = |key: &str| -> Result<Vec<f32>, String> {
        fn flatten(value: &serde_json::Value, out: &mut Vec<f32>) -> Result<(), String> {
            match value {
                serde_json::Value::Array(items) => items.iter().try_for_each(|item| flatten(item, out)),
                other => {
                    out.push(other.as_f64().ok_or_else(|| format!("{other} is no number"))? as f32);
                    Ok(())
                }
            }
        }
        let mut out = Vec::new();
        flatten(value.get(key).ok_or_else(|| format!("{key} is missing"))?, &mut out)?;
        Ok(out)
    };
    let xyz = if value["weights_xyz"].is_null() { None } else { Some(array("weights_xyz")?) };
    let numbers = [
        Some(array("wavelengths_nm")?),
        xyz,
        Some(array("weights_rgb")?),
        Some(array("ior_offsets")?),
        Some(array("matrices")?),
    ];
    Contents::from_numbers(numbers, false)
}

/// The table for readers: rows of numbers under a line of headings, then three lines per matrix.
fn table(text: &str) -> Result<Contents, String> {
    let mut contents = Contents::default();
    let mut lines = text.lines().skip_while(|line| !line.trim_start().starts_with("n "));
    let with_xyz = lines.next().ok_or("no headings")?.contains("X weight");
    let mut xyz = Vec::new();
    let mut rows: Vec<[f32; 3]> = Vec::new();
    for line in lines.filter(|line| !line.is_empty() && !line.starts_with("K_")) {
        let numbers: Vec<f32> = line
            .split_whitespace()
            .map(|word| word.parse().map_err(|e| format!("{word}: {e}")))
            .collect::<Result<_, _>>()?;
        match (numbers.as_slice(), with_xyz) {
            ([_, nm, offset, x, y, z, r, g, b], true) => {
                contents.wavelengths_nm.push(*nm);
                contents.ior_offsets.push(*offset);
                xyz.push([*x, *y, *z]);
                contents.weights_rgb.push([*r, *g, *b]);
            }
            ([_, nm, offset, r, g, b], false) => {
                contents.wavelengths_nm.push(*nm);
                contents.ior_offsets.push(*offset);
                contents.weights_rgb.push([*r, *g, *b]);
            }
            ([a, b, c], _) => rows.push([*a, *b, *c]),
            _ => return Err(format!("{} numbers in: {line}", numbers.len())),
        }
    }
    contents.weights_xyz = with_xyz.then_some(xyz);
    if rows.len() != 3 * contents.wavelengths_nm.len() {
        return Err(format!("{} rows of matrices", rows.len()));
    }
    contents.matrices = rows.chunks_exact(3).map(|r| [r[0], r[1], r[2]]).collect();
    Ok(contents)
}
