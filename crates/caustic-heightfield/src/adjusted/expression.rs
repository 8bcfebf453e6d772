//! What is to be computed at every sample, as a graph in which everything has a range.

use std::sync::Arc;

use super::interval::Interval;

/// Samples of a table's domain along each of its arguments, for its range and steepness: of one argument, of two.
const LATTICE: [usize; 2] = [513, 65];

/// A function of one or two numbers.
type Function = Arc<dyn Fn(&[f64]) -> f64 + Send + Sync>;

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

/// A function and what its samples say of it.
#[derive(Clone)]
pub(super) struct Table {
    pub(super) function: Function,
    /// Where it is defined; arguments are clamped to this.
    pub(super) domain: Vec<Interval>,
    /// Its change per change of each argument, at most.
    pub(super) steepness: Vec<f64>,
}

impl Table {
    /// The value at the place of the domain nearest to `arguments`, which are used up.
    pub(super) fn at(&self, arguments: &mut [f64]) -> f64 {
        for (x, domain) in arguments.iter_mut().zip(&self.domain) {
            *x = x.clamp(domain.low, domain.high);
        }
        (self.function)(arguments)
    }
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
        let domain: Vec<Interval> = of.iter().map(|f| self.range(*f)).collect();
        let side = LATTICE[of.len() - 1];
        let count = side.pow(of.len() as u32);
        // Sample number `i`: the digits of i, to the base `side`, are places along the arguments.
        let place = |i: usize, k: usize| i / side.pow(k as u32) % side;
        let values: Vec<f64> = (0..count)
            .map(|i| {
                let at: Vec<f64> = domain
                    .iter()
                    .enumerate()
                    .map(|(k, d)| d.low + d.width() * place(i, k) as f64 / (side - 1) as f64)
                    .collect();
                function(&at)
            })
            .collect();
        // How far the function changes between neighbouring samples along argument k, and how much that itself changes.
        let differences = |k: usize, order: usize, next: usize| {
            let values = &values;
            (0..count).filter(move |i| place(*i, k) + order < side).map(move |i| match order {
                1 => values[i + next] - values[i],
                _ => values[i + 2 * next] - 2.0 * values[i + next] + values[i],
            })
        };
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut steepness = Vec::new();
        let mut margin = 0.0;
        for (k, domain) in domain.iter().enumerate() {
            let next = side.pow(k as u32);
            let curved = largest(&mut differences(k, 2, next));
            let step = domain.width() / (side - 1) as f64;
            let steepest = largest(&mut differences(k, 1, next)) + curved;
            steepness.push(if step > 0.0 { steepest / step } else { 0.0 });
            // Between samples a function leaves the line through them by an eighth of its second difference; at the ends of a
            // table it does not leave it outwards if it is monotone.
            let up = differences(k, 1, next).all(|d| d >= 0.0);
            if !up && !differences(k, 1, next).all(|d| d <= 0.0) {
                margin += 0.25 * curved;
            }
        }
        let sampled = Interval::of(values.iter().copied());
        let range = sampled.widened(margin);
        // What is nowhere negative among its samples is not made so by the margin.
        let range = if sampled.low >= 0.0 { Interval { low: range.low.max(0.0), ..range } } else { range };
        self.push(name, Kind::Table { table: Table { function, domain, steepness }, of }, range)
    }

    fn push(&mut self, name: &str, kind: Kind, range: Interval) -> Node {
        self.entries.push(Entry { name: name.into(), kind, range });
        Node(self.entries.len() - 1)
    }
}
