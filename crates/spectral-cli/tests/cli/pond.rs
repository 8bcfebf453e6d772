//! `spectral pond`: floors of the default and of given ponds, and what goes wrong.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use caustic_heightfield::{FloorGrid, HeightField, Pond, exact_over_facets, relative_rms};

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

/// Plans say where they ran; what is no plan runs on the CPU alone.
#[test]
fn plans_run_on_the_backend_asked_for() {
    let folder = tempfile::tempdir().expect("folder");
    for method in ["convolution", "low-rank"] {
        let command = format!("pond --size 24 --method {method} --backend cpu -o e.exr --stats s.json");
        spectral_in(folder.path(), &command).done();
        let stats = stats(folder.path());
        let details = &stats["details"];
        assert_eq!((&details["backend"], &details["backend_reason"]), (&"cpu".into(), &"asked for".into()));
        assert!(stats["report"]["surface"]["transmitted_flux"].as_f64().is_some_and(|f| f > 0.5), "{stats}");
    }
    for options in [
        "--method exact --backend wgpu",
        "--precision f64 --backend vulkan",
        "--method exact --adapter x",
        "--method convolution --precision fixed8 --threads 1",
    ] {
        spectral(&format!("pond {options} -o e.exr")).bad_usage(&["plans", "--precision f32"]);
    }
    spectral("pond --backend cpu --adapter x -o e.exr").bad_usage(&["--adapter \"x\" names a GPU"]);
}

/// Impulses are summed by the plan: the floor is that of heights in f64, which another moment's is not; waves down to the floor are
/// refused there, too. Other surfaces come from the host.
#[test]
fn plans_sum_impulses_by_themselves() {
    let folder = tempfile::tempdir().expect("folder");
    let pebbles = |amplitude_m: f64, time_s: f64| {
        let text = format!(
            r#"{{"surface": {{"impulses": {{
                "ripple": {{"front_m_s": 0.5, "alpha_per_s": 0.4, "beta_per_m": 3.0, "wave_number_rad_m": 60.0, "frequency_rad_s": 30.0}},
                "impulses": [{{"position_m": [0.3, 0.4], "start_s": 0.0, "amplitude_m": {amplitude_m}}},
                             {{"position_m": [0.8, 0.1], "start_s": 0.3, "amplitude_m": -0.002}}],
                "walls": {{"tiles": 2}}, "time_s": {time_s}}}}}}}"#
        );
        fs::write(folder.path().join("pebbles.json"), text).expect("written");
    };
    let run = |options: &str| {
        let command = format!("pond --scene pebbles.json --size 48 --method convolution {options} -o e.exr");
        spectral_in(folder.path(), &command)
    };
    let lit = |options: &str| {
        run(&format!("{options} --stats s.json")).done();
        (floor(folder.path(), "e.exr").heights_m, stats(folder.path())["details"]["heights_by"].clone())
    };
    pebbles(0.003, 0.9);
    let ((planned, by), (in_f64, _)) = (lit("--backend cpu"), lit("--precision f64"));
    assert_eq!(by, "plan");
    let error = relative_rms(&planned, &in_f64);
    assert!(error < 2e-5, "{error}");
    pebbles(0.003, 0.901);
    let error = relative_rms(&lit("--backend cpu").0, &in_f64);
    assert!(error > 2e-4, "a thousandth of a second went unnoticed: {error}");
    pebbles(1.0, 0.9);
    run("--backend cpu").failed(&["above the floor"]);
    fs::write(folder.path().join("pebbles.json"), "{}").expect("written");
    assert_eq!(lit("--backend cpu").1, "host");
}

/// The paper's frame buffers: fewer bits, more error, and the statistics say how much and of what.
#[test]
fn precision_has_a_price() {
    let folder = tempfile::tempdir().expect("folder");
    let error = |options: &str| -> f64 {
        let command =
            format!("pond --size 32 --method convolution --kernel 7 {options} -o e.exr --stats s.json");
        spectral_in(folder.path(), &command).done();
        let stats = stats(folder.path());
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
    let stats = stats(folder.path());
    assert_eq!((&stats["method"], &stats["precision"]), (&"low-rank".into(), &"f32".into()));
    assert!(stats["details"]["error"].as_f64().expect("a number") <= 0.01);
    assert_eq!(stats["details"]["way"], "terms");
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

/// Water as a refractor: nearly what is summed where the lobe is narrow, in grey or with all colours, frame after frame.
#[test]
fn photons_go_through_the_water() {
    let folder = tempfile::tempdir().expect("folder");
    let clear = r#"{"surface": {"waves": [{"amplitude_m": 0.004, "cycles": [3.0, 2.0], "frequency_rad_s": 9.0}]},
        "pond": {"scattering": 500.0, "light_direction": [0.36, 0.0, -1.0]}}"#;
    fs::write(folder.path().join("clear.json"), clear).expect("written");
    let run = |options: &str| {
        let command = format!("pond --scene clear.json --size 32 {options} --stats s.json");
        (spectral_in(folder.path(), &command).done(), stats(folder.path()))
    };
    let y = |options: &str| {
        let (ran, stats) = run(&format!("{options} -o e.exr"));
        (floor(folder.path(), "e.exr").heights_m, ran.stderr, stats)
    };
    let (photon, said, stats) = y("--method photon --backend cpu");
    assert!(said.contains("a = 500") && said.lines().count() == 1, "{said}");
    // The same surface and light by direct summation, with a lobe a tenth of a texel wide.
    let surface =
        HeightField::from_fn([32, 32], [1.0, 1.0], |x, y| 0.004 * (TAU * (3.0 * x + 2.0 * y)).sin());
    let surface = surface.expect("waves");
    let water = Pond { scattering: 5000.0, light_direction: [0.36, 0.0, -1.0], ..Pond::default() };
    let exact = exact_over_facets(&surface, &water, FloorGrid::below(&surface), 2.0).expect("a floor");
    let error = relative_rms(&photon, &exact.irradiance);
    assert!(error < 0.03, "{error}");
    let details = &stats["details"];
    assert_eq!((&details["backend"], &details["facets_per_sample"]), (&"cpu".into(), &2.into()));
    assert_eq!((&details["wavelengths"], &stats["precision"]), (&1.into(), &"f32".into()));

    let (_, stats) = run("--method photon --dispersion on --backend cpu -o c.exr");
    assert_eq!(stats["details"]["wavelengths"], 3);
    assert!(stats["dispersion"]["bands"].is_null() && stats["dispersion"]["on"] == true, "{stats}");
    let image = exr::prelude::read_first_flat_layer_from_file(folder.path().join("c.exr")).expect("an EXR");
    assert_eq!(image.layer_data.channel_data.list.len(), 3);
    let in_color: Vec<f64> =
        image.layer_data.channel_data.list[1].sample_data.values_as_f32().map(f64::from).collect();
    let difference = relative_rms(&in_color, &photon);
    assert!(difference > 1e-5 && difference < 0.01, "{difference}");

    run("--method photon --backend cpu --frames 3 --step 0.1 -o f#.exr");
    let frames = [0, 1, 2].map(|i| floor(folder.path(), &format!("f{i}.exr")).heights_m);
    assert_eq!(frames[0], photon);
    assert!(relative_rms(&frames[2], &frames[0]) > 0.02 && relative_rms(&frames[1], &frames[2]) > 0.02);
}

#[test]
fn photons_know_no_more_than_they_say() {
    let folder = tempfile::tempdir().expect("folder");
    for (pond, words) in [
        (r#"{"form": "paper"}"#, "take physical"),
        (r#"{"ior_above": 1.5}"#, "dense to the thin"),
        (r#"{"depth_m": 0.0}"#, "above the floor"),
    ] {
        let scene = format!(r#"{{"surface": {{"rows": [[0.0, 0.0], [0.0, 0.0]]}}, "pond": {pond}}}"#);
        fs::write(folder.path().join("pond.json"), scene).expect("written");
        spectral_in(folder.path(), "pond --scene pond.json --method photon -o e.exr").failed(&[words]);
    }
    for precision in ["f64", "f16", "fixed8"] {
        spectral(&format!("pond --method photon --precision {precision} -o e.exr"))
            .bad_usage(&["--method photon", "f32"]);
    }
    spectral("pond --method photon --kernel 7 -o e.exr").bad_usage(&["--kernel is for --method convolution"]);
    spectral("pond --method photon --wavelengths 7 -o e.exr").bad_usage(&["--wavelengths 7", "1 to 4"]);
    assert_eq!(files_in(folder.path()), ["pond.json"]);
}

fn stats(folder: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.join("s.json")).expect("read")).expect("JSON")
}

/// Colours are computed when asked for, or when a texel or more lies between red and violet; Y stays what it was, nearly.
#[test]
fn dispersion_is_computed_where_it_shows() {
    let folder = tempfile::tempdir().expect("folder");
    let low = r#"{"pond": {"light_direction": [1.8, 0.0, -1.0]}}"#;
    fs::write(folder.path().join("low.json"), low).expect("written");
    let run = |options: &str| {
        let command = format!("pond --scene low.json --method convolution {options} -o e.exr --stats s.json");
        (spectral_in(folder.path(), &command).done(), stats(folder.path()))
    };
    let (coarse, stats) = run("--size 48");
    assert!(coarse.stderr.is_empty() && stats["dispersion"]["on"] == false, "{} {stats}", coarse.stderr);
    assert!(stats["dispersion"]["bands"].is_null());
    let (fine, stats) = run("--size 256");
    assert!(fine.stderr.contains("texels apart") && fine.stderr.contains("7 wavelengths"), "{}", fine.stderr);
    assert_eq!(stats["dispersion"]["bands"]["wavelengths_nm"].as_array().map(Vec::len), Some(7));
    let (quiet, stats) = run("--size 256 --dispersion off");
    assert!(quiet.stderr.is_empty() && stats["dispersion"]["spread"]["visible"] == true, "{}", quiet.stderr);

    let channels = |options: &str| -> Vec<String> {
        spectral_in(folder.path(), &format!("pond --size 16 --method exact {options} -o e.exr")).done();
        let image =
            exr::prelude::read_first_flat_layer_from_file(folder.path().join("e.exr")).expect("an EXR");
        image.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect()
    };
    assert_eq!(channels(""), ["Y"]);
    assert_eq!(channels("--dispersion on"), ["X", "Y", "Z"]);
    assert_eq!(channels("--wavelengths 3"), ["X", "Y", "Z"]);
    let y = |options: &str| {
        spectral_in(folder.path(), &format!("pond --size 24 --error 1e-3 {options} -o e.exr")).done();
        floor(folder.path(), "e.exr").heights_m
    };
    let difference = relative_rms(&y("--wavelengths 5"), &y(""));
    assert!(difference > 1e-6 && difference < 5e-3, "{difference}");
    spectral("pond --dispersion off --wavelengths 3 -o e.exr")
        .bad_usage(&["--wavelengths 3", "--dispersion off"]);
    spectral("pond --dispersion sometimes -o e.exr").bad_usage(&["on, off, auto"]);
}

/// A series as numbered files and as one animation; each frame is the pond of its time.
#[test]
fn a_series_has_a_frame_for_each_moment() {
    let folder = tempfile::tempdir().expect("folder");
    let pebble = |time_s: f64| {
        let text = format!(
            r#"{{"surface": {{"impulses": {{
                "ripple": {{"front_m_s": 0.5, "alpha_per_s": 0.4, "beta_per_m": 3.0, "wave_number_rad_m": 60.0, "frequency_rad_s": 30.0}},
                "impulses": [{{"position_m": [0.4, 0.5], "start_s": 0.0, "amplitude_m": 0.003}}], "time_s": {time_s}}}}}}}"#
        );
        fs::write(folder.path().join("pebble.json"), text).expect("written");
    };
    pebble(0.5);
    let run =
        |options: &str| spectral_in(folder.path(), &format!("pond --scene pebble.json --size 32 {options}"));
    run("--frames 3 --step 0.25 -o f-##.exr --stats s.json").done();
    assert_eq!(files_in(folder.path()), ["f-00.exr", "f-01.exr", "f-02.exr", "pebble.json", "s.json"]);
    let stats = stats(folder.path());
    assert_eq!(
        (&stats["frames"][2]["after_s"], stats["frames"].as_array().map(Vec::len)),
        (&0.5.into(), Some(3))
    );
    assert!(stats["frames"][1]["outside"].is_u64() && stats["frames"][1]["ms"].is_f64(), "{stats}");
    let frames: Vec<HeightField> = (0..3).map(|i| floor(folder.path(), &format!("f-0{i}.exr"))).collect();
    assert!(relative_rms(&frames[2].heights_m, &frames[0].heights_m) > 0.02);
    pebble(1.0);
    run("-o later.exr").done();
    let later = floor(folder.path(), "later.exr");
    assert!(relative_rms(&frames[2].heights_m, &later.heights_m) < 0.02);

    run("--frames 4 --step 0.1 -o pond.apng").done();
    run("--frames 2 -o p#.png").done();
    let decoder = |file: &str| {
        let file = fs::File::open(folder.path().join(file)).expect("opened");
        png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a PNG")
    };
    let mut moving = decoder("pond.apng");
    assert_eq!(moving.info().animation_control().map(|control| control.num_frames), Some(4));
    let mut shown = Vec::new();
    for _ in 0..4 {
        let mut frame = vec![0; moving.output_buffer_size().expect("a size")];
        moving.next_frame(&mut frame).expect("a frame");
        shown.push(frame);
    }
    let delay = moving.info().frame_control().map(|control| (control.delay_num, control.delay_den));
    assert_eq!(delay, Some((100, 1000)));
    assert!(shown.windows(2).all(|pair| pair[0] != pair[1]));
    assert!(decoder("p1.png").info().animation_control().is_none());
}

/// What fails on the way leaves what was there before.
#[test]
fn a_series_is_written_whole_or_not_at_all() {
    let folder = tempfile::tempdir().expect("folder");
    for frame in 0..2 {
        let surface = HeightField::flat([8, 8], [1.0, 1.0]).expect("flat");
        surface.to_exr(&folder.path().join(format!("h{frame}.exr"))).expect("written");
    }
    fs::write(folder.path().join("p.json"), r#"{"surface": {"exr": "h#.exr"}}"#).expect("written");
    fs::write(folder.path().join("e0.exr"), "older").expect("written");
    let run = |options: &str| {
        spectral_in(folder.path(), &format!("pond --scene p.json --method convolution {options}"))
    };
    let before = files_in(folder.path());
    // Eight frames are looked at before the work begins; the tenth is missing.
    run("--frames 2 -o e#.exr").done();
    assert_eq!(files_in(folder.path()).len(), before.len() + 1);
    fs::write(folder.path().join("e0.exr"), "older").expect("written");
    fs::remove_file(folder.path().join("e1.exr")).expect("removed");
    for frame in 2..20 {
        if frame != 12 {
            fs::copy(folder.path().join("h0.exr"), folder.path().join(format!("h{frame}.exr")))
                .expect("copied");
        }
    }
    let before = files_in(folder.path());
    for output in ["e#.exr", "e#.png", "e.apng"] {
        run(&format!("--frames 20 -o {output}")).failed(&["h12.exr"]);
        assert_eq!(files_in(folder.path()), before, "{output}");
    }
    assert_eq!(fs::read_to_string(folder.path().join("e0.exr")).expect("read"), "older");
    run("--frames 20 -o e.exr").bad_usage(&["# signs", ".apng"]);
    run("--frames 0 -o e#.exr").bad_usage(&["--frames"]);
    run("--step 1 -o e.exr").bad_usage(&["--frames"]);
    run("--frames 2 --step 100 -o e#.exr").bad_usage(&["0.001 to 60"]);
    run("--frames 2 -o e#.exr --stats e1.exr").bad_usage(&["same file"]);
    spectral("pond --frames 2 -o e#.exr").bad_usage(&["stands still", "frequency_rad_s"]);
}

/// A pebble's waves by the wave equation go on from frame to frame; a step that is too long is named with the longest.
#[test]
fn the_wave_equation_makes_a_series() {
    let folder = tempfile::tempdir().expect("folder");
    let pond = |step_s: f64| {
        let surface = format!(
            r#"{{"surface": {{"wave-equation": {{"speed_m_s": 1.0, "step_s": {step_s}, "time_s": 0.1,
                "pebbles": [{{"position_m": [0.5, 0.5], "height_m": 0.005, "radius_m": 0.06}}]}}}}}}"#
        );
        fs::write(folder.path().join("pond.json"), surface).expect("written");
        let command = "pond --scene pond.json --size 24 --frames 2 --step 0.2 --method convolution -o e#.exr";
        spectral_in(folder.path(), command)
    };
    pond(0.01).done();
    let [first, second] = ["e0.exr", "e1.exr"].map(|file| floor(folder.path(), file).heights_m);
    assert!(relative_rms(&first, &second) > 0.01);
    // 1 m/s on cells of 1/24 m: 1 / (24 sqrt 2) s.
    pond(0.05).failed(&["0.05 s is unstable", "0.0294"]);
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
    spectral("pond --method photons -o e.exr").bad_usage(&["convolution, low-rank, exact, photon"]);
    spectral("pond --precision f128 -o e.exr").bad_usage(&["f32, f64"]);
    spectral("pond --precision fixed3 -o e.exr").bad_usage(&["4 to 16 bits"]);
    spectral("pond --precision fixed8 -o e.exr").bad_usage(&["--precision", "--method convolution"]);
    spectral("pond --method convolution --sums per-tap -o e.exr").bad_usage(&["--sums", "fixed"]);
    spectral("pond --method exact --precision f32 -o e.exr").bad_usage(&["--precision", "f64"]);
    spectral("pond --method exact --error 0.1 -o e.exr").bad_usage(&["--error", "low-rank"]);
    spectral("pond --kernel 7 -o e.exr").bad_usage(&["--kernel", "convolution"]);
    spectral("pond --size 0 -o e.exr").bad_usage(&["--size", "1 to"]);
    spectral("pond --method convolution --kernel 6 -o e.exr").failed(&["6", "odd"]);
    spectral("pond -o e.jpg").bad_usage(&[".exr or .png"]);
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
