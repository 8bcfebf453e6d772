//! One decision for each pass that a method could use, and none that the steps contradict.

use std::collections::BTreeSet;

use asm_core::{Method, Refraction, Settings};
use frame_plan::Plan;
use spectral_scene::{BUNDLED, Scene, bundled};

use crate::stage::Planners;

const METHODS: [Method; 3] = [Method::CausticsMap, Method::Acm, Method::Asm];

/// Passes of every plan.
const OF_BOTH: [&str; 10] = [
    "visibility",
    "coverage_mip",
    "photon_refine",
    "map_fit",
    "photon_trace",
    "photon_path",
    "gap_mask",
    "gap_reach",
    "gap_fill",
    "map_resolve",
];

fn plans(planners: &mut Planners, settings: &Settings) -> [(Plan, [&'static str; 2]); 2] {
    let (bake, picture) = (planners.bake(16, settings), planners.picture(16, settings));
    [(bake, ["uv_visibility", "receiver_bake"]), (picture, ["shade", "deferred_refraction"])]
}

/// What is wrong with a plan's decisions.
fn contradictions(plan: &Plan, own: [&str; 2]) -> Vec<String> {
    let mut found = Vec::new();
    let mut run = BTreeSet::new();
    plan.for_each_pass(&mut |step| {
        run.insert(step.pass.clone());
    });
    let decided: Vec<&str> = plan.decisions.iter().map(|d| d.pass.as_str()).collect();
    let once: BTreeSet<&str> = decided.iter().copied().collect();
    if once.len() != decided.len() || once != OF_BOTH.into_iter().chain(own).collect() {
        found.push(format!("decided: {decided:?}"));
    }
    for decision in &plan.decisions {
        if decision.kept != run.contains(&decision.pass) {
            found.push(format!("not what the steps are: {decision:?}"));
        }
        if decision.reason.is_empty() || decision.notes.iter().any(String::is_empty) {
            found.push(format!("no reason: {decision:?}"));
        }
    }
    found.extend(run.iter().filter(|pass| !once.contains(pass.as_str())).map(|p| format!("undecided: {p}")));
    found
}

fn assert_decided(what: &str, scene: &Scene) {
    let mut planners = Planners::new(scene);
    for method in METHODS {
        for (prune, refraction) in
            [true, false].into_iter().flat_map(|prune| Refraction::ALL.map(|refraction| (prune, refraction)))
        {
            let settings = Settings {
                prune,
                refraction: Some(refraction),
                emission_size: 64,
                map_size: Some(64),
                ..Settings::of(method)
            };
            for (plan, own) in plans(&mut planners, &settings) {
                let found = contradictions(&plan, own);
                assert!(found.is_empty(), "{what}, {method:?}, {}, pruned {prune}: {found:?}", plan.name);
            }
        }
    }
}

#[test]
fn every_pass_has_one_decision_and_the_steps_follow_it() {
    for name in BUNDLED {
        assert_decided(name, &bundled(name).unwrap());
    }
}

#[test]
fn scenes_without_light_glass_or_camera_glass_are_decided_too() {
    let scene = bundled("sphere").unwrap();
    let mut dark = scene.clone();
    dark.lights[0].intensity = 0.0;
    assert_decided("dark", &dark);
    let mut bare = scene.clone();
    bare.objects.remove(scene.refractors().next().unwrap());
    assert_decided("bare", &bare);
    let mut none = bare;
    none.lights.clear();
    assert_decided("no lights", &none);
}

#[test]
fn a_contradiction_is_found() {
    let sphere = bundled("sphere").unwrap();
    let [(plan, own), _] = plans(&mut Planners::new(&sphere), &Settings::of(Method::CausticsMap));
    assert!(contradictions(&plan, own).is_empty());
    let mut twice = plan.clone();
    twice.decisions.push(plan.decisions[0].clone());
    assert!(!contradictions(&twice, own).is_empty());
    let mut missing = plan.clone();
    missing.decisions.retain(|d| d.pass != "photon_trace");
    assert!(!contradictions(&missing, own).is_empty());
    let mut lost = plan.clone();
    lost.steps.pop();
    assert!(!contradictions(&lost, own).is_empty());
}
