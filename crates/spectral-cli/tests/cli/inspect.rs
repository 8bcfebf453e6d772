//! `spectral plan`, `devices` and `export`: what they say and write.

use std::fs;

use serde_json::Value;

use crate::program::{files_in, spectral, spectral_in};

fn json(args: &str) -> Value {
    serde_json::from_str(&spectral(args).done().stdout).expect("JSON")
}

#[test]
fn a_plan_says_what_is_kept_and_left_out_and_why() {
    let text = spectral("plan sphere").done().stdout;
    for part in ["dispersion: on", "absorption: off", "passes kept", "passes left out", "path_trace", "KiB"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
}

#[test]
fn plans_as_json_have_effects_passes_and_resources() {
    let report = json("plan gem --json --method caustics-map");
    assert_eq!((&report["scene"], &report["method"]), (&"gem".into(), &"caustics-map".into()));
    assert_eq!(report["effects"]["dispersion"]["on"], true);
    assert!(report["effects"]["absorption"]["reason"].is_string());
    assert_eq!(report["problems"], serde_json::json!([]));
    let plans = report["plans"].as_array().expect("plans");
    assert_eq!(plans.len(), 2);
    for plan in plans {
        let decisions = plan["decisions"].as_array().expect("decisions");
        assert!(decisions.iter().any(|d| d["kept"] == true && d["pass"] == "photon_trace"));
        assert!(decisions.iter().all(|d| d["reason"].as_str().is_some_and(|r| !r.is_empty())));
        assert!(!plan["steps"].as_array().expect("steps").is_empty());
        let resources = plan["resources"].as_array().expect("resources");
        let bytes: u64 = resources.iter().map(|r| r["bytes"].as_u64().expect("bytes")).sum();
        assert_eq!(plan["total_bytes"], bytes);
        assert!(bytes > 0);
    }
}

/// Every scene has a plan; what it does not call for is left out of it.
#[test]
fn every_bundled_scene_has_a_plan() {
    for scene in spectral_scene::BUNDLED {
        let report = json(&format!("plan {scene} --json"));
        assert_eq!(report["problems"], serde_json::json!([]), "{scene}");
    }
}

#[test]
fn a_scene_without_receiver_or_camera_says_so() {
    let folder = tempfile::tempdir().expect("folder");
    let mut scene = spectral_scene::bundled("gem").expect("a bundled scene");
    for mesh in &mut scene.meshes {
        mesh.uvs.clear();
    }
    fs::write(folder.path().join("bare.glb"), spectral_scene::to_glb(&scene).expect("valid"))
        .expect("written");
    let text = spectral_in(folder.path(), "plan bare.glb").done().stdout;
    assert!(text.contains("no plan for a bake: no matt object has texture coordinates"), "{text}");
}

#[test]
fn devices_always_have_the_cpu() {
    let report = json("devices --json");
    let executors = report["executors"].as_array().expect("executors");
    assert_eq!((&executors[0]["id"], &executors[0]["status"]), (&"cpu".into(), &"available".into()));
    for id in ["wgpu", "vulkan"] {
        assert!(executors.iter().any(|e| e["id"] == id), "{id} is there or says why not");
    }
    for executor in executors {
        assert!(["available", "failed", "missing"].iter().any(|s| executor["status"] == *s));
        assert!(executor["reason"].as_str().is_some_and(|r| !r.is_empty()));
        assert_eq!(executor["status"] == "missing", executor["device"] == "");
        assert_eq!(executor["status"] == "missing", executor["device_type"].is_null());
    }
    assert_eq!(executors[0]["device_type"], "cpu");
    let auto = report["auto"].as_str().expect("auto");
    assert!(executors.iter().any(|e| e["id"] == auto && e["status"] == "available"));
    let text = spectral("devices").done().stdout;
    assert!(["cpu", "wgpu", "vulkan", "auto"].iter().all(|word| text.contains(word)), "{text}");
}

#[test]
fn an_exported_scene_comes_back() {
    let folder = tempfile::tempdir().expect("folder");
    let run = spectral_in(folder.path(), "export prism -o prism.glb").done();
    assert_eq!((run.stdout.as_str(), run.stderr.as_str()), ("", ""));
    let (scene, _) = spectral_scene::load(folder.path().join("prism.glb")).expect("loads");
    let original = spectral_scene::bundled("prism").expect("a bundled scene");
    assert_eq!(scene.materials, original.materials);
    assert_eq!(scene.objects.len(), original.objects.len());
    spectral_in(folder.path(), "export prism.glb -o prism.glb").done();
    assert_eq!(files_in(folder.path()), ["prism.glb"]);
    assert_eq!(
        spectral_scene::load(folder.path().join("prism.glb")).expect("loads").0.materials,
        original.materials
    );
}

#[test]
fn exports_that_cannot_be_written_are_failures() {
    let folder = tempfile::tempdir().expect("folder");
    spectral_in(folder.path(), "export prism -o missing/prism.glb")
        .failed(&["missing/prism.glb", "no folder"]);
    spectral_in(folder.path(), "export nothing -o out.glb").bad_usage(&["nothing", "prism"]);
    assert!(files_in(folder.path()).is_empty());
}
