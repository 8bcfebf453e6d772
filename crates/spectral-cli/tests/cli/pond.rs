//! `spectral pond`: floors of the default and of given ponds, and what goes wrong.

use std::fs;
use std::path::Path;

use caustic_heightfield::{HeightField, relative_rms};

use crate::program::{files_in, spectral, spectral_in};

/// The irradiance of a written floor.
fn floor(folder: &Path, file: &str) -> HeightField {
    HeightField::from_exr(&folder.join(file), [1.0, 1.0]).expect("one finite channel")
}

#[test]
fn methods_agree_as_far_as_they_should() {
    let folder = tempfile::tempdir().expect("folder");
    let run = |options: &str, file: &str| {
        spectral_in(folder.path(), &format!("pond --size 48 {options} -o {file}")).done();
        floor(folder.path(), file)
    };
    let exact = run("--method exact", "exact.exr");
    assert_eq!(exact.size, [48, 48]);
    let error = |options: &str| relative_rms(&run(options, "other.exr").heights_m, &exact.heights_m);
    assert!(error("--method low-rank") < 0.012);
    assert!(error("--method low-rank --precision f64 --error 0.001") < 0.0012);
    // 20 degrees are too many for the paper's expansion, in any precision.
    assert!(error("--method convolution --precision f32") > 0.9);
}

/// The paper's frame buffers: fewer bits, more error, and the statistics say how much and of what.
#[test]
fn precision_has_a_price() {
    let folder = tempfile::tempdir().expect("folder");
    let error = |options: &str| -> f64 {
        let command =
            format!("pond --size 32 --method convolution --kernel 7 {options} -o e.exr --stats s.json");
        spectral_in(folder.path(), &command).done();
        let stats: serde_json::Value =
            serde_json::from_slice(&fs::read(folder.path().join("s.json")).expect("read")).expect("JSON");
        let passes = &stats["details"]["passes"];
        assert_eq!(passes["format"], stats["precision"]);
        assert!(passes["surface"].as_array().is_some_and(|passes| passes.len() > 20), "{passes}");
        assert!(passes["error_bound"].as_f64().is_some_and(f64::is_finite), "{passes}");
        stats["details"]["error_against_f64"].as_f64().expect("a number")
    };
    let errors = ["fixed8", "fixed12", "fixed16"].map(|bits| error(&format!("--precision {bits}")));
    assert!(errors[0] > 4.0 * errors[1] && errors[1] > 4.0 * errors[2], "{errors:?}");
    assert!(error("--precision f16") < errors[0]);
    assert!(error("--precision fixed8 --sums per-tap") > errors[0]);
}

#[test]
fn a_pond_comes_from_a_file() {
    let folder = tempfile::tempdir().expect("folder");
    let pebble = r#"{
        "extent_m": [0.5, 0.5],
        "surface": {"impulses": {
            "ripple": {"front_m_s": 0.5, "alpha_per_s": 0.4, "beta_per_m": 3.0, "wave_number_rad_m": 60.0, "frequency_rad_s": 30.0},
            "impulses": [{"position_m": [0.2, 0.3], "start_s": 0.0, "amplitude_m": 0.003}],
            "walls": "four", "time_s": 0.8}},
        "pond": {"depth_m": 0.2, "light_direction": [0.2, 0.0, -1.0], "normals": "one-sided"}
    }"#;
    fs::write(folder.path().join("pebble.json"), pebble).expect("written");
    spectral_in(folder.path(), "pond --scene pebble.json --size 41 -o e.exr --stats s.json").done();
    assert_eq!(files_in(folder.path()), ["e.exr", "pebble.json", "s.json"]);
    let lit = floor(folder.path(), "e.exr");
    let [low, high] = lit.range_m();
    assert_eq!(lit.size, [41, 41]);
    assert!(low > 0.0 && high > 1.02 * low, "{low} {high}");
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("s.json")).expect("read")).expect("JSON");
    assert_eq!((&stats["method"], &stats["precision"]), (&"low-rank".into(), &"f32".into()));
    assert!(stats["details"]["error"].as_f64().expect("a number") <= 0.01);
    assert!(stats["times_ms"]["floor"].is_number());

    // Heights of a file have their own size.
    HeightField::flat([7, 5], [1.0, 1.0])
        .expect("flat")
        .to_exr(&folder.path().join("h.exr"))
        .expect("written");
    fs::write(folder.path().join("flat.json"), r#"{"surface": {"exr": "h.exr"}}"#).expect("written");
    spectral_in(folder.path(), "pond --scene flat.json --method exact -o e.exr").done();
    assert_eq!(floor(folder.path(), "e.exr").size, [7, 5]);
    spectral_in(folder.path(), "pond --scene flat.json --size 9 -o e.exr").bad_usage(&["--size 9", "leave"]);
}

#[test]
fn what_is_doubtful_is_said() {
    let folder = tempfile::tempdir().expect("folder");
    let storm = r#"{"surface": {"waves": [{"amplitude_m": 0.1, "cycles": [5, 0]}]},
        "pond": {"light_direction": [1, 0, -0.3], "outside": "periodic"}}"#;
    fs::write(folder.path().join("storm.json"), storm).expect("written");
    let run = spectral_in(folder.path(), "pond --scene storm.json --size 24 --method exact -o e.exr").done();
    for words in ["steeper than 45 degrees", "turned away", "behind a crest"] {
        assert!(run.stderr.contains(words), "{}", run.stderr);
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    spectral("pond --method photon -o e.exr").bad_usage(&["convolution, low-rank, exact"]);
    spectral("pond --precision f128 -o e.exr").bad_usage(&["f32, f64"]);
    spectral("pond --precision fixed3 -o e.exr").bad_usage(&["4 to 16 bits"]);
    spectral("pond --precision fixed8 -o e.exr").bad_usage(&["--precision", "--method convolution"]);
    spectral("pond --method convolution --sums per-tap -o e.exr").bad_usage(&["--sums", "fixed"]);
    spectral("pond --method exact --precision f32 -o e.exr").bad_usage(&["--precision", "f64"]);
    spectral("pond --method exact --error 0.1 -o e.exr").bad_usage(&["--error", "low-rank"]);
    spectral("pond --kernel 7 -o e.exr").bad_usage(&["--kernel", "convolution"]);
    spectral("pond --size 0 -o e.exr").bad_usage(&["--size", "1 to"]);
    spectral("pond --method convolution --kernel 6 -o e.exr").failed(&["6", "odd"]);
    spectral("pond -o e.png").bad_usage(&[".exr"]);
    let folder = tempfile::tempdir().expect("folder");
    let pond = |text: &str, words: &[&str]| {
        fs::write(folder.path().join("p.json"), text).expect("written");
        spectral_in(folder.path(), "pond --scene p.json -o e.exr").failed(words);
    };
    pond("{", &["p.json", "is no pond"]);
    pond(r#"{"depth": 1}"#, &["depth", "extent_m"]);
    pond(r#"{"surface": {"rows": [[0, 0], [0]]}}"#, &["row 1 has 1 values"]);
    pond(r#"{"surface": {"exr": "absent.exr"}}"#, &["absent.exr"]);
    pond(r#"{"pond": {"depth_m": -1}}"#, &["depth", "-1"]);
    pond(r#"{"pond": {"scattering": 1e8}}"#, &["samples wide", "0.25"]);
    assert_eq!(files_in(folder.path()), ["p.json"]);
}
