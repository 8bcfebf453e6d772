//! What scenes call for, and the reasons given.

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_scene::*;

fn scene(name: &str) -> Scene {
    bundled(name).unwrap_or_else(|| panic!("{name} is listed"))
}

fn on(scene: &Scene) -> Vec<&'static str> {
    let effects = Effects::required_by(scene);
    for (name, effect) in effects.iter() {
        assert!(!effect.reason.is_empty(), "{name} gives no reason");
    }
    effects.iter().filter(|(_, effect)| effect.on).map(|(name, _)| name).collect()
}

const GLASS_IN_LIGHT: [&str; 7] =
    ["refraction", "dispersion", "reflection", "caustics", "shadows", "deferred_refraction", "receivers"];

const METAL_IN_LIGHT: [&str; 4] = ["reflective_caustics", "shadows", "mirror_images", "receivers"];

#[test]
fn every_bundled_scene_calls_for_what_it_shows() {
    for &name in BUNDLED {
        let more: &[&str] = match name {
            "sphere" | "sphere-fine" | "gem" => &["coloured_light"],
            "organic" | "water" => &["absorption"],
            "underwater" => &["absorption", "immersion"],
            "glass" => &["point_or_spot_lights"],
            "lamps" => &[
                "absorption",
                "reflective_caustics",
                "mirror_images",
                "point_or_spot_lights",
                "coloured_light",
            ],
            _ => &[],
        };
        let base = if name == "metal-ring" { &METAL_IN_LIGHT[..] } else { &GLASS_IN_LIGHT[..] };
        let mut expected: Vec<&str> = base.iter().chain(more).copied().collect();
        expected.sort_unstable();
        let mut found = on(&scene(name));
        found.sort_unstable();
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn reasons_name_what_they_are_about() {
    let effects = Effects::required_by(&scene("sphere"));
    assert_eq!(effects.refraction.reason, "`glass` has n_d 1.5168");
    assert_eq!(effects.coloured_light.reason, "`sun` is illuminant E");
    assert_eq!(effects.absorption.reason, "no refractor attenuates");
    assert_eq!(effects.deferred_refraction.reason, "`camera` sees `sphere`");
    assert_eq!(effects.iridescence.reason, "not simulated yet; no material is iridescent");
    let effects = Effects::required_by(&scene("glass"));
    assert_eq!(effects.point_or_spot_lights.reason, "`spot` is a spot light");
    assert_eq!(
        effects.receivers.reason,
        "`receiver`, `wall-back`, `wall-left`, `wall-right` may catch light from `glass`"
    );
}

fn glass_of(scene: &mut Scene) -> &mut Material {
    scene.materials.iter_mut().find(|m| m.is_refractor()).expect("glass")
}

#[test]
fn without_dispersion_there_is_none() {
    let mut scene = scene("sphere");
    glass_of(&mut scene).dispersion = Dispersion::Constant { n: 1.5 };
    let effects = Effects::required_by(&scene);
    assert_eq!(effects.dispersion, Effect { on: false, reason: "every material has dispersion 0".into() });
    assert!(effects.refraction.on && effects.caustics.on);
}

#[test]
fn glass_of_index_one_does_not_reflect() {
    let mut scene = scene("sphere");
    glass_of(&mut scene).dispersion = Dispersion::Constant { n: 1.0 };
    let effects = Effects::required_by(&scene);
    assert_eq!(
        effects.reflection,
        Effect { on: false, reason: "every refractor has the index of vacuum".into() }
    );
}

#[test]
fn opaque_scenes_have_shadows_only_where_something_can_cast_them() {
    let mut scene = scene("sphere");
    glass_of(&mut scene).transmission = 0.0;
    assert_eq!(on(&scene), ["shadows", "receivers", "coloured_light"]);
    let effects = Effects::required_by(&scene);
    assert_eq!(effects.refraction.reason, "no object transmits light");
    assert_eq!(effects.dispersion.reason, "no object transmits light");
    scene.objects.truncate(1);
    assert_eq!(on(&scene), ["receivers", "coloured_light"]);
    assert_eq!(Effects::required_by(&scene).shadows.reason, "nothing stands beside `receiver`");
}

#[test]
fn dark_scenes_and_empty_scenes_call_for_no_light_transport() {
    let mut scene = scene("gem");
    scene.lights[0].intensity = 0.0;
    assert_eq!(on(&scene), ["refraction", "dispersion", "reflection", "deferred_refraction"]);
    assert_eq!(Effects::required_by(&scene).caustics.reason, "no light");
    assert_eq!(on(&Scene::default()), [""; 0]);
}

#[test]
fn a_receiver_behind_the_light_is_dark_until_glass_sends_light_there() {
    let mut scene = scene("glass");
    let LightShape::Spot { direction, .. } = &mut scene.lights[0].shape else { panic!("a spot") };
    *direction = -*direction;
    let effects = Effects::required_by(&scene);
    assert!(!effects.caustics.on && !effects.receivers.on && !effects.shadows.on);
    assert_eq!(effects.caustics.reason, "no light reaches `glass`");
    assert!(
        effects.receivers.reason.starts_with("no light reaches `receiver`"),
        "{}",
        effects.receivers.reason
    );

    // A narrow cone onto the glass from just above the table's height misses the back of the box.
    let LightShape::Spot { direction, range_m, .. } = &mut scene.lights[0].shape else { panic!("a spot") };
    *direction = -*direction;
    *range_m = Some(0.1);
    assert!(!Effects::required_by(&scene).caustics.on, "out of range");
}

#[test]
fn shadows_and_caustics_fall_on_surfaces_without_texture_coordinates() {
    let mut scene = scene("sphere");
    let with = Effects::required_by(&scene);
    scene.meshes.iter_mut().for_each(|mesh| mesh.uvs.clear());
    let without = Effects::required_by(&scene);
    assert_eq!((&without.caustics, &without.shadows), (&with.caustics, &with.shadows));
    assert!(with.caustics.on && with.shadows.on);
    assert_eq!(
        without.receivers,
        Effect { on: false, reason: "no matt object has texture coordinates".into() }
    );
    // Glass alone has nothing to cast light onto.
    scene.objects.retain(|object| object.name != "receiver");
    let alone = Effects::required_by(&scene);
    assert_eq!(alone.caustics, Effect { on: false, reason: "no matt object to land on".into() });
    assert_eq!(alone.shadows, Effect { on: false, reason: "no opaque object in light".into() });
}

#[test]
fn refractors_outside_the_picture_need_no_deferred_refraction() {
    let mut scene = scene("sphere");
    scene.cameras = vec![Camera::look_at(DVec3::new(0.0, 0.08, 1.0), DVec3::new(0.0, 0.08, 2.0))];
    let effects = Effects::required_by(&scene);
    assert_eq!(
        effects.deferred_refraction,
        Effect { on: false, reason: "no camera sees a refractor".into() }
    );
    scene.cameras.clear();
    assert_eq!(Effects::required_by(&scene).deferred_refraction.reason, "no camera");
}

#[test]
fn eyes_in_glass_and_under_water_are_immersed() {
    let reason = |scene: &Scene| Effects::required_by(scene).immersion.reason;
    assert_eq!(reason(&scene("underwater")), "`camera` is inside `water`");
    assert_eq!(reason(&scene("metal-ring")), "no object transmits light");
    for name in ["sphere", "gem"] {
        let mut scene = scene(name);
        assert_eq!(reason(&scene), "every camera is in free space");
        let mut move_to = |eye: DVec3| {
            scene.cameras = vec![Camera::look_at(eye, DVec3::ZERO)];
            Effects::required_by(&scene).immersion.on
        };
        assert!(move_to(DVec3::new(0.0, 0.08, 0.0)), "{name}: in the middle");
        assert!(!move_to(DVec3::new(0.0, 0.02, 0.0)), "{name}: below");
        assert!(!move_to(DVec3::new(0.0, 0.14, 0.0)), "{name}: above");
    }
}

#[test]
fn coloured_light_means_any_spectrum_but_white_d65() {
    let mut scene = scene("diamond");
    for (spectrum, coloured) in [
        (LightSpectrum::d65_upsampled([0.5, 0.5, 0.5]), false),
        (LightSpectrum::d65_upsampled([1.0, 0.5, 0.5]), true),
        (LightSpectrum::cct(3200.0).expect("valid"), true),
        (LightSpectrum::line(546.1).expect("visible"), true),
    ] {
        scene.lights[0].spectrum = spectrum;
        let effect = Effects::required_by(&scene).coloured_light;
        assert_eq!(effect.on, coloured, "{}", effect.reason);
    }
}

#[test]
fn what_is_not_simulated_is_said() {
    let mut scene = scene("diamond");
    let glass = glass_of(&mut scene);
    glass.roughness = 0.3;
    glass.iridescence =
        Some(Iridescence { factor: 1.0, ior: 1.3, thickness_min_nm: 100.0, thickness_max_nm: 400.0 });
    let effects = Effects::required_by(&scene);
    assert_eq!(
        effects.rough_glass.reason,
        "not simulated yet, `diamond` (roughness 0.3) is treated as smooth"
    );
    assert_eq!(effects.iridescence.reason, "not simulated yet, though `diamond` calls for it");
    assert!(!effects.rough_glass.on && !effects.iridescence.on);
    let wall = scene.materials.iter_mut().find(|m| m.name == "red").expect("a wall");
    (wall.metallic, wall.roughness) = (1.0, MIRROR_ROUGHNESS);
    let reason = "no object is of polished metal; rough metal `wall-left` is treated as matt";
    assert_eq!(Effects::required_by(&scene).reflective_caustics, Effect { on: false, reason: reason.into() });
    assert_eq!(scene.mirrors().count(), 0);
}

/// `name` as a mirror.
fn polish(scene: &mut Scene, name: &str) {
    let object = scene.objects.iter().position(|o| o.name == name).expect("it is there");
    let mut material = scene.material_of(object).clone();
    (material.metallic, material.roughness, material.transmission) = (1.0, 0.0, 0.0);
    scene.materials.push(material);
    scene.objects[object].material = scene.materials.len() - 1;
}

#[test]
fn mirrors_throw_caustics_of_their_own() {
    let mut scene = scene("sphere");
    assert_eq!(Effects::required_by(&scene).reflective_caustics.reason, "no object is of polished metal");
    assert_eq!(Effects::required_by(&scene).mirror_images.reason, "no object is of polished metal");
    polish(&mut scene, "sphere");
    assert_eq!(
        on(&scene),
        ["reflective_caustics", "shadows", "mirror_images", "receivers", "coloured_light"]
    );
    let effects = Effects::required_by(&scene);
    assert_eq!(effects.reflective_caustics.reason, "`sphere` in light");
    assert_eq!(effects.mirror_images.reason, "`camera` sees `sphere`");
    assert_eq!(effects.receivers.reason, "`receiver` may catch light from `sphere`");
    assert_eq!(effects.reflection.reason, "no object transmits light");

    // Nothing lands on a mirror, and there is nothing else.
    polish(&mut scene, "receiver");
    let effects = Effects::required_by(&scene);
    assert_eq!(effects.reflective_caustics.reason, "no matt object to land on");
    assert!(!effects.reflective_caustics.on && !effects.receivers.on && !effects.shadows.on);
    let refused = scene.receiver("receiver").expect_err("a mirror");
    assert!(matches!(refused, ReceiverError::Mirror { .. }), "{refused}");
}

#[test]
fn a_mirror_out_of_the_light_may_be_lit_by_way_of_glass() {
    let mut scene = scene("glass");
    polish(&mut scene, "wall-right");
    assert!(Effects::required_by(&scene).reflective_caustics.on);
    let glass = scene.refractors().next().expect("the glass");
    let (low, high) = scene.bounds([glass]).expect("not empty");
    let LightShape::Spot { position_m, direction, inner_cone_rad, outer_cone_rad, .. } =
        &mut scene.lights[0].shape
    else {
        panic!("a spot")
    };
    *position_m = DVec3::new(0.0, 1.0, 0.0);
    *direction = (0.5 * (low + high) - *position_m).normalize();
    (*inner_cone_rad, *outer_cone_rad) = (0.001, 0.002);
    let effects = Effects::required_by(&scene);
    assert_eq!(effects.reflective_caustics.reason, "`wall-right` may be lit by way of `glass`");
    assert!(effects.reflective_caustics.on);
}

#[test]
fn effects_are_plain_serialisable_data() {
    let effects = Effects::required_by(&scene("water"));
    let json = serde_json::to_value(&effects).expect("plain data");
    let fields = json.as_object().expect("a map");
    assert_eq!(fields.len(), effects.iter().count());
    for (name, effect) in effects.iter() {
        assert_eq!(fields[name]["on"], effect.on, "{name}");
    }
    assert_eq!(serde_json::from_value::<Effects>(json).expect("its own JSON"), effects);
}

#[test]
fn unused_glass_calls_for_nothing() {
    let mut scene = scene("gem");
    let glass = scene.objects.iter().position(|o| o.name == "gem").expect("the gem");
    scene.objects.remove(glass);
    assert!(!Effects::required_by(&scene).refraction.on);
    // Nor does glass without a single triangle.
    scene.meshes.push(Mesh::default());
    let material = scene.materials.iter().position(Material::is_refractor).expect("glass");
    let mesh = scene.meshes.len() - 1;
    scene.objects.push(Object { name: "void".into(), mesh, material, world_from_mesh: DMat4::IDENTITY });
    assert_eq!(on(&scene), ["receivers", "coloured_light"]);
}
