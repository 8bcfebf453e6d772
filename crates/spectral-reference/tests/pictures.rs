//! Camera pictures against closed forms.

mod stage;

use std::f64::consts::PI;

use glam::{DMat4, DVec3};
use spectral_core::light::LightSpectrum;
use spectral_core::rgb::xyz_from_linear_srgb;
use spectral_core::upsample::SmoothSpectrum;
use spectral_reference::{Picture, ReferenceError, RenderSettings, render};
use spectral_scene::{Attenuation, Camera, LightShape, Material, Mesh, Scene};
use stage::*;

/// A camera at (x, 3, z) that looks straight down, +x to the right and -z up, at a square of half side 0.5 on y = 0.
fn camera(x: f64, z: f64) -> Camera {
    let down = DMat4::from_rotation_x(-PI / 2.0);
    Camera {
        name: "camera".into(),
        world_from_camera: DMat4::from_translation(DVec3::new(x, 3.0, z)) * down,
        yfov_rad: 2.0 * (0.5_f64 / 3.0).atan(),
        znear_m: 0.01,
    }
}

fn request(photons: u64) -> RenderSettings {
    RenderSettings { size: [24, 24], photons, bake_size: [32, 32], step_nm: 5.0, ..RenderSettings::default() }
}

fn pictured(scene: &Scene, settings: &RenderSettings) -> Picture {
    let picture = render(scene, settings, &|_| ()).expect("the scene is valid");
    assert_eq!(picture.xyz.len(), (settings.size[0] * settings.size[1]) as usize);
    assert!(picture.xyz.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    picture
}

fn average(picture: &Picture, channel: usize) -> f64 {
    picture.xyz.iter().map(|xyz| f64::from(xyz[channel])).sum::<f64>() / picture.xyz.len() as f64
}

/// L = rho E / pi, in the colour that the wall has under white light.
#[test]
fn a_wall_in_plain_light_has_its_luminance_and_colour() {
    let color = [0.63, 0.2, 0.05];
    let mut stage = Stage::new();
    let wall = Material { base_color: color, ..matte() };
    stage.add(square(), wall, DMat4::IDENTITY);
    stage.sun([0.6, -0.8, 0.0]);
    stage.0.lights[0].intensity = 500.0;
    stage.0.lights[0].spectrum = LightSpectrum::default();
    stage.0.cameras.push(camera(0.0, 0.0));
    let picture = pictured(&stage.0, &request(1));
    for (c, xyz) in xyz_from_linear_srgb(color).into_iter().enumerate() {
        assert_close(average(&picture, c), 0.8 * 500.0 * xyz / PI, 2e-3, &format!("channel {c}"));
    }
}

/// A mirror shows what an eye on its other side would see without it, at each wavelength's share.
#[test]
fn mirrors_show_what_they_reflect() {
    let copper = [0.95, 0.64, 0.54];
    let f0 = |nm: f64| SmoothSpectrum::reflectance(copper).at(nm);
    for lambda_nm in [460.0, 620.0] {
        // A lit ceiling above the eye, seen in the floor; the sun comes from below, beside the floor.
        let mut stage = Stage::new();
        stage.add(square(), metal(copper), placed([0.0; 3], [0.6; 3]));
        stage.add(square(), matte(), panel(DVec3::Y * 4.0, DVec3::X, DVec3::NEG_Y, 3.0));
        stage.light(
            LightShape::Spot {
                position_m: DVec3::new(0.0, 2.0, 9.0),
                direction: DVec3::new(0.0, 2.0, -9.0).normalize(),
                inner_cone_rad: 0.3,
                outer_cone_rad: 0.4,
                range_m: None,
            },
            1000.0,
        );
        stage.0.lights[0].spectrum = LightSpectrum::line(lambda_nm).unwrap();
        stage.0.cameras.push(camera(0.0, 0.0));
        let mirrored = pictured(&stage.0, &request(1));
        // The same eye turned round, as far behind the mirror as it was before it, without the mirror.
        stage.0.objects.remove(0);
        let from_below = DMat4::from_translation(DVec3::Y * -3.0) * DMat4::from_rotation_x(PI / 2.0);
        stage.0.cameras[0].world_from_camera = from_below;
        let plain = pictured(&stage.0, &request(1));
        let [width, height] = [24, 24];
        for pixel in 0..width * height {
            let (column, row) = (pixel % width, pixel / width);
            let seen = f64::from(mirrored.xyz[pixel][1]);
            // A mirror turns one axis round.
            let expected = f0(lambda_nm) * f64::from(plain.xyz[(height - 1 - row) * width + column][1]);
            assert!(expected > 0.0, "lit");
            assert!(
                (seen / expected - 1.0).abs() < 0.02,
                "{lambda_nm} nm, {column} {row}: {seen}, {expected}"
            );
        }
    }
}

/// An eye in water sees the floor through the water between, and what is outside with the square of the index.
#[test]
fn an_eye_under_water_sees_the_radiance_in_water() {
    let (n, kept) = (1.33, 0.6_f64);
    let reflected = ((n - 1.0) / (n + 1.0_f64)).powi(2);
    let water =
        || Material { attenuation: Some(Attenuation { color: [kept; 3], distance_m: 1.0 }), ..glass(n) };
    // The eye is 3 m above the floor, 2 m below the surface; the sun stands in the zenith.
    let mut stage = Stage::new();
    stage.floor([0.0, 0.0], 2.0, 0.0);
    stage.add(square(), water(), placed([0.0, 5.0, 0.0], [4.0; 3]));
    stage.sun([0.0, -1.0, 0.0]);
    stage.0.cameras.push(camera(0.0, 0.0));
    let picture = pictured(&stage.0, &RenderSettings { bake_size: [8, 8], ..request(400_000) });
    let illuminance = (1.0 - reflected) * kept.powi(5);
    // The middle is nearest: rays to the corners are longer by 2.7 %.
    let middle = f64::from(picture.xyz[12 * 24 + 12][1]);
    assert_close(middle, illuminance / PI * kept.powi(3), 1e-2, "the floor through 3 m of water");

    // Looking up, through 2 m of water, at a ceiling in plain light.
    let mut stage = Stage::new();
    stage.add(square(), matte(), panel(DVec3::Y * 8.0, DVec3::X, DVec3::NEG_Y, 1.0));
    stage.add(square(), water(), placed([0.0, 5.0, 0.0], [2.0; 3]));
    let spot_m = DVec3::new(0.0, 7.0, 5.0);
    stage.light(
        LightShape::Spot {
            position_m: spot_m,
            direction: (DVec3::Y * 8.0 - spot_m).normalize(),
            inner_cone_rad: 0.05,
            outer_cone_rad: 0.1,
            range_m: None,
        },
        100.0,
    );
    let up = DMat4::from_translation(DVec3::Y * 3.0) * DMat4::from_rotation_x(PI / 2.0);
    stage.0.cameras.push(Camera { world_from_camera: up, yfov_rad: 0.01, ..camera(0.0, 0.0) });
    let picture = pictured(&stage.0, &request(100_000));
    let squared = spot_m.distance_squared(DVec3::Y * 8.0);
    let illuminance = 100.0 / squared * (1.0 / squared.sqrt());
    let expected = illuminance / PI * (1.0 - reflected) * n * n * kept.powi(2);
    assert_close(average(&picture, 1), expected, 1e-2, "the ceiling through 2 m of water");
}

/// Row 0 is the top, column 0 the left.
#[test]
fn pixels_are_where_they_should_be() {
    let mut stage = Stage::new();
    // The quarter with x > 0 and z < 0: right and up in the picture.
    stage.add(square(), matte(), placed([0.25, 0.0, -0.25], [0.25; 3]));
    stage.sun([0.0, -1.0, 0.0]);
    stage.0.cameras.push(camera(0.0, 0.0));
    let settings = RenderSettings { size: [40, 20], ..request(1) };
    let picture = pictured(&stage.0, &settings);
    for (pixel, xyz) in picture.xyz.iter().enumerate() {
        let (column, row) = (pixel % 40, pixel / 40);
        // The height spans 1 m, the width 2 m.
        let lit = row < 10 && (20..30).contains(&column);
        let expected = if lit { 1.0 / PI } else { 0.0 };
        assert!((f64::from(xyz[1]) - expected).abs() < 1e-6, "row {row} column {column}: {xyz:?}");
    }
}

/// Straight down through still water: the floor's radiance loses the surface's reflection, the volume's absorption,
/// and 1 / n^2 on its way into the air.
#[test]
fn radiance_leaves_water_by_the_n_squared_law() {
    let (n, depth) = (1.33, 0.5);
    let mut stage = Stage::new();
    stage.floor([0.0, 0.0], 1.0, 0.0);
    let attenuation = Some(Attenuation { color: [0.6; 3], distance_m: 1.0 });
    stage.add(square(), Material { attenuation, ..glass(n) }, placed([0.0, depth, 0.0], [1.2, 1.0, 1.2]));
    stage.sun([0.0, -1.0, 0.0]);
    stage.0.cameras.push(camera(0.0, 0.0));
    let picture = pictured(&stage.0, &request(400_000));
    let once = (1.0 - fresnel(1.0, n)) * 0.6_f64.powf(depth);
    // Across the picture the way is up to 2 % longer than straight down.
    assert_close(average(&picture, 1), once * once / (n * n) / PI, 1e-2, "floor under water");
}

/// A ball of index 1 in front of the camera and in the light changes nothing.
#[test]
fn index_one_is_invisible() {
    let scene = |balls: bool| {
        let mut stage = Stage::new();
        stage.floor([0.0, 0.0], 1.0, 0.0);
        stage.sun([0.2, -1.0, 0.0]);
        stage.0.cameras.push(camera(0.1, 0.05));
        if balls {
            stage.add(sphere(16), glass(1.0), placed([0.0, 0.5, 0.0], [0.2; 3]));
            stage.add(cube(), glass(1.0), placed([0.1, 0.8, 0.05], [0.1; 3]));
        }
        stage.0
    };
    let (with, without) = (pictured(&scene(true), &request(600_000)), pictured(&scene(false), &request(1)));
    assert_close(average(&with, 1), average(&without, 1), 3e-3, "mean luminance");
    let inner = |p: &Picture| f64::from(p.xyz[12 * 24 + 12][1]);
    assert_close(inner(&with), inner(&without), 0.05, "behind the glass");
}

/// A mirror image in glass: at normal incidence a plate reflects 2 R / (1 + R) in all; with no reflection inside R.
#[test]
fn glass_reflects_what_is_behind_the_camera() {
    let n = 1.5;
    let mut stage = Stage::new();
    // A bright ceiling, lit from below, above a camera that looks down at a plate.
    let upside_down = DMat4::from_translation(DVec3::Y * 5.0)
        * DMat4::from_rotation_x(PI)
        * DMat4::from_scale(DVec3::splat(9.0));
    stage.add(square(), matte(), upside_down);
    stage.sun([0.6, 0.8, 0.0]);
    stage.add(cube(), glass(n), placed([0.0, 0.0, 0.0], [4.0, 0.05, 4.0]));
    stage.0.cameras.push(camera(0.0, 0.0));
    // Direct light alone: the plate's shadow on the ceiling would be another subject.
    stage.0.lights[0].shape =
        spectral_scene::LightShape::Point { position_m: DVec3::new(0.0, 2.0, 0.0), range_m: None };
    let r = fresnel(1.0, n);
    let seen = |bounces: u32| {
        let picture = pictured(&stage.0, &RenderSettings { bounces, ..request(1) });
        f64::from(picture.xyz[12 * 24 + 12][1])
    };
    let ceiling = {
        let mut up = stage.0.clone();
        up.cameras[0].world_from_camera *= DMat4::from_rotation_x(PI);
        f64::from(pictured(&up, &request(1)).xyz[12 * 24 + 12][1])
    };
    assert!(ceiling > 0.0);
    // The image lies 6 m behind: the middle pixel sees nearly the same spot of the ceiling, twice over.
    assert_close(seen(0), ceiling * r, 0.03, "front");
    assert_close(seen(3) - seen(0), ceiling * r * (1.0 - r).powi(2) * (1.0 + r * r), 0.03, "back");
}

#[test]
fn threads_do_not_change_a_bit() {
    let mut stage = Stage::new();
    stage.floor([0.0, 0.0], 1.0, 0.0);
    stage.add(sphere(8), glass(1.5), placed([0.0, 0.5, 0.0], [0.2; 3]));
    stage.sun([0.2, -1.0, 0.0]);
    stage.0.cameras.push(camera(0.0, 0.0));
    let with = |threads| pictured(&stage.0, &RenderSettings { threads: Some(threads), ..request(20_000) });
    assert_eq!(with(1), with(3));
}

#[test]
fn a_scene_without_anything_is_black_and_without_a_camera_an_error() {
    let mut stage = Stage::new();
    let error = render(&stage.0, &request(1), &|_| ()).unwrap_err();
    assert!(matches!(error, ReferenceError::NoCamera), "{error}");
    stage.0.cameras.push(camera(0.0, 0.0));
    assert_eq!(average(&pictured(&stage.0, &request(1)), 1), 0.0);
    let wrong = RenderSettings { samples_per_pixel: 0, ..request(1) };
    let error = render(&stage.0, &wrong, &|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "samples_per_pixel is 0; it must be at least 1");
}

/// What becomes of a mesh's texture coordinates.
type Change<'a> = &'a dyn Fn(&mut Vec<[f32; 2]>);

/// A ball's light on a floor, with and without texture coordinates, and with ones that put everything
/// in one place: the same picture, in the mean and in every pixel.
#[test]
fn caustics_need_no_texture_coordinates() {
    let stage = |change: Change| {
        let mut stage = Stage::new();
        stage.floor([0.0, 0.0], 1.0, 0.0);
        stage.add(sphere(16), glass(1.5), placed([0.1, 0.5, 0.0], [0.3; 3]));
        stage.sun([0.3, -1.0, 0.1]);
        stage.0.cameras.push(camera(0.15, 0.0));
        change(&mut stage.0.meshes[0].uvs);
        stage.0
    };
    let request = |seed| RenderSettings {
        size: [16, 16],
        samples_per_pixel: 64,
        bake_size: [128, 128],
        seed,
        ..request(1_000_000)
    };
    let with = pictured(&stage(&|_| ()), &request(1));
    let difference = |other: &Picture| {
        let pairs = || with.xyz.iter().zip(&other.xyz).map(|(a, b)| [a[1], b[1]].map(f64::from));
        let largest = pairs().map(|[a, b]| (a - b).abs()).fold(0.0, f64::max);
        largest / pairs().map(|[a, _]| a).fold(0.0, f64::max)
    };
    // Direct light alone gives no pixel more than this.
    let direct = 1.0 / PI;
    assert!(with.xyz.iter().any(|xyz| f64::from(xyz[1]) > 2.0 * direct), "there is a caustic");
    let again = pictured(&stage(&|_| ()), &request(2));
    assert_close(average(&again, 1), average(&with, 1), 5e-3, "noise of the mean");
    let changes: [Change; 4] = [
        &Vec::clear,
        &|uvs| uvs.iter_mut().for_each(|uv| *uv = [0.5; 2]),
        &|uvs| uvs.iter_mut().for_each(|uv| *uv = uv.map(|c| 3.0 * c)),
        // Both halves of the floor in one place.
        &|uvs| uvs[3] = uvs[1],
    ];
    for (k, change) in changes.into_iter().enumerate() {
        let without = pictured(&stage(change), &request(1));
        assert_close(average(&without, 1), average(&with, 1), 5e-3, &format!("mean of {k}"));
        let (largest, noise) = (difference(&without), difference(&again));
        // The same photons on other texels: nearer than other photons on the same.
        assert!(largest < 0.03 && largest < noise, "{k}: {largest}, between seeds {noise}");
    }
}

/// Facets far smaller and far longer than a texel keep all of their light.
#[test]
fn every_facet_of_a_mesh_without_texture_coordinates_is_lit() {
    let strips = |count: u32| Mesh {
        name: "strips".into(),
        positions: (0..=count)
            .flat_map(|i| {
                let x = 2.0 * i as f32 / count as f32 - 1.0;
                [[x, 0.0, -1.0], [x, 0.0, 1.0]]
            })
            .collect(),
        triangles: (0..2 * count).step_by(2).flat_map(|a| [[a, a + 1, a + 3], [a, a + 3, a + 2]]).collect(),
        ..Mesh::default()
    };
    let mean = |count| {
        let mut stage = Stage::new();
        stage.add(strips(count), matte(), DMat4::IDENTITY);
        stage.add(cube(), glass(1.5), placed([0.0, 0.6, 0.0], [0.3, 0.1, 0.3]));
        stage.sun([0.2, -1.0, 0.0]);
        stage.0.cameras.push(camera(0.0, 0.0));
        average(&pictured(&stage.0, &RenderSettings { bake_size: [128, 128], ..request(400_000) }), 1)
    };
    // Half of the light comes through the glass; texels of other shapes blur its edges differently.
    assert_close(mean(3000), mean(1), 1e-2, "3000 strips");
}
