//! The singular vectors of the lobe over the states that occur.

use nalgebra::DMatrix;
use rayon::prelude::*;
use spectral_core::singular::SingularValues;

use super::state::{State, StateBox, chebyshev_weights, direction, is_same};
use super::table::{Table, node_shares, table_size};
use crate::convolve::Window;
use crate::floor::FloorGrid;
use crate::lobe::Lobe;
use crate::pond::Outside;

/// States that stand for all.
const SAMPLES: usize = 224;
/// Offsets that stand for the whole window.
const OFFSETS: usize = 2_000;
/// Most Chebyshev nodes in one coordinate, and most states in one coordinate of the table.
const MOST_NODES: usize = 28;
const MOST_STATES: usize = 96;
/// Singular values below this share of the first are rounding.
const RANK_TOLERANCE: f64 = 1e-9;

/// Kernels and coefficients of as many terms as may be asked for.
pub(super) struct Basis {
    lobe: Lobe,
    pitch_m: [f64; 2],
    /// Terms there are.
    pub(super) terms: usize,
    /// Offsets that matter.
    pub(super) window: Window,
    /// v_r at every offset of the window, terms fastest.
    pub(super) kernels: Vec<f64>,
    /// Chebyshev nodes in each coordinate.
    pub(super) nodes: [usize; 3],
    /// c_r at a grid of states.
    pub(super) table: Table<f64>,
    /// The states that stand for all.
    sample: Vec<State>,
}

impl Basis {
    pub(super) fn new(
        lobe: Lobe,
        pitch_m: [f64; 2],
        states: &[State],
        widest: Window,
        target: f64,
        max_terms: usize,
    ) -> Self {
        let sample = spread_out(states);
        let range = StateBox::around(states);
        let value = |state: State, offset: [i64; 2]| lobe_at(&lobe, pitch_m, state, offset);
        let window = trimmed(widest, &sample, 1e-4 * target, value);
        let coarse = coarse_offsets(window);

        let rows = DMatrix::from_fn(coarse.len(), sample.len(), |o, s| value(sample[s], coarse[o]));
        // The left factor is not needed: with K^T = Q R only R's decomposition is.
        let triangle = if coarse.len() > sample.len() { rows.qr().r() } else { rows };
        let svd = SingularValues::of(&triangle);
        let terms = svd.rank(RANK_TOLERANCE).clamp(1, max_terms.max(1));
        // v_r = sum over states of K(s, .) V_sr / sigma_r, orthonormal on the coarse offsets; nothing of a lobe that is nowhere.
        let mix = DMatrix::from_fn(sample.len(), terms, |s, r| match svd.values.get(r) {
            Some(sigma) => svd.right[(s, r)] / sigma,
            None => 0.0,
        });
        let kernel_at = |offset: [i64; 2], kernel: &mut [f64]| {
            for (s, state) in sample.iter().enumerate() {
                let k = value(*state, offset);
                if k != 0.0 {
                    kernel.iter_mut().enumerate().for_each(|(r, v)| *v += k * mix[(s, r)]);
                }
            }
        };
        let mut kernels = vec![0.0; window.len() * terms];
        kernels
            .par_chunks_mut(terms)
            .enumerate()
            .for_each(|(index, kernel)| kernel_at(window.offset(index), kernel));
        let mut coarse_kernels = vec![0.0; coarse.len() * terms];
        coarse_kernels
            .par_chunks_mut(terms)
            .zip(&coarse)
            .for_each(|(kernel, &offset)| kernel_at(offset, kernel));
        // c_r(s), the projection of a lobe on the kernels.
        let project = |state: State| -> Vec<f64> {
            let mut c = vec![0.0; terms];
            for (kernel, &offset) in coarse_kernels.chunks(terms).zip(&coarse) {
                let k = value(state, offset);
                if k != 0.0 {
                    c.iter_mut().zip(kernel).for_each(|(c, v)| *c += k * v);
                }
            }
            c
        };
        let nodes = [0, 1, 2].map(|k| node_count(&range, k, 0.1 * target, &project));
        let at_nodes: Vec<f64> =
            node_shares(nodes).into_par_iter().flat_map_iter(|shares| project(range.at(shares))).collect();
        let section = |k: usize| -> Vec<Vec<f64>> {
            let nodes_along = super::state::chebyshev_nodes(nodes[k]);
            let along: Vec<Vec<f64>> =
                nodes_along.iter().map(|&share| project(range.at(on_axis(k, share)))).collect();
            (0..terms).map(|r| along.iter().map(|c| c[r]).collect()).collect()
        };
        let size = table_size(nodes, 0.25 * target, MOST_STATES, section);
        let table = Table::resampled(range, nodes, size, terms, at_nodes);
        Self { lobe, pitch_m, terms, window, kernels, nodes, table, sample }
    }

    /// What each term adds at the probes, terms fastest.
    pub(super) fn at_probes(
        &self,
        states: &[State],
        flux: &[f64],
        size: [usize; 2],
        outside: Outside,
        probes: &FloorGrid,
    ) -> Vec<f64> {
        let terms = self.terms;
        let mut coefficients = vec![0.0; states.len() * terms];
        coefficients.par_chunks_mut(terms).zip(states.par_iter().zip(flux)).for_each(
            |(c, (state, &flux))| {
                self.table.at(*state, flux, c);
            },
        );
        let (kernels, window) = self.folded(size, outside);
        let stride = super::probe_stride(size) as i64;
        let mut sums = vec![0.0; probes.size[0] * probes.size[1] * terms];
        sums.par_chunks_mut(terms).enumerate().for_each(|(probe, sum)| {
            let at = [probe % probes.size[0], probe / probes.size[0]].map(|i| i as i64 * stride);
            for (sample, c) in coefficients.chunks(terms).enumerate() {
                let from = [(sample % size[0]) as i64, (sample / size[0]) as i64];
                let mut offset = [at[0] - from[0], at[1] - from[1]];
                if outside == Outside::Periodic {
                    offset = [0, 1].map(|k| offset[k].rem_euclid(size[k] as i64));
                }
                if let Some(index) = window.index(offset) {
                    let kernel = &kernels[index * terms..][..terms];
                    sum.iter_mut().zip(c.iter().zip(kernel)).for_each(|(s, (c, k))| *s += c * k);
                }
            }
        });
        sums
    }

    /// The kernels; those of a periodic pond with all their copies on one tile.
    fn folded(&self, size: [usize; 2], outside: Outside) -> (std::borrow::Cow<'_, [f64]>, Window) {
        if outside == Outside::Dark {
            return ((&self.kernels).into(), self.window);
        }
        let tile = Window { low: [0, 0], size };
        let mut folded = vec![0.0; tile.len() * self.terms];
        for (index, kernel) in self.kernels.chunks(self.terms).enumerate() {
            let offset = self.window.offset(index);
            let [x, y] = [0, 1].map(|k| offset[k].rem_euclid(size[k] as i64) as usize);
            let to = &mut folded[(y * size[0] + x) * self.terms..][..self.terms];
            to.iter_mut().zip(kernel).for_each(|(t, k)| *t += k);
        }
        (folded.into(), tile)
    }

    /// Sum over all offsets of the largest error of any sampled state, times the area of a sample.
    pub(super) fn bound(&self, terms: usize) -> f64 {
        let coefficients: Vec<Vec<f64>> = self
            .sample
            .iter()
            .map(|state| {
                let mut c = vec![0.0; self.terms];
                self.table.at(*state, 1.0, &mut c);
                c
            })
            .collect();
        let worst = |index: usize| {
            let kernel = &self.kernels[index * self.terms..][..terms];
            let offset = self.window.offset(index);
            let error = |(state, c): (&State, &Vec<f64>)| {
                let sum: f64 = c.iter().zip(kernel).map(|(c, k)| c * k).sum();
                (sum - lobe_at(&self.lobe, self.pitch_m, *state, offset)).abs()
            };
            self.sample.iter().zip(&coefficients).map(error).fold(0.0, f64::max)
        };
        let sum: f64 = (0..self.window.len()).into_par_iter().map(worst).sum();
        sum * self.pitch_m[0] * self.pitch_m[1]
    }
}

fn lobe_at(lobe: &Lobe, pitch_m: [f64; 2], state: State, offset: [i64; 2]) -> f64 {
    lobe.at(direction(state), state[2], [offset[0] as f64 * pitch_m[0], offset[1] as f64 * pitch_m[1]])
}

/// Different states from all over a list: every so many by the golden ratio, which falls into step with no wave.
fn spread_out(states: &[State]) -> Vec<State> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let pick = |i: usize| match states.len() {
        few if few <= SAMPLES => states[i],
        many => states[((i as f64 * GOLDEN).fract() * many as f64) as usize],
    };
    let mut picked: Vec<State> = Vec::with_capacity(SAMPLES);
    for state in (0..states.len().min(SAMPLES)).map(pick) {
        // Level water has one state, many times over: a decomposition takes ill to columns that differ by rounding.
        if !picked.iter().any(|other| is_same(*other, state)) {
            picked.push(state);
        }
    }
    picked
}

/// The part of a window where any of these lobes is above `share` of its peak.
fn trimmed(
    window: Window,
    sample: &[State],
    share: f64,
    value: impl Fn(State, [i64; 2]) -> f64 + Sync,
) -> Window {
    let largest: Vec<f64> = (0..window.len())
        .into_par_iter()
        .map(|index| {
            let offset = window.offset(index);
            sample.iter().step_by(7).map(|state| value(*state, offset)).fold(0.0, f64::max)
        })
        .collect();
    let threshold = share * largest.iter().copied().fold(0.0, f64::max);
    let mut low = [i64::MAX; 2];
    let mut high = [i64::MIN; 2];
    for (index, &value) in largest.iter().enumerate() {
        if value > threshold {
            let offset = window.offset(index);
            for k in 0..2 {
                low[k] = low[k].min(offset[k]);
                high[k] = high[k].max(offset[k]);
            }
        }
    }
    if low[0] > high[0] {
        return window;
    }
    Window { low, size: [0, 1].map(|k| (high[k] - low[k] + 1) as usize) }
}

/// A lattice of offsets through a window, as fine as [`OFFSETS`] allows.
fn coarse_offsets(window: Window) -> Vec<[i64; 2]> {
    let stride = (window.len() as f64 / OFFSETS as f64).sqrt().ceil().max(1.0) as usize;
    let line = |k: usize| (0..window.size[k]).step_by(stride).map(move |i| window.low[k] + i as i64);
    line(1).flat_map(|y| line(0).map(move |x| [x, y])).collect()
}

/// Shares of the way through a box: `share` along one coordinate, half in the others.
fn on_axis(k: usize, share: f64) -> [f64; 3] {
    let mut shares = [0.5; 3];
    shares[k] = share;
    shares
}

/// Nodes along a coordinate for which the polynomial through them is right to `tolerance` of the largest coefficient.
fn node_count(range: &StateBox, k: usize, tolerance: f64, project: &impl Fn(State) -> Vec<f64>) -> usize {
    if range.is_flat(k) {
        return 1;
    }
    let tests: Vec<(f64, Vec<f64>)> = (0..13)
        .map(|i| (f64::from(i) + 0.41) / 13.0)
        .map(|x| (x, project(range.at(on_axis(k, x)))))
        .collect();
    let largest = tests.iter().flat_map(|(_, c)| c).fold(0.0_f64, |m, c| m.max(c.abs()));
    (3..MOST_NODES)
        .find(|&count| {
            let along: Vec<Vec<f64>> = super::state::chebyshev_nodes(count)
                .into_iter()
                .map(|x| project(range.at(on_axis(k, x))))
                .collect();
            tests.iter().all(|(x, expected)| {
                let weights = chebyshev_weights(count, *x);
                expected.iter().enumerate().all(|(r, expected)| {
                    let sum: f64 = weights.iter().zip(&along).map(|(w, c)| w * c[r]).sum();
                    (sum - expected).abs() <= tolerance * largest
                })
            })
        })
        .unwrap_or(MOST_NODES)
}
