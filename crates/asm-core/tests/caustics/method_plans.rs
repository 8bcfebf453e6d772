//! What ACM and ASM plan for each scene, and why.

use asm_core::{
    Emission, GapFilling, Interfaces, Method, PlanError, Refraction, Settings, bake_plan, render_plan,
};
use frame_plan::{Executor, Limits, Plan, Step};
use spectral_core::dispersion::Dispersion;
use spectral_core::wavelengths::Scheme;
use spectral_scene::{BUNDLED, Scene, bundled};

use crate::stage::{Planners, cpu};

fn bake_of(scene: &Scene, settings: &Settings) -> Plan {
    let receiver = scene.receiver("receiver").unwrap();
    bake_plan(scene, receiver, [64; 2], settings, &Limits::default()).unwrap().plan
}

fn has(plan: &Plan, pass: &str) -> bool {
    let mut found = false;
    plan.for_each_pass(&mut |step| found |= step.pass == pass);
    found
}

/// Wavelengths of the last refinement's photons.
fn wavelengths(plan: &Plan) -> u32 {
    let id = plan.params.iter().find(|p| p.name.starts_with("photon_refine")).unwrap();
    let last = &id.bytes[id.bytes.len() - id.stride_bytes as usize..];
    word_of(last, 4)
}

fn word_of(bytes: &[u8], word: usize) -> u32 {
    u32::from_le_bytes(bytes[4 * word..4 * word + 4].try_into().unwrap())
}

fn reasons(plan: &Plan, pass: &str, kept: bool) -> Vec<String> {
    let of = |d: &&frame_plan::Decision| d.pass == pass && d.kept == kept;
    plan.decisions.iter().filter(of).map(|d| d.reason.clone()).collect()
}

#[test]
fn every_bundled_scene_has_its_acm_and_asm_plan() {
    // Steps are looked up by the names of one light.
    let scenes = BUNDLED.iter().map(|name| bundled(name).unwrap());
    for scene in scenes.filter(|scene| scene.refractors().count() > 0 && scene.lights.len() == 1) {
        let (name, mut planners) = (&scene.name, Planners::new(&scene));
        let mut names = |settings: &Settings| planners.bake(64, settings).step_names();
        let light = format!("light 0 `{}`", scene.lights[0].name);
        // What the two add to caustics mapping, and where.
        let mut acm = names(&Settings::of(Method::CausticsMap));
        let clear = acm.iter().position(|s| s == "clear map").unwrap();
        let copies = (0..6).map(|level| format!("copy photon queue {level} to photon queue heads"));
        let refine = [format!("coverage_mip ({light})"), format!("photon_refine ({light})")];
        acm.splice(clear..clear, refine.clone().into_iter().chain(copies));
        assert_eq!(names(&Settings::of(Method::Acm)), acm, "{name}");
        let mut asm = names(&Settings::of(Method::CausticsMap));
        let copies = (0..3).map(|level| format!("copy photon queue {level} to photon queue heads"));
        asm.splice(clear..clear, refine.into_iter().chain(copies));
        let resolve = asm.iter().position(|s| s.starts_with("map_resolve")).unwrap();
        let fill = [
            format!("gap_mask ({light})"),
            format!("gap_reach ({light})"),
            "clear filled map".to_owned(),
            format!("gap_fill ({light})"),
        ];
        let disperses = scene.materials.iter().any(|m| m.is_refractor() && m.dispersion.is_dispersive());
        if disperses {
            asm.splice(resolve..resolve, fill);
            let ledger = asm.iter().position(|s| s == "clear ledger").unwrap();
            asm.insert(ledger + 1, "clear gap energy".into());
        }
        assert_eq!(names(&Settings::of(Method::Asm)), asm, "{name}");
        for method in [Method::Acm, Method::Asm] {
            for settings in [Settings::of(method), Settings { prune: false, ..Settings::of(method) }] {
                planners.bake(64, &settings).validate(&asm_core::PASSES, &Limits::default()).unwrap();
                let picture = planners.picture(64, &settings);
                picture.validate(&asm_core::PASSES, &Limits::default()).unwrap();
            }
        }
    }
}

/// What light `light` takes: a photon that a mirror throws back is traced apart from one that goes through glass, and lands on
/// all that the light sees.
fn steps_of_light(light: &str, glass: bool, method: Method) -> Vec<String> {
    let levels = match method {
        Method::CausticsMap => 0,
        Method::Footprint => unreachable!("its steps are others"),
        Method::Acm => 6,
        Method::Asm => 3,
    };
    let view = |what: &str| format!("visibility ({light}, {what})");
    let mut steps = vec![view("landing")];
    steps.extend(glass.then(|| view("landing of reflected light")));
    steps.extend(["shadow", "entry"].map(view));
    steps.extend(glass.then(|| view("exit")));
    if levels > 0 {
        steps.extend([format!("coverage_mip ({light})"), format!("photon_refine ({light})")]);
        steps.extend((0..levels).map(|level| format!("copy photon queue {level} to photon queue heads")));
    }
    let path = |path: &str, fills: bool| {
        let mut steps = vec!["clear map".to_owned(), format!("photon_trace ({light}{path})")];
        if fills {
            steps.extend(["gap_mask", "gap_reach"].map(|pass| format!("{pass} ({light})")));
            steps.extend(["clear filled map".to_owned(), format!("gap_fill ({light})")]);
        }
        steps.push(format!("map_resolve ({light}{path})"));
        steps
    };
    if glass {
        steps.extend(path("", method == Method::Asm));
    }
    steps.extend(path(", reflected", false));
    steps
}

#[test]
fn footprints_have_their_plans() {
    for scene in BUNDLED.iter().map(|name| bundled(name).unwrap()) {
        let (name, mut planners) = (&scene.name, Planners::new(&scene));
        let footprints = Settings::of(Method::Footprint);
        let glass = scene.refractors().count() > 0;
        let mirrors = scene.mirrors().count() > 0;
        let mut wanted =
            ["clear ledger", "clear irradiance", "uv_visibility (receiver)"].map(String::from).to_vec();
        for (i, light) in scene.lights.iter().enumerate() {
            let light = format!("light {i} `{}`", light.name);
            wanted.extend(["landing", "shadow", "entry"].map(|view| format!("visibility ({light}, {view})")));
            let paths = [(glass, light.clone()), (mirrors, format!("{light}, reflected"))];
            for (_, path) in paths.into_iter().filter(|(kept, _)| *kept) {
                wanted.push("clear cell queues".into());
                wanted.push(format!("path_trace ({path})"));
                let between =
                    [8, 4, 2].map(|step| format!("path_trace ({path}, between corners {step} apart)"));
                wanted.extend(between);
                wanted.push("clear map".into());
                wanted.push(format!("footprint_split ({path})"));
                wanted.push(format!("footprints ({path}, tiles)"));
                wanted.push(format!("map_resolve ({path})"));
                wanted.push("copy cell queues to footprint work".into());
            }
            wanted.push(format!("receiver_bake ({light})"));
        }
        assert_eq!(planners.bake(64, &footprints).step_names(), wanted, "{name}");
        // Cells that may not be split take no rounds.
        let whole = planners.bake(64, &Settings { cell_splits: 0, ..footprints.clone() }).step_names();
        wanted.retain(|step| !step.starts_with("footprint_split"));
        for step in wanted.iter_mut().filter(|step| step.starts_with("footprints")) {
            *step = step.replace("footprints", "footprint_splat").replace(", tiles", "");
        }
        assert_eq!(whole, wanted, "{name}");
        for prune in [true, false] {
            let settings = Settings { prune, ..footprints.clone() };
            planners.bake(64, &settings).validate(&asm_core::PASSES, &Limits::default()).unwrap();
            let picture = planners.picture(64, &settings);
            picture.validate(&asm_core::PASSES, &Limits::default()).unwrap();
            // A picture has no receiver whose texels could hold the light.
            assert!(!glass || picture.step_names().iter().any(|step| step.starts_with("map_fit")), "{name}");
            // A fitted map may be finer than any tolerance of what would be told; mirrored light's is not fitted.
            let steps = picture.step_names();
            let mut told = steps.iter().filter(|step| step.contains("between corners"));
            assert!(told.all(|step| step.contains("reflected")), "{name}");
        }
    }
}

#[test]
fn traced_photons_have_the_steps_of_others_but_the_search_for_exits() {
    for scene in BUNDLED.iter().map(|name| bundled(name).unwrap()) {
        let (name, mut planners) = (&scene.name, Planners::new(&scene));
        for method in [Method::CausticsMap, Method::Acm, Method::Asm] {
            let of = |refraction| Settings { refraction: Some(refraction), ..Settings::of(method) };
            let (image_space, traced) =
                (planners.bake(64, &of(Refraction::ImageSpace)), planners.bake(64, &of(Refraction::Traced)));
            assert_eq!(image_space, planners.bake(64, &Settings::of(method)), "{name}: the default");
            let wanted = image_space.step_names().into_iter().filter(|step| !step.ends_with(", exit)"));
            let wanted: Vec<_> = wanted.map(|step| step.replace("photon_trace", "photon_path")).collect();
            assert_eq!(traced.step_names(), wanted, "{name} {method:?}");
            assert!(wanted.iter().any(|step| step.starts_with("photon_path")), "{name} {method:?}");
            for (plan, pass, other) in
                [(&image_space, "photon_trace", "photon_path"), (&traced, "photon_path", "photon_trace")]
            {
                assert_eq!((reasons(plan, pass, true).len(), reasons(plan, other, false).len()), (1, 1));
            }
            assert!(reasons(&traced, "photon_trace", false)[0].contains("paths through the geometry"));
            for prune in [true, false] {
                let settings = Settings { prune, ..of(Refraction::Traced) };
                planners.bake(64, &settings).validate(&asm_core::PASSES, &Limits::default()).unwrap();
                let picture = planners.picture(64, &settings);
                picture.validate(&asm_core::PASSES, &Limits::default()).unwrap();
            }
        }
    }
}

#[test]
fn notes_of_paths_say_what_is_followed() {
    let notes = |bounces| {
        let settings =
            Settings { bounces, refraction: Some(Refraction::Traced), ..Settings::of(Method::Asm) };
        let plan = bake_of(&bundled("gem").unwrap(), &settings);
        plan.decisions.iter().find(|d| d.pass == "photon_path").unwrap().notes.join("; ")
    };
    assert!(notes(0).contains("no reflection inside"), "{}", notes(0));
    assert!(notes(1).contains("1 reflection inside"), "{}", notes(1));
    assert!(notes(3).contains("3 reflections inside"), "{}", notes(3));
}

#[test]
fn bundled_scenes_with_mirrors_have_their_plans() {
    let mut seen = 0;
    for scene in BUNDLED.iter().map(|name| bundled(name).unwrap()) {
        let (name, glass) = (scene.name.as_str(), scene.refractors().count() > 0);
        if scene.mirrors().count() == 0 {
            assert!(glass && scene.lights.len() == 1, "`{name}` has no plan of its own here");
            continue;
        }
        seen += 1;
        let mut planners = Planners::new(&scene);
        for method in [Method::CausticsMap, Method::Acm, Method::Asm] {
            let settings = Settings::of(method);
            let lights: Vec<String> =
                scene.lights.iter().enumerate().map(|(i, l)| format!("light {i} `{}`", l.name)).collect();
            let mut wanted = vec!["clear ledger".to_owned()];
            wanted.extend((glass && method == Method::Asm).then(|| "clear gap energy".to_owned()));
            wanted.extend(["clear irradiance", "uv_visibility (receiver)"].map(str::to_owned));
            for light in &lights {
                wanted.extend(steps_of_light(light, glass, method));
                wanted.push(format!("receiver_bake ({light})"));
            }
            assert_eq!(planners.bake(64, &settings).step_names(), wanted, "{name} {method:?}");
            // A picture takes the same of each light, and besides may fit the map to where refracted light lands.
            let picture = planners.picture(64, &settings);
            let mut steps = picture.step_names();
            let fits = ["clear landing bounds", "map_fit (", ", landings)"];
            let before = steps.len();
            steps.retain(|step| !fits.iter().any(|fit| step.contains(fit)));
            let fitted = if glass && method != Method::Asm { 3 * lights.len() } else { 0 };
            assert_eq!(before - steps.len(), fitted, "{name} {method:?}");
            for light in &lights {
                let wanted = steps_of_light(light, glass, method);
                assert!(steps.windows(wanted.len()).any(|w| w == wanted), "{name} {method:?}: {steps:?}");
            }
        }
    }
    assert_eq!(seen, 2, "metal-ring and lamps");
}

#[test]
fn asm_without_dispersion_is_acm() {
    let mut scene = bundled("prism").unwrap();
    let split = bake_of(&scene, &Settings::of(Method::Asm));
    assert_eq!(wavelengths(&split), 7);
    assert!(reasons(&split, "gap_fill", true)[0].contains("dispersion: on"), "{:?}", split.decisions);
    for material in &mut scene.materials {
        material.dispersion = Dispersion::Constant { n: material.dispersion.n_d() };
    }
    let levels = Some(Emission::Adaptive { levels: 4 });
    let of = |method| bake_of(&scene, &Settings { emission: levels, ..Settings::of(method) });
    let (acm, asm) = (of(Method::Acm), of(Method::Asm));
    assert_eq!((acm.steps, acm.resources, acm.params), (asm.steps, asm.resources, asm.params));
    assert_eq!(
        reasons(&bake_of(&scene, &Settings::of(Method::Asm)), "gap_fill", false),
        ["one wavelength leaves no gaps between wavelengths"]
    );
    assert!(reasons(&acm_default(&scene), "gap_fill", false)[0].contains("no gap filling was asked for"));
    assert_eq!(
        reasons(&acm_default(&scene), "photon_refine", true),
        ["acm: photons where 6 levels of the emission view show glass"]
    );
    assert_eq!(
        reasons(&bake_of(&scene, &Settings::of(Method::CausticsMap)), "photon_refine", false),
        ["caustics-map: a photon per texel of the emission view"]
    );
}

fn acm_default(scene: &Scene) -> Plan {
    bake_of(scene, &Settings::of(Method::Acm))
}

#[test]
fn methods_have_the_papers_wavelengths() {
    let scene = bundled("prism").unwrap();
    assert_eq!(wavelengths(&bake_of(&scene, &Settings::of(Method::Acm))), 1);
    let many = Settings { wavelengths: Some(21), ..Settings::of(Method::Asm) };
    assert_eq!(wavelengths(&bake_of(&scene, &many)), 21);
    assert_eq!((many.scheme(), many.range_nm()), (Scheme::Uniform, (380.0, 680.0)));
    let table_1 = Settings { scheme: Some(Scheme::Asm2013), ..Settings::of(Method::Asm) };
    assert_eq!(wavelengths(&bake_of(&scene, &table_1)), 7);
    // One wavelength leaves nothing to fill, whoever asks.
    let one =
        Settings { wavelengths: Some(1), gap_filling: Some(GapFilling::Paper), ..Settings::of(Method::Asm) };
    assert!(!has(&bake_of(&scene, &one), "gap_fill"));
}

#[test]
fn photons_are_launched_by_arguments_that_a_pass_wrote() {
    let plan = acm_default(&bundled("ring").unwrap());
    let indirect = plan.steps.iter().find_map(|step| match step {
        Step::DispatchIndirect { pass, arguments, offset_bytes } if pass.pass == "photon_trace" => {
            Some((*arguments, *offset_bytes))
        }
        _ => None,
    });
    assert_eq!(indirect, Some((plan.resource("photon queue 5").unwrap(), 4)));
}

#[test]
fn settings_of_the_methods_are_checked() {
    let scene = bundled("prism").unwrap();
    let receiver = scene.receiver("receiver").unwrap();
    let base = || Settings::of(Method::Asm);
    let adaptive = |levels| Some(Emission::Adaptive { levels });
    for (settings, name) in [
        (Settings { emission: adaptive(0), ..base() }, "emission levels"),
        (Settings { emission: adaptive(9), ..base() }, "emission levels"),
        (Settings { gap_radius: 16, ..base() }, "gap_radius"),
        (Settings { gap_samples: 0, ..base() }, "gap_samples"),
        (Settings { gap_threshold: 0, ..base() }, "gap_threshold"),
        (
            Settings { refraction: Some(Refraction::ImageSpace), ..Settings::of(Method::Footprint) },
            "refraction",
        ),
        (
            Settings { refraction: Some(Refraction::Traced), interfaces: Interfaces::One, ..base() },
            "interfaces",
        ),
    ] {
        let error = bake_plan(&scene, receiver, [8; 2], &settings, &Limits::default()).unwrap_err();
        assert!(matches!(error, PlanError::Setting { setting, .. } if setting == name), "{error}");
    }
    // The paper's sums need room: fewer photons fit.
    let many = Settings { emission_size: 16_384, wavelengths: Some(21), gap_samples: 64, ..base() };
    let limits = Limits { max_texture_size: 16_384, ..Limits::default() };
    let error = bake_plan(&scene, receiver, [8; 2], &many, &limits).unwrap_err();
    assert!(matches!(error, PlanError::TooManyPhotons { max, .. } if max == 1 << 28), "{error}");
}

#[test]
fn methods_move_on_without_a_new_plan() {
    let mut scene = bundled("prism").unwrap();
    let settings = |method| Settings { emission_size: 128, map_size: Some(128), ..Settings::of(method) };
    let limits = cpu().limits();
    for method in [Method::Acm, Method::Asm] {
        let plan = |scene: &Scene| render_plan(scene, 0, [40, 30], &settings(method), &limits).unwrap();
        let mut moving = plan(&scene);
        let mut executor = cpu();
        executor.prepare(&moving.plan).unwrap();
        executor.execute().unwrap();
        let spectral_scene::LightShape::Directional { direction } = &mut scene.lights[0].shape else {
            panic!("the prism has a sun");
        };
        *direction = (*direction + glam::DVec3::new(0.02, 0.0, 0.01)).normalize();
        scene.lights[0].intensity *= 1.5;
        scene.cameras[0].world_from_camera.w_axis.x += 0.01;
        moving.update(&mut executor, plan(&scene)).unwrap();
        executor.execute().unwrap();
        let (moved, statistics) = moving.read(&mut executor).unwrap();
        let fresh = plan(&scene);
        let mut executor = cpu();
        executor.prepare(&fresh.plan).unwrap();
        executor.execute().unwrap();
        let (anew, fresh_statistics) = fresh.read(&mut executor).unwrap();
        assert_eq!(moved, anew, "{method:?}");
        assert_eq!((statistics.lights, statistics.view), (fresh_statistics.lights, fresh_statistics.view));
    }
}

#[test]
fn cells_are_split_no_further_than_a_queue_can_number_them() {
    let scene = spectral_scene::bundled("prism").unwrap();
    for (emission_size, cell_splits, wanted) in
        [(128, 3, [3, 9]), (128, 8, [8, 9]), (512, 8, [7, 7]), (100, 1, [1, 7])]
    {
        let settings = Settings { emission_size, cell_splits, bounces: 0, ..Settings::of(Method::Footprint) };
        let plan = bake_of(&scene, &settings);
        let params = plan.params.iter().find(|p| p.name.starts_with("footprint_split")).unwrap();
        assert_eq!(
            [16, 17].map(|word| word_of(&params.bytes, word)),
            wanted,
            "{emission_size}, {cell_splits}"
        );
    }
}
