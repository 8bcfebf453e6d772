//! From expressions to passes over the frame buffer.

use serde::Serialize;

use super::expression::{Expressions, Kind, Node};
use super::format::Format;
use super::interval::Interval;
use super::program::{Operation, Pass, Program};
use crate::error::PondError;

/// A function f is stored as f~ = `scale` f + `bias`: the paper's alpha and beta.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Adjust {
    /// alpha.
    pub scale: f64,
    /// beta.
    pub bias: f64,
}

impl Adjust {
    /// f of f~.
    #[must_use]
    pub fn undone(self, adjusted: f64) -> f64 {
        (adjusted - self.bias) / self.scale
    }

    /// f~ of f.
    #[must_use]
    pub fn done(self, f: f64) -> f64 {
        self.scale * f + self.bias
    }

    /// The functions that are stored from 0 to 1.
    fn range(self) -> Interval {
        Interval::between(self.undone(0.0), self.undone(1.0))
    }
}

impl Expressions {
    /// Passes that compute `outputs` in frame buffers of a format.
    ///
    /// # Errors
    /// A value whose range the format does not hold, or that has none.
    pub fn compile<F: Format>(&self, outputs: &[Node], format: F) -> Result<Program<F>, PondError> {
        let mut factors = vec![false; self.entries.len()];
        for entry in &self.entries {
            if let Kind::Product(f, g) = entry.kind {
                (factors[f.0], factors[g.0]) = (true, true);
            }
        }
        let mut compiler = Compiler { format, passes: Vec::new() };
        let mut places = Vec::with_capacity(self.entries.len());
        for (entry, is_factor) in self.entries.iter().zip(factors) {
            // Blends add (1 - g~) beta, so beta must be a pixel: 0 is in the range of a factor.
            let range = if is_factor { entry.range.with_zero() } else { entry.range };
            if !(range.is_finite() && format.holds(range)) {
                return Err(PondError::Range {
                    name: entry.name.clone(),
                    low: range.low,
                    high: range.high,
                    format: format.name(),
                });
            }
            let place = |node: &Node| places[node.0];
            places.push(match &entry.kind {
                Kind::Input { number, error } => {
                    compiler.push(&entry.name, Operation::Input(*number), range, *error)
                }
                Kind::Sum { terms, constant } => {
                    let terms: Vec<_> = terms.iter().map(|(c, f)| (*c, place(f))).collect();
                    compiler.sum(&entry.name, &terms, *constant, range)
                }
                Kind::Product(f, g) => compiler.product(&entry.name, place(f), place(g), range),
                Kind::Table { table, of } => {
                    let of: Vec<usize> = of.iter().map(place).collect();
                    let errors = of.iter().zip(&table.steepness).map(|(f, s)| s * compiler.passes[*f].error);
                    let error = errors.sum();
                    let operation = Operation::Table { table: table.clone(), of, entries: None };
                    compiler.push(&entry.name, operation, range, error)
                }
            });
        }
        let outputs = outputs.iter().map(|node| places[node.0]).collect();
        Ok(Program::new(format, compiler.passes, self.inputs, outputs))
    }
}

struct Compiler<F: Format> {
    format: F,
    passes: Vec<Pass<F::Cell>>,
}

impl<F: Format> Compiler<F> {
    /// A pass that stores functions of this range; `error` is what comes with its arguments.
    fn push(&mut self, name: &str, operation: Operation<F::Cell>, range: Interval, error: f64) -> usize {
        let adjust = self.format.adjust(range);
        self.push_adjusted(name, operation, range, adjust, error)
    }

    fn push_adjusted(
        &mut self,
        name: &str,
        operation: Operation<F::Cell>,
        range: Interval,
        adjust: Adjust,
        error: f64,
    ) -> usize {
        let error = error + self.format.rounding(range);
        self.passes.push(Pass { name: name.into(), operation, range, adjust, error });
        self.passes.len() - 1
    }

    /// f~ = alpha (sum of c_k (f_k~ - beta_k) / alpha_k + c) + beta: scales, and one bias.
    fn sum(&mut self, name: &str, terms: &[(f64, usize)], constant: f64, range: Interval) -> usize {
        let Adjust { scale, bias } = self.format.adjust(range);
        let of = |f: usize| (self.passes[f].adjust, self.passes[f].error);
        let scales = terms.iter().map(|(c, f)| (scale * c / of(*f).0.scale, *f)).collect();
        let biases: f64 = terms.iter().map(|(c, f)| c * of(*f).0.bias / of(*f).0.scale).sum();
        let error = terms.iter().map(|(c, f)| c.abs() * of(*f).1).sum();
        let operation = Operation::Sum { terms: scales, bias: scale * (constant - biases) + bias };
        self.push(name, operation, range, error)
    }

    fn product(&mut self, name: &str, f: usize, g: usize, range: Interval) -> usize {
        let of = |f: usize| (self.passes[f].adjust, self.passes[f].error, self.passes[f].range.largest());
        let ((af, ef, mf), (ag, eg, mg)) = (of(f), of(g));
        let error = mf * eg + mg * ef + ef * eg;
        // The weight of a blend is not biased; f g is then stored with the scale of both and the bias of the other.
        let weighed = [(g, ag, f, af), (f, af, g, ag)].into_iter().find(|(_, weight, ..)| weight.bias == 0.0);
        if let Some((weight, aw, other, ao)) = weighed {
            let adjust = Adjust { scale: aw.scale * ao.scale, bias: ao.bias };
            let stored = if self.format.codes().is_some() { adjust.range() } else { range };
            let operation = Operation::Blend { weight, of: other, bias: ao.bias };
            return self.push_adjusted(name, operation, stored, adjust, error);
        }
        // f g = (f~ g~ - (beta_g f~ + beta_f g~) + beta_f beta_g) / (alpha_f alpha_g).
        let biases = af.bias + ag.bias;
        let stored = Interval::between(0.0, 1.0);
        let both = self.push(
            &format!("{name}: f~ g~"),
            Operation::Blend { weight: f, of: g, bias: 0.0 },
            stored,
            0.0,
        );
        let shares = vec![(ag.bias / biases, f), (af.bias / biases, g)];
        let mixed =
            self.push(&format!("{name}: f~ + g~"), Operation::Sum { terms: shares, bias: 0.0 }, stored, 0.0);
        let Adjust { scale, bias } = self.format.adjust(range);
        let amplified = 1.0 / (af.scale * ag.scale);
        let terms = vec![(scale * amplified, both), (-scale * amplified * biases, mixed)];
        let bias = scale * amplified * af.bias * ag.bias + bias;
        let rounded = (1.0 + biases) * self.format.rounding(stored) * amplified;
        self.push(name, Operation::Sum { terms, bias }, range, error + rounded)
    }
}
