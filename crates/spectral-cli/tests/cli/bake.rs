//! `spectral bake`: the file it writes, the statistics beside it, and what goes wrong.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use exr::prelude::{ReadChannels, ReadLayers, read};
use serde_json::Value;
use spectral_scene::bundled;

use crate::program::{files_in, spectral, spectral_in};

/// Channels by name, and the size.
fn channels(path: &Path) -> (Vec<(String, Vec<f32>)>, [usize; 2]) {
    let image =
        read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let layer = image.from_file(path).expect("a readable EXR").layer_data;
    let channel = |c: &exr::image::AnyChannel<exr::image::FlatSamples>| {
        (c.name.to_string(), c.sample_data.values_as_f32().collect())
    };
    (layer.channel_data.list.iter().map(channel).collect(), [layer.size.0, layer.size.1])
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("readable")).expect("JSON")
}

/// Everything finite, the total the sum of its layers, light in the layers named.
#[track_caller]
fn check_irradiance(path: &Path, size: [usize; 2], lit: &[&str]) {
    let (channels, found) = channels(path);
    assert_eq!(found, size);
    let get = |name: &str| &channels.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}")).1;
    assert_eq!(channels.len(), 12);
    for c in ["X", "Y", "Z"] {
        let [direct, refracted, reflected] =
            ["direct", "refracted", "reflected"].map(|layer| get(&format!("{layer}.{c}")));
        for (i, total) in get(c).iter().enumerate() {
            assert!(total.is_finite() && *total >= 0.0, "{c} {i}: {total}");
            let sum = direct[i] + refracted[i] + reflected[i];
            assert!((total - sum).abs() <= 1e-6 * sum, "{c} {i}: {total} is not {sum}");
        }
    }
    for layer in lit {
        assert!(get(&format!("{layer}.Y")).iter().any(|&y| y > 0.0), "{layer} is dark");
    }
}

#[test]
fn caustics_map_bakes_with_statistics() {
    let folder = tempfile::tempdir().expect("folder");
    let run = "bake sphere --receiver receiver --size 32x16 -o out.exr --method caustics-map --wavelengths 3 \
               --refraction image-space --bounces 0 --backend cpu --threads 2 --seed 1 --stats stats.json";
    let done = spectral_in(folder.path(), run).done();
    assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", ""));
    check_irradiance(&folder.path().join("out.exr"), [32, 16], &["direct", "refracted"]);
    assert_eq!(files_in(folder.path()), ["out.exr", "stats.json"]);

    let stats = json(&folder.path().join("stats.json"));
    let expected = [
        ("command", "bake"),
        ("scene", "sphere"),
        ("target", "receiver"),
        ("method", "caustics-map"),
        ("refraction", "image-space"),
        ("backend", "cpu"),
        ("backend_asked", "cpu"),
    ];
    for (key, value) in expected {
        assert_eq!(stats[key], value, "{key}");
    }
    assert_eq!(stats["size"], serde_json::json!({"width": 32, "height": 16}));
    assert_eq!(stats["settings"]["wavelengths"], 3);
    assert!(stats["device"].as_str().expect("a device").contains("2 threads"));
    assert!(stats["driver"].is_string() && stats["backend_reason"].is_string());
    assert!(stats["statistics"]["photons"].as_u64().expect("photons") > 0);
    assert!(!stats["statistics"]["step_times"].as_array().expect("times").is_empty());
    for task in ["open_scene", "plan", "prepare", "execute", "write", "total"] {
        assert!(stats["times_ms"][task].as_f64().expect(task) >= 0.0);
    }
}

/// What footprints took stands beside what a uniform grid as fine as their finest cells would.
#[test]
fn footprints_say_how_little_they_took() {
    let folder = tempfile::tempdir().expect("folder");
    spectral_in(folder.path(), "bake sphere --size 32x32 --backend cpu -o out.exr --stats stats.json").done();
    let stats = json(&folder.path().join("stats.json"));
    assert_eq!(stats["method"], "footprint");
    let took = &stats["statistics"]["lights"][0]["footprints"];
    for (own, uniform) in [
        ("rays", "uniform_rays"),
        ("deposits", "uniform_deposits"),
        ("wavelengths_per_cell", "uniform_wavelengths_per_cell"),
    ] {
        let [own, uniform] = [own, uniform].map(|key| took[key].as_f64().expect(key));
        assert!(0.0 < own && own < uniform, "{took}");
    }
    // Of three wavelengths most are known from corners around.
    let per_cell = took["wavelengths_per_cell"].as_f64().expect("wavelengths");
    assert!((1.0..2.5).contains(&per_cell), "{took}");
}

/// The map is fixed point: threads must not show.
#[test]
fn the_same_bake_gives_the_same_bits() {
    let folder = tempfile::tempdir().expect("folder");
    for (file, threads) in [("a.exr", 1), ("b.exr", 3)] {
        let run =
            format!("bake gem --size 16x16 -o {file} --backend cpu --threads {threads} --wavelengths 1");
        spectral_in(folder.path(), &run).done();
    }
    let bytes = ["a.exr", "b.exr"].map(|file| fs::read(folder.path().join(file)).expect("written"));
    assert!(bytes[0] == bytes[1]);
}

#[test]
fn reference_bakes_with_its_standard_error() {
    let folder = tempfile::tempdir().expect("folder");
    let bake = |file: &str, seed: u32| {
        let run = format!(
            "bake gem --size 16x16 --method reference --photons 2e4 --bounces 2 --refraction traced --seed {seed} \
             --threads 2 --wavelengths 80 -o {file}.exr --stats {file}.json"
        );
        spectral_in(folder.path(), &run).done();
        fs::read(folder.path().join(format!("{file}.exr"))).expect("written")
    };
    let first = bake("first", 1);
    assert!(first == bake("again", 1), "the same seed gives the same bits");
    assert!(first != bake("other", 2), "another seed gives others");
    check_irradiance(&folder.path().join("first.exr"), [16, 16], &["direct", "refracted", "reflected"]);

    let stats = json(&folder.path().join("first.json"));
    assert_eq!((&stats["method"], &stats["backend"]), (&"reference".into(), &"cpu".into()));
    assert!(stats["device"].as_str().expect("a device").contains("2 threads"));
    assert_eq!(stats["settings"]["step_nm"], 5.0);
    assert_eq!(stats["settings"]["bounces"], 2);
    assert_eq!(stats["settings"]["seed"], 1);
    for layer in ["total", "direct", "refracted", "reflected"] {
        assert!(stats["standard_error"][layer].as_f64().expect(layer) > 0.0, "{layer}");
    }
    assert!(stats["statistics"]["photons"].as_u64().expect("photons") >= 20_000);
    assert!(stats["statistics"]["imbalance"].as_f64().expect("imbalance") < 1e-9);
    assert!(!stats["statistics"]["ledger"]["bins"].as_array().expect("bins").is_empty());
}

#[test]
fn a_noise_target_is_kept() {
    let folder = tempfile::tempdir().expect("folder");
    let run = "bake gem --size 16x16 --method reference --noise 0.2 -o out.exr --stats stats.json";
    spectral_in(folder.path(), run).done();
    let error = &json(&folder.path().join("stats.json"))["standard_error"];
    assert!(error["refracted"].as_f64().expect("an error") <= 0.2, "{error}");
}

/// Where a GPU executor has an adapter it must bake; where it has none the message says what works.
#[test]
fn gpus_bake_or_say_that_there_is_no_adapter() {
    let devices: Value = serde_json::from_str(&spectral("devices --json").done().stdout).expect("JSON");
    let executors = devices["executors"].as_array().expect("executors");
    for backend in ["wgpu", "vulkan"] {
        let folder = tempfile::tempdir().expect("folder");
        let there = executors.iter().any(|e| e["id"] == backend && e["status"] == "available");
        let run = format!(
            "bake gem --size 16x16 --wavelengths 1 -o out.exr --backend {backend} --stats stats.json"
        );
        let run = spectral_in(folder.path(), &run);
        if there {
            run.done();
            check_irradiance(&folder.path().join("out.exr"), [16, 16], &["direct", "refracted"]);
            assert_eq!(json(&folder.path().join("stats.json"))["backend"], backend);
            let run =
                format!("bake gem --size 16x16 -o out.exr --backend {backend} --adapter no-such-adapter");
            spectral(&run).failed(&["no-such-adapter"]);
        } else {
            run.failed(&[backend, "--backend cpu"]);
            assert!(files_in(folder.path()).is_empty());
        }
    }
}

#[test]
fn a_scenes_only_receiver_needs_no_name() {
    let folder = tempfile::tempdir().expect("folder");
    let mut scene = bundled("gem").expect("a bundled scene");
    for object in &mut scene.objects {
        object.name = format!("my {}", object.name);
    }
    for mesh in &mut scene.meshes {
        mesh.name = format!("my {}", mesh.name);
    }
    fs::write(folder.path().join("mine.glb"), spectral_scene::to_glb(&scene).expect("valid"))
        .expect("written");
    let run = "bake mine.glb --size 16x16 --wavelengths 1 --backend cpu -o out.exr --stats stats.json";
    spectral_in(folder.path(), run).done();
    assert_eq!(json(&folder.path().join("stats.json"))["target"], "my receiver");
    spectral_in(folder.path(), "bake mine.glb --receiver receiver -o out.exr")
        .bad_usage(&["`receiver`", "my receiver"]);
}

#[test]
fn scenes_and_receivers_that_are_not_there_are_refused() {
    spectral("bake no-such-scene -o out.exr").bad_usage(&["no-such-scene", "sphere-fine"]);
    spectral("bake missing.glb -o out.exr").bad_usage(&["missing.glb"]);
    spectral("bake sphere --receiver nobody -o out.exr").bad_usage(&["nobody", "receiver"]);
    spectral("bake sphere --receiver sphere -o out.exr").bad_usage(&["sphere", "refracting"]);
}

/// None was named, so it is not the command line that is wrong.
#[test]
fn a_scene_without_a_receiver_is_a_failure() {
    let folder = tempfile::tempdir().expect("folder");
    let mut scene = bundled("gem").expect("a bundled scene");
    scene.meshes.iter_mut().for_each(|mesh| mesh.uvs.clear());
    fs::write(folder.path().join("bare.glb"), spectral_scene::to_glb(&scene).expect("valid"))
        .expect("written");
    spectral_in(folder.path(), "bake bare.glb -o out.exr").failed(&["bare", "texture coordinates"]);
    spectral_in(folder.path(), "bake bare.glb -o out.exr --receiver receiver").bad_usage(&["`receiver`"]);
    assert_eq!(files_in(folder.path()), ["bare.glb"]);
}

#[test]
fn scenes_that_are_no_files_are_refused_at_once() {
    let folder = tempfile::tempdir().expect("folder");
    let mut wrong = vec!["."];
    if cfg!(target_os = "linux") {
        wrong.push("/dev/zero");
    }
    for scene in wrong {
        let run =
            spectral_in(folder.path(), &format!("bake {scene} -o out.exr")).failed(&[scene, "regular file"]);
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    }
    assert!(files_in(folder.path()).is_empty());
}

/// The error names the light and what it may have.
#[test]
fn lights_beyond_what_a_map_can_hold_are_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let mut scene = bundled("gem").expect("a bundled scene");
    scene.lights[0].intensity = 1e30;
    let brightest = spectral_scene::to_glb(&scene).expect("valid");
    fs::write(folder.path().join("bright.glb"), &brightest).expect("written");
    let options = "-o out.exr --size 16x16 --wavelengths 1 --backend cpu";
    spectral_in(folder.path(), &format!("bake bright.glb {options}")).done();
    check_irradiance(&folder.path().join("out.exr"), [16, 16], &["direct", "refracted"]);
    fs::remove_file(folder.path().join("out.exr")).expect("removed");

    let at = brightest.windows(5).position(|bytes| bytes == b"1e+30").expect("the intensity");
    let mut spoilt = brightest;
    spoilt[at..at + 5].copy_from_slice(b"1e+31");
    fs::write(folder.path().join("brighter.glb"), spoilt).expect("written");
    spectral_in(folder.path(), &format!("bake brighter.glb {options}")).failed(&[
        scene.lights[0].name.as_str(),
        "intensity",
        "1e30",
    ]);
    assert_eq!(files_in(folder.path()), ["bright.glb", "brighter.glb"]);
}

/// A `.glb` file whose first accessor claims more elements than any memory holds.
fn with_hostile_count(glb: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().expect("four bytes")) as usize;
    let (json, binary) = glb[20..].split_at(word(12));
    let mut document: Value = serde_json::from_slice(json).expect("JSON");
    document["accessors"][0]["count"] = 9_999_999_999_u64.into();
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = |n: usize| (n as u32).to_le_bytes();
    let total = 20 + json.len() + binary.len();
    [&glb[..8], &length(total), &length(json.len()), &glb[16..20], &json, binary].concat()
}

#[test]
fn broken_scenes_fail_and_destroy_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    spectral_in(folder.path(), "export gem -o gem.glb").done();
    let whole = fs::read(folder.path().join("gem.glb")).expect("written");
    fs::write(folder.path().join("out.exr"), "older").expect("written");
    let broken: [(&str, Vec<u8>); 4] = [
        ("truncated.glb", whole[..whole.len() / 2].to_vec()),
        ("empty.glb", Vec::new()),
        ("noise.glb", (0..999_u32).map(|i| (i * 7919 % 251) as u8).collect()),
        ("hostile.glb", with_hostile_count(&whole)),
    ];
    for (name, bytes) in broken {
        fs::write(folder.path().join(name), bytes).expect("written");
        spectral_in(folder.path(), &format!("bake {name} -o out.exr --stats stats.json")).failed(&[name]);
        spectral_in(folder.path(), &format!("plan {name}")).failed(&[name]);
    }
    spectral_in(folder.path(), "plan hostile.glb").failed(&["accessors[0]"]);
    assert_eq!(fs::read_to_string(folder.path().join("out.exr")).expect("there"), "older");
    assert!(!folder.path().join("stats.json").exists());
}

/// The photons would take weeks: these end because the outputs are looked at first.
#[test]
fn unwritable_outputs_are_found_before_the_work() {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("file"), "").expect("written");
    let bake = |outputs: &str| {
        spectral_in(folder.path(), &format!("bake sphere --method reference --photons 1e15 {outputs}"))
    };
    bake("-o missing/out.exr").failed(&["missing/out.exr", "no folder"]);
    bake("-o file/out.exr").failed(&["file/out.exr", "not a directory"]);
    bake("-o out.exr --stats missing/stats.json").failed(&["missing/stats.json", "no folder"]);
    bake("-o out.exr --stats .").failed(&["folder"]);
    assert_eq!(files_in(folder.path()), ["file"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_a_failure() {
    spectral("bake gem --size 16x16 --wavelengths 1 --backend cpu -o /dev/full")
        .failed(&["/dev/full", "space"]);
}

#[test]
fn an_interrupted_run_leaves_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let mut child = Command::new(env!("CARGO_BIN_EXE_spectral"))
        .args("bake gem --method reference --photons 1e15 -o out.exr --stats stats.json".split(' '))
        .current_dir(folder.path())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().expect("a state").is_none(), "it is still at work");
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert!(files_in(folder.path()).is_empty());
}
