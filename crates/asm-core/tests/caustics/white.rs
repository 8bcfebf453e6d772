//! Light that should pass unchanged does: white stays white, clear glass follows Fresnel.

use asm_core::{Method, Settings, Splat};
use glam::DVec3;
use spectral_core::dispersion::Dispersion;
use spectral_scene::{LightShape, Material};

use crate::stage::*;

/// Share of light that one interface reflects at `cos_i`, from the textbook.
fn reflectance(cos_i: f64, n: f64) -> f64 {
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (n * n)).sqrt();
    let r_s = (cos_i - n * cos_t) / (cos_i + n * cos_t);
    let r_p = (n * cos_i - cos_t) / (n * cos_i + cos_t);
    0.5 * (r_s * r_s + r_p * r_p)
}

#[test]
fn a_plate_without_contrast_leaves_exactly_the_direct_light() {
    // One photon per texel of the map, so nothing but rounding remains: seven weights rounded to 2^-31 and f32 in the resolve.
    let scene = plate_over_floor(glass(1.0), 1.0, sun(DVec3::NEG_Y));
    let settings = Settings { prune: false, ..aligned(128) };
    let (maps, statistics) = bake(&scene, 32, &settings);
    assert_eq!(statistics.lights[0].ledgers.len(), 7);
    assert_eq!(total(&maps.direct), [0.0; 3]);
    for texel in &maps.refracted {
        for c in 0..3 {
            assert!((f64::from(texel[c]) / D65[c] - 1.0).abs() < 5e-7, "{texel:?}");
        }
    }
}

#[test]
fn splats_keep_a_floor_that_is_lit_all_over_even_up_to_its_edges() {
    // The plate is wider than the floor, so light goes on beyond the floor's edges. Texels of the map as far apart as photons:
    // every texel gets the same taps, and what rounding leaves is that of the cumulative shares, 2^-24 each.
    for radius in [1, 2, 4] {
        let mut scene = plate_over_floor(glass(1.0), 1.5, sun(DVec3::NEG_Y));
        let settings = Settings {
            emission_size: 97,
            map_size: Some(64),
            splat: Splat::Gaussian { radius },
            prune: false,
            ..Settings::of(Method::CausticsMap)
        };
        // 1.5 / (97 - 0.98) is the photons' distance; the floor and its guard of radius + 1 texels get a map as fine.
        let used = 64.0 - 2.0 * (f64::from(radius) + 1.0) - 0.98;
        let side = 1.5 / (97.0 - 0.98) * used;
        scene.objects[0].world_from_mesh = glam::DMat4::from_scale(DVec3::new(side, 1.0, side));
        let (maps, statistics) = bake(&scene, 32, &settings);
        for texel in &maps.refracted {
            for c in 0..3 {
                assert!((f64::from(texel[c]) / D65[c] - 1.0).abs() < 2e-6, "radius {radius}: {texel:?}");
            }
        }
        assert!(
            statistics.lights[0]
                .ledgers
                .iter()
                .all(|l| l.beside.flux > 0 && l.beside.flux < l.outside_map.flux)
        );
    }
}

#[test]
fn edges_are_as_bright_as_the_middle_whatever_the_light_and_the_spacing() {
    // Slanting light draws the floor as a rhomboid whose edges run across the map's texels.
    for (direction, emission_size) in
        [(DVec3::NEG_Y, 200), (DVec3::new(0.3, -1.0, 0.2), 333), (DVec3::new(-0.5, -1.0, 0.7), 512)]
    {
        let mut scene = plate_over_floor(glass(1.0), 2.0, sun(direction));
        scene.objects[1].world_from_mesh = glam::DMat4::from_translation(DVec3::Y * 0.08);
        let settings = Settings { emission_size, ..Settings::of(Method::CausticsMap) };
        let (maps, _) = bake(&scene, 32, &settings);
        let cosine = -direction.normalize().y;
        let mean = |texels: &mut dyn Iterator<Item = usize>| {
            let (mut sum, mut count) = (0.0, 0.0);
            for i in texels {
                sum += f64::from(maps.refracted[i][1]);
                count += 1.0;
            }
            sum / count / cosine
        };
        let edge = |i: &usize| [i % 32, i / 32].iter().any(|c| [0, 31].contains(c));
        let edges = mean(&mut (0..1024).filter(edge));
        let middle = mean(&mut (0..1024).filter(|i| !edge(i)));
        assert!((edges - 1.0).abs() < 1e-3, "{direction} {emission_size}: edges {edges}");
        assert!((middle - 1.0).abs() < 1e-3, "{direction} {emission_size}: middle {middle}");
        // The photons' grid shows through the Gaussians.
        let unevenness =
            maps.refracted.iter().map(|t| (f64::from(t[1]) / cosine - 1.0).abs()).fold(0.0, f64::max);
        assert!(unevenness < 5e-3, "{direction} {emission_size}: {unevenness}");
    }
}

#[test]
fn texels_are_means_however_large() {
    // The map is finer than the bake: a few samples per texel would miss most of it.
    let scene = spectral_scene::bundled("gem").unwrap();
    let mean = |size: u32| {
        let settings = Settings { emission_size: 256, ..Settings::of(Method::CausticsMap) };
        let refracted = bake(&scene, size, &settings).0.refracted;
        total(&refracted)[1] / refracted.len() as f64
    };
    let fine = mean(256);
    // A single texel has samples for every fourth of the map's columns and rows only.
    for (size, bound) in [(1, 1e-2), (4, 2e-3), (32, 2e-3)] {
        assert!((mean(size) / fine - 1.0).abs() < bound, "{size}: {} {fine}", mean(size));
    }
}

#[test]
fn a_sphere_s_caustic_has_no_holes() {
    // Behind the focus light diverges. Photons land up to five texels of the map apart, where point splats leave holes; a
    // search for the exit that ends too early displaces whole facets' light.
    let scene = spectral_scene::bundled("sphere").unwrap();
    let holes = |splat, exit_iterations| {
        let settings = Settings { splat, exit_iterations, ..Settings::of(Method::CausticsMap) };
        let refracted = bake(&scene, 128, &settings).0.refracted;
        // The lit disc round the focus; a hole has less than half of the mean of what surrounds it.
        let y = |x: usize, z: usize| f64::from(refracted[z * 128 + x][1]);
        let disc = (4..124).flat_map(|z| (4..124).map(move |x| (x, z)));
        disc.filter(|&(x, z)| (x as f64 - 63.0).hypot(z as f64 - 63.0) < 50.0)
            .filter(|&(x, z)| {
                let around = (z - 3..=z + 3).flat_map(|z| (x - 3..=x + 3).map(move |x| (x, z)));
                y(x, z) < 0.5 * around.map(|(x, z)| y(x, z)).sum::<f64>() / 49.0
            })
            .count()
    };
    let iterations = Settings::of(Method::CausticsMap).exit_iterations;
    assert_eq!(holes(Splat::Auto, iterations), 0);
    let (point, early) = (holes(Splat::Point, iterations), holes(Splat::Auto, 2));
    assert!(point > 20 && early > 20, "{point} {early}");
}

#[test]
fn an_index_just_above_one_passes_all_but_its_fresnel_loss() {
    // ((n - 1) / (n + 1))^2 twice, 2.5e-13 at n - 1 = 1e-6: the direct light up to rounding, as with n = 1, and nothing is lost.
    for (n, loss) in [(1.0 + 1e-6, 0.0), (1.0001, 5e-9), (1.01, 2.0 * (0.01_f64 / 2.01).powi(2))] {
        let scene = plate_over_floor(glass(n), 1.0, sun(DVec3::NEG_Y));
        let (maps, statistics) = bake(&scene, 32, &aligned(128));
        for texel in &maps.refracted {
            let got = f64::from(texel[1]);
            assert!((got - (1.0 - loss)).abs() < 5e-7, "n {n}: {got}");
        }
        let ledgers = &statistics.lights[0].ledgers;
        assert!(ledgers.iter().all(|l| l.total_reflection.flux + l.wrong_side.flux + l.no_exit.flux == 0));
    }
}

#[test]
fn strong_dispersion_follows_fresnel_at_every_wavelength() {
    // V_d 10 (KHR_materials_dispersion 2), 55 and infinity: a plate across the light passes (1 - R(n))^2 of each line.
    for khr_dispersion in [2.0, 20.0 / 55.0, 0.0] {
        let dispersion = Dispersion::from_khr(1.6, khr_dispersion).unwrap();
        let mut material = glass(1.0);
        material.dispersion = dispersion.clone();
        let mut scene = plate_over_floor(material, 1.0, sun(DVec3::NEG_Y));
        for nm in [400.0, 486.13, 587.56, 700.0] {
            scene.lights[0].spectrum = spectral_core::light::LightSpectrum::line(nm).unwrap();
            let (maps, _) = bake(&scene, 16, &aligned(64));
            let n = dispersion.ior(nm);
            // Between the plate's surfaces light is reflected to and fro; caustics mapping follows the first way through.
            let wanted = (1.0 - ((n - 1.0) / (n + 1.0)).powi(2)).powi(2);
            for texel in &maps.refracted {
                let got = f64::from(texel[1]);
                assert!((got - wanted).abs() < 1e-6, "dispersion {khr_dispersion}, {nm} nm: {got} {wanted}");
            }
        }
    }
}

#[test]
fn clear_plates_follow_fresnel() {
    for (angle_deg, n) in [(0.0_f64, 1.5), (0.0, 2.4), (30.0, 1.5), (60.0, 1.33)] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let scene = plate_over_floor(glass(n), 1.0, sun(DVec3::new(sin, -cos, 0.0)));
        let (maps, _) =
            bake(&scene, 32, &Settings { emission_size: 512, ..Settings::of(Method::CausticsMap) });
        let wanted = (1.0 - reflectance(cos, n)).powi(2) * cos;
        // Middle of the plate's light: away from the rim, and for slanting light away from the plate's sides.
        let middle = |x: usize| (12..20).map(move |y| y * 32 + x);
        let mean = (14..18).flat_map(middle).map(|i| f64::from(maps.refracted[i][1])).sum::<f64>() / 32.0;
        assert!((mean / wanted - 1.0).abs() < 2e-3, "{angle_deg} degrees, n {n}: {mean}, wanted {wanted}");
    }
}

#[test]
fn more_photons_come_closer_to_a_clear_plate() {
    let scene = plate_over_floor(glass(1.5), 1.0, sun(DVec3::new(0.3, -1.0, 0.2)));
    let cosine = 1.0 / (1.0_f64 + 0.09 + 0.04).sqrt();
    let wanted = (1.0 - reflectance(cosine, 1.5)).powi(2) * cosine;
    let error = |emission_size: u32| {
        let settings = Settings {
            emission_size,
            map_size: Some(64),
            splat: Splat::Point,
            ..Settings::of(Method::CausticsMap)
        };
        let (maps, _) = bake(&scene, 32, &settings);
        let middle = (12..20).flat_map(|y| (12..20).map(move |x| y * 32 + x));
        (middle.map(|i| (f64::from(maps.refracted[i][1]) / wanted - 1.0).powi(2)).sum::<f64>() / 64.0).sqrt()
    };
    let errors = [100, 300, 900].map(error);
    assert!(errors[0] > 2.0 * errors[1] && errors[1] > 2.0 * errors[2], "{errors:?}");
    assert!(errors[2] < 0.03, "{errors:?}");
}

#[test]
fn equal_wavelengths_add_up_to_one() {
    let mut scene = spectral_scene::bundled("gem").unwrap();
    for material in &mut scene.materials {
        material.dispersion = Dispersion::Constant { n: material.dispersion.n_d() };
    }
    let settings = |wavelengths| Settings {
        wavelengths: Some(wavelengths),
        prune: false,
        emission_size: 128,
        ..Settings::of(Method::CausticsMap)
    };
    let (one, _) = bake(&scene, 64, &settings(1));
    for count in [7, 21] {
        let (many, statistics) = bake(&scene, 64, &settings(count));
        assert_eq!(statistics.lights[0].ledgers.len(), count as usize);
        assert_eq!(many.direct, one.direct);
        // A photon's deposit of each wavelength is rounded to 2^-30 of the strongest, its weight to 2^-31, its sum to f32.
        let largest = one.refracted.iter().flatten().copied().fold(0.0, f32::max);
        for (a, b) in many.refracted.iter().flatten().zip(one.refracted.iter().flatten()) {
            assert!((a - b).abs() <= 1e-6 * b + 1e-8 * largest, "{count}: {a} {b}");
        }
    }
}

#[test]
fn a_lamp_with_an_eye_shines_through_a_plate_without_contrast_as_if_it_were_not_there() {
    let position_m = DVec3::new(0.1, 0.9, -0.2);
    let shapes = [
        LightShape::Point { position_m, range_m: None },
        LightShape::Spot {
            position_m,
            direction: (DVec3::new(0.05, 0.0, 0.0) - position_m).normalize(),
            inner_cone_rad: 0.2,
            outer_cone_rad: 0.6,
            range_m: None,
        },
    ];
    for shape in shapes {
        let bare = |scene: &mut spectral_scene::Scene| drop(scene.objects.pop());
        let with_plate = plate_over_floor(glass(1.0), 0.4, light(shape, 2.0));
        let mut without = with_plate.clone();
        bare(&mut without);
        let settings = Settings { emission_size: 800, ..Settings::of(Method::CausticsMap) };
        let (a, _) = bake(&with_plate, 64, &settings);
        let (b, _) = bake(&without, 64, &settings);
        let sum: Vec<[f32; 3]> =
            a.direct.iter().zip(&a.refracted).map(|(d, r)| std::array::from_fn(|c| d[c] + r[c])).collect();
        for c in 0..3 {
            assert!(
                (total(&sum)[c] / total(&b.direct)[c] - 1.0).abs() < 1e-3,
                "{:?} {:?}",
                total(&sum),
                total(&b.direct)
            );
        }
        assert!(total(&a.refracted)[1] > 0.1 * total(&b.direct)[1]);
        assert!(relative_rms(&sum, &b.direct, 16) < 0.01, "{}", relative_rms(&sum, &b.direct, 16));
        // The light itself: candela over distance squared, by the cosine.
        if let LightShape::Point { .. } = shape {
            let to_texel = DVec3::new(0.5 / 64.0, 0.0, 0.5 / 64.0) - position_m;
            let wanted = 2.0 * position_m.y / to_texel.length().powi(3);
            let texel = b.direct[32 * 64 + 32];
            assert!((f64::from(texel[1]) / wanted - 1.0).abs() < 1e-3, "{texel:?} {wanted}");
        }
    }
}

#[test]
fn absorption_is_beer_lambert() {
    let color = [0.5, 0.25, 0.125];
    let material = tinted(1.0, color, 0.05);
    let scene = plate_over_floor(material, 1.0, sun(DVec3::NEG_Y));
    let (maps, statistics) = bake(&scene, 16, &aligned(64));
    // 0.1 of glass is twice the distance after which `color` remains; seven wavelengths integrate its square roughly.
    let squared = Material { base_color: color.map(|c| c * c), ..opaque([1.0; 3]) };
    let xyz = spectral_core::rgb::xyz_from_linear_srgb(squared.base_color);
    for (sum, wanted) in total(&maps.refracted).iter().zip(xyz) {
        let mean = sum / 256.0;
        assert!((mean / wanted - 1.0).abs() < 0.25, "{mean} {wanted}");
    }
    let ledgers = &statistics.lights[0].ledgers;
    assert!(ledgers.iter().all(|l| l.absorbed.flux > 0 && l.reflected.flux == 0 && l.kept_inside.flux == 0));
    // A grey tint is the same at every wavelength, and exact.
    let scene = plate_over_floor(tinted(1.0, [0.25; 3], 0.1), 1.0, sun(DVec3::NEG_Y));
    let (maps, _) = bake(&scene, 16, &aligned(64));
    assert!(maps.refracted.iter().all(|t| (t[1] - 0.25).abs() < 1e-6), "{:?}", maps.refracted[0]);
}
