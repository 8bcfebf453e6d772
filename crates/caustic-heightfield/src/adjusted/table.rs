//! Functions that are tabulated, and what samples say of their range and steepness.

use std::sync::Arc;

use super::interval::Interval;

/// A function of one or two numbers.
pub(super) type Function = Arc<dyn Fn(&[f64]) -> f64 + Send + Sync>;

/// Samples along each argument: of functions of one, of two.
const SIDES: [usize; 2] = [513, 65];

/// A function and where it is defined.
#[derive(Clone)]
pub(super) struct Table {
    function: Function,
    /// Arguments are clamped to this.
    domain: Vec<Interval>,
    /// Its change per change of each argument, at most.
    pub(super) steepness: Vec<f64>,
    /// Where its values lie.
    pub(super) range: Interval,
}

impl Table {
    /// A function, sampled all over its domain.
    pub(super) fn new(function: Function, domain: Vec<Interval>) -> Self {
        let lattice = Lattice::new(&function, &domain);
        let mut steepness = Vec::with_capacity(domain.len());
        let mut margin = 0.0;
        for (k, domain) in domain.iter().enumerate() {
            let curved = lattice.second_differences(k).fold(0.0_f64, |m, d| m.max(d.abs()));
            let steepest = lattice.differences(k).fold(0.0_f64, |m, d| m.max(d.abs()));
            let step = domain.width() / (lattice.side - 1) as f64;
            steepness.push(if step > 0.0 { (steepest + curved) / step } else { 0.0 });
            // Between samples a function leaves the line through them by an eighth of its second difference; one that is monotone
            // does not leave its range by that.
            let monotone =
                lattice.differences(k).all(|d| d >= 0.0) || lattice.differences(k).all(|d| d <= 0.0);
            margin += if monotone { 0.0 } else { 0.25 * curved };
        }
        let sampled = Interval::of(lattice.values.iter().copied());
        let mut range = sampled.widened(margin);
        if sampled.low >= 0.0 {
            // What is nowhere negative among its samples is not made so by the margin.
            range.low = range.low.max(0.0);
        }
        Self { function, domain, steepness, range }
    }

    /// The value at the place of the domain nearest to `arguments`, which are used up.
    pub(super) fn at(&self, arguments: &mut [f64]) -> f64 {
        for (x, domain) in arguments.iter_mut().zip(&self.domain) {
            *x = x.clamp(domain.low, domain.high);
        }
        (self.function)(arguments)
    }
}

/// Values of a function at evenly spaced places of its domain, its ends included; first argument fastest.
struct Lattice {
    side: usize,
    values: Vec<f64>,
}

impl Lattice {
    fn new(function: &Function, domain: &[Interval]) -> Self {
        let side = SIDES[domain.len() - 1];
        let share = |i: usize, k: usize| place(side, i, k) as f64 / (side - 1) as f64;
        let value = |i: usize| {
            let at: Vec<f64> =
                domain.iter().enumerate().map(|(k, d)| d.low + d.width() * share(i, k)).collect();
            function(&at)
        };
        Self { side, values: (0..side.pow(domain.len() as u32)).map(value).collect() }
    }

    /// From every sample to the next along argument `k`.
    fn differences(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        let next = self.side.pow(k as u32);
        (0..self.values.len())
            .filter(move |&i| place(self.side, i, k) + 1 < self.side)
            .map(move |i| self.values[i + next] - self.values[i])
    }

    /// Of those.
    fn second_differences(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        let next = self.side.pow(k as u32);
        (0..self.values.len())
            .filter(move |&i| place(self.side, i, k) + 2 < self.side)
            .map(move |i| self.values[i + 2 * next] - 2.0 * self.values[i + next] + self.values[i])
    }
}

/// Where sample `i` is along argument `k`: a digit of i to the base `side`.
fn place(side: usize, i: usize, k: usize) -> usize {
    i / side.pow(k as u32) % side
}
