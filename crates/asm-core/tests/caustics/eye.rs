//! What a camera's rays do beyond what they meet first: mirrors throw them on, and an eye in a medium sees through it.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};

use asm_core::{GlassView, Method, Picture, Settings};
use glam::{DMat3, DMat4, DVec2, DVec3};
use spectral_scene::{Camera, Material, Scene};

use crate::stage::*;

const SIZE: u32 = 64;

/// Pixels of a square picture: where the eye is, the ray, and Y.
fn rays(camera: &Camera, picture: &Picture) -> Vec<(DVec3, DVec3, f64)> {
    let eye = camera.world_from_camera.w_axis.truncate();
    let world_from_camera = DMat3::from_mat4(camera.world_from_camera);
    let tangent = (camera.yfov_rad / 2.0).tan();
    let ray = |i: usize| {
        let at = DVec2::new((i as u32 % SIZE) as f64, (i as u32 / SIZE) as f64) + 0.5;
        let slope = tangent * (2.0 * at / f64::from(SIZE) - 1.0);
        (world_from_camera * DVec3::new(slope.x, -slope.y, -1.0)).normalize()
    };
    picture.xyz.iter().enumerate().map(|(i, xyz)| (eye, ray(i), f64::from(xyz[1]))).collect()
}

/// Whether the picture shows `point`, not too near to its edge.
fn is_shown(camera: &Camera, point: DVec3) -> bool {
    let local = camera.world_from_camera.inverse().transform_point3(point);
    let slope = local.truncate() / -local.z / (camera.yfov_rad / 2.0).tan();
    local.z < 0.0 && slope.abs().max_element() < 0.95
}

fn one_sample(method: Method) -> Settings {
    Settings { picture_samples: 1, emission_size: 256, map_size: Some(256), ..Settings::of(method) }
}

/// A white floor under a sun straight above, and an upright mirror of side 0.4 that faces -x: no light falls on it.
fn mirror_on_floor(base_color: [f64; 3]) -> Scene {
    let mut scene = Scene { name: "mirror".into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(2.0), opaque([1.0; 3]), DVec3::ZERO);
    place(&mut scene, "mirror", quad(0.4), Material::mirror("metal", base_color), DVec3::ZERO);
    scene.objects[1].world_from_mesh =
        DMat4::from_translation(DVec3::new(0.3, 0.21, 0.0)) * DMat4::from_rotation_z(FRAC_PI_2);
    scene.lights.push(sun(DVec3::NEG_Y));
    let camera = Camera::look_at(DVec3::new(-0.4, 0.5, 0.05), DVec3::new(0.1, 0.0, 0.0));
    scene.cameras.push(Camera { yfov_rad: 1.3, ..camera });
    scene
}

#[test]
fn a_mirror_shows_the_floor_before_it_at_its_fresnel_share() {
    for (method, wavelengths) in [(Method::CausticsMap, 1), (Method::Acm, 1), (Method::Asm, 7)] {
        let scene = mirror_on_floor([0.8; 3]);
        let settings = Settings { wavelengths: Some(wavelengths), ..one_sample(method) };
        let picture = picture_of(&scene, [SIZE; 2], &settings);
        let camera = &scene.cameras[0];
        let (mut floor, mut sky) = (0, 0);
        for (eye, ray, y) in rays(camera, &picture) {
            let at = eye + (0.3 - eye.x) / ray.x * ray;
            if ray.x <= 0.0 || at.z.abs() > 0.19 || (at.y - 0.21).abs() > 0.19 {
                continue;
            }
            let back = ray * DVec3::new(-1.0, 1.0, 1.0);
            if back.y >= 0.0 {
                assert_eq!(y, 0.0, "the sky at {at}");
                sky += 1;
                continue;
            }
            let seen = at - at.y / back.y * back;
            if seen.abs().max_element() < 0.95 && is_shown(camera, seen) {
                let share = 0.8 + 0.2 * (1.0 - ray.x).powi(5);
                assert!((y / (share * FRAC_1_PI) - 1.0).abs() < 1e-3, "{y} at {at}, {share}");
                floor += 1;
            }
        }
        assert!(floor > 100, "{floor} pixels of floor, {sky} of sky");
    }
}

#[test]
fn gold_colours_what_it_shows() {
    let gold = [1.0, 0.766, 0.336];
    let scene = mirror_on_floor(gold);
    let wanted = spectral_core::rgb::xyz_from_linear_srgb(gold);
    let picture = picture_of(&scene, [SIZE; 2], &one_sample(Method::Asm));
    let lit = picture.xyz.iter().zip(rays(&scene.cameras[0], &picture)).filter(|(xyz, (eye, ray, _))| {
        let at = eye + (0.3 - eye.x) / ray.x * ray;
        ray.x > 0.0 && at.z.abs() < 0.19 && (at.y - 0.21).abs() < 0.19 && xyz[1] > 0.0
    });
    let mut pixels = 0;
    for (xyz, (_, ray, _)) in lit {
        // Schlick takes the metal's colour towards white by the same share at each wavelength.
        let grazing = (1.0 - ray.x).powi(5);
        for c in 0..3 {
            let share = wanted[c] / D65[c] + (1.0 - wanted[c] / D65[c]) * grazing;
            let seen = f64::from(xyz[c]) / D65[c] / FRAC_1_PI;
            assert!((seen - share).abs() < 0.03, "channel {c}: {seen} for {share}");
        }
        pixels += 1;
    }
    assert!(pixels > 100, "{pixels}");
}

/// A floor, and level water 1 m above it.
fn pool(water: Material, floor: [f64; 3], light: DVec3, eye: DVec3, target: DVec3) -> Scene {
    let mut scene = Scene { name: "pool".into(), ..Scene::default() };
    place(&mut scene, "receiver", quad(6.0), opaque(floor), DVec3::ZERO);
    place(&mut scene, "water", quad(6.0), water, DVec3::Y);
    scene.lights.push(sun(light));
    scene.cameras.push(Camera { yfov_rad: 1.2, ..Camera::look_at(eye, target) });
    scene
}

#[test]
fn an_eye_under_water_sees_through_what_the_water_lets_pass() {
    let picture = |water: Material, view: GlassView| {
        let scene = pool(water, [1.0; 3], DVec3::NEG_Y, DVec3::new(0.0, 0.6, 0.0), DVec3::ZERO);
        let settings = Settings { glass_view: Some(view), ..one_sample(Method::Acm) };
        let picture = picture_of(&scene, [SIZE; 2], &settings);
        rays(&scene.cameras[0], &picture)
    };
    for view in [GlassView::Straight, GlassView::Deferred] {
        let clear = picture(glass(1.33), view);
        let dim = picture(tinted(1.33, [0.5; 3], 1.0), view);
        for ((_, ray, clear), (.., dim)) in clear.into_iter().zip(dim) {
            // Light has come down 1 m.
            let wanted = 0.5_f64.powf(1.0 - 0.6 / ray.y);
            assert!(clear > 0.9 * FRAC_1_PI, "{clear}");
            assert!((dim / clear / wanted - 1.0).abs() < 2e-3, "{view:?}: {} for {wanted}", dim / clear);
        }
    }
}

#[test]
fn the_world_above_water_is_in_snells_window_and_the_rest_mirrors_the_floor() {
    // The sun shines along the water onto a wall behind it: no light goes in, the floor is dark.
    let n = 1.33;
    let eye = DVec3::new(0.0, 0.5, 0.0);
    let mut scene = pool(glass(n), [1.0; 3], DVec3::X, eye, DVec3::new(0.8, 1.0, 0.0));
    place(&mut scene, "wall", quad(8.0), opaque([1.0; 3]), DVec3::ZERO);
    scene.objects[2].world_from_mesh =
        DMat4::from_translation(DVec3::new(2.0, 5.0, 0.0)) * DMat4::from_rotation_z(FRAC_PI_2);
    let picture = picture_of(&scene, [SIZE; 2], &one_sample(Method::Acm));
    let (mut window, mut mirrored) = (0, 0);
    for (_, ray, y) in rays(&scene.cameras[0], &picture) {
        let sine = (1.0 - ray.y * ray.y).sqrt();
        if ray.y < 0.05 || (n * sine - 1.0).abs() < 0.02 {
            continue;
        }
        if n * sine > 1.0 {
            assert_eq!(y, 0.0, "total reflection of a dark floor along {ray}");
            mirrored += 1;
            continue;
        }
        let cos_t = (1.0 - (n * sine).powi(2)).sqrt();
        let out = DVec3::new(n * ray.x, cos_t, n * ray.z);
        let surface = eye + 0.5 / ray.y * ray;
        let seen = surface + (2.0 - surface.x) / out.x * out;
        if out.x <= 0.0 || seen.y > 8.8 || seen.z.abs() > 3.8 || !is_shown(&scene.cameras[0], seen) {
            continue;
        }
        let (s, p) = ((n * ray.y - cos_t) / (n * ray.y + cos_t), (ray.y - n * cos_t) / (ray.y + n * cos_t));
        let wanted = n * n * (1.0 - 0.5 * (s * s + p * p)) * FRAC_1_PI;
        assert!((y / wanted - 1.0).abs() < 2e-3, "{y} for {wanted} along {ray}, at {seen}");
        window += 1;
    }
    assert!(window > 100 && mirrored > 100, "{window} in the window, {mirrored} beside it");
}
