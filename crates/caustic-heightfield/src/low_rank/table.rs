//! Coefficients of all terms as a function of the state: a table with linear interpolation, as a GPU's textures have it.

use num_traits::Float;

use super::state::{State, StateBox, chebyshev_nodes, chebyshev_weights};
use crate::convolve::Sample;

/// Coefficients on a regular grid of states; terms fastest, then the states' coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Table<T> {
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
        let place = self.grid().place(state);
        coefficients.fill(T::zero());
        for (entry, weight) in place.corners() {
            let weight = T::rounded(weight * factor);
            let values = &self.values[entry * self.terms..][..self.terms];
            coefficients.iter_mut().zip(values).for_each(|(sum, &value)| *sum = *sum + weight * value);
        }
        place.inside
    }

    /// Where its states lie.
    pub(crate) fn grid(&self) -> TableGrid<f64> {
        TableGrid { low: self.range.low, high: self.range.high, size: self.size, flat_tolerance: 1e-6 }
    }

    /// Coefficients; terms fastest, then the states' coordinates.
    pub(crate) fn values(&self) -> &[T] {
        &self.values
    }
}

/// The states of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TableGrid<T> {
    /// The first state in each coordinate.
    pub(crate) low: [T; 3],
    /// The last.
    pub(crate) high: [T; 3],
    /// How many there are.
    pub(crate) size: [usize; 3],
    /// Share by which a state may differ in a coordinate of one state only.
    pub(crate) flat_tolerance: T,
}

/// A state among those of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place<T> {
    size: [usize; 3],
    corner: [usize; 3],
    share: [T; 3],
    /// It is inside the table; else it is the nearest that is.
    pub(crate) inside: bool,
}

impl<T: Float> TableGrid<T> {
    /// Where a state is.
    pub(crate) fn place(&self, state: [T; 3]) -> Place<T> {
        let real = |n: usize| T::from(n).expect("f32 and f64 hold it");
        let smallest = T::from(1e-3).expect("f32 and f64 hold it");
        let mut place = Place { size: self.size, corner: [0; 3], share: [T::zero(); 3], inside: true };
        for (k, &state) in state.iter().enumerate() {
            if self.size[k] == 1 {
                let tolerance = self.flat_tolerance * self.low[k].abs().max(smallest);
                place.inside &= (state - self.low[k]).abs() <= tolerance;
                continue;
            }
            let cells = real(self.size[k] - 1);
            let at = (state - self.low[k]) / (self.high[k] - self.low[k]) * cells;
            place.inside &= at >= T::zero() && at <= cells;
            let clamped = at.max(T::zero()).min(cells);
            place.corner[k] = clamped.to_usize().map_or(0, |low| low.min(self.size[k] - 2));
            place.share[k] = clamped - real(place.corner[k]);
        }
        place
    }
}

impl<T: Float> Place<T> {
    /// The states around, by their index, and their weights.
    pub(crate) fn corners(&self) -> impl Iterator<Item = (usize, T)> {
        let Self { size, corner, share, .. } = *self;
        (0..8_usize).filter_map(move |c| {
            let bit = |k: usize| (c >> k) & 1;
            if (0..3).any(|k| bit(k) == 1 && size[k] == 1) {
                return None;
            }
            let along = |k: usize| if bit(k) == 1 { share[k] } else { T::one() - share[k] };
            let [i, j, l] = [0, 1, 2].map(|k| corner[k] + bit(k));
            Some(((l * size[1] + j) * size[0] + i, along(0) * along(1) * along(2)))
        })
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
