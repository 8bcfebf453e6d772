//! The colour error of a dispersed line, and that the scheme `optimal` deserves its name.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use spectral_core::observer::Observer;
use spectral_core::quality::{DispersedLine, EdgeReport, SPREADS_PX, edge_delta_e};
use spectral_core::wavelengths::{DEFAULT_RANGE_NM, Scheme, WavelengthSet};

fn set(scheme: Scheme, n: usize) -> WavelengthSet {
    WavelengthSet::new(scheme, n, DEFAULT_RANGE_NM, Observer::Cie1931).unwrap()
}

#[test]
fn figures_are_those_of_an_independent_prototype() {
    // Mean CIEDE2000 at 1, 4, 16 and 64 px, to the digits given; the tolerance is half of the last one.
    for (scheme, n, expected) in [
        (Scheme::Gauss, 4, [(4.2, 0.1), (16.0, 0.5), (40.0, 0.5), (58.0, 0.5)]),
        (Scheme::Uniform, 7, [(0.6, 0.05), (2.4, 0.05), (24.0, 0.5), (53.0, 0.5)]),
        (Scheme::Uniform, 21, [(0.5, 0.05), (0.3, 0.05), (1.8, 0.05), (28.0, 1.0)]),
    ] {
        for ((spread_px, delta_e), (figure, tolerance)) in
            EdgeReport::new(&set(scheme, n)).iter().zip(expected)
        {
            assert!(
                (delta_e - figure).abs() < tolerance,
                "{scheme} {n} at {spread_px} px: {delta_e}, not {figure}"
            );
        }
    }
}

#[test]
fn every_nanometre_has_no_error() {
    let all = WavelengthSet::new(Scheme::Uniform, 401, (380.0, 780.0), Observer::Cie1931).unwrap();
    for (spread_px, delta_e) in EdgeReport::new(&all).iter() {
        assert!(delta_e < 1e-9, "{spread_px}: {delta_e}");
    }
}

#[test]
fn without_dispersion_no_set_has_an_error() {
    for (scheme, n) in
        [(Scheme::Gauss, 1), (Scheme::Fraunhofer, 3), (Scheme::Asm2013, 7), (Scheme::Optimal, 12)]
    {
        let delta_e = edge_delta_e(&set(scheme, n), 0.0).unwrap();
        assert!(delta_e < 1e-9, "{scheme}: {delta_e}");
    }
}

#[test]
fn wrong_weights_are_seen() {
    let set = set(Scheme::Optimal, 7);
    let line = DispersedLine::new(set.observer, 1.0).unwrap();
    let mut weights = set.relative_weights_xyz();
    let right = line.delta_e(&set.wavelengths_nm, &weights);
    weights.swap(2, 5);
    let swapped = line.delta_e(&set.wavelengths_nm, &weights);
    assert!(swapped > right + 5.0, "{right} {swapped}");
}

#[test]
fn error_grows_with_the_spread_once_the_samples_come_apart() {
    for scheme in [Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy, Scheme::Optimal] {
        let report = EdgeReport::new(&set(scheme, 7)).delta_e;
        assert!(report[1] < report[2] && report[2] < report[3], "{scheme} {report:?}");
    }
}

#[test]
fn undefined_spreads_are_refused() {
    for bad in [-1.0, 64.1, f64::NAN, f64::INFINITY] {
        let error = DispersedLine::new(Observer::Cie1931, bad).unwrap_err();
        assert!(
            error.to_string().starts_with("the spread between F and C must be from 0 to 64 px, got"),
            "{error}"
        );
    }
}

/// Mean over spreads of 1, 4 and 16 px: what `optimal` minimises.
struct Mean(Vec<DispersedLine>);

impl Mean {
    fn new(observer: Observer) -> Self {
        Self(SPREADS_PX[..3].iter().map(|&px| DispersedLine::new(observer, px).unwrap()).collect())
    }

    fn of(&self, set: &WavelengthSet) -> f64 {
        let weights = set.relative_weights_xyz();
        self.0.iter().map(|line| line.delta_e(&set.wavelengths_nm, &weights)).sum::<f64>()
            / self.0.len() as f64
    }
}

/// The sets of all other schemes in a range; those with fixed wavelengths only if these are in it.
fn others(n: usize, range_nm: (f64, f64), observer: Observer) -> Vec<WavelengthSet> {
    let schemes = Scheme::ALL.into_iter().filter(|&s| s != Scheme::Optimal);
    let sets = schemes.filter_map(|s| WavelengthSet::new(s, n, range_nm, observer).ok());
    sets.filter(|set| range_nm.0 <= set.range_nm.0 && set.range_nm.1 <= range_nm.1).collect()
}

#[test]
fn optimal_beats_every_other_scheme_for_3_to_12_wavelengths() {
    for observer in Observer::ALL {
        let mean = Mean::new(observer);
        for range_nm in [DEFAULT_RANGE_NM, (380.0, 780.0), (400.0, 700.0), (380.0, 680.0)] {
            for n in 3..=12 {
                let optimal = mean.of(&WavelengthSet::new(Scheme::Optimal, n, range_nm, observer).unwrap());
                let others = others(n, range_nm, observer);
                assert!(others.len() >= 3);
                for other in others {
                    let error = mean.of(&other);
                    assert!(
                        optimal < 0.97 * error,
                        "{observer} {n} {range_nm:?}: {optimal}, {} {error}",
                        other.scheme
                    );
                }
            }
        }
    }
}

#[test]
fn optimal_is_no_worse_than_any_other_scheme_elsewhere() {
    for observer in Observer::ALL {
        let mean = Mean::new(observer);
        // Few and many wavelengths, beyond the tables, and ranges that cut the tables' wavelengths off.
        for (range_nm, counts) in [
            (DEFAULT_RANGE_NM, &[1, 2, 13, 16, 21, 24, 25, 40, 64, 200][..]),
            ((380.0, 780.0), &[1, 2, 21, 24, 25, 64]),
            ((500.0, 600.0), &[1, 2, 3, 4, 7, 21]),
            ((360.0, 450.0), &[1, 3, 7]),
        ] {
            for &n in counts {
                let optimal = mean.of(&WavelengthSet::new(Scheme::Optimal, n, range_nm, observer).unwrap());
                for other in others(n, range_nm, observer) {
                    let error = mean.of(&other);
                    // Weights normalised twice differ in the last bits.
                    assert!(
                        optimal <= error * (1.0 + 1e-12),
                        "{observer} {n} {range_nm:?}: {optimal}, {} {error}",
                        other.scheme
                    );
                }
            }
        }
    }
}

#[test]
fn more_optimal_wavelengths_are_better() {
    for observer in Observer::ALL {
        let mean = Mean::new(observer);
        let error = |n| mean.of(&WavelengthSet::new(Scheme::Optimal, n, DEFAULT_RANGE_NM, observer).unwrap());
        let errors: Vec<f64> = (1..=22).map(error).collect();
        assert!(errors.windows(2).all(|w| w[1] < w[0]), "{observer} {errors:?}");
        assert!(error(24) < 0.5 * error(16), "{observer}");
    }
}

/// The tables are the output of `examples/optimise_wavelengths.rs`: a solution, so nudging any wavelength makes it worse.
#[test]
fn optimal_tables_are_at_a_minimum() {
    let mean = Mean::new(Observer::Cie1931);
    for n in [3, 7, 12] {
        let best = set(Scheme::Optimal, n);
        let least = mean.of(&best);
        for i in 0..n {
            for nudge_nm in [-4.0, 4.0] {
                let mut nudged = best.clone();
                nudged.wavelengths_nm[i] += nudge_nm;
                let error = mean.of(&nudged);
                assert!(
                    error > least,
                    "{n}: {} nm by {nudge_nm} nm: {error}, {least}",
                    best.wavelengths_nm[i]
                );
            }
        }
    }
}
