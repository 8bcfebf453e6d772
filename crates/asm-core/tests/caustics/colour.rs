//! Dispersion: the order of hues, and line lights.

use asm_core::{Method, Settings};
use spectral_core::light::LightSpectrum;
use spectral_core::rgb::linear_srgb_from_xyz;
use spectral_core::wavelengths::Scheme;

use crate::stage::*;

/// Hue in degrees, red 0, green 120, blue 240, of XYZ brought into sRGB by adding white.
fn hue_deg(xyz: [f64; 3]) -> f64 {
    let rgb = linear_srgb_from_xyz(xyz);
    let least = rgb.into_iter().fold(f64::INFINITY, f64::min);
    let [r, g, b] = rgb.map(|c| c - least);
    let degrees = (3.0_f64.sqrt() * (g - b)).atan2(2.0 * r - g - b).to_degrees();
    degrees.rem_euclid(360.0)
}

#[test]
fn a_prism_spreads_violet_to_red_with_cyan_between() {
    let scene = spectral_scene::bundled("prism").unwrap();
    // Plain samples of the spectrum: each on the spectral locus.
    let settings = Settings {
        wavelengths: Some(31),
        scheme: Some(Scheme::Uniform),
        range_nm: Some((400.0, 700.0)),
        ..Settings::of(Method::CausticsMap)
    };
    let (maps, _) = bake(&scene, 256, &settings);
    // The spectrum lies along u. Columns that are not dark, from the short-wave end.
    let column = |x: usize| total(&(0..256).map(|y| maps.refracted[y * 256 + x]).collect::<Vec<_>>());
    let columns: Vec<[f64; 3]> = (0..256).map(column).collect();
    let brightest = columns.iter().flatten().copied().fold(0.0, f64::max);
    let lit: Vec<usize> = (0..256).filter(|&x| columns[x].iter().sum::<f64>() > 0.02 * brightest).collect();
    assert!(lit.len() > 20, "{}", lit.len());
    // Violet lies beyond blue on the hue circle; red ends at 0.
    let hues: Vec<f64> =
        lit.iter().map(|&x| hue_deg(columns[x])).map(|h| if h > 340.0 { h - 360.0 } else { h }).collect();
    let (first, last) = (hues[0], hues[hues.len() - 1]);
    assert!((225.0..300.0).contains(&first) && (-20.0..20.0).contains(&last), "{hues:?}");
    assert!(hues.windows(2).all(|pair| pair[1] < pair[0] + 1.0), "{hues:?}");
    for (name, range) in
        [("blue", 210.0..260.0), ("cyan", 165.0..205.0), ("green", 90.0..150.0), ("yellow", 40.0..75.0)]
    {
        assert!(hues.iter().any(|h| range.contains(h)), "no {name} in {hues:?}");
    }
}

#[test]
fn wavelengths_land_in_the_order_of_their_indices() {
    // One line at a time: the shorter the wavelength, the farther it is bent.
    let mut scene = spectral_scene::bundled("prism").unwrap();
    let mut last = f64::NEG_INFINITY;
    for nm in [420.0, 470.0, 520.0, 570.0, 620.0, 670.0] {
        scene.lights[0].spectrum = LightSpectrum::line(nm).unwrap();
        let (maps, statistics) =
            bake(&scene, 256, &Settings { emission_size: 256, ..Settings::of(Method::CausticsMap) });
        assert_eq!(statistics.lights[0].wavelengths_nm, [nm]);
        let (mut sum, mut moment) = (0.0, 0.0);
        for (i, texel) in maps.refracted.iter().enumerate() {
            sum += f64::from(texel[1]);
            moment += f64::from(texel[1]) * (i % 256) as f64;
        }
        let x = moment / sum;
        assert!(x > last + 1.0, "{nm} nm lands at column {x}, the last at {last}");
        last = x;
    }
}

#[test]
fn pictures_of_spectral_light_on_coloured_walls_are_never_negative() {
    // 510 nm lies far outside sRGB: on a red wall its linear sRGB times the wall's has a negative X and Y.
    let mut scene = spectral_scene::bundled("diamond").unwrap();
    for nm in [450.0, 510.0, 620.0] {
        scene.lights[0].spectrum = LightSpectrum::line(nm).unwrap();
        // `picture` asserts that nothing is below 0.
        let picture = picture(&scene, &Settings { emission_size: 64, ..Settings::of(Method::CausticsMap) });
        assert!(picture.xyz.iter().any(|t| t[1] > 0.0), "{nm} nm: something to see");
    }
}

#[test]
fn a_line_light_keeps_its_own_chromaticity() {
    let mut scene = spectral_scene::bundled("sphere").unwrap();
    scene.lights[0].spectrum = LightSpectrum::line(546.1).unwrap();
    let unit = scene.lights[0].spectrum.unit_xyz(spectral_core::observer::Observer::Cie1931);
    let (maps, _) = bake(&scene, 32, &Settings { emission_size: 64, ..Settings::of(Method::CausticsMap) });
    for texel in maps.direct.iter().chain(&maps.refracted) {
        // f32, and where it is nearly dark a twentieth of the map's unit: 2^-30 lux, 24 texels of the map to one of the emission view.
        for c in 0..3 {
            let wanted = unit[c] * f64::from(texel[1]);
            let error = (f64::from(texel[c]) - wanted).abs();
            assert!(error <= 1e-5 * f64::from(texel[1]) + 1e-9, "{texel:?} {unit:?}");
        }
    }
}
