//! The state of a point of the surface that its lobe on the floor depends on: the beam's slopes and its height.

use num_traits::Float;

use crate::error::PondError;
use crate::height_field::HeightField;
use crate::pond::Pond;
use crate::surface_light::SurfaceLight;

/// Share of its range by which a box of states is larger than what was seen.
const MARGIN: f64 = 0.01;

/// (L_x / |L_z|, L_y / |L_z|, d + h in metres).
pub(super) type State = [f64; 3];

/// Beams flatter than this have no state; mirrored by `LEAST_DOWN` in `shaders/pond_coefficients.wgsl`.
pub(crate) const LEAST_DOWN: f64 = 1e-3;

/// The state of a beam that starts `above_m` over the floor.
pub(crate) fn state<T: Float>([x, y, z]: [T; 3], above_m: T) -> [T; 3] {
    [x / -z, y / -z, above_m]
}

/// The states of all samples of a surface.
///
/// # Errors
/// Beams that do not travel downwards.
pub(super) fn states(
    surface: &HeightField,
    pond: &Pond,
    light: &SurfaceLight,
) -> Result<Vec<State>, PondError> {
    let upwards = light.directions.iter().filter(|direction| direction[2] >= -LEAST_DOWN).count();
    if upwards > 0 {
        return Err(PondError::UpwardBeams { upwards, samples: light.directions.len() });
    }
    let beams = light.directions.iter().zip(&surface.heights_m);
    Ok(beams.map(|(direction, h)| state(*direction, pond.depth_m + h)).collect())
}

/// Whether coordinates of this size that differ by so much are the same: beams of equal slope differ by rounding.
fn is_rounding(difference: f64, size: f64) -> bool {
    difference.abs() < 1e-9 * size.abs().max(1e-3)
}

/// Whether two states are the same but for rounding.
pub(super) fn is_same(a: State, b: State) -> bool {
    (0..3).all(|k| is_rounding(a[k] - b[k], a[k]))
}

/// The unit direction of a state's beam.
pub(super) fn direction([p, q, _]: State) -> [f64; 3] {
    let z = 1.0 / (1.0 + p * p + q * q).sqrt();
    [p * z, q * z, -z]
}

/// A box of states, spanned by Chebyshev nodes of the second kind in each coordinate: the ends and what is between.
#[derive(Clone, Copy, Debug)]
pub(super) struct StateBox {
    pub(super) low: State,
    pub(super) high: State,
}

impl StateBox {
    /// Around all of these.
    pub(super) fn around(states: &[State]) -> Self {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for state in states {
            for k in 0..3 {
                low[k] = low[k].min(state[k]);
                high[k] = high[k].max(state[k]);
            }
        }
        let lowest = low[2];
        for k in 0..3 {
            let margin = MARGIN * (high[k] - low[k]);
            (low[k], high[k]) = (low[k] - margin, high[k] + margin);
            if is_rounding(high[k] - low[k], high[k]) {
                high[k] = low[k];
            }
        }
        // The floor stays below all states of the box.
        low[2] = low[2].max(0.5 * lowest);
        Self { low, high }
    }

    /// Whether a coordinate does not vary.
    pub(super) fn is_flat(&self, k: usize) -> bool {
        self.high[k] <= self.low[k]
    }

    /// The state at these shares of the way from `low` to `high`.
    pub(super) fn at(&self, shares: [f64; 3]) -> State {
        [0, 1, 2].map(|k| self.low[k] + shares[k] * (self.high[k] - self.low[k]))
    }
}

/// Chebyshev nodes on 0..1, ends included; the middle if there is one.
pub(super) fn chebyshev_nodes(count: usize) -> Vec<f64> {
    if count == 1 {
        return vec![0.5];
    }
    let node = |i: usize| 0.5 - 0.5 * (std::f64::consts::PI * i as f64 / (count - 1) as f64).cos();
    (0..count).map(node).collect()
}

/// Weights of the values at `count` nodes in the polynomial through them, at `x` (barycentric form, Berrut & Trefethen 2004).
pub(super) fn chebyshev_weights(count: usize, x: f64) -> Vec<f64> {
    let nodes = chebyshev_nodes(count);
    if let Some(hit) = nodes.iter().position(|node| (x - node).abs() < 1e-14) {
        return (0..count).map(|i| f64::from(u8::from(i == hit))).collect();
    }
    let mut weights: Vec<f64> = nodes
        .iter()
        .enumerate()
        .map(|(i, node)| {
            let end = if i == 0 || i + 1 == count { 0.5 } else { 1.0 };
            let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
            sign * end / (x - node)
        })
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    weights
}
