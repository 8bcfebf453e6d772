//! The matrices K_n: exact sums in f32, closeness to the formula, lights, degenerate input.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use proptest::prelude::*;
use spectral_core::illuminant::Illuminant;
use spectral_core::light::LightSpectrum;
use spectral_core::mat3::{self, Mat3};
use spectral_core::matrices::{MAX_DEVIATION, MatrixError, SpectralMatrices, formula};
use spectral_core::observer::Observer;
use spectral_core::rgb::{D65_WHITE_XYZ, RgbSpace};
use spectral_core::wavelengths::{DEFAULT_RANGE_NM, MAX_COUNT, Scheme, WavelengthSet};

const IDENTITY: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn set(scheme: Scheme, n: usize) -> WavelengthSet {
    WavelengthSet::new(scheme, n, DEFAULT_RANGE_NM, Observer::Cie1931).unwrap()
}

fn sum_f32<'a>(matrices: impl Iterator<Item = &'a [[f32; 3]; 3]>) -> [[f32; 3]; 3] {
    let mut sum = [[0.0_f32; 3]; 3];
    for k in matrices {
        for i in 0..3 {
            for j in 0..3 {
                sum[i][j] += k[i][j];
            }
        }
    }
    sum
}

/// Exact sums in ascending, descending and pairwise order, every element within the bound of the formula.
fn assert_closed(matrices: &SpectralMatrices, formula: &[Mat3], what: &str) {
    let k = &matrices.matrices;
    assert_eq!(k.len(), formula.len(), "{what}");
    assert_eq!(sum_f32(k.iter()), matrices.sum, "{what}");
    assert_eq!(sum_f32(k.iter().rev()), matrices.sum, "{what}");
    let halves = [sum_f32(k.iter().step_by(2)), sum_f32(k.iter().skip(1).step_by(2))];
    assert_eq!(sum_f32(halves.iter()), matrices.sum, "{what}");
    assert_eq!(matrices.sum_residual(), 0.0, "{what}");
    for (n, (k, exact)) in k.iter().zip(formula).enumerate() {
        for i in 0..3 {
            for j in 0..3 {
                let off = (f64::from(k[i][j]) - exact[i][j]).abs();
                assert!(off <= MAX_DEVIATION, "{what}: K_{n} ({i}, {j}) is {off:e} off");
                assert!(k[i][j].to_bits() != (-0.0_f32).to_bits(), "{what}: K_{n} ({i}, {j}) is -0");
            }
        }
    }
}

#[test]
fn every_scheme_closes_for_1_to_64_wavelengths_in_every_space() {
    for scheme in Scheme::ALL {
        for n in 1..=64 {
            let Ok(set) = WavelengthSet::new(scheme, n, DEFAULT_RANGE_NM, Observer::Cie1931) else {
                assert!(matches!(scheme, Scheme::Fraunhofer | Scheme::Asm2013), "{scheme} {n}");
                continue;
            };
            for rgb in RgbSpace::ALL {
                let matrices = SpectralMatrices::new(&set, &rgb).unwrap();
                assert_eq!(matrices.sum, IDENTITY);
                assert_closed(&matrices, &formula(&set, &rgb), &format!("{scheme} {n} {}", rgb.name));
            }
        }
    }
}

#[test]
fn the_largest_set_closes() {
    for scheme in [Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy, Scheme::Optimal] {
        let set = set(scheme, MAX_COUNT);
        let matrices = SpectralMatrices::new(&set, &RgbSpace::SRGB).unwrap();
        assert_closed(&matrices, &formula(&set, &RgbSpace::SRGB), scheme.name());
    }
}

/// Why the care: f32 roundings of the formula do not sum to the identity.
#[test]
fn plain_rounding_does_not_close() {
    let missed = (3..=24)
        .filter(|&n| {
            let rounded: Vec<[[f32; 3]; 3]> = formula(&set(Scheme::Gauss, n), &RgbSpace::SRGB)
                .iter()
                .map(|k| k.map(|row| row.map(|v| v as f32)))
                .collect();
            sum_f32(rounded.iter()) != IDENTITY
        })
        .count();
    assert!(missed > 15, "{missed}");
}

#[test]
fn a_changed_matrix_has_a_residual() {
    let mut matrices = SpectralMatrices::new(&set(Scheme::Optimal, 7), &RgbSpace::SRGB).unwrap();
    matrices.matrices[3][1][2] += f32::EPSILON;
    assert_eq!(matrices.sum_residual(), f32::EPSILON);
}

#[test]
fn one_wavelength_is_the_identity() {
    for rgb in RgbSpace::ALL {
        let one = SpectralMatrices::new(&set(Scheme::Gauss, 1), &rgb).unwrap();
        assert_eq!(one.matrices, [IDENTITY], "{}", rgb.name);
    }
}

#[test]
fn formula_is_specgens() {
    // Conjugation keeps the trace: tr K_n = W_x + W_y + W_z, and so do products with XYZ from outside.
    let set = set(Scheme::Gauss, 5);
    for rgb in RgbSpace::ALL {
        for (k, w) in formula(&set, &rgb).iter().zip(set.weights_xyz.as_ref().unwrap()) {
            let trace = k[0][0] + k[1][1] + k[2][2];
            assert!((trace - w.iter().sum::<f64>()).abs() < 1e-14, "{}", rgb.name);
            let xyz = [0.3, 0.5, 0.2];
            let through =
                mat3::apply(&rgb.xyz_from_rgb(), mat3::apply(k, mat3::apply(&rgb.rgb_from_xyz(), xyz)));
            for c in 0..3 {
                assert!((through[c] - w[c] * xyz[c]).abs() < 1e-15, "{} {c}", rgb.name);
            }
        }
    }
}

#[test]
fn spectral_white_leaves_the_gamut_as_known() {
    // SPECGEN's four lines: the bluest turns white into about (-0.57, 0.18, 1.11), which no display shows.
    let blue = SpectralMatrices::new(&set(Scheme::Fraunhofer, 4), &RgbSpace::SRGB).unwrap().weights_rgb[0];
    for (component, known) in blue.iter().zip([-0.57, 0.18, 1.11]) {
        assert!((component - known).abs() < 0.005, "{blue:?}");
    }
}

#[test]
fn rgb_only_weights_give_diagonal_matrices() {
    let asm = set(Scheme::Asm2013, 7);
    for rgb in RgbSpace::ALL {
        let matrices = SpectralMatrices::new(&asm, &rgb).unwrap();
        assert_eq!(matrices.weights_xyz, None);
        for (k, weight) in matrices.matrices.iter().zip(&asm.weights_rgb) {
            for (i, row) in k.iter().enumerate() {
                for (j, &element) in row.iter().enumerate() {
                    let expected = if i == j { weight[i] } else { 0.0 };
                    assert!((f64::from(element) - expected).abs() <= MAX_DEVIATION);
                    assert!(i == j || element == 0.0);
                }
            }
        }
    }
}

#[test]
fn rgb_weights_are_what_white_becomes() {
    let set = set(Scheme::Optimal, 7);
    let matrices = SpectralMatrices::new(&set, &RgbSpace::SRGB).unwrap();
    for (own, derived) in matrices.weights_rgb.iter().zip(&set.weights_rgb) {
        for c in 0..3 {
            assert!((own[c] - derived[c]).abs() < 1e-14);
        }
    }
}

#[test]
fn under_a_light_white_becomes_its_colour() {
    let lines = [380.0, 450.0, 546.1, 640.0, 780.0].map(|nm| LightSpectrum::line(nm).unwrap());
    let lights = Illuminant::ALL.into_iter().map(LightSpectrum::Illuminant).chain(lines);
    for light in lights.chain([LightSpectrum::default(), LightSpectrum::cct(2000.0).unwrap()]) {
        for (scheme, n) in
            [(Scheme::Optimal, 7), (Scheme::Gauss, 64), (Scheme::Asm2013, 7), (Scheme::Fraunhofer, 3)]
        {
            for rgb in RgbSpace::ALL {
                let set = set(scheme, n);
                let matrices = SpectralMatrices::for_light(&set, &rgb, &light).unwrap();
                let what = format!("{scheme} {} {light:?}", rgb.name);
                assert_eq!(sum_f32(matrices.matrices.iter()), matrices.sum, "{what}");
                let white = mat3::apply(&matrices.sum.map(|row| row.map(f64::from)), [1.0; 3]);
                let expected = mat3::apply(&rgb.rgb_from_xyz(), light.unit_xyz(set.observer));
                let scale = expected.iter().fold(1.0, |max: f64, v| max.max(v.abs()));
                for c in 0..3 {
                    assert!(
                        (white[c] - expected[c]).abs() < 2e-6 * scale,
                        "{what} {c}: {} {}",
                        white[c],
                        expected[c]
                    );
                }
                if let Some(weights) = &matrices.weights_xyz {
                    let (z, unit_z) =
                        (weights.iter().map(|w| w[2]).sum::<f64>(), light.unit_xyz(set.observer)[2]);
                    assert!((z - unit_z).abs() <= 1e-12 * unit_z, "{what}: {z} {unit_z}");
                }
            }
        }
    }
}

#[test]
fn under_d65_the_sum_is_the_identity_but_the_matrices_are_not_those_of_equal_energy() {
    let set = set(Scheme::Uniform, 7);
    let d65 = SpectralMatrices::for_light(&set, &RgbSpace::SRGB, &LightSpectrum::default()).unwrap();
    assert_eq!(d65.sum, IDENTITY);
    let channel = |c: usize| d65.weights_xyz.as_ref().unwrap().iter().map(|w| w[c]).sum::<f64>();
    assert!((0..3).all(|c| (channel(c) - D65_WHITE_XYZ[c]).abs() < 1e-14));
    assert_ne!(d65.matrices, SpectralMatrices::new(&set, &RgbSpace::SRGB).unwrap().matrices);
}

#[test]
fn impossible_matrices_are_refused() {
    let set = set(Scheme::Gauss, 4);
    let collinear = RgbSpace::new("grey", [[0.3, 0.3], [0.4, 0.4], [0.5, 0.5]], D65_WHITE_XYZ);
    let error = SpectralMatrices::new(&set, &collinear).unwrap_err();
    assert!(matches!(error, MatrixError::NotFinite { rgb_space: "grey", .. }), "{error}");

    let nearly = RgbSpace::new("nearly grey", [[0.3, 0.3], [0.31, 0.3], [0.3, 0.31]], D65_WHITE_XYZ);
    let error = SpectralMatrices::new(&set, &nearly).unwrap_err();
    assert!(matches!(error, MatrixError::NoExactSum { .. }), "{error}");

    let mut tampered = set;
    tampered.weights_xyz.as_mut().unwrap()[1][1] += 0.01;
    let error = SpectralMatrices::new(&tampered, &RgbSpace::SRGB).unwrap_err();
    assert!(matches!(error, MatrixError::NoExactSum { .. }), "{error}");
}

#[test]
fn serde_round_trips() {
    let matrices = SpectralMatrices::new(&set(Scheme::Asm2013, 7), &RgbSpace::SRGB).unwrap();
    let text = serde_json::to_string(&matrices).unwrap();
    assert_eq!(serde_json::from_str::<SpectralMatrices>(&text).unwrap(), matrices);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn any_set_closes(
        scheme in proptest::sample::select(vec![Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy, Scheme::Optimal]),
        n in 1_usize..=64,
        lo in 360.0..640.0,
        width in 1.0..190.0,
        observer in proptest::sample::select(Observer::ALL.to_vec()),
        rgb in proptest::sample::select(RgbSpace::ALL.to_vec()),
    ) {
        // Ranges without blue have no such set in some schemes.
        if let Ok(set) = WavelengthSet::new(scheme, n, (lo, lo + width), observer) {
            let matrices = SpectralMatrices::new(&set, &rgb).unwrap();
            prop_assert_eq!(matrices.sum, IDENTITY);
            assert_closed(&matrices, &formula(&set, &rgb), &format!("{scheme} {n} {lo} {width} {observer} {}", rgb.name));
        }
    }
}
