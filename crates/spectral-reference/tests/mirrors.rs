//! Light thrown back by polished metal against closed forms.

mod stage;

use std::f64::consts::PI;

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;
use spectral_core::rgb::xyz_from_linear_srgb;
use spectral_core::upsample::SmoothSpectrum;
use spectral_reference::{Bake, BakeSettings, ReferenceError, bake};
use spectral_scene::{LightShape, Mesh, Scene};
use stage::*;

/// F0 + (1 - F0) (1 - cos)^5.
fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

/// A mirror on y = 0 and a panel above its end, front to -x: light at an angle to the vertical is thrown at all of it.
/// The panel's index is 1.
fn panel_over_mirror(base_color: [f64; 3], angle: f64) -> Stage {
    let mut stage = Stage::new();
    let reach = 0.4 * angle.tan();
    stage.add(square(), metal(base_color), placed([1.0 - reach, 0.0, 0.0], [reach, 1.0, 0.3]));
    stage.add(square(), matte(), panel(DVec3::new(1.0, 0.5, 0.0), DVec3::Z, DVec3::NEG_X, 0.2));
    stage.sun([angle.sin(), -angle.cos(), 0.0]);
    stage
}

#[test]
fn a_plane_mirror_sends_on_schlicks_share_at_every_angle() {
    for degrees in [10.0_f64, 45.0, 60.0, 80.0] {
        for f0 in [0.0, 0.5, 1.0] {
            let angle = degrees.to_radians();
            let mut stage = panel_over_mirror([f0; 3], angle);
            let bake = baked(&stage.0, 1, &settings(8, 400_000));
            let expected = angle.sin() * schlick(f0, angle.cos());
            let what = format!("F0 {f0} at {degrees} degrees");
            if expected > 1e-5 {
                assert_close(mean(&bake.reflected, 1), expected, 1e-3, &what);
            }
            assert_close(mean(&bake.direct, 1), angle.sin(), 1e-9, &what);
            assert_eq!(mean(&bake.refracted, 1), 0.0, "{what}");
            assert_eq!((bake.photons > 0, bake.reflection_photons), (true, 0), "{what}");
            let total = bake.ledger.total();
            let absorbed = total.absorbed / (total.emitted - total.passed);
            assert!((absorbed - 1.0 + schlick(f0, angle.cos())).abs() < 1e-9, "{what}: absorbed {absorbed}");
            // The other side is a mirror too.
            stage.0.objects[0].world_from_mesh *= DMat4::from_rotation_x(PI);
            let turned = baked(&stage.0, 1, &settings(8, 400_000));
            if expected > 1e-5 {
                assert_close(mean(&turned.reflected, 1), expected, 1e-3, &format!("{what}, turned"));
            }
        }
    }
}

#[test]
fn metal_colours_light_wavelength_by_wavelength() {
    let gold = [1.0, 0.766, 0.336];
    let angle = 1.1_f64;
    for lambda_nm in [450.0, 546.1, 650.0] {
        let mut stage = panel_over_mirror(gold, angle);
        stage.0.lights[0].spectrum = LightSpectrum::line(lambda_nm).unwrap();
        let bake = baked(&stage.0, 1, &settings(8, 400_000));
        let f0 = SmoothSpectrum::reflectance(gold).at(lambda_nm);
        let expected = angle.sin() * schlick(f0, angle.cos());
        assert_close(mean(&bake.reflected, 1), expected, 1e-3, &format!("{lambda_nm} nm"));
    }
    // White light at nearly normal incidence has the metal's colour.
    let angle = 0.1_f64;
    let mut stage = panel_over_mirror(gold, angle);
    stage.0.lights[0].spectrum = LightSpectrum::default();
    let bake = baked(&stage.0, 1, &settings(8, 1_600_000));
    for (c, expected) in xyz_from_linear_srgb(gold).into_iter().enumerate() {
        assert_close(mean(&bake.reflected, c), angle.sin() * expected, 2e-3, &format!("channel {c}"));
    }
}

/// At 45 degrees light from above goes on level, to the mirrored place and no other.
#[test]
fn a_tilted_mirror_sends_light_to_the_mirrored_place() {
    let mut stage = Stage::new();
    let tilted = DMat4::from_translation(DVec3::new(0.0, 1.0, 0.0)) * DMat4::from_rotation_z(-PI / 4.0);
    stage.add(square(), metal([0.8; 3]), tilted * DMat4::from_scale(DVec3::splat(0.1)));
    let half = 0.2;
    stage.add(square(), matte(), panel(DVec3::new(1.0, 1.0, 0.0), DVec3::Z, DVec3::NEG_X, half));
    stage.sun([0.0, -1.0, 0.0]);
    let n = 64;
    let bake = baked(&stage.0, 1, &settings(n, 1_600_000));
    let expected = schlick(0.8, 0.5_f64.sqrt());
    // The mirror is 0.1 to each side along z and 0.1 / sqrt(2) along its tilt, which becomes the height.
    let size = [0.1, 0.1 / 2_f64.sqrt()];
    let area = 4.0 * size[0] * size[1];
    let flux = mean(&bake.reflected, 1) * 4.0 * half * half;
    assert_close(flux, expected * area, 1e-3, "flux");
    for (texel, xyz) in bake.reflected.iter().enumerate() {
        let at = |k: usize| half * (2.0 * (k as f64 + 0.5) / f64::from(n) - 1.0);
        let place = [at(texel % n as usize).abs(), at(texel / n as usize).abs()];
        let margin = half / f64::from(n);
        let clear = |sign: f64| place.iter().zip(size).map(move |(p, s)| sign * (s - p) - margin);
        if clear(1.0).all(|c| c > 0.0) {
            assert!((xyz[1] - expected).abs() < 0.1, "{place:?}: {xyz:?}");
        } else if clear(-1.0).any(|c| c > 0.0) {
            assert_eq!(xyz[1], 0.0, "{place:?}");
        }
    }
}

/// A smooth surface y = height(x, z) over the square of half side 1 about the origin, with its slopes.
fn surface(cells: u32, height: impl Fn(f64, f64) -> (f64, [f64; 2])) -> Mesh {
    let mut mesh = Mesh { name: "surface".into(), ..Mesh::default() };
    let at = |k: u32| 2.0 * f64::from(k) / f64::from(cells) - 1.0;
    for i in 0..=cells {
        for j in 0..=cells {
            let (x, z) = (at(i), at(j));
            let (y, [along_x, along_z]) = height(x, z);
            mesh.positions.push(DVec3::new(x, y, z).as_vec3().to_array());
            mesh.normals.push(DVec3::new(-along_x, 1.0, -along_z).normalize().as_vec3().to_array());
            if i < cells && j < cells {
                let a = i * (cells + 1) + j;
                let (right, up) = (a + cells + 1, a + 1);
                mesh.triangles.extend([[a, up, right + 1], [a, right + 1, right]]);
            }
        }
    }
    mesh
}

/// y = (x^2 + z^2) / 4 f throws all light along its axis at the focus.
#[test]
fn a_parabolic_mirror_has_its_focus() {
    let focal = 2.0;
    let dish = surface(128, |x, z| ((x * x + z * z) / (4.0 * focal), [x / (2.0 * focal), z / (2.0 * focal)]));
    let half = 0.01;
    let share = |height: f64| {
        let mut stage = Stage::new();
        stage.add(dish.clone(), metal([1.0; 3]), DMat4::IDENTITY);
        let screen = stage.add(square(), matte(), panel(DVec3::Y * height, DVec3::X, DVec3::NEG_Y, half));
        stage.sun([0.0, -1.0, 0.0]);
        let bake = baked(&stage.0, screen, &settings(8, 1_600_000));
        // White metal keeps nothing. The screen stands in its own light.
        assert_eq!(bake.ledger.total().absorbed, 0.0);
        let area = 4.0 * half * half;
        mean(&bake.reflected, 1) * area / (4.0 - area)
    };
    assert_close(share(focal), 1.0, 2e-3, "at the focus");
    // At 0.9 f the pencil still has a tenth of the dish's width.
    assert_close(share(0.9 * focal), half * half / 0.01, 0.05, "before it");
}

/// Light that slants onto the inside of an upright cylinder draws a nephroid on the floor, whatever the slant: its cusp
/// is half a radius from the axis, and beyond it, towards the axis, there is no second or third ray.
#[test]
fn a_cylinder_draws_a_nephroid_with_its_cusp_at_half_the_radius() {
    // Half the wall, facing -x where light along +x arrives.
    let segments = 512;
    let mut wall = Mesh { name: "wall".into(), ..Mesh::default() };
    for i in 0..=segments {
        let (sin, cos) = (1.2 * (2.0 * f64::from(i) / f64::from(segments) - 1.0)).sin_cos();
        for y in [0.0, 1.0] {
            wall.positions.push(DVec3::new(cos, y, sin).as_vec3().to_array());
            wall.normals.push(DVec3::new(-cos, 0.0, -sin).as_vec3().to_array());
        }
        if i < segments {
            wall.triangles.extend([[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]);
        }
    }
    for slope in [0.7_f64, 1.2] {
        let mut stage = Stage::new();
        let (centre, half, n) = (0.5, 0.25, 125_u32);
        let floor = stage.floor([centre, 0.0], half, 0.0);
        stage.add(wall.clone(), metal([1.0; 3]), DMat4::IDENTITY);
        stage.sun([1.0, -slope, 0.0]);
        let bake = baked(&stage.0, floor, &settings(n, 8_000_000));
        let x = |u: u32| centre + half * (2.0 * (f64::from(u) + 0.5) / f64::from(n) - 1.0);
        let y = |u: u32, v: u32| bake.reflected[(v * n + u) as usize][1];
        let middle = n / 2;
        let peak = (0..n).max_by(|&a, &b| y(a, middle).total_cmp(&y(b, middle))).expect("a row");
        let texel = 2.0 * half / f64::from(n);
        // The cusp is z = (4 s / 3)^1.5 at s from its point: this far both branches lie in the row of texels.
        let within = 0.75 * (0.5 * texel).powf(2.0 / 3.0);
        let range = 0.5 - texel..0.5 + within + texel;
        assert!(range.contains(&x(peak)), "slope {slope}: cusp at {}, expected {range:?}", x(peak));
        // A pencil at distance s behind its focus is s / (R / 2) as wide as the wall that it comes from, in the plane;
        // 1 / (0.5 - x) has its mean over a range by the logarithm.
        let sun = slope / (1.0 + slope * slope).sqrt();
        let columns: Vec<u32> = (0..n).filter(|&u| (0.30..0.42).contains(&x(u))).collect();
        let (from, to) = (x(columns[0]) - 0.5 * texel, x(columns[columns.len() - 1]) + 0.5 * texel);
        let expected = sun * 0.5 * ((0.5 - from) / (0.5 - to)).ln() / (to - from);
        let rows = middle - 2..=middle + 2;
        let sum: f64 =
            rows.clone().flat_map(|v| columns.iter().map(move |&u| (u, v))).map(|(u, v)| y(u, v)).sum();
        let found = sum / (rows.count() * columns.len()) as f64;
        assert_close(found, expected, 0.03, &format!("slope {slope}, behind the cusp"));
    }
}

/// Light that has been in glass stays refracted when a mirror throws it on, and becomes so when it enters glass later.
#[test]
fn layers_go_by_the_first_event_but_for_glass() {
    let angle = 0.8_f64;
    let expected = angle.sin() * schlick(0.6, angle.cos());
    // Glass of index 1, so that light goes straight: before the mirror, then behind it.
    for (centre, half) in [([-1.0, 2.0, 0.0], [1.5, 0.05, 0.5]), ([0.925, 0.5, 0.0], [0.025, 0.4, 0.5])] {
        let mut stage = panel_over_mirror([0.6; 3], angle);
        stage.add(cube(), glass(1.0), placed(centre, half));
        let bake = baked(&stage.0, 1, &settings(8, 1_600_000));
        // Light that passes the glass and lands without a mirror is refracted too.
        assert_close(mean(&bake.refracted, 1), angle.sin() + expected, 2e-3, &format!("{centre:?}"));
        assert_eq!(mean(&bake.reflected, 1), 0.0, "{centre:?}");
    }
}

/// A periscope: the first reflection is always followed, the second is one of `bounces`.
#[test]
fn further_reflections_are_limited_by_bounces() {
    let mut stage = Stage::new();
    let tilted = |x: f64| {
        DMat4::from_translation(DVec3::new(x, 1.0, 0.0))
            * DMat4::from_rotation_z(-PI / 4.0)
            * DMat4::from_scale(DVec3::new(0.5, 1.0, 0.5))
    };
    stage.add(square(), metal([0.5; 3]), tilted(0.0));
    stage.add(square(), metal([0.5; 3]), tilted(2.0));
    // A roof over the second mirror leaves it to the first.
    stage.add(square(), matte(), placed([2.0, 3.0, 0.0], [0.9, 1.0, 0.9]));
    let floor = stage.floor([2.0, 0.0], 0.2, 0.0);
    stage.sun([0.0, -1.0, 0.0]);
    let bake = |bounces| baked(&stage.0, floor, &BakeSettings { bounces, ..settings(8, 400_000) });
    let share = schlick(0.5, 0.5_f64.sqrt());
    let none = bake(0);
    assert_eq!(mean(&none.reflected, 1), 0.0);
    assert!(none.ledger.total().truncated > 0.1 * none.ledger.total().emitted);
    assert_close(mean(&bake(1).reflected, 1), share * share, 1e-3, "two reflections");
    assert_eq!(bake(1).ledger.total().truncated, 0.0);
}

/// Light of several lamps is the sum of each one's, and glass and mirrors far apart have nothing to do with each other.
#[test]
fn lamps_and_casters_add_up() {
    let lamps = [
        LightShape::Directional { direction: DVec3::new(0.3, -1.0, 0.1).normalize() },
        LightShape::Point { position_m: DVec3::new(-0.5, 2.0, 0.3), range_m: None },
        LightShape::Spot {
            position_m: DVec3::new(0.5, 2.0, -0.3),
            direction: DVec3::NEG_Y,
            inner_cone_rad: 0.3,
            outer_cone_rad: 0.8,
            range_m: None,
        },
    ];
    let stage = |lamps: &[LightShape], left: bool, right: bool, ball: bool| {
        let mut stage = Stage::new();
        let floor = stage.floor([0.0, 0.0], 1.5, 0.0);
        let mut add = |there: bool, material, x: f64, z: f64| {
            if there {
                stage.add(sphere(12), material, placed([x, 0.45, z], [0.2; 3]));
            }
        };
        add(left, glass(1.5), -1.0, 0.0);
        add(right, glass(1.7), 1.0, 0.0);
        add(ball, metal([0.9, 0.7, 0.4]), 0.0, -1.0);
        lamps.iter().for_each(|&lamp| stage.light(lamp, 1.0));
        (stage.0, floor)
    };
    let bake = |(scene, floor): (Scene, usize)| baked(&scene, floor, &settings(32, 600_000));
    let flux = |layer: fn(&Bake) -> &Vec<[f64; 3]>, bakes: &[Bake]| -> f64 {
        bakes.iter().map(|bake| mean(layer(bake), 1)).sum()
    };
    let all = [bake(stage(&lamps, true, true, true))];
    let single = lamps.map(|lamp| bake(stage(&[lamp], true, true, true)));
    for (layer, name) in LAYERS {
        assert_close(flux(layer, &single), flux(layer, &all), 3e-3, &format!("lamps, {name}"));
    }
    let sun = [bake(stage(&lamps[..1], true, true, true))];
    let alone = [(true, false, false), (false, true, false), (false, false, true)]
        .map(|(l, r, b)| bake(stage(&lamps[..1], l, r, b)));
    for (layer, name) in &LAYERS[1..] {
        assert_close(flux(*layer, &alone), flux(*layer, &sun), 5e-3, &format!("casters, {name}"));
    }
}

type Of = fn(&Bake) -> &Vec<[f64; 3]>;
const LAYERS: [(Of, &str); 3] =
    [(|b| &b.direct, "direct"), (|b| &b.refracted, "refracted"), (|b| &b.reflected, "reflected")];

#[test]
fn nothing_lands_on_a_mirror() {
    let stage = panel_over_mirror([1.0; 3], 0.5);
    let mut scene = stage.0;
    scene.meshes[0].uvs = vec![[0.0; 2]; 4];
    let error = bake(&scene, 0, &settings(8, 100), &|_| ()).expect_err("a mirror");
    assert!(matches!(error, ReferenceError::ReceiverMirrors { .. }), "{error}");
}
