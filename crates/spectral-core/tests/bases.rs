//! Spectral bases on flat patches: the 24 ColorChecker reflectances, 400 to 700 nm by 5 nm, Bradford to D65, CIE94
//! against 5 nm sampling.

use proptest::prelude::*;
use spectral_core::basis::{BasisError, Optimal, SpectralBasis, Training, Weighting};
use spectral_core::color_checker;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_core::patch::{Shown, light_xyz, rgb_rendered_xyz, sampled_xyz};
use spectral_core::rgb::D65_WHITE_XYZ;

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;
const OBSERVER: Observer = Observer::Cie1931;

fn light(illuminant: Illuminant) -> Vec<f64> {
    GRID.sample(|lambda_nm| illuminant.relative_power(lambda_nm))
}

fn illuminants() -> Vec<Vec<f64>> {
    Illuminant::ALL.map(light).to_vec()
}

fn lines(lines_nm: &[f64]) -> Vec<f64> {
    lines_nm.iter().fold(vec![0.0; GRID.samples()], |mut sum, &lambda_nm| {
        let line = GRID.line(lambda_nm).expect("on the grid");
        sum.iter_mut().zip(line).for_each(|(s, l)| *s += l);
        sum
    })
}

/// The four ways of being optimal.
const EVERY: [Optimal; 4] = [UNIFORM, PERCEPTUAL, FREE, FREE_PERCEPTUAL];
const UNIFORM: Optimal = Optimal { weighting: Weighting::Uniform, exact_white: true };
const PERCEPTUAL: Optimal = Optimal { weighting: Weighting::Perceptual, exact_white: true };
const FREE: Optimal = Optimal { exact_white: false, ..UNIFORM };
const FREE_PERCEPTUAL: Optimal = Optimal { exact_white: false, ..PERCEPTUAL };

struct Case {
    reflectances: Vec<Vec<f64>>,
    lights: Vec<Vec<f64>>,
}

impl Case {
    /// All patches and all CIE illuminants.
    fn chart() -> Self {
        Self { reflectances: color_checker::sampled(&GRID), lights: illuminants() }
    }

    fn training(&self) -> Training<'_> {
        Training { grid: GRID, observer: OBSERVER, reflectances: &self.reflectances, lights: &self.lights }
    }

    fn optimal(&self, coefficients: usize, settings: Optimal) -> SpectralBasis {
        self.training().optimal(coefficients, settings).expect("within the rank")
    }

    /// Mean and largest CIE94 over the chart, or whatever the reflectances are.
    fn errors(&self, basis: &SpectralBasis, lights: &[Vec<f64>]) -> (f64, f64) {
        let report = basis.report(&self.reflectances, lights).expect("lights that are seen");
        (report.delta_e_mean, report.delta_e_max)
    }
}

fn mean_and_max(differences: &[f64]) -> (f64, f64) {
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    (mean, differences.iter().copied().fold(0.0, f64::max))
}

/// The prototype found 8.2 and 28.8.
#[test]
fn rgb_under_fl4_errs_as_the_prototype_says() {
    let fl4 = light(Illuminant::Fl4);
    let shown = Shown::under(light_xyz(&GRID, OBSERVER, &fl4)).unwrap();
    let differences: Vec<f64> = color_checker::sampled(&GRID)
        .iter()
        .map(|r| {
            let reference = sampled_xyz(&GRID, OBSERVER, r, &fl4);
            shown.delta_e_94(reference, rgb_rendered_xyz(&GRID, OBSERVER, r, &fl4))
        })
        .collect();
    let (mean, max) = mean_and_max(&differences);
    println!("RGB under FL4: {mean:.3} / {max:.3}");
    assert!((mean - 8.2).abs() < 0.1 && (max - 28.8).abs() < 0.3, "{mean} {max}");
}

#[test]
fn rgb_is_right_for_white_under_any_light_and_for_any_patch_under_d65() {
    let white = GRID.sample(|_| 1.0);
    for illuminant in Illuminant::ALL {
        let light = light(illuminant);
        let light_white = light_xyz(&GRID, OBSERVER, &light);
        let shown = Shown::under(light_white).unwrap();
        let rgb = rgb_rendered_xyz(&GRID, OBSERVER, &white, &light);
        assert!(shown.delta_e_94(light_white, rgb) < 1e-9, "{illuminant}");
    }
    // The grid's white is not exactly that of sRGB: the light's own colour is multiplied in, so a trace of it is left.
    let d65 = light(Illuminant::D65);
    let shown = Shown::under(light_xyz(&GRID, OBSERVER, &d65)).unwrap();
    for reflectance in color_checker::sampled(&GRID) {
        let reference = sampled_xyz(&GRID, OBSERVER, &reflectance, &d65);
        let off = shown.delta_e_94(reference, rgb_rendered_xyz(&GRID, OBSERVER, &reflectance, &d65));
        assert!(off < 0.05, "{off}");
    }
}

#[test]
fn peercy_with_8_and_12_under_fl4() {
    let chart = Case::chart();
    let fl4 = [light(Illuminant::Fl4)];
    let (mean, max) = chart.errors(&chart.training().peercy(8).unwrap(), &fl4);
    println!("Peercy 8 under FL4: {mean:.3} / {max:.3}");
    assert!((0.4..0.6).contains(&mean) && (1.0..1.3).contains(&max), "{mean} {max}");
    let (mean, max) = chart.errors(&chart.training().peercy(12).unwrap(), &fl4);
    println!("Peercy 12 under FL4: {mean:.3} / {max:.3}");
    assert!(mean < 0.05 && max < 0.12, "{mean} {max}");
}

#[test]
fn optimal_5_under_fl4_beats_the_paper_s_eight() {
    let chart = Case::chart();
    let fl4 = [light(Illuminant::Fl4)];
    for settings in EVERY {
        let (mean, max) = chart.errors(&chart.optimal(5, settings), &fl4);
        println!("optimal 5 {settings:?} under FL4: {mean:.3} / {max:.3}");
        assert!(mean <= 0.1 && max <= 0.5, "{settings:?} {mean} {max}");
    }
}

#[test]
fn optimal_8_is_within_a_tenth_under_every_illuminant() {
    let chart = Case::chart();
    for settings in EVERY {
        let (mean, max) = chart.errors(&chart.optimal(8, settings), &chart.lights);
        println!("optimal 8 {settings:?} under all: {mean:.4} / {max:.4}");
        assert!(max <= 0.1, "{settings:?} {mean} {max}");
    }
}

#[test]
fn perceptual_weights_lower_the_worst_error_of_few_coefficients() {
    let chart = Case::chart();
    for coefficients in [4, 5, 6] {
        let [uniform, perceptual] = [FREE, FREE_PERCEPTUAL].map(|settings| {
            let errors = chart.errors(&chart.optimal(coefficients, settings), &chart.lights);
            println!("optimal {coefficients} {settings:?} under all: {errors:.4?}");
            errors
        });
        assert!(perceptual.0 < uniform.0 && perceptual.1 < uniform.1, "{uniform:?} {perceptual:?}");
    }
}

/// The truncated decomposition leaves exactly the singular values it drops (Eckart & Young 1936).
#[test]
fn the_optimal_basis_leaves_what_its_dropped_singular_values_say() {
    let chart = Case::chart();
    for coefficients in [1, 3, 5, 8] {
        let basis = chart.optimal(coefficients, FREE);
        let mut left = 0.0;
        for light in &chart.lights {
            let y = light_xyz(&GRID, OBSERVER, light)[1];
            let light: Vec<f64> = light.iter().map(|v| v / y).collect();
            let of_light = basis.light_coefficients(&light);
            for reflectance in &chart.reflectances {
                let reference = sampled_xyz(&GRID, OBSERVER, reflectance, &light);
                let xyz = SpectralBasis::xyz(&basis.albedo_coefficients(reflectance), &of_light);
                left += (0..3).map(|c| (xyz[c] - reference[c]).powi(2)).sum::<f64>();
            }
        }
        let dropped: f64 = basis.singular_values()[coefficients..].iter().map(|s| s * s).sum();
        assert!((left / dropped - 1.0).abs() < 1e-9, "{coefficients}: {left} {dropped}");
    }
}

#[test]
fn functions_are_dual_and_peercy_s_are_orthonormal() {
    let chart = Case::chart();
    let bases = [chart.training().peercy(8).unwrap()]
        .into_iter()
        .chain(EVERY.map(|settings| chart.optimal(8, settings)))
        .collect::<Vec<_>>();
    for basis in &bases {
        // The light that stands for a unit vector of coefficients has that vector as its coefficients.
        for j in 0..8 {
            let mut unit = [0.0; 8];
            unit[j] = 1.0;
            let back = basis.light_coefficients(&basis.light_from_coefficients(&unit));
            for (b, u) in back.iter().zip(unit) {
                assert!((b - u).abs() < 1e-10, "{:?} {j} {back:?}", basis.kind());
            }
        }
        println!("{:?} 8: condition numbers {:.1?}", basis.kind(), basis.condition_numbers());
    }
    let (chi, phi) = bases[0].condition_numbers();
    assert!((chi - 1.0).abs() < 1e-10 && (phi - 1.0).abs() < 1e-10);
    assert!(bases[1..].iter().all(|b| b.condition_numbers().1 > 5.0));
}

#[test]
fn errors_fall_to_rounding_at_full_rank() {
    let chart = Case::chart();
    for settings in EVERY {
        let basis = chart.optimal(16, settings);
        let report = basis.report(&chart.reflectances, &chart.lights).unwrap();
        assert!(report.delta_e_max < 1e-6, "{}", report.delta_e_max);
        // Sixteen functions span sixteen lights: any reflectance is right then.
        let other = [GRID.sample(|l| 0.5 + 0.5 * (l / 7.0).sin())];
        assert!(basis.report(&other, &chart.lights).unwrap().delta_e_max < 1e-5);
    }
    let all = chart.training().peercy(40).unwrap();
    let report = all.report(&chart.reflectances, &chart.lights).unwrap();
    assert!(report.delta_e_max < 1e-9, "{}", report.delta_e_max);
    assert!(report.lights.iter().all(|l| l.residual < 1e-9));
}

#[test]
fn more_coefficients_than_the_rank_are_refused_with_both_numbers() {
    let chart = Case::chart();
    let refused = |asked| chart.training().optimal(asked, FREE).unwrap_err();
    assert_eq!(refused(17), BasisError::Coefficients { asked: 17, least: 1, rank: 16 });
    assert_eq!(
        refused(0).to_string(),
        "0 coefficients were asked for; with training spectra of rank 16, 1 to 16 are possible"
    );
    // White takes the first three.
    for (asked, least, rank) in [(17, 3, 16), (2, 3, 16)] {
        let refused = chart.training().optimal(asked, UNIFORM).unwrap_err();
        assert_eq!(refused, BasisError::Coefficients { asked, least, rank });
    }
    assert_eq!(
        chart.training().peercy(41).unwrap_err(),
        BasisError::Coefficients { asked: 41, least: 1, rank: 40 }
    );
}

/// One reflectance has three rows, m R for x, y and z: three coefficients are exact under any light at all.
#[test]
fn a_palette_of_one_needs_three_coefficients_for_any_light() {
    let mut one = Case::chart();
    one.reflectances = vec![one.reflectances[14].clone()];
    let basis = one.optimal(3, FREE);
    for untrained in [lines(&[546.1]), lines(&[532.0, 638.0]), GRID.sample(|l| l)] {
        let (mean, max) = one.errors(&basis, &[untrained]);
        assert!(max < 1e-6, "{mean} {max}");
    }
    assert_eq!(
        one.training().optimal(4, FREE).unwrap_err(),
        BasisError::Coefficients { asked: 4, least: 1, rank: 3 }
    );
}

/// Greys are multiples of one another: the rank is that of the colour-matching functions.
#[test]
fn a_palette_of_greys_has_rank_three() {
    let mut greys = Case::chart();
    greys.reflectances = [1.0, 1.0, 0.5, 0.18].map(|grey| GRID.sample(|_| grey)).to_vec();
    for settings in EVERY {
        let basis = greys.optimal(3, settings);
        for untrained in [lines(&[546.1]), GRID.sample(|l| l)] {
            assert!(greys.errors(&basis, &[untrained]).1 < 1e-6);
        }
        let refused = greys.training().optimal(4, settings).unwrap_err();
        assert!(matches!(refused, BasisError::Coefficients { asked: 4, rank: 3, .. }), "{refused}");
    }
    assert_eq!(
        greys.training().peercy(18).unwrap_err(),
        BasisError::Coefficients { asked: 18, least: 1, rank: 16 }
    );
}

#[test]
fn one_light_needs_one_coefficient() {
    let mut chart = Case::chart();
    chart.lights = vec![light(Illuminant::Fl11)];
    for settings in EVERY {
        let basis = chart.optimal(1, settings);
        assert!(chart.errors(&basis, &chart.lights).1 < 1e-9);
        assert!(chart.training().optimal(2, settings).is_err());
    }
}

#[test]
fn dependent_reflectances_add_no_rank_and_change_no_colour() {
    let chart = Case::chart();
    let mut doubled = Case::chart();
    doubled.reflectances.extend(chart.reflectances.clone());
    let mixture = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect();
    doubled.reflectances.extend(chart.reflectances.iter().zip(&chart.reflectances[1..]).map(mixture));
    assert_eq!(
        doubled.training().peercy(41).unwrap_err(),
        BasisError::Coefficients { asked: 41, least: 1, rank: 40 }
    );
    assert!(doubled.training().optimal(17, UNIFORM).is_err());
    let basis = doubled.optimal(8, UNIFORM);
    assert!(chart.errors(&basis, &chart.lights).1 <= 0.1);

    // Every patch twice weighs every patch the same as once: the same functions, coefficients and colours.
    let mut twice = Case::chart();
    twice.reflectances.extend(chart.reflectances.clone());
    let (once, twice) = (chart.optimal(5, UNIFORM), twice.optimal(5, UNIFORM));
    let (a, b) = (chart.errors(&once, &chart.lights), chart.errors(&twice, &chart.lights));
    assert!((a.1 - b.1).abs() < 1e-8, "{a:?} {b:?}");
}

/// Whatever the light: also one that the basis was not trained on.
#[test]
fn white_and_greys_are_exact_under_any_light() {
    let chart = Case::chart();
    let greys = [1.0, 0.5, 0.03].map(|grey| GRID.sample(|_| grey));
    let mut lights = illuminants();
    lights.extend([lines(&[546.1]), lines(&[532.0, 638.0]), GRID.sample(|l| 1.0 + (l / 9.0).sin())]);
    for settings in [UNIFORM, PERCEPTUAL] {
        for coefficients in [3, 5, 8] {
            let basis = chart.optimal(coefficients, settings);
            for light in &lights {
                let white = light_xyz(&GRID, OBSERVER, light);
                let of_light = basis.light_coefficients(light);
                for (grey, share) in greys.iter().zip([1.0, 0.5, 0.03]) {
                    let xyz = SpectralBasis::xyz(&basis.albedo_coefficients(grey), &of_light);
                    for c in 0..3 {
                        assert!(
                            (xyz[c] - share * white[c]).abs() < 1e-9 * white[1],
                            "{settings:?} {xyz:?} {white:?}"
                        );
                    }
                }
            }
        }
    }
    // Without being asked for it is only near.
    let free = chart.optimal(5, FREE);
    let off = free.report(&greys[..1], &[light(Illuminant::Fl4)]).unwrap().delta_e_max;
    assert!(off > 1e-4, "{off}");
}

/// Under one line everything is a multiple of the line's colour, shown as grey; the pair has two dimensions.
#[test]
fn lines_and_a_laser_pair_are_learnt_like_any_lamp() {
    let mut chart = Case::chart();
    chart.lights.extend([lines(&[546.1]), lines(&[532.0, 638.0]), lines(&[445.0, 532.0, 638.0])]);
    let spiky = &chart.lights[16..];
    let errors = |coefficients, settings: Optimal| {
        let basis = chart.optimal(coefficients, settings);
        let errors = (chart.errors(&basis, spiky), chart.errors(&basis, &chart.lights));
        println!("optimal {coefficients} {settings:?}, spiky: {:.4?}, all: {:.4?}", errors.0, errors.1);
        errors
    };
    // Bradford's gains are large for saturated whites: eight are too few in XYZ, and ten are enough.
    let (uniform, perceptual) = (errors(8, UNIFORM), errors(8, PERCEPTUAL));
    assert!(uniform.0.1 > 10.0 && perceptual.0.1 < 2.5, "{uniform:?} {perceptual:?}");
    for settings in [UNIFORM, PERCEPTUAL] {
        let (spiky, all) = errors(10, settings);
        assert!(spiky.1 < 0.1 && all.1 < 0.1, "{spiky:?} {all:?}");
    }
    let (_, max) = chart.errors(&chart.optimal(8, PERCEPTUAL), &[light(Illuminant::Fl11)]);
    assert!(max < 0.2, "{max}");
}

#[test]
fn under_a_single_line_every_patch_is_a_grey_of_its_reflectance_there() {
    let line = GRID.line(545.0).unwrap();
    let white = light_xyz(&GRID, OBSERVER, &line);
    let shown = Shown::under(white).unwrap();
    for patch in 0..24 {
        let reflectance = GRID.sample(|l| color_checker::reflectance(patch, l));
        let lab = shown.lab(sampled_xyz(&GRID, OBSERVER, &reflectance, &line));
        let grey = spectral_core::color::lab_from_xyz(
            D65_WHITE_XYZ.map(|w| w * color_checker::reflectance(patch, 545.0)),
            D65_WHITE_XYZ,
        );
        for c in 0..3 {
            assert!((lab[c] - grey[c]).abs() < 1e-9, "{patch} {lab:?} {grey:?}");
        }
    }
}

/// Trained on lamps only, a basis has no reason to know a laser: the report says so instead of hiding it.
#[test]
fn an_untrained_laser_pair_is_reported_as_wrong() {
    let chart = Case::chart();
    let laser = [lines(&[532.0, 638.0])];
    for basis in [chart.optimal(5, UNIFORM), chart.training().peercy(8).unwrap()] {
        let report = basis.report(&chart.reflectances, &laser).unwrap();
        println!("{:?}, untrained laser pair: {:.3?}", basis.kind(), report.lights[0]);
        assert!(report.delta_e_max > 1.0 && report.lights[0].residual > 0.5, "{report:?}");
    }
}

#[test]
fn bad_spectra_are_refused_with_their_place() {
    let chart = Case::chart();
    let refused = |spoil: &dyn Fn(&mut Case)| {
        let mut case = Case::chart();
        spoil(&mut case);
        let peercy = case.training().peercy(5).unwrap_err();
        assert_eq!(peercy, case.training().optimal(5, PERCEPTUAL).unwrap_err());
        peercy.to_string()
    };
    assert_eq!(refused(&|c| c.lights.clear()), "there are no lights: a basis needs one at least");
    assert_eq!(
        refused(&|c| c.reflectances[2][3] = -0.5),
        "reflectances 2 is -0.5 at 415 nm; spectra are finite and not negative"
    );
    assert_eq!(
        refused(&|c| c.lights[1][0] = f64::INFINITY),
        "lights 1 is inf at 400 nm; spectra are finite and not negative"
    );
    assert_eq!(refused(&|c| c.lights[0].truncate(60)), "lights 0 has 60 values, the grid has 61 wavelengths");
    assert_eq!(refused(&|c| c.lights[4].fill(0.0)), "lights 4 has no luminance on the grid");
    let black = [vec![0.0; GRID.samples()]];
    let report = chart.optimal(5, UNIFORM).report(&black, &chart.lights).unwrap();
    assert_eq!((report.delta_e_max, report.albedo_residuals[0]), (0.0, 0.0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() })]

    /// Light adds up: so do its coefficients and the colours.
    #[test]
    fn colours_are_linear_in_light(a in 0_usize..16, b in 0_usize..16, share in 0.0..1.0, patch in 0_usize..24) {
        let chart = Case::chart();
        let basis = chart.optimal(5, UNIFORM);
        let albedo = basis.albedo_coefficients(&chart.reflectances[patch]);
        let mixed: Vec<f64> =
            chart.lights[a].iter().zip(&chart.lights[b]).map(|(a, b)| share * a + (1.0 - share) * b).collect();
        let xyz = |light: &[f64]| SpectralBasis::xyz(&albedo, &basis.light_coefficients(light));
        let (of_a, of_b, of_mixed) = (xyz(&chart.lights[a]), xyz(&chart.lights[b]), xyz(&mixed));
        for c in 0..3 {
            let sum: f64 = share * of_a[c] + (1.0 - share) * of_b[c];
            prop_assert!(f64::abs(of_mixed[c] - sum) < 1e-9 * (1.0 + sum.abs()));
        }
    }
}
