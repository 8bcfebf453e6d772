//! Heights of a water surface on a rectangular grid.

use crate::error::{PondError, check_positive};
use crate::pond::Outside;

/// Samples that are worth a task of their own.
pub(crate) const CHUNK: usize = 512;
/// Most samples on a side.
pub(crate) const MAX_SIDE: usize = 1 << 14;

/// The surface z = h(x, y), sampled at the centres of a grid's cells.
///
/// What this crate makes is valid. The fields are open, so whatever takes one checks it again.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Samples in x and y.
    pub size: [usize; 2],
    /// Length of the pond in x and y, metres.
    pub extent_m: [f64; 2],
    /// Heights above the water at rest, metres, row-major with x fastest.
    pub heights_m: Vec<f64>,
}

impl HeightField {
    /// Water at rest.
    ///
    /// # Errors
    /// A grid without samples or a pond without extent.
    pub fn flat(size: [usize; 2], extent_m: [f64; 2]) -> Result<Self, PondError> {
        Self::from_fn(size, extent_m, |_, _| 0.0)
    }

    /// The heights `h(x_m, y_m)`, metres, of any function.
    ///
    /// # Errors
    /// A grid without samples, a pond without extent, a height that is no finite number.
    pub fn from_fn(
        size: [usize; 2],
        extent_m: [f64; 2],
        h: impl Fn(f64, f64) -> f64,
    ) -> Result<Self, PondError> {
        check_grid(size, extent_m)?;
        let heights_m = positions_m(size, extent_m).map(|[x, y]| h(x, y)).collect();
        Self::from_values(size, extent_m, heights_m)
    }

    /// Heights that were computed elsewhere, metres, row-major with x fastest.
    ///
    /// # Errors
    /// As [`Self::from_fn`], and if the number of heights is not that of the samples.
    pub fn from_values(size: [usize; 2], extent_m: [f64; 2], heights_m: Vec<f64>) -> Result<Self, PondError> {
        let field = Self { size, extent_m, heights_m };
        field.check()?;
        Ok(field)
    }

    /// Heights as rows of equal length, metres, the row of the smallest y first.
    ///
    /// # Errors
    /// As [`Self::from_values`], and if rows have different lengths.
    pub fn from_rows(rows: &[Vec<f64>], extent_m: [f64; 2]) -> Result<Self, PondError> {
        let width = rows.first().map_or(0, Vec::len);
        if let Some((row, values)) = rows.iter().enumerate().find(|(_, values)| values.len() != width) {
            return Err(PondError::RaggedRow { row, got: values.len(), expected: width });
        }
        Self::from_values([width, rows.len()], extent_m, rows.concat())
    }

    /// Whether it is a height field: samples, an extent, finite heights, as many as the grid has samples.
    ///
    /// # Errors
    /// Says which of these does not hold.
    pub fn check(&self) -> Result<(), PondError> {
        check_grid(self.size, self.extent_m)?;
        check_values("height", self.size, &self.heights_m, "finite", f64::is_finite)
    }

    /// Distance between neighbouring samples in x and y, metres.
    #[must_use]
    pub fn pitch_m(&self) -> [f64; 2] {
        [0, 1].map(|k| self.extent_m[k] / self.size[k] as f64)
    }

    /// The heights with what is around them.
    pub(crate) fn view(&self, outside: Outside) -> Heights<'_, f64> {
        Heights { size: self.size, pitch_m: self.pitch_m(), outside, heights_m: &self.heights_m }
    }

    /// Lowest and highest height, metres.
    #[must_use]
    pub fn range_m(&self) -> [f64; 2] {
        self.heights_m
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &h| [low.min(h), high.max(h)])
    }
}

/// Heights as the sums over them see them, in f32 or f64.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heights<'a, T> {
    /// Samples in x and y.
    pub(crate) size: [usize; 2],
    /// Distance between neighbours, metres.
    pub(crate) pitch_m: [T; 2],
    /// What is outside of the grid.
    pub(crate) outside: Outside,
    /// Heights, metres.
    pub(crate) heights_m: &'a [T],
}

impl<T: Copy> Heights<'_, T> {
    /// The height at sample (i, j), metres.
    pub(crate) fn at(&self, i: usize, j: usize) -> T {
        self.heights_m[j * self.size[0] + i]
    }
}

/// Centres of a grid's cells, metres, in the order of their values.
pub(crate) fn positions_m(size: [usize; 2], extent_m: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let at = move |k: usize, i: usize| (i as f64 + 0.5) * (extent_m[k] / size[k] as f64);
    (0..size[1]).flat_map(move |j| (0..size[0]).map(move |i| [at(0, i), at(1, j)]))
}

/// Whether a grid has samples and an extent.
pub(crate) fn check_grid(size: [usize; 2], extent_m: [f64; 2]) -> Result<(), PondError> {
    let [width, height] = size;
    if size.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
        return Err(PondError::Size { width, height, max: MAX_SIDE });
    }
    check_positive("extent in x, metres,", extent_m[0])?;
    check_positive("extent in y, metres,", extent_m[1])
}

/// Whether there is one value per sample and each is `allowed`.
pub(crate) fn check_values(
    name: &'static str,
    size: [usize; 2],
    values: &[f64],
    expected: &'static str,
    allowed: impl Fn(f64) -> bool,
) -> Result<(), PondError> {
    let [width, height] = size;
    if values.len() != width * height {
        return Err(PondError::Ragged { name, got: values.len(), width, height });
    }
    // Without a way out in between, so that several are looked at at once.
    if values.iter().fold(true, |all, &v| all & allowed(v)) {
        return Ok(());
    }
    match values.iter().position(|&v| !allowed(v)) {
        None => Ok(()),
        Some(i) => {
            Err(PondError::Sample { name, column: i % width, row: i / width, got: values[i], expected })
        }
    }
}
