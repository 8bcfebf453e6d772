//! Meshes and scales that break assumptions.

use asm_core::{Interfaces, LandingUpdate, Method, Settings, Splat};
use frame_plan::Executor;
use glam::{DMat4, DVec3};
use spectral_scene::{Camera, LightShape, Mesh, Scene};

use crate::stage::*;

fn few() -> Settings {
    Settings { emission_size: 128, ..Settings::of(Method::CausticsMap) }
}

#[test]
fn an_empty_scene_is_black() {
    let mut scene = Scene { cameras: vec![Camera::look_at(DVec3::ONE, DVec3::ZERO)], ..Scene::default() };
    for prune in [true, false] {
        let settings = Settings { prune, ..few() };
        scene.lights.clear();
        assert!(picture(&scene, &settings).xyz.iter().all(|p| *p == [0.0; 3]));
        scene.lights.push(sun(DVec3::NEG_Y));
        assert!(picture(&scene, &settings).xyz.iter().all(|p| *p == [0.0; 3]));
    }
}

#[test]
fn a_scene_without_lights_or_glass_bakes() {
    let mut scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    scene.objects.pop();
    for prune in [true, false] {
        let (maps, _) = bake(&scene, 8, &Settings { prune, ..few() });
        assert!(maps.direct.iter().all(|t| (t[1] - 1.0).abs() < 1e-6));
        assert_eq!(total(&maps.refracted), [0.0; 3]);
    }
    scene.lights.clear();
    let (maps, statistics) = bake(&scene, 8, &few());
    assert_eq!(total(&maps.direct), [0.0; 3]);
    assert_eq!(statistics.photons, 0);
}

#[test]
fn light_lands_inside_an_open_surface() {
    // A water surface of side 1 over a floor of side 1: one interface, absorption over the way to the floor.
    let mut scene = plate_over_floor(tinted(1.5, [0.25; 3], 0.4), 1.0, sun(DVec3::NEG_Y));
    scene.meshes[1] = quad(1.0);
    let (maps, statistics) = bake(&scene, 16, &aligned(64));
    let wanted = 0.96 * 0.5;
    assert!(
        maps.refracted.iter().all(|t| (f64::from(t[1]) / wanted - 1.0).abs() < 1e-5),
        "{:?}",
        maps.refracted[0]
    );
    assert_eq!(total(&maps.direct), [0.0; 3]);
    assert!(statistics.lights[0].ledgers.iter().all(|l| l.no_exit.flux == 0 && l.absorbed.flux > 0));
    // From below, light leaves the water: no absorption on the way it has not gone through it.
    scene.meshes[1].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let (maps, _) = bake(&scene, 16, &aligned(64));
    assert!(
        maps.refracted.iter().all(|t| (f64::from(t[1]) / 0.96 - 1.0).abs() < 1e-5),
        "{:?}",
        maps.refracted[0]
    );
}

#[test]
fn inside_out_glass_is_turned() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let mut turned = scene.clone();
    let glass = turned.refractors().next().unwrap();
    let mesh = turned.objects[glass].mesh;
    turned.meshes[mesh].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    let (wanted, _) = bake(&scene, 32, &few());
    assert_eq!(bake(&turned, 32, &few()).0, wanted);
    turned.meshes[mesh].normals.iter_mut().flatten().for_each(|n| *n = -*n);
    assert_eq!(bake(&turned, 32, &few()).0, wanted);
    let decisions = plan(&turned, 32, &few()).plan.decisions;
    assert!(decisions.iter().flat_map(|d| &d.notes).any(|n| n.contains("inside out")), "{decisions:?}");
}

#[test]
fn triangles_without_area_and_duplicates_change_nothing() {
    let scene = spectral_scene::bundled("gem").unwrap();
    let mut messy = scene.clone();
    for mesh in &mut messy.meshes {
        let [a, b, c] = mesh.triangles[0];
        mesh.triangles.extend([[a, a, a], [a, b, a], [a, b, c]]);
    }
    // Duplicated corners in opposite order would be a second surface; these are the same one.
    assert_eq!(bake(&messy, 32, &few()).0, bake(&scene, 32, &few()).0);
    // Nor do they open a closed surface, or hide that it is inside out.
    let decisions = |scene: &Scene| plan(scene, 32, &few()).plan.decisions;
    assert_eq!(decisions(&messy), decisions(&scene));
    messy.meshes.iter_mut().flat_map(|m| &mut m.triangles).for_each(|t| t.swap(1, 2));
    let turned = decisions(&messy);
    assert!(
        turned.iter().flat_map(|d| &d.notes).any(|n| n.contains("`gem` is closed and inside out")),
        "{turned:?}"
    );
}

#[test]
fn pictures_need_no_texture_coordinates() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let mut bare = scene.clone();
    bare.meshes.iter_mut().for_each(|mesh| mesh.uvs.clear());
    let wanted = picture(&scene, &few());
    assert!(wanted == picture(&bare, &few()), "shadow and caustic are those of the scene with coordinates");
    // And both are there: without the glass the picture is another one.
    bare.objects.retain(|object| object.name == "receiver");
    assert!(wanted != picture(&bare, &few()));
}

fn scaled(scene: &Scene, factor: f64) -> Scene {
    let mut scene = scene.clone();
    for object in &mut scene.objects {
        object.world_from_mesh = DMat4::from_scale(DVec3::splat(factor)) * object.world_from_mesh;
    }
    for light in &mut scene.lights {
        match &mut light.shape {
            LightShape::Directional { .. } => {}
            LightShape::Point { position_m, .. } | LightShape::Spot { position_m, .. } => {
                *position_m *= factor;
                light.intensity *= factor * factor;
            }
        }
    }
    for material in &mut scene.materials {
        if let Some(attenuation) = &mut material.attenuation {
            attenuation.distance_m *= factor;
        }
    }
    scene
}

#[test]
fn a_millimetre_and_ten_kilometres_look_alike() {
    for name in ["sphere", "glass", "organic", "water"] {
        let scene = spectral_scene::bundled(name).unwrap();
        let (wanted, _) = bake(&scene, 64, &few());
        // The scenes are some decimetres wide.
        for factor in [1e-2, 1e5] {
            let (maps, _) = bake(&scaled(&scene, factor), 64, &few());
            for (got, wanted) in [(&maps.direct, &wanted.direct), (&maps.refracted, &wanted.refracted)] {
                if total(wanted)[1] > 0.0 {
                    let rms = relative_rms(got, wanted, 16);
                    assert!(rms < 1e-3, "{name} x {factor}: {rms}");
                    assert!((total(got)[1] / total(wanted)[1] - 1.0).abs() < 1e-4, "{name} x {factor}");
                }
            }
        }
    }
}

#[test]
fn far_from_the_origin_looks_alike() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let mut moved = scene.clone();
    for object in &mut moved.objects {
        object.world_from_mesh = DMat4::from_translation(DVec3::new(5e3, -2e3, 1e4)) * object.world_from_mesh;
    }
    let [(a, _), (b, _)] = [scene, moved].map(|s| bake(&s, 64, &few()));
    assert!(relative_rms(&a.refracted, &b.refracted, 16) < 1e-3);
}

#[test]
fn opaque_things_block_before_and_behind_the_glass() {
    let with_blocker = |y: f64| {
        let mut scene = plate_over_floor(glass(1.0), 1.0, sun(DVec3::NEG_Y));
        place(&mut scene, "blocker", quad(0.25), opaque([0.0; 3]), DVec3::new(0.0, y, 0.0));
        bake(
            &scene,
            64,
            &Settings {
                emission_size: 256,
                map_size: Some(256),
                splat: Splat::Point,
                ..Settings::of(Method::CausticsMap)
            },
        )
    };
    for y in [0.5, 0.05] {
        let (maps, statistics) = with_blocker(y);
        let at = |x: usize, z: usize| maps.refracted[z * 64 + x][1];
        assert_eq!(at(32, 32), 0.0, "blocker at {y}");
        assert!((at(8, 8) - 1.0).abs() < 0.05, "blocker at {y}: {}", at(8, 8));
        let lit = total(&maps.refracted)[1] / 4096.0;
        assert!((lit - (1.0 - 0.0625)).abs() < 5e-3, "blocker at {y}: {lit}");
        let blocked: u64 = statistics.lights[0].ledgers.iter().map(|l| l.blocked.flux).sum();
        assert_eq!(blocked > 0, y > 0.2, "only what stands before the glass blocks photons");
    }
}

#[test]
fn shahs_own_settings_make_a_caustic() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let (maps, statistics) = bake(&scene, 64, &Settings::shah());
    assert!(total(&maps.refracted)[1] > 0.0);
    // One interface: nothing is lost at an exit.
    assert!(statistics.lights[0].ledgers.iter().all(|l| l.kept_inside.flux == 0 && l.no_exit.flux == 0));
    // His factor and exponent do not keep energy; without them one interface does.
    let physical = Settings {
        interfaces: Interfaces::One,
        ray_geo_update: LandingUpdate::Distance,
        ray_geo_iterations: 30,
        ..few()
    };
    let (maps, statistics) = bake(&scene, 64, &physical);
    let light = &statistics.lights[0];
    let landed: f64 =
        light.ledgers.iter().zip(&light.lumens_per_unit).map(|(l, u)| l.landed.flux as f64 * u).sum();
    let texel = 0.16 * 0.16 / 4096.0;
    assert!(
        (total(&maps.refracted)[1] * texel / landed - 1.0).abs() < 5e-3,
        "{} {landed}",
        total(&maps.refracted)[1] * texel
    );
}

#[test]
fn both_updates_of_ray_geo_agree_when_they_converge() {
    let scene = spectral_scene::bundled("sphere").unwrap();
    let with = |ray_geo_update, ray_geo_iterations| {
        bake(&scene, 64, &Settings { ray_geo_update, ray_geo_iterations, ..few() }).0.refracted
    };
    let plane = with(LandingUpdate::Plane, 2);
    let distances = [1, 4, 30].map(|k| relative_rms(&with(LandingUpdate::Distance, k), &plane, 16));
    assert!(
        distances[0] > distances[1] && distances[1] > distances[2] && distances[2] < 2e-3,
        "{distances:?}"
    );
}

#[test]
fn pictures_move_on_without_a_new_plan() {
    let mut scene = spectral_scene::bundled("gem").unwrap();
    let mut cpu = cpu();
    let limits = cpu.limits();
    let make = |scene: &Scene| asm_core::render_plan(scene, 0, [48, 32], &few(), &limits).unwrap();
    let mut current = make(&scene);
    cpu.prepare(&current.plan).unwrap();
    cpu.execute().unwrap();
    // Light, camera and glass move.
    scene.lights[0].shape = LightShape::Directional { direction: DVec3::new(0.2, -1.0, 0.3).normalize() };
    scene.cameras[0].world_from_camera *= DMat4::from_translation(DVec3::X * 0.02);
    let glass = scene.refractors().next().unwrap();
    scene.objects[glass].world_from_mesh =
        DMat4::from_translation(DVec3::Y * 0.01) * scene.objects[glass].world_from_mesh;
    current.update(&mut cpu, make(&scene)).unwrap();
    cpu.execute().unwrap();
    let moved = current.read(&mut cpu).unwrap().0;
    assert_eq!(moved, picture_of(&scene, [48, 32], &few()));
    // Another mesh is another structure.
    let floor = scene.objects[0].mesh;
    scene.meshes[floor] = Mesh { triangles: vec![[0, 1, 2]], ..scene.meshes[floor].clone() };
    let error = current.update(&mut cpu, make(&scene)).unwrap_err();
    assert!(matches!(error, asm_core::UpdateError::StructureChanged { .. }), "{error}");
    cpu.execute().unwrap();
    assert_eq!(current.read(&mut cpu).unwrap().0, moved);
}
