//! Pictures side by side, and what differs between them.

use crate::values::Size;

/// The CIE94 difference that is shown brightest.
const BRIGHTEST: f64 = 10.0;

/// Panels of one size in rows of equal length.
pub(super) struct Panels {
    size: Size,
    rows: Vec<Vec<Vec<[u8; 3]>>>,
}

impl Panels {
    pub(super) fn new(size: Size, rows: Vec<Vec<Vec<[u8; 3]>>>) -> Self {
        Self { size, rows }
    }

    /// The whole figure and its size.
    pub(super) fn joined(&self) -> (Size, Vec<[u8; 3]>) {
        let (width, columns) = (self.size.width as usize, self.rows[0].len());
        let line = |row: &Vec<Vec<[u8; 3]>>, y: usize| {
            row.iter().flat_map(|panel| panel[y * width..(y + 1) * width].to_vec()).collect::<Vec<_>>()
        };
        let texels = self
            .rows
            .iter()
            .flat_map(|row| (0..self.size.height as usize).flat_map(|y| line(row, y)))
            .collect();
        let (width, height) = (self.size.width * columns as u32, self.size.height * self.rows.len() as u32);
        (Size { width, height }, texels)
    }
}

/// A map of differences, black to yellow.
pub(super) fn difference_map(differences: &[f64]) -> Vec<[u8; 3]> {
    differences
        .iter()
        .map(|d| colorous::INFERNO.eval_continuous((d / BRIGHTEST).min(1.0)).as_array())
        .collect()
}

/// What the map's colours mean: from 0 on the left to the brightest on the right, in the middle of a panel.
pub(super) fn scale(size: Size) -> Vec<[u8; 3]> {
    let (width, height) = (f64::from(size.width), f64::from(size.height));
    let texel = |i: u64| {
        let (x, y) = (i % u64::from(size.width), i / u64::from(size.width));
        let (x, y) = (x as f64 / width, y as f64 / height);
        let along = (x - 0.1) / 0.8;
        if (0.0..=1.0).contains(&along) && (y - 0.5).abs() < 0.05 {
            colorous::INFERNO.eval_continuous(along).as_array()
        } else {
            [48; 3]
        }
    };
    (0..size.texels()).map(texel).collect()
}
