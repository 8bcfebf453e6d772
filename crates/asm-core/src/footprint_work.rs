//! What footprints took: rays, wavelengths and deposits, against a uniform grid as fine as their finest cells.

use serde::{Deserialize, Serialize};

use crate::shared::footprint::{
    WORK_BINS, WORK_CELLS, WORK_CORNERS, WORK_COUNTS, WORK_DEPOSITS, WORK_RAYS, WORK_WORDS,
};

/// What the footprints of one light took, over its paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FootprintWork {
    /// Paths that were traced: of the wavelengths of a corner those that paths around do not tell.
    pub rays: u64,
    /// Paths of a uniform grid as fine as cells may become, with the same wavelengths.
    pub uniform_rays: u64,
    /// Cells that were laid down; one whose spectrum was split counts for each part.
    pub cells: u64,
    /// Wavelengths that the spectrum of a cell was traced at, on average: those of a corner, for each part of the cell's spectrum.
    pub wavelengths_per_cell: f64,
    /// The most: all spectra split as often as they may be.
    pub uniform_wavelengths_per_cell: f64,
    /// Tents that were put down, and texels that gathered light, over all landings.
    pub deposits: u64,
    /// Deposits of the uniform grid, with as many steps for each landing as one may have.
    pub uniform_deposits: u64,
}

/// What the host keeps to read the work of one light's footprints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct WorkBooks {
    /// First row of its paths, [`WORK_WORDS`] each.
    pub(crate) first_row: u32,
    /// Number of them.
    pub(crate) rows: u32,
    /// Of the whole spectrum.
    pub(crate) bins: u32,
    /// The `uniform_*` of [`FootprintWork`].
    pub(crate) uniform: FootprintWork,
}

impl WorkBooks {
    /// From the rows of all lights.
    pub(crate) fn read(&self, words: &[u32]) -> FootprintWork {
        let rows = words.chunks_exact(WORK_WORDS).skip(self.first_row as usize).take(self.rows as usize);
        let mut sums = [0_u64; WORK_COUNTS];
        for row in rows {
            for (sum, count) in sums.iter_mut().zip(row.chunks_exact(2)) {
                *sum += u64::from(count[0]) | u64::from(count[1]) << 32;
            }
        }
        let whole_spectra = sums[WORK_BINS] as f64 / f64::from(self.bins);
        // Of the wavelengths of a corner not all are traced.
        let per_corner = sums[WORK_RAYS] as f64 / (sums[WORK_CORNERS] as f64).max(1.0);
        let traced = sums[WORK_CELLS] as f64 * per_corner;
        FootprintWork {
            rays: sums[WORK_RAYS],
            cells: sums[WORK_CELLS],
            wavelengths_per_cell: if whole_spectra > 0.0 { traced / whole_spectra } else { 0.0 },
            deposits: sums[WORK_DEPOSITS],
            ..self.uniform
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_a_light_add_up() {
        let uniform = FootprintWork { uniform_rays: 7, ..FootprintWork::default() };
        let books = WorkBooks { first_row: 1, rows: 2, bins: 256, uniform };
        let row =
            |corners, deposits, cells, bins, rays| [deposits, 1, cells, 0, bins, 0, corners, 0, rays, 0];
        let rows = [row(1, 1, 1, 1, 1), row(10, 20, 2, 512, 25), row(5, 1, 2, 256, 5), row(9, 9, 9, 9, 9)];
        let work = books.read(rows.as_flattened());
        assert_eq!((work.rays, work.cells, work.deposits), (30, 4, 21 + (2 << 32)));
        // Two whole cells, and one in two halves; two wavelengths of a corner are traced.
        assert_eq!(work.wavelengths_per_cell, 4.0 * 2.0 / 3.0);
        assert_eq!(work.uniform_rays, 7);
        let nothing = WorkBooks { rows: 0, ..books }.read(&[]);
        assert_eq!(nothing.wavelengths_per_cell, 0.0);
    }
}
