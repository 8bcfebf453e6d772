//! `spectral matrices`: every format, every scheme, and what goes wrong.

use std::fs;
use std::process::{Command, Stdio};

use serde_json::Value;

use crate::program::{files_in, spectral, spectral_in};

fn json(args: &str) -> Value {
    let run = spectral(&format!("matrices --format json {args}")).done();
    assert_eq!(run.stderr, "");
    serde_json::from_str(&run.stdout).expect("JSON")
}

/// The matrices as the f32 that any language reads from the text.
fn matrices(set: &Value) -> Vec<[[f32; 3]; 3]> {
    serde_json::from_value(set["matrices"].clone()).expect("3 x 3 matrices")
}

#[test]
fn every_scheme_sums_to_the_identity_in_f32() {
    let schemes = ["gauss", "uniform", "equal-energy", "optimal"];
    let mut runs: Vec<String> =
        schemes.iter().flat_map(|s| [1, 3, 7, 21].map(|n| format!("-n {n} --scheme {s}"))).collect();
    runs.extend(["-n 3", "-n 4"].map(|n| format!("{n} --scheme fraunhofer")));
    runs.push("-n 7 --scheme asm2013".into());
    for run in runs {
        let set = json(&run);
        let mut sum = [[0.0_f32; 3]; 3];
        for k in matrices(&set) {
            for i in 0..3 {
                for j in 0..3 {
                    sum[i][j] += k[i][j];
                }
            }
        }
        assert_eq!(sum, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], "{run}");
        assert_eq!(set["wavelengths_nm"].as_array().map(Vec::len), set["n"].as_u64().map(|n| n as usize));
    }
}

#[test]
fn options_reach_the_set() {
    let set = json("-n 5 --scheme uniform --range 400..700 --cmf cie1964");
    assert_eq!(set["wavelengths_nm"], serde_json::json!([400.0, 475.0, 550.0, 625.0, 700.0]));
    assert_eq!(set["cmf"], "cie1964");
    assert_ne!(matrices(&set), matrices(&json("-n 5 --scheme uniform --range 400..700 --cmf wyman2013")));
    // SPECGEN's range and the counts that schemes imply.
    assert_eq!(json("--scheme uniform")["range_nm"], serde_json::json!([420.0, 680.0]));
    assert_eq!((&json("")["n"], &json("--scheme fraunhofer")["n"]), (&7.into(), &3.into()));
}

/// The offset is 0 at the reference line: D 589.3 nm of SPECGEN is fraunhofer's second line; glTF's d is another.
#[test]
fn offsets_follow_their_convention() {
    let offset = |convention: &str| {
        let set = json(&format!("--scheme fraunhofer --offsets {convention}"));
        assert_eq!(set["offsets"], convention);
        set["ior_offsets"][1].as_f64().expect("a number")
    };
    assert_eq!(offset("specgen"), 0.0);
    let at = |um: f64| 1.0 / (um * um);
    let expected = (at(0.5893) - at(0.58756)) / (at(0.48613) - at(0.65627));
    assert!((offset("gltf") - expected).abs() < 1e-12, "{} {expected}", offset("gltf"));
}

#[test]
fn all_formats_carry_the_same_matrices() {
    let matrices = matrices(&json("-n 3 --scheme gauss"));
    for format in ["glsl", "hlsl", "wgsl", "msl", "c", "rust", "json", "text"] {
        let text = spectral(&format!("matrices -n 3 --scheme gauss --format {format}")).done().stdout;
        let digits = text.replace('.', "");
        for value in matrices.iter().flatten().flatten() {
            let scientific = format!("{:.8e}", value.abs());
            let nine = scientific.split('e').next().expect("a mantissa").replace('.', "");
            assert!(digits.contains(&nine), "{format} lacks {value}");
        }
    }
}

#[test]
fn the_quality_report_is_in_the_output_and_on_the_terminal() {
    for spread in ["1", "4", "16", "64"] {
        assert!(json("-n 4")["edge_delta_e"][spread].as_f64().expect("a number") > 0.0);
    }
    assert!(spectral("matrices --format glsl").done().stdout.contains("CIEDE2000"));
    let folder = tempfile::tempdir().expect("folder");
    let run = spectral_in(folder.path(), "matrices --format wgsl -o k.wgsl").done();
    assert!(run.stdout.contains("CIEDE2000") && run.stdout.contains("64 px"), "{}", run.stdout);
    let on_stdout = spectral("matrices --format wgsl").done().stdout;
    assert_eq!(fs::read_to_string(folder.path().join("k.wgsl")).expect("written"), on_stdout);
    assert_eq!(files_in(folder.path()), ["k.wgsl"]);
}

#[test]
fn wrong_values_are_refused() {
    let matrices = |options: &str| spectral(&format!("matrices {options}"));
    matrices("-n 0").bad_usage(&["-n", "1 to 4096"]);
    matrices("-n -1").bad_usage(&["1 to 4096"]);
    matrices("-n 5000").bad_usage(&["1 to 4096"]);
    matrices("-n 99999999999999999999").bad_usage(&["1 to 4096"]);
    matrices("-n 5 --scheme fraunhofer").bad_usage(&["fraunhofer", "3 or 4", "5"]);
    matrices("-n 8 --scheme asm2013").bad_usage(&["asm2013", "7", "8"]);
    matrices("--scheme bogus").bad_usage(&["bogus", "equal-energy"]);
    matrices("--range 680..420").bad_usage(&["--range", "680", "420..680"]);
    matrices("--range 100..2000").bad_usage(&["100", "360"]);
    matrices("--range NaN..680").bad_usage(&["NaN"]);
    matrices("--cmf bogus").bad_usage(&["bogus", "cie1931"]);
    matrices("--offsets bogus").bad_usage(&["bogus", "specgen"]);
    matrices("--format bogus").bad_usage(&["bogus", "wgsl"]);
    // No Z at any of these.
    matrices("-n 3 --scheme uniform --range 700..830").bad_usage(&["Z", "white"]);
}

#[test]
fn files_that_cannot_be_written_are_failures() {
    let folder = tempfile::tempdir().expect("folder");
    spectral_in(folder.path(), "matrices -o missing/k.glsl").failed(&["missing/k.glsl", "no folder"]);
    spectral_in(folder.path(), "matrices -o .").failed(&["folder"]);
    assert!(files_in(folder.path()).is_empty());
    #[cfg(target_os = "linux")]
    spectral("matrices -o /dev/full").failed(&["/dev/full", "no space"]);
}

#[test]
fn a_reader_that_leaves_early_is_no_failure() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_spectral"))
        .args(["matrices", "-n", "4096", "--scheme", "uniform"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("the program ends");
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty());
}
