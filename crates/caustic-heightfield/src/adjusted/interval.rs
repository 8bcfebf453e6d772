//! Where the values of an expression can lie.

use serde::Serialize;

/// All numbers from `low` to `high`, both included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The smallest.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

impl Interval {
    /// From one number to another, in either order.
    #[must_use]
    pub fn between(a: f64, b: f64) -> Self {
        Self { low: a.min(b), high: a.max(b) }
    }

    /// From `-largest` to `largest`.
    #[must_use]
    pub fn around_zero(largest: f64) -> Self {
        Self::between(-largest, largest)
    }

    /// The smallest interval with all of these numbers; that of none is 0.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        values.into_iter().map(|x| Self::between(x, x)).reduce(Self::hull).unwrap_or(Self::between(0.0, 0.0))
    }

    /// What both cover and all between.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Widened so far that 0 is in it.
    #[must_use]
    pub fn with_zero(self) -> Self {
        self.hull(Self::between(0.0, 0.0))
    }

    /// Widened by `margin` on both sides.
    #[must_use]
    pub fn widened(self, margin: f64) -> Self {
        Self { low: self.low - margin, high: self.high + margin }
    }

    /// Of c x.
    #[must_use]
    pub fn times(self, c: f64) -> Self {
        Self::between(c * self.low, c * self.high)
    }

    /// Of x + y.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { low: self.low + other.low, high: self.high + other.high }
    }

    /// Of x y.
    #[must_use]
    pub fn product(self, other: Self) -> Self {
        self.times(other.low).hull(self.times(other.high))
    }

    /// high - low.
    #[must_use]
    pub fn width(self) -> f64 {
        self.high - self.low
    }

    /// Largest absolute value.
    #[must_use]
    pub fn largest(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    /// Whether both ends are numbers.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }
}
