//! Coefficients of all terms as a function of the state: a table with linear interpolation, as a GPU's textures have it.

use super::state::{State, StateBox, chebyshev_nodes, chebyshev_weights};
use crate::convolve::Sample;

/// Coefficients on a regular grid of states; terms fastest, then the states' coordinates.
#[derive(Clone, Debug)]
pub(super) struct Table<T> {
    range: StateBox,
    pub(super) size: [usize; 3],
    terms: usize,
    values: Vec<T>,
}

impl Table<f64> {
    /// The polynomial through values at `nodes` Chebyshev nodes per coordinate, sampled at `size` states.
    pub(super) fn resampled(
        range: StateBox,
        nodes: [usize; 3],
        size: [usize; 3],
        terms: usize,
        values: Vec<f64>,
    ) -> Self {
        let mut values = values;
        let mut shape = nodes;
        for k in 0..3 {
            let weights: Vec<Vec<f64>> = (0..size[k])
                .map(|i| {
                    let share = if size[k] == 1 { 0.5 } else { i as f64 / (size[k] - 1) as f64 };
                    chebyshev_weights(nodes[k], share)
                })
                .collect();
            let inner = terms * shape[..k].iter().product::<usize>();
            let outer: usize = shape[k + 1..].iter().product();
            let mut next = vec![0.0; inner * size[k] * outer];
            for block in 0..outer {
                for (i, row) in weights.iter().enumerate() {
                    let to = &mut next[(block * size[k] + i) * inner..][..inner];
                    for (node, weight) in row.iter().enumerate() {
                        let from = &values[(block * shape[k] + node) * inner..][..inner];
                        to.iter_mut().zip(from).for_each(|(t, f)| *t += weight * f);
                    }
                }
            }
            values = next;
            shape[k] = size[k];
        }
        Self { range, size, terms, values }
    }

    /// Only the first `terms` terms.
    pub(super) fn truncated<T: Sample>(&self, terms: usize) -> Table<T> {
        let kept = self.values.chunks(self.terms).flat_map(|all| all[..terms].iter().map(|&x| T::rounded(x)));
        Table { range: self.range, size: self.size, terms, values: kept.collect() }
    }
}

impl<T: Sample> Table<T> {
    /// The coefficients of all terms at a state, times `factor`, into `coefficients`; whether the state is inside the table, else
    /// those of the nearest that is.
    pub(super) fn at(&self, state: State, factor: f64, coefficients: &mut [T]) -> bool {
        let mut inside = true;
        let mut corner = [0; 3];
        let mut share = [0.0; 3];
        for k in 0..3 {
            if self.size[k] == 1 {
                let tolerance = 1e-6 * self.range.low[k].abs().max(1e-3);
                inside &= (state[k] - self.range.low[k]).abs() <= tolerance;
                continue;
            }
            let cells = (self.size[k] - 1) as f64;
            let at = (state[k] - self.range.low[k]) / (self.range.high[k] - self.range.low[k]) * cells;
            inside &= (0.0..=cells).contains(&at);
            let clamped = at.clamp(0.0, cells);
            corner[k] = (clamped as usize).min(self.size[k] - 2);
            share[k] = clamped - corner[k] as f64;
        }
        coefficients.fill(T::zero());
        for c in 0..8_usize {
            let bit = |k: usize| (c >> k) & 1;
            if (0..3).any(|k| bit(k) == 1 && self.size[k] == 1) {
                continue;
            }
            let weight: f64 = (0..3).map(|k| if bit(k) == 1 { share[k] } else { 1.0 - share[k] }).product();
            let weight = T::rounded(weight * factor);
            let [i, j, l] = [0, 1, 2].map(|k| corner[k] + bit(k));
            let from = ((l * self.size[1] + j) * self.size[0] + i) * self.terms;
            let values = &self.values[from..from + self.terms];
            coefficients.iter_mut().zip(values).for_each(|(sum, &value)| *sum = *sum + weight * value);
        }
        inside
    }
}

/// States of the table along each coordinate, so that linear interpolation of no function of the state that is as curved as these
/// polynomials errs by more than `tolerance` of its largest value.
///
/// `section(k)` are the values of all terms at the nodes along coordinate k.
pub(super) fn table_size(
    nodes: [usize; 3],
    tolerance: f64,
    most: usize,
    section: impl Fn(usize) -> Vec<Vec<f64>>,
) -> [usize; 3] {
    const FINE: usize = 256;
    [0, 1, 2].map(|k| {
        if nodes[k] == 1 {
            return 1;
        }
        let terms = section(k);
        let weights: Vec<Vec<f64>> =
            (0..=FINE).map(|i| chebyshev_weights(nodes[k], i as f64 / FINE as f64)).collect();
        let along = |term: &[f64]| -> Vec<f64> {
            weights.iter().map(|w| w.iter().zip(term).map(|(w, v)| w * v).sum()).collect()
        };
        let lines: Vec<Vec<f64>> = terms.iter().map(|term| along(term)).collect();
        let largest = lines.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        // Second differences over FINE cells; the error of a cell is an eighth of that over its own width.
        let curved = lines
            .iter()
            .flat_map(|line| line.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()))
            .fold(0.0_f64, f64::max)
            * (FINE * FINE) as f64;
        let cells = (curved / (8.0 * tolerance * largest)).sqrt().ceil();
        ((cells as usize).max(1) + 1).min(most)
    })
}

/// Shares of the way through a box, one per Chebyshev node, first coordinate fastest.
pub(super) fn node_shares(nodes: [usize; 3]) -> Vec<[f64; 3]> {
    let [p, q, d] = nodes.map(chebyshev_nodes);
    let mut shares = Vec::with_capacity(nodes.iter().product());
    for &d in &d {
        for &q in &q {
            shares.extend(p.iter().map(|&p| [p, q, d]));
        }
    }
    shares
}
