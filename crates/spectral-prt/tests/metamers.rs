//! METACOW's pairs: the same colour under daylight, as different as can be under a lamp.

use spectral_core::color::delta_e_2000;
use spectral_core::color_checker;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_core::patch::{Shown, light_xyz, sampled_xyz};
use spectral_prt::metamer::{Metamer, MetamerError, MetamerSettings, metamer};

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;
const OBSERVER: Observer = Observer::Cie1931;

fn light(illuminant: Illuminant) -> Vec<f64> {
    GRID.sample(|lambda_nm| illuminant.relative_power(lambda_nm))
}

fn pair(patch: usize, settings: MetamerSettings) -> Metamer {
    let standard = &color_checker::sampled(&GRID)[patch];
    let (day, lamp) = (light(Illuminant::D65), light(Illuminant::A));
    metamer(&GRID, OBSERVER, standard, &day, &lamp, settings).expect("a metamer")
}

fn delta_e(illuminant: Illuminant, a: &[f64], b: &[f64]) -> f64 {
    let light = light(illuminant);
    let shown = Shown::under(light_xyz(&GRID, OBSERVER, &light)).expect("a white");
    let lab = |r: &[f64]| shown.lab(sampled_xyz(&GRID, OBSERVER, r, &light));
    delta_e_2000(lab(a), lab(b))
}

#[test]
fn every_patch_has_a_partner_that_daylight_does_not_tell_and_lamplight_does() {
    let standards = color_checker::sampled(&GRID);
    for (patch, standard) in standards.iter().enumerate() {
        let found = pair(patch, MetamerSettings::default());
        let (day, lamp) = (
            delta_e(Illuminant::D65, standard, &found.reflectance),
            delta_e(Illuminant::A, standard, &found.reflectance),
        );
        assert!(day < 1e-4, "{}: {day} under D65", color_checker::PATCHES[patch]);
        // Twice what is just noticed; black has no room.
        assert!(lamp > 2.0 || patch == 23, "{}: {lamp} under A", color_checker::PATCHES[patch]);
        assert!((found.shown_delta_e - lamp).abs() < 1e-12 && (found.matched_delta_e - day).abs() < 1e-12);
    }
}

#[test]
fn bounds_and_bends_hold() {
    let standards = color_checker::sampled(&GRID);
    let settings = MetamerSettings::default();
    for (patch, standard) in standards.iter().enumerate() {
        let reflectance = pair(patch, settings).reflectance;
        for (r, s) in reflectance.iter().zip(standard) {
            assert!(
                *r >= settings.reflectances[0].min(*s) - 1e-8
                    && *r <= settings.reflectances[1].max(*s) + 1e-8
            );
        }
        let difference: Vec<f64> = reflectance.iter().zip(standard).map(|(r, s)| r - s).collect();
        for d in difference.windows(3) {
            assert!((d[0] - 2.0 * d[1] + d[2]).abs() <= settings.most_bend_per_nm2 * 25.0 + 1e-8);
        }
    }
}

#[test]
fn more_freedom_shows_more() {
    let narrow = pair(21, MetamerSettings { most_bend_per_nm2: 2e-5, ..MetamerSettings::default() });
    let usual = pair(21, MetamerSettings::default());
    let free = pair(21, MetamerSettings { most_bend_per_nm2: 2e-3, ..MetamerSettings::default() });
    assert!(narrow.shown_delta_e < usual.shown_delta_e && usual.shown_delta_e < free.shown_delta_e);
}

#[test]
fn under_the_light_it_matches_nothing_shows() {
    let standard = &color_checker::sampled(&GRID)[14];
    let day = light(Illuminant::D65);
    let found = metamer(&GRID, OBSERVER, standard, &day, &day, MetamerSettings::default()).unwrap();
    assert!(found.shown_delta_e < 1e-4, "{}", found.shown_delta_e);
}

#[test]
fn what_is_no_spectrum_is_refused() {
    let (day, lamp) = (light(Illuminant::D65), light(Illuminant::A));
    let grey = vec![0.5; GRID.samples()];
    let refused = |standard: &[f64], matched: &[f64], settings| {
        metamer(&GRID, OBSERVER, standard, matched, &lamp, settings).unwrap_err()
    };
    let usual = MetamerSettings::default();
    assert_eq!(
        refused(&grey[1..], &day, usual).to_string(),
        "the standard has 60 values, the grid 61 wavelengths"
    );
    assert_eq!(refused(&grey, &vec![0.0; GRID.samples()], usual), MetamerError::Light("matched"));
    let mut bad = grey.clone();
    bad[2] = f64::NAN;
    assert_eq!(
        refused(&bad, &day, usual).to_string(),
        "the standard reflects NaN at 410 nm; reflectances are 0 to 1"
    );
    assert_eq!(
        refused(&grey, &day, MetamerSettings { most_bend_per_nm2: -1.0, ..usual }),
        MetamerError::Bend(-1.0)
    );
}
