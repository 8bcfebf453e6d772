//! What is in a plan and why, and what makes none.

use asm_core::{Interfaces, Method, PlanError, Settings, Splat, bake_plan, render_plan};
use frame_plan::{Limits, Plan};
use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_scene::{Scene, bundled};

use crate::stage::*;

/// Step names without the light's, which every bundled scene but `lamps` has one of.
fn steps(plan: &Plan) -> Vec<String> {
    let names = plan.step_names();
    let short = |name: String| name.replace("light 0 `sun`", "light").replace("light 0 `spot`", "light");
    names.into_iter().map(short).collect()
}

fn bake_of(scene: &Scene, settings: &Settings) -> Plan {
    plan(scene, 64, settings).plan
}

fn render_of(scene: &Scene, settings: &Settings) -> Plan {
    render_plan(scene, 0, [64; 2], settings, &Limits::default()).unwrap().plan
}

#[test]
fn every_bundled_scene_has_its_plan() {
    // Scenes with something opaque before the glass draw shadows apart; water has no faces for light to leave by; only
    // those that absorb need the thickness that the camera sees, and only under water is the eye in what absorbs.
    for (name, apart, exits, absorbs) in [
        ("prism", true, true, false),
        ("sphere", false, true, false),
        ("sphere-fine", false, true, false),
        ("ring", true, true, false),
        ("gem", false, true, false),
        ("diamond", true, true, false),
        ("glass", true, true, false),
        ("organic", true, true, true),
        ("water", false, false, true),
        ("underwater", false, false, true),
    ] {
        let scene = bundled(name).unwrap();
        let immersed = name == "underwater";
        let light = [
            (true, "visibility (light, landing)"),
            (apart, "visibility (light, shadow)"),
            (true, "visibility (light, entry)"),
            (exits, "visibility (light, exit)"),
        ];
        // So small a bake resolves no finer map.
        let fit = [
            (true, "clear landing bounds"),
            (true, "photon_trace (light, landings)"),
            (true, "map_fit (light)"),
        ];
        let map = [(true, "clear map"), (true, "photon_trace (light)"), (true, "map_resolve (light)")];
        let bake = [(true, "clear ledger"), (true, "clear irradiance"), (true, "uv_visibility (receiver)")]
            .into_iter()
            .chain(light)
            .chain(map)
            .chain([(true, "receiver_bake (light)")]);
        let render = [
            (true, "clear ledger"),
            (!immersed, "clear picture"),
            (immersed, "clear background"),
            (true, "visibility (camera)"),
            (true, "visibility (camera, glass)"),
            (absorbs, "visibility (camera, backs of glass)"),
        ]
        .into_iter()
        .chain(light)
        .chain(fit)
        .chain(map)
        .chain([
            (true, "shade (light)"),
            (immersed, "clear view counts"),
            (immersed, "deferred_refraction (camera)"),
        ]);
        let kept = |steps: &mut dyn Iterator<Item = (bool, &'static str)>| -> Vec<String> {
            steps.filter(|(kept, _)| *kept).map(|(_, name)| name.to_owned()).collect()
        };
        assert_eq!(
            steps(&bake_of(&scene, &Settings::of(Method::CausticsMap))),
            kept(&mut bake.into_iter()),
            "{name}"
        );
        assert_eq!(
            steps(&render_of(&scene, &Settings::of(Method::CausticsMap))),
            kept(&mut render.into_iter()),
            "{name}"
        );
        // Without pruning every scene has every pass.
        let all = Settings { prune: false, ..Settings::of(Method::CausticsMap) };
        assert_eq!(steps(&bake_of(&scene, &all)).len(), 17, "{name}");
        assert_eq!(steps(&render_of(&scene, &all)).len(), 21, "{name}");
    }
}

#[test]
fn bundled_scenes_without_what_calls_for_a_pass_lose_it() {
    let reasons = |plan: &Plan| {
        let of = |d: &frame_plan::Decision| format!("{}\n{}", d.reason, d.notes.join("\n"));
        plan.decisions.iter().map(of).collect::<Vec<_>>().join("\n")
    };
    let z_groups = |plan: &Plan| {
        plan.steps.iter().find_map(|step| match step {
            frame_plan::Step::Dispatch { pass, groups } if pass.pass == "photon_trace" => Some(groups[2]),
            _ => None,
        })
    };
    let mut scene = bundled("organic").unwrap();
    assert_eq!(z_groups(&bake_of(&scene, &Settings::of(Method::CausticsMap))), Some(7));
    for material in &mut scene.materials {
        material.dispersion = Dispersion::Constant { n: material.dispersion.n_d() };
    }
    // The tint still treats wavelengths differently.
    assert_eq!(z_groups(&bake_of(&scene, &Settings::of(Method::CausticsMap))), Some(7));
    scene.materials.iter_mut().for_each(|m| m.attenuation = None);
    let plan = bake_of(&scene, &Settings::of(Method::CausticsMap));
    assert_eq!(z_groups(&plan), Some(1));
    assert!(reasons(&plan).contains("1 wavelength: dispersion: off, every material has dispersion 0"));
    assert!(
        !steps(&render_of(&scene, &Settings::of(Method::CausticsMap)))
            .iter()
            .any(|s| s.contains("backs of glass"))
    );
    // No glass: no photons, no map.
    let glass: Vec<usize> = scene.refractors().collect();
    scene.objects.retain({
        let mut i = 0;
        move |_| {
            i += 1;
            !glass.contains(&(i - 1))
        }
    });
    let plan = bake_of(&scene, &Settings::of(Method::CausticsMap));
    assert_eq!(z_groups(&plan), None);
    assert!(reasons(&plan).contains("caustics: off, no object transmits light"), "{}", reasons(&plan));
    // No light: nothing at all.
    scene.lights[0].intensity = 0.0;
    assert_eq!(steps(&bake_of(&scene, &Settings::of(Method::CausticsMap))), ["clear irradiance"]);
    assert_eq!(steps(&render_of(&scene, &Settings::of(Method::CausticsMap))), ["clear picture"]);
}

#[test]
fn plans_fit_the_limits_that_every_device_has() {
    for name in spectral_scene::BUNDLED {
        let scene = bundled(name).unwrap();
        for settings in [
            Settings::of(Method::CausticsMap),
            Settings::shah(),
            Settings { prune: false, ..Settings::of(Method::CausticsMap) },
        ] {
            bake_of(&scene, &settings).validate(&asm_core::PASSES, &Limits::default()).unwrap();
            render_of(&scene, &settings).validate(&asm_core::PASSES, &Limits::default()).unwrap();
        }
    }
}

fn refused(scene: &Scene, size: [u32; 2], settings: &Settings, limits: &Limits) -> PlanError {
    bake_plan(scene, 0, size, settings, limits).unwrap_err()
}

#[test]
fn what_does_not_fit_is_refused_with_the_numbers() {
    let scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let limits = Limits::default();
    let map = |size| Settings { map_size: Some(size), ..Settings::of(Method::CausticsMap) };
    let error = refused(&scene, [64; 2], &map(8192), &limits);
    let PlanError::Limit { needed, max, remedy, .. } = &error else { panic!("{error}") };
    assert_eq!((*needed, *remedy), (24 * 8192 * 8192, "map_size"));
    assert_eq!(*max, limits.max_storage_binding_bytes);
    assert!(error.to_string().contains("lower map_size"), "{error}");
    let error = refused(&scene, [16_384, 2], &Settings::of(Method::CausticsMap), &limits);
    assert!(matches!(&error, PlanError::Limit { needed: 16_384, max: 8192, .. }), "{error}");
    // Samples give way before texels do.
    bake_plan(
        &scene,
        0,
        [2048; 2],
        &Settings { bake_samples: 16, ..Settings::of(Method::CausticsMap) },
        &limits,
    )
    .unwrap();
    let small = Limits { max_total_bytes: 10 << 20, ..limits };
    assert!(
        matches!(refused(&scene, [64; 2], &Settings::of(Method::CausticsMap), &small), PlanError::Limit { max, .. } if max == 10 << 20)
    );
    // 16384 x 16384 texels x 4096 wavelengths are 2^40 photons.
    let many = Settings {
        emission_size: 16_384,
        wavelengths: Some(4096),
        prune: false,
        ..Settings::of(Method::CausticsMap)
    };
    let huge = Limits { max_texture_size: 1 << 15, ..limits };
    assert!(matches!(refused(&scene, [64; 2], &many, &huge), PlanError::TooManyPhotons { .. }));
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let base = || Settings::of(Method::CausticsMap);
    for (name, settings) in [
        ("emission_size", Settings { emission_size: 0, ..base() }),
        ("map_size", Settings { map_size: Some(0), ..base() }),
        ("wavelengths", Settings { wavelengths: Some(0), ..base() }),
        ("ray_geo_iterations", Settings { ray_geo_iterations: 0, ..base() }),
        ("exit_iterations", Settings { exit_iterations: 1000, ..base() }),
        ("splat radius", Settings { splat: Splat::Gaussian { radius: 9 }, ..base() }),
        ("bake_samples", Settings { bake_samples: 0, ..base() }),
        ("shah_intensity", Settings { shah_intensity: Some(f64::NAN), ..base() }),
        ("artistic_power", Settings { artistic_power: Some(-1.0), ..base() }),
    ] {
        let error = refused(&scene, [8; 2], &settings, &Limits::default());
        assert!(matches!(error, PlanError::Setting { setting, .. } if setting == name), "{name}: {error}");
    }
    assert!(matches!(
        refused(&scene, [8, 0], &base(), &Limits::default()),
        PlanError::Setting { setting: "size", .. }
    ));
    let three =
        Settings { scheme: Some(spectral_core::wavelengths::Scheme::Fraunhofer), prune: false, ..base() };
    assert!(matches!(refused(&scene, [8; 2], &three, &Limits::default()), PlanError::Wavelengths(_)));
}

#[test]
fn what_is_no_receiver_is_refused() {
    let scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let bake = |scene: &Scene, object| {
        bake_plan(scene, object, [8; 2], &Settings::of(Method::CausticsMap), &Limits::default())
            .unwrap_err()
            .to_string()
    };
    assert_eq!(bake(&scene, 1), "`plate` cannot be baked onto: light passes through it");
    assert_eq!(bake(&scene, 2), "there is no object 2, the scene has 2");
    let mut bare = scene.clone();
    bare.meshes[0].uvs.clear();
    assert_eq!(bake(&bare, 0), "`receiver` cannot be baked onto: it has no texture coordinates");
    let no_camera =
        render_plan(&scene, 0, [8; 2], &Settings::of(Method::CausticsMap), &Limits::default()).unwrap_err();
    assert_eq!(no_camera.to_string(), "there is no camera 0, the scene has 0");
    let no_light = Settings { lights: Some(vec![3]), ..Settings::of(Method::CausticsMap) };
    assert_eq!(
        refused(&scene, [8; 2], &no_light, &Limits::default()).to_string(),
        "there is no light 3, the scene has 1"
    );
    let mut broken = scene;
    broken.meshes[0].positions[0][1] = f32::NAN;
    assert!(matches!(
        refused(&broken, [8; 2], &Settings::of(Method::CausticsMap), &Limits::default()),
        PlanError::Scene(_)
    ));
}

#[test]
fn plans_and_settings_survive_json() {
    let scene = bundled("gem").unwrap();
    let settings = Settings { interfaces: Interfaces::One, ..Settings::of(Method::CausticsMap) };
    let plan = plan(&scene, 8, &settings);
    let back: asm_core::BakePlan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
    assert_eq!(back, plan);
    assert_eq!(
        serde_json::from_str::<Settings>(&serde_json::to_string(&settings).unwrap()).unwrap(),
        settings
    );
    assert_eq!(serde_json::from_str::<Settings>("{}").unwrap(), Settings::default());
    assert!(serde_json::from_str::<Settings>(r#"{"emision_size": 3}"#).is_err());
}
