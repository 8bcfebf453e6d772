//! What a frame buffer holds: a few bits from 0 to 1, or floating-point numbers.

use half::f16;

use super::compile::Adjust;
use super::interval::Interval;

/// Numbers of a frame buffer.
pub trait Format: Copy + Send + Sync {
    /// A pixel's component.
    type Cell: Copy + Send + Sync + Default;

    /// The nearest number there is; what is out of range is clamped.
    fn store(self, x: f64) -> Self::Cell;
    /// What a cell stands for.
    fn load(self, cell: Self::Cell) -> f64;
    /// Whether storing this number clamps it.
    fn clamps(self, x: f64) -> bool;
    /// Scale and bias for a function of this range.
    fn adjust(self, range: Interval) -> Adjust;
    /// Largest difference between a function of this range and what is stored of it.
    fn rounding(self, range: Interval) -> f64;
    /// Whether functions of this range can be stored at all.
    fn holds(self, range: Interval) -> bool;
    /// What users call it.
    fn name(self) -> String;
    /// Numbers that a cell can hold, if they are so few that tables have an entry for each, and the place of a cell among them.
    fn codes(self) -> Option<usize>;
    /// The place of a cell in a table.
    fn code(self, cell: Self::Cell) -> usize;
}

/// Unsigned fixed point from 0 to 1: code / (2^bits - 1), as frame buffers and textures have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fixed {
    bits: u32,
    by_hand: bool,
}

impl Fixed {
    /// Numbers of bits there are.
    pub const BITS: std::ops::RangeInclusive<u32> = 4..=16;

    /// With 4 to 16 bits, else nothing.
    #[must_use]
    pub fn new(bits: u32) -> Option<Self> {
        Self::BITS.contains(&bits).then_some(Self { bits, by_hand: false })
    }

    /// The same with scales and biases as a programmer without a compiler chooses them: alpha = 1, beta = 0 for what is nowhere
    /// negative and alpha = beta = 1/2 for what is, over as small a power of two as larger ranges need.
    #[must_use]
    pub fn by_hand(self) -> Self {
        Self { by_hand: true, ..self }
    }

    fn last(self) -> f64 {
        f64::from((1_u32 << self.bits) - 1)
    }
}

impl Format for Fixed {
    type Cell = u16;

    fn store(self, x: f64) -> u16 {
        (x * self.last()).round().clamp(0.0, self.last()) as u16
    }

    fn load(self, cell: u16) -> f64 {
        f64::from(cell) / self.last()
    }

    fn clamps(self, x: f64) -> bool {
        (x - 0.5).abs() > 0.5 + 0.5 / self.last()
    }

    fn adjust(self, range: Interval) -> Adjust {
        if self.by_hand {
            let share = range.largest().max(1.0).log2().ceil().exp2().recip();
            let signed = range.low < 0.0;
            return if signed {
                Adjust { scale: 0.5 * share, bias: 0.5 }
            } else {
                Adjust { scale: share, bias: 0.0 }
            };
        }
        let width = range.width();
        if width > 0.0 {
            return Adjust { scale: 1.0 / width, bias: (0.0 - range.low) / width };
        }
        // A constant is all scale: its cell is full, or 0 if it is.
        Adjust { scale: if range.low == 0.0 { 1.0 } else { 1.0 / range.low }, bias: 0.0 }
    }

    fn rounding(self, range: Interval) -> f64 {
        if range.width() == 0.0 && !self.by_hand {
            return 0.0;
        }
        0.5 / (self.adjust(range).scale * self.last())
    }

    fn holds(self, range: Interval) -> bool {
        range.is_finite()
    }

    fn name(self) -> String {
        format!("fixed{}{}", self.bits, if self.by_hand { " by hand" } else { "" })
    }

    fn codes(self) -> Option<usize> {
        Some(1 << self.bits)
    }

    fn code(self, cell: u16) -> usize {
        usize::from(cell)
    }
}

/// Floating point, where nothing needs to be adjusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Float<T>(std::marker::PhantomData<T>);

/// 16-bit floating point.
pub type F16 = Float<f16>;

/// Floating-point numbers of a frame buffer.
pub trait FloatCell: Copy + Send + Sync + Default {
    /// What users call it.
    const NAME: &'static str;
    /// Largest error of a rounded number, as a share of it.
    const RELATIVE: f64;
    /// Largest error of a number close to 0.
    const ABSOLUTE: f64;
    /// The largest number.
    const LARGEST: f64;
    /// The nearest to this.
    fn nearest(x: f64) -> Self;
    /// Without loss.
    fn value(self) -> f64;
}

impl FloatCell for f16 {
    const NAME: &'static str = "f16";
    const RELATIVE: f64 = 1.0 / 2048.0;
    const ABSOLUTE: f64 = 1.0 / 33_554_432.0;
    const LARGEST: f64 = 65_504.0;

    fn nearest(x: f64) -> Self {
        Self::from_f64(x)
    }

    fn value(self) -> f64 {
        self.to_f64()
    }
}

impl FloatCell for f32 {
    const NAME: &'static str = "f32";
    const RELATIVE: f64 = 0.5 * f32::EPSILON as f64;
    const ABSOLUTE: f64 = 1e-45;
    const LARGEST: f64 = Self::MAX as f64;

    fn nearest(x: f64) -> Self {
        x as Self
    }

    fn value(self) -> f64 {
        f64::from(self)
    }
}

impl<T: FloatCell> Format for Float<T> {
    type Cell = T;

    fn store(self, x: f64) -> T {
        T::nearest(x.clamp(-T::LARGEST, T::LARGEST))
    }

    fn load(self, cell: T) -> f64 {
        cell.value()
    }

    fn clamps(self, x: f64) -> bool {
        x.abs() > T::LARGEST
    }

    fn adjust(self, _: Interval) -> Adjust {
        Adjust { scale: 1.0, bias: 0.0 }
    }

    fn rounding(self, range: Interval) -> f64 {
        T::RELATIVE * range.largest() + T::ABSOLUTE
    }

    fn holds(self, range: Interval) -> bool {
        range.largest() <= T::LARGEST
    }

    fn name(self) -> String {
        T::NAME.into()
    }

    fn codes(self) -> Option<usize> {
        None
    }

    fn code(self, _: T) -> usize {
        0
    }
}
