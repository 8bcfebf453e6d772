//! What is to be computed at every sample, as a graph in which everything has a range.

use std::sync::Arc;

use super::interval::Interval;
use super::table::{Function, Table};

/// A value of an [`Expressions`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node(pub(super) usize);

/// Expressions over the same inputs; what they share is computed once.
#[derive(Clone, Default)]
pub struct Expressions {
    pub(super) entries: Vec<Entry>,
    pub(super) inputs: usize,
}

/// One value.
#[derive(Clone)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) range: Interval,
}

/// How a value comes about.
#[derive(Clone)]
pub(super) enum Kind {
    /// The input of this number, off by so much already.
    Input { number: usize, error: f64 },
    /// Sum of c_k f_k, plus a constant.
    Sum { terms: Vec<(f64, Node)>, constant: f64 },
    /// f g.
    Product(Node, Node),
    /// A function of one or two others.
    Table { table: Table, of: Vec<Node> },
}

impl Expressions {
    /// None yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A new input with values in `range` that are off by `error` at most; inputs are numbered from 0 in this order.
    pub fn input(&mut self, name: &str, range: Interval, error: f64) -> Node {
        self.inputs += 1;
        self.push(name, Kind::Input { number: self.inputs - 1, error }, range)
    }

    /// Sum of c f over `terms`, plus a constant: sums, differences and multiples.
    pub fn sum(&mut self, name: &str, terms: &[(f64, Node)], constant: f64) -> Node {
        let start = Interval::between(constant, constant);
        let range = terms.iter().fold(start, |range, (c, f)| range.plus(self.range(*f).times(*c)));
        self.push(name, Kind::Sum { terms: terms.to_vec(), constant }, range)
    }

    /// The same, known to stay within `known`, narrower than its terms say; what does not is clamped.
    pub fn sum_within(&mut self, name: &str, terms: &[(f64, Node)], constant: f64, known: Interval) -> Node {
        let node = self.sum(name, terms, constant);
        let range = &mut self.entries[node.0].range;
        *range = Interval { low: range.low.max(known.low), high: range.high.min(known.high) };
        node
    }

    /// f g.
    pub fn product(&mut self, name: &str, f: Node, g: Node) -> Node {
        let range = self.range(f).product(self.range(g));
        self.push(name, Kind::Product(f, g), range)
    }

    /// A function of one value.
    pub fn table(
        &mut self,
        name: &str,
        f: Node,
        function: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Node {
        self.tabulated(name, vec![f], Arc::new(move |x: &[f64]| function(x[0])))
    }

    /// A function of two values: what the paper calls pixel texturing.
    pub fn table_of_two(
        &mut self,
        name: &str,
        [f, g]: [Node; 2],
        function: impl Fn(f64, f64) -> f64 + Send + Sync + 'static,
    ) -> Node {
        self.tabulated(name, vec![f, g], Arc::new(move |x: &[f64]| function(x[0], x[1])))
    }

    /// Where the values of a node can lie.
    #[must_use]
    pub fn range(&self, node: Node) -> Interval {
        self.entries[node.0].range
    }

    fn tabulated(&mut self, name: &str, of: Vec<Node>, function: Function) -> Node {
        let table = Table::new(function, of.iter().map(|f| self.range(*f)).collect());
        let range = table.range;
        self.push(name, Kind::Table { table, of }, range)
    }

    fn push(&mut self, name: &str, kind: Kind, range: Interval) -> Node {
        self.entries.push(Entry { name: name.into(), kind, range });
        Node(self.entries.len() - 1)
    }
}
