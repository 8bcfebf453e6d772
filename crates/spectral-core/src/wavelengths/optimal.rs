//! The scheme `optimal`: the least colour error of a dispersed line.
//!
//! The best of some candidates, by the mean error over spreads of 1, 4 and 16 px:
//!
//! * a table of up to 24 wavelengths per observer, found by `examples/optimise_wavelengths.rs`, which searches
//!   420 to 680 nm with free weights; a candidate in every range that contains its wavelengths;
//! * every other scheme as it is, so none is ever better (those with fixed wavelengths only if the range contains them);
//! * their wavelengths, and some spread out like a prism does, each weighted by the integrals of the colour-matching functions
//!   over all wavelengths that are nearest to it.
//!
//! Up to 24 wavelengths the tables win in every range that contains them; up to 22 each wavelength more lowers their error.
//! The other candidates serve larger sets, starting over at twice the error of the last tabulated one, and ranges that cut
//! a table's wavelengths off.

use alloc::vec::Vec;

use super::{Scheme, WavelengthError, WavelengthSet, evenly_spaced, neighbourhoods_nm, quantiles};
use crate::csv_table::parse_csv;
use crate::observer::Observer;
use crate::quality::DispersedLine;

/// Most wavelengths that the tables have.
const MAX_TABULATED: usize = 24;
const ROWS: usize = MAX_TABULATED * (MAX_TABULATED + 1) / 2;

/// Count, wavelength in nm, XYZ weights; the sets of 1, 2, 3, ... wavelengths below each other.
static CIE_1931: [[f64; 5]; ROWS] = parse_csv(include_str!("../../data/optimal_cie1931.csv"));
static CIE_1964: [[f64; 5]; ROWS] = parse_csv(include_str!("../../data/optimal_cie1964.csv"));
static WYMAN_2013: [[f64; 5]; ROWS] = parse_csv(include_str!("../../data/optimal_wyman2013.csv"));

/// The spreads whose mean error is least, px.
const SPREADS_PX: [f64; 3] = [1.0, 4.0, 16.0];

/// Ascending wavelengths in nm and their XYZ weights, each channel with sum 1 or close to it.
type Candidate = (Vec<f64>, Vec<[f64; 3]>);

pub(super) fn optimal(
    n: usize,
    range_nm: (f64, f64),
    observer: Observer,
) -> Result<WavelengthSet, WavelengthError> {
    let lines = SPREADS_PX.map(|px| {
        DispersedLine::new(observer, px).expect("the spreads are within the limit of the comparison")
    });
    let error = |(nodes_nm, weights): &Candidate| {
        lines.iter().map(|line| line.delta_e(nodes_nm, weights)).sum::<f64>()
    };
    // The middle of equal parts: a candidate for every count and range.
    let mut best = by_neighbourhood(evenly_spaced(n, range_nm), observer);
    let mut least = error(&best);
    for candidate in candidates(n, range_nm, observer) {
        let error = error(&candidate);
        if error < least {
            (best, least) = (candidate, error);
        }
    }
    let (nodes_nm, weights) = best;
    let (lo_nm, hi_nm) = range_nm;
    let quadrature = neighbourhoods_nm(&nodes_nm)
        .into_iter()
        .map(|(a_nm, b_nm)| b_nm.min(hi_nm) - a_nm.max(lo_nm))
        .collect();
    WavelengthSet::from_weights(Scheme::Optimal, range_nm, observer, nodes_nm, weights, quadrature)
}

fn candidates(n: usize, range_nm: (f64, f64), observer: Observer) -> impl Iterator<Item = Candidate> {
    let (lo_nm, hi_nm) = range_nm;
    let others = Scheme::ALL
        .into_iter()
        .filter(|&scheme| scheme != Scheme::Optimal)
        // A scheme that has no such set is no candidate.
        .filter_map(move |scheme| WavelengthSet::new(scheme, n, range_nm, observer).ok())
        .filter(move |set| lo_nm <= set.range_nm.0 && set.range_nm.1 <= hi_nm)
        .flat_map(move |set| {
            let weights = set.relative_weights_xyz();
            [by_neighbourhood(set.wavelengths_nm.clone(), observer), (set.wavelengths_nm, weights)]
        });
    let spread_out = [0.15, 0.25, 0.35].into_iter().map(move |exponent| {
        by_neighbourhood(quantiles::spread_out(n, range_nm, observer, exponent), observer)
    });
    tabulated(n, range_nm, observer).into_iter().chain(others).chain(spread_out)
}

/// The tabulated set, if there is one and the range contains it.
fn tabulated(n: usize, range_nm: (f64, f64), observer: Observer) -> Option<Candidate> {
    let table = match observer {
        Observer::Cie1931 => &CIE_1931,
        Observer::Cie1964 => &CIE_1964,
        Observer::Wyman2013 => &WYMAN_2013,
    };
    let first = n * (n - 1) / 2;
    let rows = table.get(first..first + n)?;
    let contained = rows.iter().all(|row| (range_nm.0..=range_nm.1).contains(&row[1]));
    contained.then(|| rows.iter().map(|row| (row[1], [row[2], row[3], row[4]])).unzip())
}

/// Wavelengths weighted by the integrals of the colour-matching functions, over the whole table, of all that are nearest
/// to each.
fn by_neighbourhood(nodes_nm: Vec<f64>, observer: Observer) -> Candidate {
    let mut weights: Vec<[f64; 3]> = neighbourhoods_nm(&nodes_nm)
        .into_iter()
        .map(|(lo_nm, hi_nm)| observer.xyz_bar_integral(lo_nm, hi_nm))
        .collect();
    let sums = [0, 1, 2].map(|c| weights.iter().map(|w| w[c]).sum::<f64>());
    for weight in &mut weights {
        for c in 0..3 {
            weight[c] /= sums[c];
        }
    }
    (nodes_nm, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_hold_sets_of_1_to_24_in_order() {
        for table in [&CIE_1931, &CIE_1964, &WYMAN_2013] {
            let counts = (1..=MAX_TABULATED).flat_map(|n| core::iter::repeat_n(n as f64, n));
            assert!(table.iter().map(|row| row[0]).eq(counts));
            for n in 1..=MAX_TABULATED {
                let rows = &table[n * (n - 1) / 2..n * (n + 1) / 2];
                assert!(rows.windows(2).all(|pair| pair[0][1] < pair[1][1]), "{n}");
                for c in 2..5 {
                    // Seven decimals are tabulated.
                    let sum: f64 = rows.iter().map(|row| row[c]).sum();
                    assert!((sum - 1.0).abs() < 1e-7 * n as f64, "{n} {c} {sum}");
                }
            }
        }
    }
}
