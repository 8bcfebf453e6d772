//! Pass 6: three convolutions and their sum, in a frame buffer.

use rayon::prelude::*;

use super::Accumulation;
use crate::adjusted::{Expressions, Format, Interval, PassReport, Program};
use crate::convolution::Kernels;
use crate::convolve::{Convolve, TermSum, Window, add_row};
use crate::error::PondError;
use crate::pond::Outside;

/// Kernels as they are stored, and how floors are summed with them.
pub(super) struct FloorSum<F: Format> {
    format: F,
    size: [usize; 2],
    outside: Outside,
    /// What kernels were divided by: their largest weight.
    kernel_scale: f64,
    way: Way,
    /// Input 0 to 2 are the convolutions, output 0 is the floor. Where every tap is stored only its floor's range is used.
    sum: Program<F>,
    passes: Vec<PassReport>,
}

enum Way {
    PerTerm(Box<[TermSum<f64>; 3]>),
    PerTap { window: Window, kernels: [Vec<f64>; 3] },
}

impl<F: Format> FloorSum<F> {
    /// `sources` say what is known of what is convolved.
    pub(super) fn new(
        size: [usize; 2],
        outside: Outside,
        kernels: Kernels,
        sources: &[PassReport; 3],
        accumulation: Accumulation,
        format: F,
    ) -> Result<Self, PondError> {
        let Kernels { window, values, .. } = kernels;
        let largest = Interval::of(values.iter().flatten().copied()).largest();
        let kernel_scale = if largest > 0.0 { largest } else { 1.0 };
        let mut e = Expressions::new();
        let mut terms = Vec::with_capacity(3);
        let stored = [0, 1, 2].map(|k| {
            let exact: Vec<f64> = values[k].iter().map(|v| v / kernel_scale).collect();
            let range = Interval::of(exact.iter().copied()).with_zero();
            let adjust = format.adjust(range);
            let stored: Vec<f64> =
                exact.iter().map(|&v| adjust.undone(format.load(format.store(adjust.done(v))))).collect();
            // Sources may be 0 anywhere, outside of the pond they are.
            let lit = sources[k].range.with_zero();
            let zero = Interval::between(0.0, 0.0);
            let reached = stored.iter().fold(zero, |sum, w| sum.plus(lit.times(*w)));
            let weights: f64 = stored.iter().map(|w| w.abs()).sum();
            let missing: f64 = stored.iter().zip(&exact).map(|(s, e)| (s - e).abs()).sum();
            let error = weights * sources[k].error_bound + missing * lit.largest();
            terms.push((1.0, e.input(["F_x * k_x", "F_y * k_y", "F_z * k_z"][k], reached, error)));
            stored
        });
        let floor = e.sum("E", &terms, 0.0);
        let sum = e.compile(&[floor], format)?;
        let mut passes = sum.passes();
        let way = match accumulation {
            Accumulation::PerTerm => {
                let term = |kernel| TermSum::new(size, outside, window, vec![kernel], Convolve::Auto);
                Way::PerTerm(Box::new(stored.map(term)))
            }
            Accumulation::PerTap => {
                // One store a tap, of the floor's range, in place of four.
                let exact: f64 = passes[..3].iter().map(|p| p.error_bound - format.rounding(p.range)).sum();
                passes.drain(..3);
                passes[0].error_bound = exact + 3.0 * window.len() as f64 * format.rounding(passes[0].range);
                Way::PerTap { window, kernels: stored }
            }
        };
        Ok(Self { format, size, outside, kernel_scale, way, sum, passes })
    }

    pub(super) fn format(&self) -> F {
        self.format
    }

    pub(super) fn kernel_scale(&self) -> f64 {
        self.kernel_scale
    }

    pub(super) fn passes(&self) -> Vec<PassReport> {
        self.passes.clone()
    }

    /// The floor of three sources, and how often a value was clamped.
    pub(super) fn sum(&self, sources: Vec<Vec<f64>>) -> (Vec<f64>, usize) {
        match &self.way {
            Way::PerTerm(terms) => {
                let convolved: Vec<Vec<f64>> =
                    terms.iter().zip(sources).map(|(term, source)| term.sum(&[source])).collect();
                let floor = self.sum.run(convolved[0].len(), |k, sample| convolved[k][sample]);
                (floor.cells[0].iter().map(|&cell| self.sum.value(0, cell)).collect(), floor.clamped)
            }
            Way::PerTap { window, kernels } => {
                let format = self.format;
                let adjust = self.passes[0].adjust;
                let dark = format.store(adjust.done(0.0));
                let mut floor = vec![dark; self.size[0] * self.size[1]];
                let clamped = floor
                    .par_chunks_mut(self.size[0])
                    .enumerate()
                    .map(|(j, row)| {
                        let clamped = std::cell::Cell::new(0);
                        let add = |cell: F::Cell, weight: f64, light: f64| {
                            let next = format.load(cell) + adjust.scale * weight * light;
                            clamped.set(clamped.get() + usize::from(format.clamps(next)));
                            format.store(next)
                        };
                        for (kernel, source) in kernels.iter().zip(&sources) {
                            add_row(
                                row,
                                j,
                                self.size,
                                self.outside,
                                (*window, window.whole()),
                                kernel,
                                source,
                                add,
                            );
                        }
                        clamped.get()
                    })
                    .sum();
                (floor.into_iter().map(|cell| adjust.undone(format.load(cell))).collect(), clamped)
            }
        }
    }
}
