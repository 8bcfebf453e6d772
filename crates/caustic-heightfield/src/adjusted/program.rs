//! Passes over the frame buffer, and running them.

use rayon::prelude::*;
use serde::Serialize;

use super::compile::Adjust;
use super::format::Format;
use super::interval::Interval;
use super::table::Table;

/// Samples that go through all passes together.
const CHUNK: usize = 256;
/// Most entries of a table; larger ones are computed where they are read, with the same result.
const MAX_ENTRIES: usize = 1 << 16;

/// Compiled expressions.
pub struct Program<F: Format> {
    format: F,
    passes: Vec<Pass<F::Cell>>,
    inputs: usize,
    outputs: Vec<usize>,
}

/// One pass: what it reads, does and stores.
pub(super) struct Pass<C> {
    pub(super) name: String,
    pub(super) operation: Operation<C>,
    pub(super) range: Interval,
    pub(super) adjust: Adjust,
    /// Largest difference between what is stored and what was meant.
    pub(super) error: f64,
}

/// What a pass does with adjusted functions, which are the numbers of earlier passes.
pub(super) enum Operation<C> {
    /// Stores an input.
    Input(usize),
    /// Sum of s f~, plus a bias.
    Sum { terms: Vec<(f64, usize)>, bias: f64 },
    /// g~ f~ + (1 - g~) beta.
    Blend { weight: usize, of: usize, bias: f64 },
    /// A look-up, in `entries` where there are so few that all are kept, first argument fastest.
    Table { table: Table, of: Vec<usize>, entries: Option<Vec<C>> },
}

/// A pass as people may want to see it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassReport {
    /// What it computes.
    pub name: String,
    /// Where its values can lie.
    pub range: Interval,
    /// How they are stored.
    pub adjust: Adjust,
    /// Largest error of any value, with the errors of all that it is made of.
    pub error_bound: f64,
}

/// The outputs of a program.
#[derive(Clone, Debug)]
pub struct Values<C> {
    /// One list of cells per output.
    pub cells: Vec<Vec<C>>,
    /// How often a pass clamped what it stored.
    pub clamped: usize,
}

impl<F: Format> Program<F> {
    pub(super) fn new(format: F, passes: Vec<Pass<F::Cell>>, inputs: usize, outputs: Vec<usize>) -> Self {
        let mut program = Self { format, passes, inputs, outputs };
        for place in 0..program.passes.len() {
            let entries = program.entries(place);
            if let Operation::Table { entries: kept, .. } = &mut program.passes[place].operation {
                *kept = entries;
            }
        }
        program
    }

    /// All entries of the table of a pass, if it is one and they are few.
    fn entries(&self, place: usize) -> Option<Vec<F::Cell>> {
        let Operation::Table { table, of, .. } = &self.passes[place].operation else { return None };
        let codes = self.format.codes()?;
        let count = codes.checked_pow(of.len() as u32).filter(|count| *count <= MAX_ENTRIES)?;
        let adjust = self.passes[place].adjust;
        let entry = |index: usize| {
            let mut arguments: Vec<f64> = of
                .iter()
                .enumerate()
                .map(|(k, f)| {
                    let code = index / codes.pow(k as u32) % codes;
                    self.passes[*f].adjust.undone(code as f64 / (codes - 1) as f64)
                })
                .collect();
            self.format.store(adjust.done(table.at(&mut arguments)))
        };
        Some((0..count).map(entry).collect())
    }

    /// What is stored where.
    #[must_use]
    pub fn passes(&self) -> Vec<PassReport> {
        let report = |pass: &Pass<F::Cell>| PassReport {
            name: pass.name.clone(),
            range: pass.range,
            adjust: pass.adjust,
            error_bound: pass.error,
        };
        self.passes.iter().map(report).collect()
    }

    /// How an output is stored, where it lies, and the largest error of its values.
    #[must_use]
    pub fn output(&self, output: usize) -> PassReport {
        self.passes().swap_remove(self.outputs[output])
    }

    /// The value of an output's cell.
    #[must_use]
    pub fn value(&self, output: usize, cell: F::Cell) -> f64 {
        self.passes[self.outputs[output]].adjust.undone(self.format.load(cell))
    }

    /// Run all passes for so many samples; `input(number, sample)` are the inputs.
    #[must_use]
    pub fn run(&self, samples: usize, input: impl Fn(usize, usize) -> f64 + Sync) -> Values<F::Cell> {
        let chunks: Vec<(Vec<Vec<F::Cell>>, usize)> = (0..samples.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let of_chunk = chunk * CHUNK..samples.min((chunk + 1) * CHUNK);
                let mut buffers: Vec<Vec<F::Cell>> = Vec::with_capacity(self.passes.len());
                let mut clamped = 0;
                for pass in &self.passes {
                    let (cells, of_pass) = self.pass(pass, &buffers, of_chunk.clone(), &input);
                    clamped += of_pass;
                    buffers.push(cells);
                }
                (self.outputs.iter().map(|&place| buffers[place].clone()).collect(), clamped)
            })
            .collect();
        let cells = (0..self.outputs.len())
            .map(|output| chunks.iter().flat_map(|(cells, _)| cells[output].iter().copied()).collect())
            .collect();
        Values { cells, clamped: chunks.iter().map(|(_, clamped)| clamped).sum() }
    }

    /// One pass over one chunk: its cells, and how many were clamped.
    fn pass(
        &self,
        pass: &Pass<F::Cell>,
        buffers: &[Vec<F::Cell>],
        samples: std::ops::Range<usize>,
        input: &impl Fn(usize, usize) -> f64,
    ) -> (Vec<F::Cell>, usize) {
        let format = self.format;
        let load = |place: usize, i: usize| format.load(buffers[place][i]);
        let count = samples.len();
        let mut clamped = 0;
        let mut store = |x: f64| {
            clamped += usize::from(format.clamps(x));
            format.store(x)
        };
        let cells = match &pass.operation {
            Operation::Input(number) => {
                debug_assert!(*number < self.inputs);
                samples.map(|sample| store(pass.adjust.done(input(*number, sample)))).collect()
            }
            Operation::Sum { terms, bias } => (0..count)
                .map(|i| store(bias + terms.iter().map(|(s, f)| s * load(*f, i)).sum::<f64>()))
                .collect(),
            Operation::Blend { weight, of, bias } => (0..count)
                .map(|i| {
                    let g = load(*weight, i);
                    store(g * load(*of, i) + (1.0 - g) * bias)
                })
                .collect(),
            Operation::Table { of, entries: Some(entries), .. } => {
                let codes = format.codes().unwrap_or(1);
                let code = |f: &usize, i: usize| format.code(buffers[*f][i]);
                let place = |i: usize| of.iter().rev().fold(0, |place, f| place * codes + code(f, i));
                (0..count).map(|i| entries[place(i)]).collect()
            }
            Operation::Table { table, of, entries: None } => {
                let mut arguments = vec![0.0; of.len()];
                (0..count)
                    .map(|i| {
                        for (x, f) in arguments.iter_mut().zip(of) {
                            *x = self.passes[*f].adjust.undone(load(*f, i));
                        }
                        store(pass.adjust.done(table.at(&mut arguments)))
                    })
                    .collect()
            }
        };
        (cells, clamped)
    }
}
