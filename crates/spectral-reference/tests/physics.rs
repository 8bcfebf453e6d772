//! Light through simple bodies against closed forms.

mod stage;

use std::f64::consts::{FRAC_PI_3, PI};

use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_scene::{Attenuation, LightShape, Mesh, Scene};
use stage::*;

/// A plate that is the whole sky of the receiver below it, lit at an angle of up to 60 degrees; so long that what its far end
/// throws back comes down beyond the receiver.
fn slab(angle: f64, material: spectral_scene::Material) -> (Scene, usize) {
    let mut stage = Stage::new();
    let floor = stage.floor([0.4 * angle.tan(), 0.0], 0.5, 0.0);
    stage.add(cube(), material, placed([0.6, 0.4, 0.0], [1.4, 0.05, 0.7]));
    stage.sun([angle.sin(), -angle.cos(), 0.0]);
    (stage.0, floor)
}

/// T (1 + R^2) T: straight through, and once more after two reflections inside. A third reflection inside goes up
/// again, so three bounces add nothing to two.
#[test]
fn a_plane_parallel_plate_transmits_the_two_interface_series() {
    for degrees in [0.0_f64, 60.0] {
        let (scene, floor) = slab(degrees.to_radians(), glass(1.5));
        let cos_i = degrees.to_radians().cos();
        let r = fresnel(cos_i, 1.5);
        for (bounces, series) in [(0, 1.0), (1, 1.0), (3, 1.0 + r * r)] {
            let bake =
                baked(&scene, floor, &spectral_reference::BakeSettings { bounces, ..settings(8, 400_000) });
            let expected = cos_i * (1.0 - r).powi(2) * series;
            assert_close(mean(&bake.refracted, 1), expected, 1e-3, &format!("{degrees} degrees, {bounces}"));
            assert_eq!(mean(&bake.direct, 1), 0.0);
            assert_eq!(mean(&bake.reflected, 1), 0.0);
        }
    }
}

/// The plate again, now coloured: Beer and Lambert's law over the refracted way, at single wavelengths.
#[test]
fn absorption_follows_the_refracted_way() {
    let (n, angle) = (1.5, 0.9_f64);
    let attenuation = Attenuation { color: [0.5; 3], distance_m: 0.1 };
    let (scene, floor) = slab(angle, spectral_scene::Material { attenuation: Some(attenuation), ..glass(n) });
    let bake = baked(&scene, floor, &settings(8, 400_000));
    let r = fresnel(angle.cos(), n);
    let cos_t = (1.0 - (angle.sin() / n).powi(2)).sqrt();
    let through = 0.5_f64.powf(0.1 / cos_t / 0.1);
    let expected = angle.cos() * (1.0 - r).powi(2) * through * (1.0 + (r * through).powi(2));
    assert_close(mean(&bake.refracted, 1), expected, 1e-3, "grey glass");
    let absorbed = bake.ledger.total().absorbed / bake.ledger.total().emitted;
    assert!(absorbed > 0.3 && absorbed < 0.6, "{absorbed}");
}

/// A coloured plate filters like the colour's own spectrum does.
#[test]
fn coloured_glass_has_the_attenuation_colour_after_its_distance() {
    let color = [0.8, 0.3, 0.1];
    let attenuation = Attenuation { color, distance_m: 0.1 };
    let material = spectral_scene::Material { attenuation: Some(attenuation), ..glass(1.0) };
    let (mut scene, floor) = slab(0.0, material);
    scene.lights[0].spectrum = LightSpectrum::default();
    let bake = baked(&scene, floor, &settings(8, 100_000));
    let expected = spectral_core::rgb::xyz_from_linear_srgb(color);
    for (c, expected) in expected.into_iter().enumerate() {
        assert_close(mean(&bake.refracted, c), expected, 2e-3, &format!("channel {c}"));
    }
}

/// A surface's own share and colour act at each passage.
#[test]
fn a_tinted_surface_takes_its_share_twice() {
    let material = spectral_scene::Material { transmission: 0.5, base_color: [0.6; 3], ..glass(1.0) };
    let (scene, floor) = slab(0.0, material);
    let bake = baked(&scene, floor, &settings(8, 100_000));
    assert_close(mean(&bake.refracted, 1), 0.3 * 0.3, 1e-3, "two passages");
}

/// An equilateral prism of side 1 along z, its refracting edge at the top.
fn prism() -> Mesh {
    let section = [[-0.5, 0.0], [0.5, 0.0], [0.0, FRAC_PI_3.sin()]];
    let corner = |z: f64| section.map(|[x, y]| [x as f32, (y - 0.3) as f32, z as f32]);
    let triangles =
        vec![[3, 4, 5], [0, 2, 1], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
    let positions = [corner(-0.5), corner(0.5)].concat();
    Mesh { name: "prism".into(), positions, triangles, ..Mesh::default() }
}

/// Mean position of the light on a receiver that faces back along `towards`, at a distance from the origin.
fn spot(scene: &Scene, towards: DVec3, distance: f64) -> DVec3 {
    let mut scene = scene.clone();
    let (u, v) = (DVec3::Z, towards.cross(DVec3::Z).normalize());
    let half = 3.0;
    let centre = towards * distance;
    let mut stage = Stage(std::mem::take(&mut scene));
    let receiver = stage.add(square(), matte(), panel(centre, u, -towards, half));
    let n = 256;
    let refracted =
        spectral_reference::BakeSettings { bounces: 0, direct_samples: 1, ..settings(n, 100_000) };
    let bake = baked(&stage.0, receiver, &refracted);
    let mut sum = DVec3::ZERO;
    let mut total = 0.0;
    for (texel, xyz) in bake.refracted.iter().enumerate() {
        let at = |k: usize| 2.0 * (k as f64 + 0.5) / f64::from(n) - 1.0;
        let (i, j) = (texel % n as usize, texel / n as usize);
        sum += (centre + (u * at(i) + v * at(j)) * half) * xyz[1];
        total += xyz[1];
    }
    assert!(total > 0.0);
    sum / total
}

/// delta_min = 2 asin(n sin(A / 2)) - A, for three wavelengths of one dispersive prism, each at its own minimum; and
/// five degrees off the minimum the deviation is what Snell's law gives.
#[test]
fn a_prism_deviates_as_theory_says() {
    let dispersion = Dispersion::Cauchy { a: 1.7, b_um2: 0.02, c_um4: 0.0 };
    for lambda_nm in [450.0, 680.0] {
        let n = dispersion.ior(lambda_nm);
        let minimum = (n * 0.5).asin();
        for incidence in [minimum, minimum + 5_f64.to_radians()] {
            let inside = FRAC_PI_3 - (incidence.sin() / n).asin();
            let deviation = incidence + (n * inside.sin()).asin() - FRAC_PI_3;
            if incidence == minimum {
                assert_close(deviation, 2.0 * minimum - FRAC_PI_3, 1e-12, "closed forms");
            }
            // The entrance face looks to the upper left; light bends towards the base.
            let entrance = DVec3::new(-FRAC_PI_3.sin(), 0.5, 0.0);
            let direction = DMat4::from_rotation_z(incidence).transform_vector3(-entrance);
            let expected = DMat4::from_rotation_z(-deviation).transform_vector3(direction);
            let mut stage = Stage::new();
            stage.add(
                prism(),
                spectral_scene::Material { dispersion: dispersion.clone(), ..glass(1.0) },
                DMat4::IDENTITY,
            );
            stage.sun(direction.to_array());
            stage.0.lights[0].spectrum = LightSpectrum::line(lambda_nm).unwrap();
            let (near, far) = (spot(&stage.0, expected, 4.0), spot(&stage.0, expected, 12.0));
            let found = (far - near).normalize();
            let off = found.angle_between(expected);
            assert!(off < 2e-4, "{lambda_nm} nm, incidence {incidence}: off by {off} rad");
        }
    }
}

/// A ball lens brings a thin pencil to a point n R / (2 (n - 1)) behind its centre: the radius of the pencil on a
/// screen at distance z is a |1 - z / f|.
#[test]
fn a_sphere_focuses_where_theory_says() {
    let (n, aperture) = (1.5, 0.04);
    let focal = n / (2.0 * (n - 1.0));
    let radius = |z: f64| {
        let mut stage = Stage::new();
        let half = 0.05;
        let screen = stage.floor([0.0, 0.0], half, -z);
        // Of the sphere, what is behind the stop: photons start over a lens that they go through.
        stage.add(ball_lens(2.0 * aperture), glass(n), DMat4::IDENTITY);
        stage.add(stop(aperture), matte(), DMat4::from_translation(DVec3::Y * 1.5));
        stage.sun([0.0, -1.0, 0.0]);
        let size = 128;
        let bake = baked(
            &stage.0,
            screen,
            &spectral_reference::BakeSettings { bounces: 0, direct_samples: 1, ..settings(size, 200_000) },
        );
        let at = |k: u32| half * (2.0 * (f64::from(k) + 0.5) / f64::from(size) - 1.0);
        let (mut second, mut total) = (0.0, 0.0);
        for (texel, xyz) in bake.refracted.iter().enumerate() {
            let (x, z) = (at(texel as u32 % size), at(texel as u32 / size));
            second += (x * x + z * z) * xyz[1];
            total += xyz[1];
        }
        let r = fresnel(1.0, n);
        assert_close(
            total * (2.0 * half / f64::from(size)).powi(2),
            4.0 * aperture.powi(2) * (1.0 - r).powi(2),
            0.01,
            "flux",
        );
        (second / total).sqrt()
    };
    // The square stop's second moment: 2/3 of its half side squared.
    let full = aperture * (2.0_f64 / 3.0).sqrt();
    for z in [1.05, 1.25] {
        assert_close(radius(z), full * (1.0 - z / focal), 0.01, &format!("screen at {z}"));
    }
    // What is left is a texel's width and some spherical aberration.
    assert!(radius(focal) < 0.03 * full, "{}", radius(focal) / full);
}

/// The unit sphere, smooth, ground down to a rod along y of this half side, whose ends are the sphere's.
fn ball_lens(half: f64) -> Mesh {
    let n = 24;
    let mut mesh = Mesh { name: "ball lens".into(), ..Mesh::default() };
    let at = |i: u32| half * (2.0 * f64::from(i) / f64::from(n) - 1.0);
    for side in [1.0, -1.0] {
        for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
            let [x, z] = [at(i), at(j)];
            let p = [x, side * (1.0 - x * x - z * z).sqrt(), z].map(|v| v as f32);
            mesh.positions.push(p);
            mesh.normals.push(p);
        }
    }
    let below = (n + 1).pow(2);
    let index = |i: u32, j: u32| i * (n + 1) + j;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        mesh.triangles.extend([[a, c, b], [a, d, c]].map(|t| t.map(|v| v + below)));
    }
    // Round the rim, from above with the rod to the left.
    let rim = (0..n).map(|k| index(0, k)).chain((0..n).map(|k| index(k, n)));
    let rim: Vec<u32> =
        rim.chain((0..n).map(|k| index(n, n - k))).chain((0..n).map(|k| index(n - k, 0))).collect();
    for (k, &a) in rim.iter().enumerate() {
        let b = rim[(k + 1) % rim.len()];
        mesh.triangles.extend([[a, a + below, b + below], [a, b + below, b]]);
    }
    mesh
}

/// An opaque plate of half side 2 with a square hole of half side `a`.
fn stop(a: f64) -> Mesh {
    let ring = |h: f64| [[-h, -h], [-h, h], [h, h], [h, -h]].map(|[x, z]| [x as f32, 0.0, z as f32]);
    let triangles = (0..4).flat_map(|k| {
        let next = (k + 1) % 4;
        [[k, next, next + 4], [k, next + 4, k + 4]]
    });
    let positions = [ring(2.0), ring(a)].concat();
    Mesh { name: "stop".into(), positions, triangles: triangles.collect(), ..Mesh::default() }
}

/// A flat water surface: one interface, then the volume down to the floor.
#[test]
fn an_open_surface_is_one_interface() {
    let (n, angle, depth) = (1.33, 0.7_f64, 0.5);
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 0.5, 0.0);
    let attenuation = Some(Attenuation { color: [0.6; 3], distance_m: 1.0 });
    let water = spectral_scene::Material { attenuation, ..glass(n) };
    stage.add(square(), water, placed([0.0, depth, 0.0], [2.0, 1.0, 2.0]));
    stage.sun([angle.sin(), -angle.cos(), 0.0]);
    let bake = baked(&stage.0, floor, &settings(8, 400_000));
    assert_eq!(bake.geometry.open_refractors, 1);
    let cos_t = (1.0 - (angle.sin() / n).powi(2)).sqrt();
    let expected = angle.cos() * (1.0 - fresnel(angle.cos(), n)) * 0.6_f64.powf(depth / cos_t);
    assert_close(mean(&bake.refracted, 1), expected, 1e-3, "water");
    assert_eq!(mean(&bake.direct, 1), 0.0);
}

/// A point light in the middle of a glass ball: normal incidence everywhere, so each number of reflections adds its
/// R^k to the same directions.
#[test]
fn a_light_inside_glass_shines_out() {
    let n = 1.8;
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 2.0, -2.0);
    stage.add(sphere(24), glass(n), DMat4::IDENTITY);
    stage.light(LightShape::Point { position_m: DVec3::ZERO, range_m: None }, 1.0);
    let bake = baked(&stage.0, floor, &settings(8, 400_000));
    let r = fresnel(1.0, n);
    let series = (1.0 - r) * (1.0 + r + r * r + r.powi(3));
    let bare = {
        stage.0.objects.remove(1);
        mean(&baked(&stage.0, floor, &settings(8, 1)).direct, 1)
    };
    assert_close(mean(&bake.refracted, 1), bare * series, 2e-3, "glass ball");
    assert_eq!(mean(&bake.direct, 1), 0.0);
}

/// Inverse square law, cosine and the spot's smooth edge.
#[test]
fn direct_light_follows_the_punctual_formulas() {
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 0.01, 0.0);
    let position_m = DVec3::new(3.0, 4.0, 0.0);
    stage.light(LightShape::Point { position_m, range_m: None }, 50.0);
    assert_close(mean(&baked(&stage.0, floor, &settings(1, 1)).direct, 1), 50.0 / 25.0 * 0.8, 1e-4, "point");
    stage.0.lights[0].shape = LightShape::Point { position_m, range_m: Some(4.9) };
    assert_eq!(mean(&baked(&stage.0, floor, &settings(1, 1)).direct, 1), 0.0);
    let (inner_cone_rad, outer_cone_rad) = (0.2_f64, 0.5_f64);
    let off = 0.35_f64;
    let direction = DMat4::from_rotation_z(off).transform_vector3(-position_m.normalize());
    stage.0.lights[0].shape =
        LightShape::Spot { position_m, direction, inner_cone_rad, outer_cone_rad, range_m: None };
    let edge = (off.cos() - outer_cone_rad.cos()) / (inner_cone_rad.cos() - outer_cone_rad.cos());
    let expected = 50.0 / 25.0 * 0.8 * edge * edge;
    assert_close(mean(&baked(&stage.0, floor, &settings(1, 1)).direct, 1), expected, 1e-3, "spot");
}

/// Light from a point through a ball of index 1 is all there, and so is a spot's.
#[test]
fn punctual_lights_send_the_flux_that_is_missing_behind_the_glass() {
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 1.0, 0.0);
    stage.add(sphere(24), glass(1.0), placed([0.1, 0.5, 0.0], [0.2; 3]));
    let position_m = DVec3::new(0.3, 1.5, 0.2);
    let spot = LightShape::Spot {
        position_m,
        direction: -position_m.normalize(),
        inner_cone_rad: 0.1,
        outer_cone_rad: 0.6,
        range_m: None,
    };
    for shape in [LightShape::Point { position_m, range_m: None }, spot] {
        stage.0.lights.clear();
        stage.light(shape, 10.0);
        let with = baked(&stage.0, floor, &settings(32, 1_000_000));
        let bare = Scene { objects: stage.0.objects[..1].to_vec(), ..stage.0.clone() };
        let without = baked(&bare, floor, &settings(32, 1));
        let total = mean(&with.direct, 1) + mean(&with.refracted, 1);
        assert!(mean(&with.refracted, 1) > 0.05 * total);
        assert_close(total, mean(&without.direct, 1), 5e-4, "flux");
    }
}

/// The ball of a cubic metre's light: what is emitted at the bounds and meets the ball is its cross-section.
#[test]
fn the_flux_that_meets_a_sphere_is_its_cross_section() {
    let mut stage = Stage::new();
    let floor = stage.floor([0.0, 0.0], 1.0, -2.0);
    stage.add(sphere(40), glass(1.5), DMat4::IDENTITY);
    stage.sun([0.3, -1.0, 0.2]);
    let total = baked(&stage.0, floor, &settings(8, 400_000)).ledger.total();
    // The mesh lies inside the sphere.
    assert_close(total.emitted - total.passed, PI, 1e-3, "cross-section");
    assert!(total.wrong_side / total.emitted < 1e-3);
}
