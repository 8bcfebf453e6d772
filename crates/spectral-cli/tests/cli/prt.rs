//! `spectral prt`: the figures and scenes, and what goes wrong.

use std::fs;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text,
    WritableImage, read_first_rgba_layer_from_file,
};
use spectral_core::illuminant::Illuminant;

use crate::program::{files_in, spectral, spectral_in};

fn stats(folder: &Path) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("s.json")).expect("statistics");
    serde_json::from_str(&text).expect("JSON")
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Width and height of a PNG file, from its header.
fn png_size(path: &Path) -> [u32; 2] {
    let bytes = fs::read(path).expect("a picture");
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes")))
}

/// The paper's second figure: five coefficients are not told from sampling, RGB is.
#[test]
fn the_chart_under_fl4_is_right_in_spectra_and_wrong_in_rgb() {
    let folder = tempfile::tempdir().expect("folder");
    let figure = |options: &str| {
        let command = format!("prt --figure 2 --size 96x54 --backend cpu {options} -o f.png --stats s.json");
        spectral_in(folder.path(), &command).done();
        assert_eq!(png_size(&folder.path().join("f.png")), [3 * 96, 2 * 54]);
        let lamp = stats(folder.path())["lamps"][0].clone();
        assert_eq!(lamp["lamp"], "FL4");
        lamp
    };
    let five = figure("");
    assert!(number(&five["spectral"]["mean"]) < 0.15 && number(&five["spectral"]["max"]) < 0.5, "{five}");
    assert!(number(&five["rgb"]["mean"]) > 5.0, "{five}");
    let three = figure("--coefficients 3");
    assert!(number(&three["spectral"]["mean"]) > 3.0 * number(&five["spectral"]["mean"]), "{three}");
}

#[test]
fn a_scene_is_lit_by_its_sky_and_what_is_not_matt_is_left_out() {
    let folder = tempfile::tempdir().expect("folder");
    let run = |options: &str| {
        let command = format!("prt prism --size 40x30 --backend cpu {options} --stats s.json");
        spectral_in(folder.path(), &command).done();
        stats(folder.path())
    };
    let lit = run("-o p.png");
    assert_eq!(png_size(&folder.path().join("p.png")), [40, 30]);
    let warnings = lit["warnings"].as_array().expect("a list");
    assert!(warnings.iter().any(|w| w.as_str().is_some_and(|w| w.contains("left out"))), "{lit}");
    assert_eq!((&lit["backend"], &lit["functions"]), (&"cpu".into(), &1.into()));
    let bounced = run("--bounces 1 --environment FL11 -o p.exr");
    assert_eq!(bounced["bounces"], 1);
    assert!(folder.path().join("p.exr").exists());
}

/// Metal is there with a lobe alone, and what shines looks as rough as bands can tell.
#[test]
fn metal_shines_where_it_is_asked_to() {
    let folder = tempfile::tempdir().expect("folder");
    let side = r#"{"lights": [{"spectrum": {"illuminant": "D65"}, "bands": [[1.0], [0.5, 0.0, 0.5]]}]}"#;
    fs::write(folder.path().join("side.json"), side).expect("written");
    let run = |options: &str| {
        let command = format!(
            "prt metal-ring --environment side.json --size 48x36 --backend cpu {options} -o p.exr --stats s.json"
        );
        spectral_in(folder.path(), &command).done();
        (pixels(&folder.path().join("p.exr")), stats(folder.path()))
    };
    let said = |stats: &serde_json::Value, what: &str| {
        let warnings = stats["warnings"].as_array().expect("a list");
        warnings.iter().filter_map(|w| w.as_str()).any(|w| w.contains("`ring`") && w.contains(what))
    };
    let (matt, without) = run("");
    assert!(said(&without, "--gloss") && without["glossy_objects"] == 0, "{without}");
    let (metal, with) = run("--gloss");
    assert!(said(&with, "less sharp") && !said(&with, "left out") && with["glossy_objects"] == 1, "{with}");
    assert_ne!(matt, metal);
    let (rougher, broad) = run("--gloss=0.8");
    assert!(!said(&broad, "less sharp") && broad["glossy_objects"] == 2, "{broad}");
    assert_ne!(metal, rougher);
}

/// A sky that is brightest below the horizon, by two bands alone, rings above: what faces up is below zero.
#[test]
fn pixels_below_zero_are_kept_and_counted_and_black_on_a_screen() {
    let folder = tempfile::tempdir().expect("folder");
    let below = r#"{"lights": [{"spectrum": {"illuminant": "D65"}, "bands": [[1.0], [-3.0, 0.0, 0.0]]}]}"#;
    fs::write(folder.path().join("below.json"), below).expect("written");
    let run = |environment: &str, output: &str| {
        let command = format!(
            "prt glass --environment {environment} --bands 2 --size 24x18 --backend cpu -o {output} --stats s.json"
        );
        spectral_in(folder.path(), &command).done();
        let stats = stats(folder.path());
        (number(&stats["ringing_pixels"]), stats["warnings"].to_string())
    };
    let (kept, said) = run("below.json", "p.exr");
    let dark = pixels(&folder.path().join("p.exr")).iter().filter(|rgb| rgb[1] < 0.0).count();
    assert!(kept > 0.0 && dark > 0 && said.contains("below zero and kept"), "{kept} {dark} {said}");
    let (black, said) = run("below.json", "p.png");
    assert!(black == kept && said.contains("below zero and shown black"), "{black} {said}");
    let (none, said) = run("D65", "p.exr");
    assert!(none == 0.0 && !said.contains("below zero"), "{none} {said}");
}

/// A sigmoid shows otherwise what is clipped to the same white, and the statistics say by which.
#[test]
fn a_sigmoid_is_another_picture_of_the_same_light() {
    let folder = tempfile::tempdir().expect("folder");
    let run = |curve: &str| {
        let command = format!(
            "prt glass --exposure 0.5 --tone-map {curve} --size 24x18 --backend cpu -o p.png --stats s.json"
        );
        spectral_in(folder.path(), &command).done();
        let display = stats(folder.path())["display"].clone();
        assert_eq!(display["exposure"], 0.5, "{display}");
        (fs::read(folder.path().join("p.png")).expect("a picture"), display["tone_map"].clone())
    };
    let (clipped, clip) = run("clip");
    let (curved, sigmoid) = run("sigmoid");
    assert_ne!(clipped, curved);
    assert_eq!(clip, "clip");
    // Slope 1 of log against log at middle grey, 0.18.
    assert!((number(&sigmoid["sigmoid"]["contrast"]) * 0.82 - 1.0).abs() < 1e-12, "{sigmoid}");
    spectral_in(folder.path(), "prt glass --tone-map film -o p.png")
        .bad_usage(&["--tone-map", "clip, sigmoid"]);
}

/// An equirectangular picture in the JCGT's spectral layout: the same everywhere, every 5 nm.
fn write_even_sky(path: &Path, channel: &str, radiance: impl Fn(f64) -> f64) {
    let size = (6, 3);
    let list = (380..=780).step_by(5).map(|nm| {
        AnyChannel::new(
            &*format!("{channel}.{nm},0nm"),
            FlatSamples::F32(vec![radiance(nm.into()) as f32; 18]),
        )
    });
    let mut own = LayerAttributes::default();
    for (name, value) in [("spectralLayoutVersion", "1.0"), ("emissiveUnits", "W.m^-2.sr^-1")] {
        own.other.insert(Text::from(name), AttributeValue::Text(Text::from(value)));
    }
    let layer = Layer::new(size, own, Encoding::UNCOMPRESSED, AnyChannels::sort(list.collect()));
    Image::from_layer(layer).write().to_file(path).expect("written");
}

/// Linear sRGB of a picture.
fn pixels(path: &Path) -> Vec<[f32; 3]> {
    let read = read_first_rgba_layer_from_file(
        path,
        |size, _| vec![vec![[0.0; 3]; size.width()]; size.height()],
        |rows, at, (r, g, b, _): (f32, f32, f32, f32)| rows[at.y()][at.x()] = [r, g, b],
    );
    read.expect("a picture").layer_data.channel_data.pixels.concat()
}

/// An equirectangular picture of one linear sRGB.
fn write_rgb_sky(path: &Path, rgb: [f32; 3]) {
    exr::prelude::write_rgb_file(path, 6, 3, |_, _| (rgb[0], rgb[1], rgb[2])).expect("written");
}

/// White of a screen is D65's, upsampled; red is not.
#[test]
fn a_white_rgb_sky_is_daylight() {
    let folder = tempfile::tempdir().expect("folder");
    write_rgb_sky(&folder.path().join("white.exr"), [1.0; 3]);
    write_rgb_sky(&folder.path().join("red.exr"), [1.0, 0.1, 0.1]);
    let shown = |environment: &str| {
        let command = format!("prt glass --size 24x18 --backend cpu --environment {environment} -o p.exr");
        spectral_in(folder.path(), &command).done();
        pixels(&folder.path().join("p.exr")).concat()
    };
    let daylight = shown("D65");
    let brightest = daylight.iter().copied().fold(0.0, f32::max);
    let off = |other: &[f32]| {
        let each = daylight.iter().zip(other).map(|(a, b)| (a - b).abs());
        each.fold(0.0, f32::max) / brightest
    };
    let (white, red) = (off(&shown("white.exr")), off(&shown("red.exr")));
    println!("white {white}, red {red}");
    assert!(white < 1e-4 && red > 0.1, "{white} {red}");
}

/// A spectral picture and a sky file that are the same everywhere show coloured walls as their illuminant does.
#[test]
fn skies_from_files_are_their_illuminants() {
    let folder = tempfile::tempdir().expect("folder");
    let in_folder = |name: &str| folder.path().join(name);
    write_even_sky(&in_folder("sky.exr"), "S0", |nm| 0.03 * Illuminant::Fl11.relative_power(nm));
    let even = r#"{"lights": [{"spectrum": {"illuminant": "FL11"}, "bands": [[1.0]]}]}"#;
    fs::write(in_folder("sky.json"), even).expect("written");
    let shown = |environment: &str| {
        let command = format!("prt glass --size 24x18 --backend cpu --environment {environment} -o p.exr");
        spectral_in(folder.path(), &command).done();
        pixels(&in_folder("p.exr"))
    };
    let difference = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        let each = a.as_flattened().iter().zip(b.as_flattened());
        each.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let lamp = shown("FL11");
    for file in ["sky.exr", "sky.json"] {
        let error = difference(&lamp, &shown(file));
        assert!(error < 1e-5, "{file}: {error}");
    }
    // Another lamp, and the same from one side.
    assert!(difference(&lamp, &shown("A")) > 0.01);
    let side = even.replace("[[1.0]]", "[[1.0], [0.0, 0.0, 0.5]]");
    fs::write(in_folder("side.json"), side).expect("written");
    assert!(difference(&lamp, &shown("side.json")) > 0.01);
}

#[test]
fn skies_that_are_none_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    write_even_sky(&folder.path().join("paint.exr"), "T", |_| 0.5);
    write_even_sky(&folder.path().join("cold.exr"), "S0", |nm| 550.0 - nm);
    write_even_sky(&folder.path().join("infrared.exr"), "S0", |nm| f64::from(nm > 750.0));
    fs::write(folder.path().join("sky.json"), "{}").expect("written");
    let failed = |sky: &str, said: &[&str]| {
        let command = format!("prt prism --backend cpu --environment {sky} -o p.png");
        spectral_in(folder.path(), &command).failed(said);
        assert!(!folder.path().join("p.png").exists());
    };
    failed("paint.exr", &["paint.exr", "reflectances", "S0.<nm>nm"]);
    failed("cold.exr", &["cold.exr", "column 0, row 0", "555 nm", "not negative"]);
    failed("infrared.exr", &["infrared.exr", "no light from 400 to 700 nm"]);
    failed("sky.json", &["sky.json", "lights"]);
}

#[test]
fn what_makes_no_sense_is_refused_before_any_work() {
    let folder = tempfile::tempdir().expect("folder");
    let refused = |command: &str, said: &[&str]| {
        spectral_in(folder.path(), command).bad_usage(said);
        assert_eq!(files_in(folder.path()), [""; 0], "{command}");
    };
    refused("prt prism --environment moonlight -o p.png", &["moonlight", "no such illuminant", "D65"]);
    refused("prt --figure 3 -o p.png", &["--figure", "1..=2"]);
    refused("prt --figure 1 -o p.exr", &["--output", ".png"]);
    refused("prt --figure 1 --environment A -o p.png", &["--environment"]);
    refused("prt -o p.png", &["SCENE"]);
    refused("prt prism --bands 11 -o p.png", &["--bands", "1..=10"]);
    refused("prt prism --gloss=1.5 -o p.png", &["--gloss", "0 to 1"]);
    refused("prt metal-ring --gloss --bands 6 -o p.png", &["--bands 6", "2 to 5"]);
    refused("prt metal-ring --gloss --bands 1 -o p.png", &["--bands 1", "2 to 5"]);
    refused("prt --gloss glass -o p.png", &["--gloss", "roughness 1", "--gloss=0.5"]);
    refused("prt --figure 1 --gloss -o p.png", &["--gloss"]);
    refused("prt nothing-like-it -o p.png", &["nothing-like-it"]);
    spectral("prt prism --backend cpu --adapter x -o p.png").bad_usage(&["--adapter \"x\" names a GPU"]);
}

/// More coefficients than there are colours: both numbers are said.
#[test]
fn a_basis_has_no_more_coefficients_than_its_training_has_rank() {
    spectral("prt --figure 2 --coefficients 61 -o p.png").bad_usage(&["--coefficients 61", "rank"]);
}
