//! Light that mirrors, and the outside of glass, throw back.

use asm_core::{Ledger, Method, Reflections, Settings};
use frame_plan::Limits;
use glam::{DMat4, DVec3};
use spectral_core::upsample::SmoothSpectrum;
use spectral_scene::{LightShape, Material, Mesh, Scene};

use crate::stage::*;

fn mirror(base_color: [f64; 3]) -> Material {
    Material { name: "mirror".into(), metallic: 1.0, roughness: 0.0, ..opaque(base_color) }
}

/// Share that a mirror reflects, written apart from the passes.
fn schlick(at_normal: f64, cosine: f64) -> f64 {
    at_normal + (1.0 - at_normal) * (1.0 - cosine).powi(5)
}

/// A floor of side 1 as `receiver`, and an upright mirror of side 0.2 that faces -x, its middle at (0.3, 0.2, 0): light that
/// comes down along (1, -1, 0) goes back down along (-1, -1, 0) and lands at x = 0 to 0.2.
fn upright_mirror(base_color: [f64; 3]) -> Scene {
    let mut scene = Scene { name: "mirror".into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(1.4), opaque([1.0; 3]), DVec3::ZERO);
    place(&mut scene, "mirror", quad(0.2), mirror(base_color), DVec3::ZERO);
    let upright = DMat4::from_rotation_z(std::f64::consts::FRAC_PI_2);
    scene.objects[1].world_from_mesh = DMat4::from_translation(DVec3::new(0.3, 0.2, 0.0)) * upright;
    scene.lights.push(sun(DVec3::new(1.0, -1.0, 0.0)));
    scene
}

fn is_lost(ledger: &Ledger) -> u64 {
    ledger.outside_map.flux + ledger.escaped.flux + ledger.wrong_side.flux
}

#[test]
fn a_plane_mirror_sends_light_to_the_mirrored_place_with_its_fresnel_share() {
    let color = [0.9, 0.6, 0.3];
    let scene = upright_mirror(color);
    let settings = Settings { wavelengths: Some(7), emission_size: 256, ..Settings::of(Method::CausticsMap) };
    let (maps, statistics) = bake(&scene, 140, &settings);
    let light = &statistics.lights[0];
    assert!(light.ledgers.is_empty(), "nothing goes into glass");
    assert_eq!(light.reflected.len(), 7);
    let cosine = std::f64::consts::FRAC_1_SQRT_2;
    for (ledger, &nm) in light.reflected.iter().zip(&light.wavelengths_nm) {
        let share = schlick(SmoothSpectrum::reflectance(color).at(nm), cosine);
        let kept = ledger.landed.flux as f64 / ledger.emitted.flux as f64;
        assert!((kept - share).abs() < 1e-6, "{nm} nm: {kept} of {share}");
        assert_eq!(is_lost(ledger), 0, "{ledger:?}");
        assert_eq!(ledger.reflected.flux, 0);
        assert_eq!(ledger.absorbed.flux, ledger.emitted.flux - ledger.landed.flux);
    }
    // 1 lux across the light; the floor, like the mirror, leans by 45 degrees.
    for (i, texel) in maps.reflected.iter().enumerate() {
        let [x, z] = [i % 140, i / 140].map(|t| (t as f64 + 0.5) / 100.0 - 0.7);
        let within = |room: f64| x > -room && x < 0.2 + room && z.abs() < 0.1 + room;
        let y = f64::from(texel[1]);
        if within(-0.015) {
            let white = schlick(spectral_core::rgb::luminance(color), cosine) * cosine;
            assert!((y / white - 1.0).abs() < 0.1, "({x}, {z}): {y} for about {white}");
            assert!(texel[0] > texel[2], "({x}, {z}): {texel:?} is not warm");
        } else if !within(0.015) {
            assert_eq!(y, 0.0, "({x}, {z})");
        }
    }
    // Behind the mirror there is its shadow, as long as it is high.
    let shadowed = maps.direct.iter().filter(|t| t[1] == 0.0).count() as f64 * 1e-4;
    assert!((shadowed - 0.04).abs() < 2e-3, "{shadowed} m2 in shadow");
    assert!(maps.refracted.iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn few_wavelengths_have_the_colour_of_a_mirror_that_many_have() {
    // A gold that is steeper in blue than the metal, beside a mirror that takes nothing: grids of photons are not of one size.
    let [gold, white] = [[1.0, 0.766, 0.05], [1.0; 3]].map(upright_mirror);
    let of = |wavelengths, method| {
        let wavelengths = Some(wavelengths);
        let settings =
            Settings { wavelengths, emission_size: 64, map_size: Some(128), ..Settings::of(method) };
        let [gold, white] = [&gold, &white].map(|scene| total(&bake(scene, 64, &settings).0.reflected));
        std::array::from_fn::<f64, 3, _>(|c| gold[c] / white[c])
    };
    let many = of(61, Method::CausticsMap);
    for nodes in 2..=4 {
        let few = of(nodes, Method::Footprint);
        for (few, many) in few.into_iter().zip(many) {
            assert!((few / many - 1.0).abs() < 0.01, "{nodes} nodes: {few}, {many}");
        }
    }
}

#[test]
fn mirrors_reflect_on_both_sides() {
    let total_of = |turned: bool| {
        let mut scene = upright_mirror([0.8; 3]);
        if turned {
            scene.meshes[1].triangles = vec![[0, 2, 1], [0, 3, 2]];
        }
        total(&bake(&scene, 64, &Settings::of(Method::CausticsMap)).0.reflected)
    };
    let (front, back) = (total_of(false), total_of(true));
    assert!(front[1] > 0.0);
    for c in 0..3 {
        assert!((front[c] / back[c] - 1.0).abs() < 1e-4, "{front:?} {back:?}");
    }
}

/// A wall of radius `radius` round the y axis, from -35 to 35 degrees about +x and between two heights, its normals inwards.
fn trough(radius: f32, low: f32, high: f32) -> Mesh {
    let steps = 256;
    let mut mesh = Mesh { name: "trough".into(), ..Mesh::default() };
    for i in 0..=steps {
        let angle = (70.0 * i as f32 / steps as f32 - 35.0).to_radians();
        let (sin, cos) = angle.sin_cos();
        for y in [low, high] {
            mesh.positions.push([radius * cos, y, radius * sin]);
            mesh.normals.push([-cos, 0.0, -sin]);
        }
    }
    for i in 0..steps {
        let a = 2 * i;
        mesh.triangles.extend([[a, a + 3, a + 1], [a, a + 2, a + 3]]);
    }
    mesh
}

#[test]
fn a_trough_has_its_cusp_at_half_the_radius() {
    // Light comes along +x and falls by 1 for every 4: what meets the wall at height y lands y * 4 before it.
    let (radius, slope) = (0.4, 0.25);
    let mut scene = Scene { name: "trough".into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(1.0), opaque([1.0; 3]), DVec3::ZERO);
    place(&mut scene, "trough", trough(radius as f32, 0.02, 0.09), mirror([1.0; 3]), DVec3::ZERO);
    scene.lights.push(sun(DVec3::new(1.0, -slope, 0.0)));
    let size = 400;
    let settings =
        Settings { emission_size: 1024, map_size: Some(1024), ..Settings::of(Method::CausticsMap) };
    let (maps, statistics) = bake(&scene, size, &settings);
    let y = |x: usize, z: usize| f64::from(maps.reflected[z * size as usize + x][1]);
    let column = |x: f64| ((x + 0.5) * f64::from(size)) as usize;
    // Along the axis of the nephroid: dark towards the centre, brightest at the cusp.
    let axis = |x: usize| y(x, 199) + y(x, 200);
    let brightest = (column(0.1)..column(0.36)).max_by(|&a, &b| axis(a).total_cmp(&axis(b))).unwrap();
    let at = (brightest as f64 + 0.5) / f64::from(size) - 0.5;
    assert!((at - 0.5 * radius).abs() < 0.015, "brightest at {at}, the focus is at {}", 0.5 * radius);
    // The caustic's branches: a ray that meets the wall at angle t touches them at R / 4 (3 cos t - cos 3 t, 3 sin t - sin 3 t).
    for t in [0.35_f64, 0.5] {
        let touch = [
            0.25 * radius * (3.0 * t.cos() - (3.0 * t).cos()),
            0.25 * radius * (3.0 * t.sin() - (3.0 * t).sin()),
        ];
        let profile: Vec<f64> = (0..size as usize).map(|z| y(column(touch[0]), z)).collect();
        let half = &profile[size as usize / 2..];
        let peak = (0..half.len()).max_by(|&a, &b| half[a].total_cmp(&half[b])).unwrap();
        let at = (peak as f64 + 0.5) / f64::from(size);
        assert!((at - touch[1]).abs() < 0.012, "at x = {}: {at}, the nephroid is at {}", touch[0], touch[1]);
    }
    // What white light loses at a mirror of reflectance 1 is nothing.
    let ledger = &statistics.lights[0].reflected[0];
    assert_eq!(ledger.absorbed.flux, 0, "{ledger:?}");
}

/// Upright walls 8 high that meet in an edge at the origin, at right angles and open to -x, each 0.1 wide along z.
fn corner(walls: &[u32]) -> Mesh {
    let mut mesh = Mesh { name: "corner".into(), ..Mesh::default() };
    for [x, z] in [[-0.1, -0.1], [0.0, 0.0], [-0.1, 0.1]] {
        mesh.positions.extend([[x, -4.0, z], [x, 4.0, z]]);
    }
    mesh.triangles
        .extend(walls.iter().map(|wall| 2 * wall).flat_map(|a| [[a, a + 1, a + 3], [a, a + 3, a + 2]]));
    mesh
}

#[test]
fn light_in_a_corner_is_reflected_by_both_walls() {
    let corner_scene = |meshes: &[&[u32]]| {
        let mut scene = Scene { name: "corner".into(), ..Scene::default() };
        place(&mut scene, "receiver", quad(1.0), opaque([1.0; 3]), DVec3::new(-1.0, 0.0, 0.0));
        for walls in meshes {
            place(&mut scene, "corner", corner(walls), mirror([0.5; 3]), DVec3::ZERO);
        }
        scene.lights.push(sun(DVec3::new(1.0, -0.25, 0.0)));
        scene
    };
    let absorbed = |scene: &Scene| {
        let settings = Settings { emission_size: 256, ..Settings::of(Method::CausticsMap) };
        let ledger = bake(scene, 16, &settings).1.lights[0].reflected[0];
        assert_eq!((ledger.wrong_side.flux, ledger.no_exit.flux), (0, 0), "{ledger:?}");
        ledger.absorbed.flux as f64 / ledger.emitted.flux as f64
    };
    let share = schlick(0.5, std::f64::consts::FRAC_1_SQRT_2 / 1.0_f64.hypot(0.25));
    // But for the few photons that fall below the other wall.
    let twice = absorbed(&corner_scene(&[&[0, 1]]));
    assert!((twice - (1.0 - share * share)).abs() < 0.005, "{twice} for {}", 1.0 - share * share);
    // Whichever way round the walls are wound.
    let mut turned = corner_scene(&[&[0, 1]]);
    turned.meshes[1].triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert!((absorbed(&turned) - twice).abs() < 1e-4);
    // Two mirrors do not know of each other.
    let once = absorbed(&corner_scene(&[&[0], &[1]]));
    assert!((once - (1.0 - share)).abs() < 1e-6, "{once} for {}", 1.0 - share);
}

#[test]
fn the_outside_of_glass_reflects_its_fresnel_share() {
    // At normal incidence ((n - 1) / (n + 1))^2, straight back up, where no surface is: it escapes or leaves the map.
    let scene = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let all =
        Settings { reflections: Reflections::All, wavelengths: Some(1), ..Settings::of(Method::CausticsMap) };
    let (maps, statistics) = bake(&scene, 32, &all);
    let (inside, outside) = (&statistics.lights[0].ledgers[0], &statistics.lights[0].reflected[0]);
    assert_eq!(inside.emitted, outside.emitted);
    let share = (outside.emitted.flux - outside.kept_inside.flux) as f64 / outside.emitted.flux as f64;
    assert!((share - 0.04).abs() < 1e-6, "{share}");
    let back = outside.emitted.flux - outside.kept_inside.flux;
    assert!(inside.reflected.flux.abs_diff(back) < back / 100_000, "{inside:?} {outside:?}");
    assert_eq!(outside.landed.flux, 0, "{outside:?}");
    assert!(maps.reflected.iter().flatten().all(|v| *v == 0.0));
    // The refracted layer is what it is without.
    let (alone, _) = bake(&scene, 32, &Settings { reflections: Reflections::None, ..all });
    assert_eq!(alone.refracted, maps.refracted);
    assert_eq!(alone.direct, maps.direct);
}

#[test]
fn water_from_below_reflects_totally() {
    // A lamp under an open surface, beyond the critical angle: everything comes back down, through water.
    let mut scene = Scene { name: "pool".into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(4.0), opaque([1.0; 3]), DVec3::ZERO);
    let mut water = tinted(1.33, [0.5, 0.5, 0.5], 1.0);
    water.name = "water".into();
    place(&mut scene, "surface", quad(0.1), water, DVec3::new(0.5, 0.3, 0.0));
    // The sine of incidence is above 1 / 1.33 everywhere.
    let shape = LightShape::Point { position_m: DVec3::new(-0.1, 0.05, 0.0), range_m: None };
    scene.lights.push(light(shape, 1.0));
    let settings =
        Settings { reflections: Reflections::All, wavelengths: Some(1), ..Settings::of(Method::CausticsMap) };
    let (_, statistics) = bake(&scene, 32, &settings);
    let (up, back) = (&statistics.lights[0].ledgers[0], &statistics.lights[0].reflected[0]);
    assert_eq!(up.total_reflection.flux, up.emitted.flux, "{up:?}");
    assert_eq!(back.kept_inside.flux, 0, "{back:?}");
    assert!(back.absorbed.flux > 0 && back.absorbed.flux < back.emitted.flux / 2, "{back:?}");
    let room = back.emitted.flux / 50;
    assert!(
        back.landed.flux + back.outside_map.flux + back.absorbed.flux + room > back.emitted.flux,
        "{back:?}"
    );
    assert!(back.landed.flux > back.emitted.flux / 2, "{back:?}");
}

#[test]
fn a_scene_pays_only_for_reflections_it_calls_for() {
    let steps = |scene: &Scene, reflections| {
        let plan = plan(scene, 16, &Settings { reflections, ..Settings::of(Method::CausticsMap) }).plan;
        let notes: Vec<String> = plan.decisions.iter().flat_map(|d| d.notes.clone()).collect();
        let traces = plan.step_names().iter().filter(|s| s.starts_with("photon_trace")).count();
        (traces, notes.into_iter().find(|n| n.starts_with("reflected light")).unwrap_or_default())
    };
    let glass_only = plate_over_floor(glass(1.5), 0.4, sun(DVec3::NEG_Y));
    let (traces, note) = steps(&glass_only, Reflections::Mirrors);
    assert_eq!(traces, 1, "{note}");
    assert!(note.contains("not traced") && note.contains("no object is of polished metal"), "{note}");
    let (traces, note) = steps(&glass_only, Reflections::All);
    assert_eq!(traces, 2, "{note}");
    assert!(note.contains("the outside of glass") && !note.contains("mirrors"), "{note}");
    let mirror_only = upright_mirror([1.0; 3]);
    assert_eq!(steps(&mirror_only, Reflections::Mirrors).0, 1);
    assert_eq!(steps(&mirror_only, Reflections::None), (0, String::new()));
    let mut both = upright_mirror([1.0; 3]);
    place(&mut both, "plate", cuboid([0.1, 0.05, 0.1]), glass(1.5), DVec3::new(-0.4, 0.2, 0.0));
    assert_eq!(steps(&both, Reflections::Mirrors).0, 2);
    assert_eq!(steps(&both, Reflections::All).0, 2);
    assert_eq!(steps(&both, Reflections::None).0, 1);
    let limits = Limits::default();
    let refused = asm_core::bake_plan(&mirror_only, 1, [16; 2], &Settings::of(Method::CausticsMap), &limits)
        .unwrap_err();
    assert!(refused.to_string().contains("mirror"), "{refused}");
}

/// Two plates of glass and a mirror over a floor.
fn three_casters() -> Scene {
    let mut scene = upright_mirror([0.9, 0.8, 0.7]);
    place(&mut scene, "plate", cuboid([0.15, 0.05, 0.15]), glass(1.5), DVec3::new(-0.4, 0.2, 0.3));
    place(&mut scene, "other", cuboid([0.1, 0.08, 0.1]), glass(1.7), DVec3::new(-0.3, 0.25, -0.3));
    scene
}

#[test]
fn casters_together_throw_what_each_throws_alone() {
    let all = three_casters();
    // Wide splats follow the photons' spacing, which the emission view sets: with points only their places count.
    let settings = Settings {
        splat: asm_core::Splat::Point,
        emission_size: 512,
        reflections: Reflections::Mirrors,
        ..Settings::of(Method::CausticsMap)
    };
    let alone = |keep: usize| {
        let mut scene = all.clone();
        scene.objects = vec![all.objects[0].clone(), all.objects[keep].clone()];
        bake(&scene, 32, &settings).0
    };
    let together = bake(&all, 32, &settings).0;
    let parts = [1, 2, 3].map(alone);
    for (name, whole, of) in [
        ("refracted", &together.refracted, parts.each_ref().map(|p| &p.refracted)),
        ("reflected", &together.reflected, parts.each_ref().map(|p| &p.reflected)),
    ] {
        let (whole, sum) = (
            total(whole),
            of.map(|p| total(p)).into_iter().reduce(|a, b| std::array::from_fn(|c| a[c] + b[c])).unwrap(),
        );
        for c in 0..3 {
            assert!(sum[c] > 0.0 && (whole[c] / sum[c] - 1.0).abs() < 0.01, "{name}: {whole:?} of {sum:?}");
        }
    }
}

#[test]
fn lights_together_throw_what_each_throws_alone() {
    let mut scene = three_casters();
    let shape = LightShape::Point { position_m: DVec3::new(-0.6, 0.9, 0.1), range_m: None };
    scene.lights.push(light(shape, 1.0));
    let with = |lights| bake(&scene, 32, &Settings { lights, ..Settings::of(Method::CausticsMap) }).0;
    let (both, first, second) = (with(None), with(Some(vec![0])), with(Some(vec![1])));
    for (name, both, first, second) in [
        ("direct", both.direct, first.direct, second.direct),
        ("refracted", both.refracted, first.refracted, second.refracted),
        ("reflected", both.reflected, first.reflected, second.reflected),
    ] {
        assert!(total(&first)[1] > 0.0 && total(&second)[1] > 0.0, "{name}");
        for (i, (both, (a, b))) in both.iter().zip(first.iter().zip(&second)).enumerate() {
            for c in 0..3 {
                let sum = a[c] + b[c];
                assert!((both[c] - sum).abs() <= 1e-6 * sum.max(1e-3), "{name}, {i}: {} of {sum}", both[c]);
            }
        }
    }
}
