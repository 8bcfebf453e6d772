//! The colour of surfaces: pictures hold spectra times reflectances, whatever the wavelengths that were traced.

use asm_core::{MapFit, Method, Picture, Settings};
use glam::{DMat4, DVec3};
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_core::observer::{Observer, VISIBLE_NM};
use spectral_core::rgb::linear_srgb_from_xyz;
use spectral_core::upsample::SmoothSpectrum;
use spectral_core::wavelengths::{Scheme, WavelengthSet};
use spectral_scene::{Camera, Scene, bundled};

use crate::stage::*;

const SATURATED: [f64; 3] = [0.05, 0.8, 0.05];
const COLOURS: [[f64; 3]; 5] = [[1.0; 3], [0.5; 3], [0.8, 0.3, 0.1], SATURATED, [0.02, 0.05, 0.9]];

/// XYZ that a surface reflects of a light of Y = 1: the trapezoidal rule over spectrum, reflectance and observer by 1/16 nm.
fn reflected(light: &LightSpectrum, colour: [f64; 3]) -> [f64; 3] {
    let rho = SmoothSpectrum::reflectance(colour);
    let unit = light.unit_xyz(Observer::Cie1931);
    if let Some(line_nm) = light.line_nm() {
        return unit.map(|v| v * rho.at(line_nm));
    }
    let (low_nm, high_nm) = VISIBLE_NM;
    let steps = ((high_nm - low_nm) * 16.0) as u32;
    let mut sums = [[0.0; 2]; 3];
    for i in 0..=steps {
        let nm = low_nm + 0.0625 * f64::from(i);
        let width = if i == 0 || i == steps { 0.5 } else { 1.0 };
        let bar = Observer::Cie1931.xyz_bar(nm);
        for (sum, bar) in sums.iter_mut().zip(bar) {
            let white = width * light.relative_power(nm) * bar;
            sum[0] += white * rho.at(nm);
            sum[1] += white;
        }
    }
    std::array::from_fn(|c| unit[c] * sums[c][0] / sums[c][1])
}

/// A camera straight above the middle of the floor, under whatever hangs at y = 0.2, seeing 0.05 to each side.
fn look_down(scene: &mut Scene) {
    scene.cameras.push(Camera {
        name: "above the floor".into(),
        world_from_camera: DMat4::from_translation(DVec3::Y * 0.1)
            * DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        yfov_rad: 2.0 * 0.5_f64.atan(),
        znear_m: 1e-3,
    });
}

fn floor(colour: [f64; 3], spectrum: LightSpectrum) -> Scene {
    let mut scene = plate_over_floor(glass(1.0), 1.0, sun(DVec3::NEG_Y));
    scene.materials[0].base_color = colour;
    scene.lights[0].spectrum = spectrum;
    look_down(&mut scene);
    scene
}

fn every_kind_of_light() -> [LightSpectrum; 4] {
    [
        LightSpectrum::default(),
        LightSpectrum::illuminant("A").unwrap(),
        LightSpectrum::illuminant("FL4").unwrap(),
        LightSpectrum::line(546.1).unwrap(),
    ]
}

fn assert_all_are(picture: &Picture, wanted: [f64; 3], relative: f64) {
    for texel in &picture.xyz {
        for c in 0..3 {
            let wanted = wanted[c] / std::f64::consts::PI;
            assert!((f64::from(texel[c]) - wanted).abs() <= relative * wanted, "{texel:?}, {c}: {wanted}");
        }
    }
}

#[test]
fn a_floor_in_the_open_reflects_the_integral_over_the_spectrum() {
    for spectrum in every_kind_of_light() {
        for colour in COLOURS {
            let mut scene = floor(colour, spectrum.clone());
            scene.objects.truncate(1);
            let picture = picture_of(&scene, [8; 2], &Settings::of(Method::CausticsMap));
            assert_all_are(&picture, reflected(&spectrum, colour), 1e-5);
            // Under D65 that is the colour itself, which reflectances are solved for by a sum over whole nanometres.
            if spectrum == LightSpectrum::default() {
                let rgb = linear_srgb_from_xyz(picture.xyz[0].map(|v| f64::from(v) * std::f64::consts::PI));
                assert!((0..3).all(|c| (rgb[c] - colour[c]).abs() < 5e-5), "{rgb:?} {colour:?}");
            }
        }
    }
}

#[test]
fn a_floor_behind_clear_glass_is_the_same_with_any_number_of_wavelengths() {
    for spectrum in every_kind_of_light() {
        for colour in COLOURS {
            let scene = floor(colour, spectrum.clone());
            for (count, prune) in [(7, true), (1, false), (7, false), (21, false)] {
                // One photon per texel of the map, so nothing but rounding remains: weights to 2^-31 and f32.
                let settings = Settings { wavelengths: Some(count), prune, ..aligned(32) };
                let picture = picture_of(&scene, [8; 2], &settings);
                assert_all_are(&picture, reflected(&spectrum, colour), 1e-5);
            }
        }
    }
}

#[test]
fn caustics_without_dispersion_have_one_colour_with_any_number_of_wavelengths() {
    let mut scene = bundled("gem").unwrap();
    for material in &mut scene.materials {
        material.dispersion = Dispersion::Constant { n: material.dispersion.n_d() };
        if material.transmission == 0.0 {
            material.base_color = SATURATED;
        }
    }
    let settings = |wavelengths| Settings {
        wavelengths: Some(wavelengths),
        prune: false,
        emission_size: 128,
        ..Settings::of(Method::CausticsMap)
    };
    let one = picture(&scene, &settings(1));
    let brightest = one.xyz.iter().flatten().copied().fold(0.0, f32::max);
    for count in [7, 21] {
        let many = picture(&scene, &settings(count));
        for (a, b) in many.xyz.iter().flatten().zip(one.xyz.iter().flatten()) {
            assert!((a - b).abs() <= 2e-6 * b + 1e-7 * brightest, "{count}: {a} {b}");
        }
    }
}

#[test]
fn a_rainbow_on_a_saturated_floor_is_the_sum_of_its_bands() {
    const COUNT: usize = 7;
    let mut scene = bundled("prism").unwrap();
    let paint = |scene: &mut Scene, colour| {
        scene.materials.iter_mut().filter(|m| m.transmission == 0.0).for_each(|m| m.base_color = colour);
    };
    let settings = Settings {
        wavelengths: Some(COUNT as u32),
        scheme: Some(Scheme::Uniform),
        emission_size: 128,
        // The same map for all of them and each alone.
        map_fit: Some(MapFit::Receivers),
        ..Settings::of(Method::CausticsMap)
    };
    let set = WavelengthSet::new(Scheme::Uniform, COUNT, settings.range_nm(), Observer::Cie1931).unwrap();
    let white = scene.lights[0].spectrum.clone();
    let weights = set.light_weights(&white);
    paint(&mut scene, SATURATED);
    let rainbow = picture(&scene, &settings);
    // Each band alone, on white: a line light with Y = 1.
    paint(&mut scene, [1.0; 3]);
    let rho: Vec<f64> =
        set.wavelengths_nm.iter().map(|&nm| SmoothSpectrum::reflectance(SATURATED).at(nm)).collect();
    let exact = reflected(&white, SATURATED);
    let scale: [f64; 3] =
        std::array::from_fn(|c| exact[c] / weights.iter().zip(&rho).map(|(w, rho)| w[c] * rho).sum::<f64>());
    let mut sum = vec![[0.0; 3]; rainbow.xyz.len()];
    for (k, &nm) in set.wavelengths_nm.iter().enumerate() {
        scene.lights[0].spectrum = LightSpectrum::line(nm).unwrap();
        for (sum, texel) in sum.iter_mut().zip(&picture(&scene, &settings).xyz) {
            (0..3).for_each(|c| sum[c] += f64::from(texel[1]) * weights[k][c] * rho[k] * scale[c]);
        }
    }
    let dark = 0.02; // what the rest of the scene reflects
    let brightest = sum.iter().map(|t| t[1]).fold(0.0, f64::max);
    let mut outside_srgb = 0;
    for (texel, wanted) in rainbow.xyz.iter().zip(&sum) {
        let of_the_rainbow = wanted[1] > dark * brightest;
        for c in 0..3 {
            assert!(texel[c] >= 0.0);
            let error = (f64::from(texel[c]) - wanted[c]).abs();
            assert!(!of_the_rainbow || error <= 1e-5 * wanted[c] + 1e-6 * brightest, "{texel:?} {wanted:?}");
        }
        let rgb = linear_srgb_from_xyz(texel.map(f64::from));
        outside_srgb += usize::from(of_the_rainbow && rgb.iter().any(|v| *v < -1e-3 * brightest));
    }
    assert!(
        outside_srgb > 5,
        "{outside_srgb}: spectral colours that a product in linear sRGB would have bent"
    );
}

#[test]
fn a_line_keeps_its_chromaticity_on_any_floor() {
    let mut scene = bundled("sphere").unwrap();
    let spectrum = LightSpectrum::line(546.1).unwrap();
    let unit = spectrum.unit_xyz(Observer::Cie1931);
    scene.lights[0].spectrum = spectrum;
    for material in scene.materials.iter_mut().filter(|m| m.transmission == 0.0) {
        material.base_color = [0.7, 0.2, 0.4];
    }
    let picture = picture(&scene, &Settings { emission_size: 64, ..Settings::of(Method::CausticsMap) });
    assert!(picture.xyz.iter().any(|t| t[1] > 0.0));
    for texel in &picture.xyz {
        for c in 0..3 {
            let error = (f64::from(texel[c]) - unit[c] * f64::from(texel[1])).abs();
            assert!(error <= 1e-5 * f64::from(texel[1]) + 1e-9, "{texel:?} {unit:?}");
        }
    }
}

#[test]
fn two_floors_side_by_side_each_have_their_colour() {
    // The map holds what each reflects; texels at their border mix both, farther away nothing does.
    let mut scene = floor([0.8, 0.3, 0.1], LightSpectrum::default());
    let half = |scene: &mut Scene, i: usize, x: f64| {
        scene.objects[i].world_from_mesh =
            DMat4::from_translation(DVec3::X * x) * DMat4::from_scale(DVec3::new(0.5, 1.0, 1.0));
    };
    place(&mut scene, "other half", quad(1.0), opaque([0.1, 0.3, 0.8]), DVec3::ZERO);
    half(&mut scene, 0, -0.25);
    half(&mut scene, 2, 0.25);
    let settings = Settings { prune: false, ..aligned(256) };
    let picture = picture_of(&scene, [16; 2], &settings);
    for (side, colour) in [(0..7, [0.8, 0.3, 0.1]), (9..16, [0.1, 0.3, 0.8])] {
        let xyz = side.flat_map(|x| (0..16).map(move |y| y * 16 + x)).map(|i| picture.xyz[i]).collect();
        let of_one = Picture { xyz, ..picture.clone() };
        assert_all_are(&of_one, reflected(&LightSpectrum::default(), colour), 1e-5);
    }
}
