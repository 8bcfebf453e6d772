//! What is written comes back the same.

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;
use spectral_core::dispersion::Dispersion;
use spectral_core::illuminant::Illuminant;
use spectral_core::light::LightSpectrum;
use spectral_scene::*;

fn round_trip(scene: &Scene) -> (Scene, Vec<Warning>) {
    let glb = to_glb(scene).unwrap_or_else(|e| panic!("{}: {e}", scene.name));
    load_bytes(&glb, &scene.name).unwrap_or_else(|e| panic!("{}: {e}", scene.name))
}

/// Directions pass through a quaternion and may lose their last bits; takes them from `written` after checking.
fn assert_same(written: &Scene, read: &Scene) {
    let mut read = read.clone();
    for (w, r) in written.lights.iter().zip(&mut read.lights) {
        let (LightShape::Directional { direction: dw } | LightShape::Spot { direction: dw, .. }) = w.shape
        else {
            continue;
        };
        let (LightShape::Directional { direction: dr } | LightShape::Spot { direction: dr, .. }) =
            &mut r.shape
        else {
            panic!("{:?} became {:?}", w.shape, r.shape)
        };
        assert!(dw.distance(*dr) < 1e-15, "{dw} became {dr}");
        *dr = dw;
    }
    assert!(*written == read, "{} changed", written.name);
}

fn json_of(glb: &[u8]) -> Value {
    let length = u32::from_le_bytes(glb[12..16].try_into().expect("4 bytes")) as usize;
    serde_json::from_slice(&glb[20..20 + length]).expect("our own JSON")
}

#[test]
fn bundled_scenes_come_back_exactly() {
    for &name in BUNDLED.iter().filter(|&&n| n != "sphere-fine") {
        let scene = bundled(name).expect("listed");
        let (read, warnings) = round_trip(&scene);
        assert_same(&scene, &read);
        assert_eq!(warnings, [], "{name}");
    }
}

/// One scene with everything that a scene can say.
fn everything() -> Scene {
    let gem = bundled("gem").expect("bundled");
    let glass = gem.materials.iter().find(|m| m.is_refractor()).expect("glass").clone();
    let material =
        |name: &str, dispersion: Dispersion| Material { name: name.into(), dispersion, ..glass.clone() };
    let sellmeier = Dispersion::sellmeier([[1.1, 0.01], [0.2, 90.0]]).expect("valid");
    let materials = vec![
        material("constant", Dispersion::Constant { n: 1.234 }),
        material("khr", Dispersion::from_khr(1.5168, 20.0 / 64.17).expect("valid")),
        material("cauchy", Dispersion::Cauchy { a: 1.4, b_um2: 0.01, c_um4: 1e-4 }),
        material("anomalous", Dispersion::Cauchy { a: 1.6, b_um2: -0.01, c_um4: 0.0 }),
        material("catalogue", spectral_core::glass::by_name("N-BK7").expect("listed")),
        Material {
            base_color: [0.1, 0.2, 0.3],
            metallic: 0.25,
            roughness: 0.5,
            transmission: 0.75,
            attenuation: Some(Attenuation { color: [0.9, 0.8, 0.1], distance_m: 0.37 }),
            thickness_m: 0.0123,
            iridescence: Some(Iridescence {
                factor: 0.5,
                ior: 1.4,
                thickness_min_nm: 120.0,
                thickness_max_nm: 333.3,
            }),
            emissive: [0.1, 7.7, 0.3],
            double_sided: true,
            ..material("", sellmeier)
        },
    ];
    let mut meshes = vec![gem.meshes[1].clone(), gem.meshes[0].clone()];
    meshes[1].name = "floor mesh \u{e9}\"\\".into();
    // The third object's transform mirrors: its mesh is the same surface with turned triangles.
    let mut turned = meshes[0].clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    meshes.push(turned);
    let place = |scale: DVec3, angle: f64| {
        DMat4::from_scale_rotation_translation(
            scale,
            DQuat::from_rotation_x(angle),
            DVec3::new(0.1, 0.2, -0.3),
        )
    };
    let object = |name: &str, mesh, material, world_from_mesh| Object {
        name: name.into(),
        mesh,
        material,
        world_from_mesh,
    };
    let objects = vec![
        object("a", 0, 0, place(DVec3::ONE, 0.3)),
        object("receiver", 1, 1, DMat4::IDENTITY),
        object("mirrored", 2, 2, place(DVec3::new(-1.0, 2.0, 0.5), 1.0)),
        object("a", 0, 0, place(DVec3::splat(1e-3), -2.0)),
    ];
    let spot = |spectrum, color| Light {
        name: "spot".into(),
        color,
        intensity: 12.5,
        spectrum,
        shape: LightShape::Spot {
            position_m: DVec3::new(1.0, 2.0, 3.0),
            direction: DVec3::new(-0.3, 0.5, 1.0).normalize(),
            inner_cone_rad: 0.1,
            outer_cone_rad: 0.7,
            range_m: Some(11.0),
        },
    };
    let coloured = [1.0, 0.5, 0.25];
    let lights = vec![
        spot(LightSpectrum::d65_upsampled(coloured), coloured),
        spot(LightSpectrum::d65_upsampled(coloured), [1.0; 3]),
        spot(LightSpectrum::Illuminant(Illuminant::Fl11), [1.0; 3]),
        spot(LightSpectrum::cct(3200.0).expect("valid"), [1.0; 3]),
        spot(LightSpectrum::cct(7777.7).expect("valid"), [1.0; 3]),
        spot(LightSpectrum::BlackBody { cct_k: 9000.0 }, [1.0; 3]),
        Light {
            shape: LightShape::Point { position_m: DVec3::new(0.1, 0.2, 0.3), range_m: None },
            ..spot(LightSpectrum::line(546.1).expect("visible"), [0.2, 0.4, 0.6])
        },
        Light {
            shape: LightShape::Directional { direction: DVec3::Z },
            ..spot(LightSpectrum::default(), [1.0; 3])
        },
    ];
    let cameras = vec![
        Camera::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO),
        Camera { name: "other".into(), ..Camera::look_at(DVec3::new(-1.0, 2.0, 0.1), DVec3::Y) },
    ];
    Scene { name: "everything".into(), meshes, materials, objects, lights, cameras }
}

#[test]
fn every_kind_of_material_light_and_transform_comes_back() {
    let scene = everything();
    let (read, warnings) = round_trip(&scene);
    assert_same(&scene, &read);
    // Only the last material has something to warn of, and no object uses it.
    assert_eq!(warnings.len(), 0, "{warnings:?}");
}

#[test]
fn viewers_without_extras_see_the_same_index_and_abbe_number() {
    let json = json_of(&to_glb(&bundled("prism").expect("bundled")).expect("valid"));
    let glass =
        json["materials"].as_array().expect("list").iter().find(|m| m["name"] == "N-SF11").expect("there");
    let number =
        |extension: &str, field: &str| glass["extensions"][extension][field].as_f64().expect("a number");
    // Printed in SCHOTT's data sheet: n_d 1.78472, V_d 25.68.
    assert!((number("KHR_materials_ior", "ior") - 1.78472).abs() < 1e-5);
    assert!((20.0 / number("KHR_materials_dispersion", "dispersion") - 25.68).abs() < 0.01);
    assert_eq!(glass["extras"]["spectral"]["glass"], "N-SF11");
}

#[test]
fn plain_media_need_no_extras() {
    let json = json_of(&to_glb(&everything()).expect("valid"));
    let extras = |name: &str| {
        let materials = json["materials"].as_array().expect("list");
        materials.iter().find(|m| m["name"] == name).expect("there").get("extras").cloned()
    };
    assert_eq!(extras("constant"), None);
    assert_eq!(extras("anomalous"), Some(serde_json::json!({"spectral": {"cauchy": [1.6, -0.01]}})));
}

#[test]
fn sheared_objects_are_written_in_world_space() {
    let mut scene = bundled("gem").expect("bundled");
    let shear = DMat4::from_rotation_y(0.5)
        * DMat4::from_scale(DVec3::new(-1.0, 3.0, 1.0))
        * DMat4::from_rotation_z(0.4);
    scene.objects[1].world_from_mesh = shear;
    // The transform mirrors: triangles are counter-clockwise in the world, so the other way round in the mesh.
    let mesh = scene.objects[1].mesh;
    scene.meshes[mesh].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let (read, warnings) = round_trip(&scene);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(read.objects[1].world_from_mesh, DMat4::IDENTITY);
    let (before, after) = (scene.world_mesh(1), read.world_mesh(1));
    assert_eq!(before.triangles, after.triangles);
    for (b, a) in before.positions.iter().zip(&after.positions) {
        assert!(b.distance(*a) < 1e-7);
    }
}

#[test]
fn empty_scenes_are_written_and_read() {
    let empty = Scene { name: "empty".into(), ..Scene::default() };
    let (read, warnings) = round_trip(&empty);
    assert_eq!(read, empty);
    assert_eq!(warnings, [Warning::NoLight]);
}

#[test]
fn invalid_scenes_are_not_written() {
    let mut scene = bundled("gem").expect("bundled");
    scene.meshes[1].positions[3][1] = f32::NAN;
    let message = to_glb(&scene).expect_err("NaN").to_string();
    assert!(message.contains("meshes[1].positions[3]") && message.contains("finite"), "{message}");
}
