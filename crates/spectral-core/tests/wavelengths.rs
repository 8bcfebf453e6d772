//! Sets of wavelengths through their public face: every scheme, hard ranges and counts, lights.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use proptest::prelude::*;
use spectral_core::illuminant::Illuminant;
use spectral_core::light::LightSpectrum;
use spectral_core::observer::Observer;
use spectral_core::rgb::D65_WHITE_XYZ;
use spectral_core::wavelengths::{DEFAULT_RANGE_NM, MAX_COUNT, Scheme, WavelengthError, WavelengthSet};

fn set(scheme: Scheme, n: usize) -> WavelengthSet {
    WavelengthSet::new(scheme, n, DEFAULT_RANGE_NM, Observer::Cie1931).unwrap()
}

fn channel_sums(weights: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|c| weights.iter().map(|w| w[c]).sum())
}

/// What holds for every set: ascending wavelengths within the stated range, XYZ weights that are never negative,
/// every channel with sum 1.
fn assert_sound(set: &WavelengthSet) {
    let what = format!("{} {} {:?} {}", set.scheme, set.len(), set.range_nm, set.observer);
    assert!(set.wavelengths_nm.windows(2).all(|w| w[0] < w[1]), "{what}: {:?}", set.wavelengths_nm);
    let (lo, hi) = set.range_nm;
    assert!(set.wavelengths_nm.iter().all(|nm| (lo..=hi).contains(nm)), "{what}: {:?}", set.wavelengths_nm);
    assert_eq!(set.quadrature.len(), set.len(), "{what}");
    assert!(set.quadrature.iter().all(|&q| q > 0.0), "{what}: {:?}", set.quadrature);
    let xyz = set.relative_weights_xyz();
    assert_eq!((xyz.len(), set.weights_rgb.len()), (set.len(), set.len()), "{what}");
    assert!(xyz.iter().flatten().all(|&w| w >= 0.0), "{what}: {xyz:?}");
    for sum in channel_sums(&xyz).into_iter().chain(channel_sums(&set.weights_rgb)) {
        assert!((sum - 1.0).abs() < 1e-12, "{what}: {sum}");
    }
}

#[test]
fn every_scheme_is_sound_for_every_observer() {
    for observer in Observer::ALL {
        for scheme in Scheme::ALL {
            let counts: &[usize] = match scheme {
                Scheme::Fraunhofer => &[3, 4],
                Scheme::Asm2013 => &[7],
                _ => &[1, 2, 3, 7, 21, 24, 25, 64],
            };
            for &n in counts {
                for range_nm in [DEFAULT_RANGE_NM, (360.0, 830.0), (500.0, 600.0)] {
                    assert_sound(&WavelengthSet::new(scheme, n, range_nm, observer).unwrap());
                }
            }
        }
    }
}

#[test]
fn largest_count_is_sound_and_one_more_is_refused() {
    for scheme in [Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy, Scheme::Optimal] {
        assert_sound(&set(scheme, MAX_COUNT));
        let error =
            WavelengthSet::new(scheme, MAX_COUNT + 1, DEFAULT_RANGE_NM, Observer::Cie1931).unwrap_err();
        assert_eq!(error.to_string(), format!("scheme {scheme} has 1 to 4096 wavelengths, got 4097"));
    }
}

#[test]
fn fixed_schemes_have_their_published_wavelengths() {
    assert_eq!(set(Scheme::Fraunhofer, 3).wavelengths_nm, [486.1, 589.3, 656.3]);
    assert_eq!(set(Scheme::Fraunhofer, 4).wavelengths_nm, [486.1, 546.1, 589.3, 656.3]);
    let asm = set(Scheme::Asm2013, 7);
    assert_eq!(asm.wavelengths_nm, [380.0, 430.0, 480.0, 530.0, 580.0, 630.0, 680.0]);
    assert_eq!(asm.weights_xyz, None);
    // Table 1 of Blanchette & Agu 2013: the row of 530 nm, and the total of each column.
    for (weight, table) in asm.weights_rgb[3].iter().zip([76.5, 255.0, 102.0]) {
        assert_eq!(*weight, table / 893.0);
    }
    // The published wavelengths do not depend on the range that was asked for, and the set says so.
    let narrow = WavelengthSet::new(Scheme::Asm2013, 7, (500.0, 510.0), Observer::Cie1931).unwrap();
    assert_eq!((narrow.range_nm, narrow), ((380.0, 680.0), asm));
}

#[test]
fn uniform_includes_both_ends_and_one_is_the_middle() {
    let wavelengths = set(Scheme::Uniform, 14).wavelengths_nm;
    assert_eq!((wavelengths[0], wavelengths[13]), (420.0, 680.0));
    assert!(wavelengths.windows(2).all(|w| (w[1] - w[0] - 20.0).abs() < 1e-12));
    assert_eq!(set(Scheme::Uniform, 1).wavelengths_nm, [550.0]);
    // Ends whose multiples are not exact.
    let range_nm = (479.16410823248685, 817.3976893149363);
    let odd = WavelengthSet::new(Scheme::Uniform, 48, range_nm, Observer::Cie1931).unwrap().wavelengths_nm;
    assert_eq!((odd[0], odd[47]), range_nm);
}

#[test]
fn a_single_wavelength_carries_all_of_white() {
    for scheme in [Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy, Scheme::Optimal] {
        let one = set(scheme, 1);
        assert_eq!(one.weights_xyz, Some(vec![[1.0; 3]]), "{scheme}");
        for component in one.weights_rgb[0] {
            assert!((component - 1.0).abs() < 1e-14, "{scheme}");
        }
        // Even where its own colour lacks a channel: there is nothing to split.
        let red = WavelengthSet::new(scheme, 1, (660.0, 700.0), Observer::Cie1931).unwrap();
        assert_eq!(red.weights_xyz, one.weights_xyz, "{scheme}");
    }
}

#[test]
fn equal_energy_weights_are_equal_in_their_measure() {
    let set = set(Scheme::EqualEnergy, 5);
    let weights = set.weights_xyz.as_ref().unwrap();
    // Undo the normalisation of each channel: the ratios to c / (x + y + z) are constants.
    for c in 0..3 {
        let scale = |i: usize| {
            let bar = set.observer.xyz_bar(set.wavelengths_nm[i]);
            bar[c] / bar.iter().sum::<f64>() / weights[i][c]
        };
        let lit: Vec<usize> = (0..5).filter(|&i| weights[i][c] > 0.0).collect();
        assert!(lit.len() >= 2);
        for &i in &lit {
            assert!((scale(i) / scale(lit[0]) - 1.0).abs() < 1e-12, "{c} {i}");
        }
    }
}

#[test]
fn impossible_sets_are_refused_with_the_numbers() {
    let refusal = |scheme, n, range_nm| {
        WavelengthSet::new(scheme, n, range_nm, Observer::Cie1931).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(Scheme::Fraunhofer, 7, DEFAULT_RANGE_NM),
        "scheme fraunhofer has 3 or 4 wavelengths, got 7"
    );
    assert_eq!(refusal(Scheme::Asm2013, 21, DEFAULT_RANGE_NM), "scheme asm2013 has 7 wavelengths, got 21");
    assert_eq!(refusal(Scheme::Gauss, 0, DEFAULT_RANGE_NM), "scheme gauss has 1 to 4096 wavelengths, got 0");
    assert_eq!(
        refusal(Scheme::Gauss, 3, (680.0, 420.0)),
        "the range 680..420 nm is empty: its start must be below its end"
    );
    assert_eq!(
        refusal(Scheme::Gauss, 3, (300.0, 700.0)),
        "the range 300..700 nm is outside the colour-matching tables, 360 to 830 nm"
    );
    for bad in [(500.0, 500.0), (f64::NAN, 600.0), (400.0, f64::NAN)] {
        let error = WavelengthSet::new(Scheme::Optimal, 3, bad, Observer::Cie1931).unwrap_err();
        assert!(matches!(error, WavelengthError::EmptyRange { .. }), "{error}");
    }
    for bad in [(f64::NEG_INFINITY, 600.0), (400.0, f64::INFINITY), (359.0, 600.0), (400.0, 830.5)] {
        let error = WavelengthSet::new(Scheme::Fraunhofer, 3, bad, Observer::Cie1931).unwrap_err();
        assert!(matches!(error, WavelengthError::RangeOutsideTable { .. }), "{error}");
    }
}

#[test]
fn a_vanishing_channel_is_refused_by_name_where_the_scheme_cannot_help() {
    // CIE 1931 has no z from 651 nm on.
    for (scheme, n, range_nm) in [
        (Scheme::Uniform, 5, (660.0, 700.0)),
        (Scheme::Gauss, 2, (655.0, 700.0)),
        (Scheme::EqualEnergy, 3, (660.0, 700.0)),
    ] {
        let error = WavelengthSet::new(scheme, n, range_nm, Observer::Cie1931).unwrap_err();
        assert!(matches!(error, WavelengthError::ChannelVanishes { channel: 'Z', .. }), "{error}");
        assert!(error.to_string().contains("cie1931 has no Z at any of the"), "{error}");
    }
    // The same range with a little z left is defined: all of it falls to the first wavelength.
    let rest = WavelengthSet::new(Scheme::Uniform, 2, (600.0, 700.0), Observer::Cie1931).unwrap();
    assert_sound(&rest);
    assert_eq!(rest.weights_xyz.unwrap()[0][2], 1.0);
    // `optimal` weighs by integrals over the whole spectrum, so it is defined everywhere.
    assert_sound(&WavelengthSet::new(Scheme::Optimal, 5, (660.0, 700.0), Observer::Cie1931).unwrap());
    // Of the three Fraunhofer lines the reddest has no z.
    let lines = set(Scheme::Fraunhofer, 3);
    assert_eq!(lines.weights_xyz.unwrap()[2][2], 0.0);
}

/// Every kind of light.
fn lights() -> Vec<LightSpectrum> {
    let mut lights: Vec<_> = Illuminant::ALL.into_iter().map(LightSpectrum::Illuminant).collect();
    lights.extend([
        LightSpectrum::default(),
        LightSpectrum::d65_upsampled([1.0, 0.0, 0.0]),
        LightSpectrum::d65_upsampled([0.0, 0.1, 1.0]),
        LightSpectrum::cct(100.0).unwrap(),
        LightSpectrum::cct(3200.0).unwrap(),
        LightSpectrum::cct(25000.0).unwrap(),
    ]);
    lights.extend([380.0, 450.0, 546.1, 640.0, 700.0, 780.0].map(|nm| LightSpectrum::line(nm).unwrap()));
    lights
}

fn assert_weights_are_the_light(set: &WavelengthSet, light: &LightSpectrum) {
    let weights = set.light_weights(light);
    assert_eq!(weights.len(), set.len());
    let (sums, unit_xyz) = (channel_sums(&weights), light.unit_xyz(set.observer));
    for c in 0..3 {
        assert!(weights.iter().all(|w| w[c] >= 0.0), "{} {light:?}: {weights:?}", set.scheme);
        let off = (sums[c] - unit_xyz[c]).abs();
        assert!(
            off <= 1e-12 * unit_xyz[c],
            "{} {} {light:?} {c}: {} {}",
            set.scheme,
            set.len(),
            sums[c],
            unit_xyz[c]
        );
    }
}

#[test]
fn light_weights_sum_to_the_light() {
    for observer in Observer::ALL {
        for (scheme, n) in [
            (Scheme::Fraunhofer, 3),
            (Scheme::Asm2013, 7),
            (Scheme::Gauss, 1),
            (Scheme::Uniform, 21),
            (Scheme::EqualEnergy, 7),
            (Scheme::Optimal, 7),
        ] {
            let set = WavelengthSet::new(scheme, n, DEFAULT_RANGE_NM, observer).unwrap();
            for light in lights() {
                assert_weights_are_the_light(&set, &light);
            }
        }
    }
    for light in lights() {
        assert_weights_are_the_light(&set(Scheme::Gauss, MAX_COUNT), &light);
    }
}

#[test]
fn equal_energy_light_gives_the_sets_own_weights() {
    let e = LightSpectrum::Illuminant(Illuminant::E);
    for scheme in [Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy, Scheme::Optimal] {
        let set = set(scheme, 7);
        let unit_xyz = e.unit_xyz(set.observer);
        for (weight, own) in set.light_weights(&e).iter().zip(set.weights_xyz.as_ref().unwrap()) {
            for c in 0..3 {
                assert!(
                    (weight[c] - own[c] * unit_xyz[c]).abs() < 1e-14,
                    "{scheme} {c}: {} {}",
                    weight[c],
                    own[c]
                );
            }
        }
    }
}

#[test]
fn incandescent_light_moves_weight_to_the_red() {
    let set = set(Scheme::Uniform, 7);
    let luminance_above_580 =
        |light: LightSpectrum| set.light_weights(&light)[4..].iter().map(|w| w[1]).sum::<f64>();
    let (daylight, bulb) = (
        luminance_above_580(LightSpectrum::default()),
        luminance_above_580(LightSpectrum::Illuminant(Illuminant::A)),
    );
    assert!(bulb > 1.2 * daylight, "{bulb} {daylight}");
}

#[test]
fn a_line_falls_to_the_nearest_wavelength() {
    let set = set(Scheme::Fraunhofer, 3);
    // 640 nm has a trace of z, but its wavelength in this set, 656.3 nm, has none: the trace must not be lost or NaN.
    for (line_nm, nearest) in [(450.0, 0), (530.0, 0), (546.1, 1), (600.0, 1), (640.0, 2), (700.0, 2)] {
        let light = LightSpectrum::line(line_nm).unwrap();
        let unit_xyz = light.unit_xyz(set.observer);
        for (i, weight) in set.light_weights(&light).into_iter().enumerate() {
            assert_eq!(weight, if i == nearest { unit_xyz } else { [0.0; 3] }, "{line_nm} {i}");
        }
    }
}

#[test]
fn lines_between_the_wavelengths_are_not_missed() {
    // FL11's strongest line, at 545 nm, is nearest to the second of these, but not at it: sampled at the wavelengths
    // alone, the second would get little of the luminance.
    let set = WavelengthSet::new(Scheme::Uniform, 3, (500.0, 620.0), Observer::Cie1931).unwrap();
    let own = set.weights_xyz.as_ref().unwrap();
    let sampled: Vec<f64> = set
        .wavelengths_nm
        .iter()
        .zip(own)
        .map(|(&nm, w)| w[1] * Illuminant::Fl11.relative_power(nm))
        .collect();
    assert!(sampled[1] / sampled.iter().sum::<f64>() < 0.45, "{sampled:?}");
    let weights = set.light_weights(&LightSpectrum::Illuminant(Illuminant::Fl11));
    assert!(weights[1][1] > 0.65, "{weights:?}");
}

#[test]
fn d65_weights_add_up_to_the_projects_white() {
    let sums = channel_sums(&set(Scheme::Optimal, 7).light_weights(&LightSpectrum::default()));
    for c in 0..3 {
        assert!((sums[c] - D65_WHITE_XYZ[c]).abs() < 1e-15);
    }
}

#[test]
fn names_and_serde_round_trip() {
    for scheme in Scheme::ALL {
        assert_eq!(scheme.to_string().parse(), Ok(scheme));
        assert_eq!(serde_json::to_string(&scheme).unwrap(), format!("\"{scheme}\""));
    }
    for scheme in [Scheme::Optimal, Scheme::Asm2013] {
        let set = set(scheme, 7);
        let text = serde_json::to_string(&set).unwrap();
        assert_eq!(serde_json::from_str::<WavelengthSet>(&text).unwrap(), set);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_set_is_sound_or_refused(
        scheme in proptest::sample::select(Scheme::ALL.to_vec()),
        n in 0_usize..80,
        lo in 340.0..840.0,
        width in -20.0..400.0,
        observer in proptest::sample::select(Observer::ALL.to_vec()),
    ) {
        if let Ok(set) = WavelengthSet::new(scheme, n, (lo, lo + width), observer) {
            prop_assert_eq!(set.len(), n);
            assert_sound(&set);
            assert_weights_are_the_light(&set, &LightSpectrum::default());
        }
    }
}
