//! Headers in all formats: each is checked by a compiler or parser of its language, read back the way that language
//! orders matrices, and compared bit by bit; each check must refuse a broken header.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod read_back;

use read_back::{Contents, read_back};
use spectral_core::dispersion::OffsetConvention;
use spectral_core::header::{Format, write};
use spectral_core::light::LightSpectrum;
use spectral_core::matrices::SpectralMatrices;
use spectral_core::observer::Observer;
use spectral_core::rgb::RgbSpace;
use spectral_core::wavelengths::{Scheme, WavelengthSet};

fn cases() -> Vec<(WavelengthSet, SpectralMatrices, OffsetConvention)> {
    let set = |scheme, n, observer| WavelengthSet::new(scheme, n, (420.0, 680.0), observer).unwrap();
    let optimal = set(Scheme::Optimal, 7, Observer::Cie1931);
    let asm = set(Scheme::Asm2013, 7, Observer::Cie1931);
    let one = set(Scheme::Gauss, 1, Observer::Cie1964);
    let many = set(Scheme::Uniform, 21, Observer::Wyman2013);
    let bulb = LightSpectrum::illuminant("A").unwrap();
    vec![
        (
            optimal.clone(),
            SpectralMatrices::new(&optimal, &RgbSpace::SRGB).unwrap(),
            OffsetConvention::Specgen,
        ),
        (asm.clone(), SpectralMatrices::new(&asm, &RgbSpace::SRGB).unwrap(), OffsetConvention::Gltf),
        (one.clone(), SpectralMatrices::new(&one, &RgbSpace::REC2020).unwrap(), OffsetConvention::Gltf),
        (many.clone(), SpectralMatrices::new(&many, &RgbSpace::ACESCG).unwrap(), OffsetConvention::Specgen),
        (
            optimal.clone(),
            SpectralMatrices::for_light(&optimal, &RgbSpace::SRGB, &bulb).unwrap(),
            OffsetConvention::Gltf,
        ),
    ]
}

/// Every case in one format: valid, equal to the library's numbers bit for bit, with the sum that the library promises.
fn assert_format(format: Format) {
    for (set, matrices, offsets) in cases() {
        let text = write(&set, &matrices, offsets, format);
        let contents =
            read_back(format, &text).unwrap_or_else(|e| panic!("{format} {}: {e}\n{text}", set.scheme));
        // Equality of floats is equality of bits here: no NaN, and -0 is excluded by a test of the matrices.
        assert_eq!(contents, Contents::of(&set, &matrices, offsets), "{format} {}\n{text}", set.scheme);
        assert_eq!(contents.sum_f32(), matrices.sum, "{format} {}", set.scheme);
    }
}

/// The negative controls of each check: a header with its last bracket or number missing, and one with a digit changed.
fn assert_broken_is_refused(format: Format) {
    let (set, matrices, offsets) = cases().remove(0);
    let text = write(&set, &matrices, offsets, format);
    let good = read_back(format, &text).unwrap();

    let mut incomplete = text.clone();
    if format == Format::Text {
        incomplete.truncate(text.trim_end().rfind(' ').unwrap());
    } else {
        incomplete.remove(text.rfind([')', '}', ']']).unwrap());
    }
    assert!(read_back(format, &incomplete).is_err(), "{format} accepts\n{incomplete}");

    // The last number with nine digits belongs to a matrix.
    let digit = text.rfind(|c: char| c.is_ascii_digit()).unwrap();
    let mut changed = text.clone();
    if format == Format::Json {
        // There the colour error comes last.
        let k = text.find("\"matrices\"").unwrap();
        let digit = k + text[k..].find(|c: char| c.is_ascii_digit() && c != '0').unwrap();
        changed.replace_range(digit..=digit, "0");
    } else {
        let digit = text[..digit].rfind('.').unwrap() + 2;
        let other = if &text[digit..=digit] == "7" { "1" } else { "7" };
        changed.replace_range(digit..=digit, other);
    }
    let contents = read_back(format, &changed).unwrap();
    assert_ne!(contents, good, "{format} does not see the change in\n{changed}");
    assert_ne!(contents.sum_f32(), matrices.sum, "{format}");
}

#[test]
fn glsl_is_accepted_by_naga_and_a_broken_one_is_not() {
    assert_format(Format::Glsl);
    assert_broken_is_refused(Format::Glsl);
}

#[test]
fn wgsl_is_accepted_by_naga_and_a_broken_one_is_not() {
    assert_format(Format::Wgsl);
    assert_broken_is_refused(Format::Wgsl);
}

#[test]
fn hlsl_parses_and_a_broken_one_does_not() {
    assert_format(Format::Hlsl);
    assert_broken_is_refused(Format::Hlsl);
}

#[test]
fn msl_parses_and_a_broken_one_does_not() {
    assert_format(Format::Msl);
    assert_broken_is_refused(Format::Msl);
}

#[test]
fn c_compiles_and_a_broken_one_does_not() {
    assert_format(Format::C);
    assert_broken_is_refused(Format::C);
}

#[test]
fn rust_compiles_and_a_broken_one_does_not() {
    assert_format(Format::Rust);
    assert_broken_is_refused(Format::Rust);
}

#[test]
fn json_parses_and_a_broken_one_does_not() {
    assert_format(Format::Json);
    assert_broken_is_refused(Format::Json);
}

#[test]
fn table_reads_back_and_a_broken_one_does_not() {
    assert_format(Format::Text);
    assert_broken_is_refused(Format::Text);
}

#[test]
fn json_has_the_members_that_are_relied_on() {
    let (set, matrices, offsets) = cases().remove(0);
    let value: serde_json::Value =
        serde_json::from_str(&write(&set, &matrices, offsets, Format::Json)).unwrap();
    let keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    let mut expected = [
        "n",
        "scheme",
        "cmf",
        "range_nm",
        "wavelengths_nm",
        "weights_xyz",
        "weights_rgb",
        "matrices",
        "offsets",
        "ior_offsets",
        "sum_residual",
        "edge_delta_e",
    ];
    expected.sort_unstable();
    let mut sorted = keys;
    sorted.sort_unstable();
    assert_eq!(sorted, expected);
    assert_eq!(value["n"], 7);
    assert_eq!(value["scheme"], "optimal");
    assert_eq!(value["cmf"], "cie1931");
    assert_eq!(value["range_nm"], serde_json::json!([420.0, 680.0]));
    assert_eq!(value["sum_residual"], 0.0);
    for spread in ["1", "4", "16", "64"] {
        assert!(value["edge_delta_e"][spread].as_f64().unwrap() > 0.0, "{spread}");
    }
    for (row, weight) in set.weights_xyz.unwrap().iter().enumerate() {
        for (column, exact) in weight.iter().enumerate() {
            assert_eq!(value["weights_xyz"][row][column].as_f64(), Some(*exact));
        }
    }
    let (asm, matrices, offsets) = cases().remove(1);
    let text = write(&asm, &matrices, offsets, Format::Json);
    assert!(text.contains("\"weights_xyz\": null"), "{text}");
}

#[test]
fn headers_say_where_they_come_from() {
    let (set, matrices, offsets) = cases().remove(0);
    for format in Format::ALL.into_iter().filter(|&f| f != Format::Json) {
        let text = write(&set, &matrices, offsets, format);
        for part in [
            "scheme optimal",
            "420 to 680 nm",
            "cie1931",
            "linear sRGB",
            "residual 0.0",
            "specgen",
            "CIEDE2000",
        ] {
            assert!(text.contains(part), "{format} does not mention {part}:\n{text}");
        }
    }
}

#[test]
fn matrices_have_nine_significant_digits_in_every_format() {
    let (set, matrices, offsets) = cases().remove(0);
    for format in Format::ALL {
        let text = write(&set, &matrices, offsets, format);
        for v in matrices.matrices.iter().flatten().flatten() {
            let exact = format!("{:.8e}", v.abs());
            let digits: String =
                exact.split('e').next().unwrap().chars().filter(|c| c.is_ascii_digit()).collect();
            let significant = digits.trim_start_matches('0');
            let plain: String = text.chars().filter(|&c| c != '.').collect();
            assert!(plain.contains(significant), "{format} lacks the digits {significant} of {v}");
        }
    }
}
