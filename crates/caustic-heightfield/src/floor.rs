//! The pond's floor and the light on it.

use rayon::prelude::*;
use serde::Serialize;

use crate::height_field::{CHUNK, HeightField};
use crate::pond::Pond;
use crate::surface_light::SurfaceReport;

/// Points of the floor, at the centres of a grid's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorGrid {
    /// Samples in x and y.
    pub size: [usize; 2],
    /// Corner of cell (0, 0), metres from the pond's corner.
    pub corner_m: [f64; 2],
    /// Length in x and y, metres.
    pub extent_m: [f64; 2],
}

impl FloorGrid {
    /// The floor straight below a surface, sample below sample.
    #[must_use]
    pub fn below(surface: &HeightField) -> Self {
        Self { size: surface.size, corner_m: [0.0; 2], extent_m: surface.extent_m }
    }

    /// Every `stride`-th sample of this grid in x and y, from the first on; the last ones may be left over.
    #[must_use]
    pub fn every(&self, stride: usize) -> Self {
        let size = self.size.map(|side| (side / stride).max(1));
        let pitch_m = [0, 1].map(|k| self.extent_m[k] / self.size[k] as f64);
        let shift = 0.5 * (stride as f64 - 1.0);
        Self {
            size,
            corner_m: [0, 1].map(|k| self.corner_m[k] - shift * pitch_m[k]),
            extent_m: [0, 1].map(|k| (size[k] * stride) as f64 * pitch_m[k]),
        }
    }

    /// This grid with so many cells more on every side.
    pub(crate) fn widened(&self, cells: usize) -> Self {
        let pitch_m = [0, 1].map(|k| self.extent_m[k] / self.size[k] as f64);
        let more_m = pitch_m.map(|pitch_m| cells as f64 * pitch_m);
        Self {
            size: self.size.map(|side| side + 2 * cells),
            corner_m: [0, 1].map(|k| self.corner_m[k] - more_m[k]),
            extent_m: [0, 1].map(|k| self.extent_m[k] + 2.0 * more_m[k]),
        }
    }

    /// Area of a cell, square metres.
    #[must_use]
    pub fn cell_m2(&self) -> f64 {
        self.extent_m[0] / self.size[0] as f64 * (self.extent_m[1] / self.size[1] as f64)
    }
}

/// Irradiance on the floor.
#[derive(Clone, Debug)]
pub struct FloorLight {
    /// Where.
    pub grid: FloorGrid,
    /// Irradiance, in the unit of the pond's illumination; row-major, x fastest.
    pub irradiance: Vec<f64>,
    /// What is noteworthy.
    pub report: FloorReport,
}

/// What is noteworthy about a computed floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FloorReport {
    /// The surface under its light.
    pub surface: SurfaceReport,
    /// Flux on the floor that was computed.
    pub floor_flux: f64,
    /// Standard deviation of the lobe of a vertical beam on the floor, in samples of the surface. Below 1 the grid does not
    /// resolve it: single facets show as dots, and the sum is no irradiance between them. 0 where there is no lobe.
    pub lobe_samples: f64,
    /// Ponds on each side that were summed over; 0 where the outside is dark.
    pub periodic_tiles: i64,
    /// Largest share of the light that is missing since those beyond were not.
    pub periodic_tail: f64,
}

impl FloorLight {
    /// Flux on this floor: irradiance times area.
    #[must_use]
    pub fn flux(&self) -> f64 {
        self.irradiance.iter().sum::<f64>() * self.grid.cell_m2()
    }

    /// The means of `points` x `points` samples each; the last ones may be left over.
    #[must_use]
    pub fn texel_means(&self, points: usize) -> Self {
        let size = self.grid.size.map(|side| side / points);
        let pitch_m = [0, 1].map(|k| self.grid.extent_m[k] / self.grid.size[k] as f64);
        let extent_m = [0, 1].map(|k| (size[k] * points) as f64 * pitch_m[k]);
        let mean = |i: usize, j: usize| {
            let rows = self.irradiance.chunks(self.grid.size[0]).skip(j * points).take(points);
            let sum: f64 = rows.map(|row| row[i * points..][..points].iter().sum::<f64>()).sum();
            sum / (points * points) as f64
        };
        let irradiance = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j)));
        Self {
            grid: FloorGrid { size, corner_m: self.grid.corner_m, extent_m },
            irradiance: irradiance.map(|(i, j)| mean(i, j)).collect(),
            report: self.report,
        }
    }
}

/// A computed floor with its report, below a surface whose samples are `pitch_m` apart.
pub(crate) fn floor_light(
    pitch_m: [f64; 2],
    pond: &Pond,
    surface: SurfaceReport,
    grid: FloorGrid,
    irradiance: Vec<f64>,
    (periodic_tiles, periodic_tail): (i64, f64),
) -> FloorLight {
    // In parts, whose order is the same on any number of threads.
    let parts: Vec<f64> = irradiance.par_chunks(8 * CHUNK).map(|part| part.iter().sum()).collect();
    let report = FloorReport {
        surface,
        floor_flux: parts.iter().sum::<f64>() * grid.cell_m2(),
        lobe_samples: lobe_samples(pitch_m, pond),
        periodic_tiles,
        periodic_tail,
    };
    FloorLight { grid, irradiance, report }
}

/// Standard deviation of the lobe on the floor, in samples: cos^(2a) is nearly a Gaussian of variance 1 / (2a) in angle.
pub(crate) fn lobe_samples([dx, dy]: [f64; 2], pond: &Pond) -> f64 {
    let sigma_m = pond.depth_m / (2.0 * pond.scattering).max(1.0).sqrt();
    sigma_m / dx.max(dy)
}

/// RMS of the difference over RMS of the reference.
#[must_use]
pub fn relative_rms(values: &[f64], reference: &[f64]) -> f64 {
    debug_assert_eq!(values.len(), reference.len());
    let difference: f64 = values.iter().zip(reference).map(|(v, r)| (v - r) * (v - r)).sum();
    let power: f64 = reference.iter().map(|r| r * r).sum();
    (difference / power).sqrt()
}
