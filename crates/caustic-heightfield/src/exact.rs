//! The integral itself, by direct summation over the surface in f64: what every other method is held against.
//!
//! It makes none of the paper's approximations but one: the surface is a grid of facets, each of which is a point with the area
//! and normal of its sample. That is exact to rounding as long as the lobe spans a sample or two on the floor
//! ([`FloorReport::lobe_samples`]), since a sum over a grid of a smooth function converges faster than any power of the pitch.

use rayon::prelude::*;
use serde::Serialize;

use crate::error::PondError;
use crate::height_field::{HeightField, check_grid, positions_m};
use crate::lobe::{Lobe, downward_share};
use crate::pond::{Form, Outside, Pond};
use crate::surface_light::{SurfaceLight, SurfaceReport};

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
    /// resolve it: single facets show as dots, and the sum is no irradiance between them.
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
}

/// The light on `floor` by direct summation of the pond's integral over `surface`.
///
/// A surface that touches the floor (d + h = 0) puts its light down where it is, as the limit of shallow water does; the paper's
/// form has no such limit.
///
/// # Errors
/// As [`Pond::check`]; a floor without samples; in the paper's form, a surface that touches the floor.
pub fn exact(surface: &HeightField, pond: &Pond, floor: FloorGrid) -> Result<FloorLight, PondError> {
    let light = SurfaceLight::new(surface, pond)?;
    check_grid(floor.size, floor.extent_m)?;
    if pond.form == Form::Paper {
        check_clear_of_floor(surface, pond)?;
    }
    let lobe = Lobe::new(pond);
    let highest_m = pond.depth_m + surface.range_m()[1];
    let (tiles, tail) = match pond.outside {
        Outside::Dark => (0, 0.0),
        Outside::Periodic => lobe.periodic_tiles(surface.extent_m, highest_m, largest_tilt(&light)),
    };
    let beams = beams(surface, pond, &light);
    let touching: Vec<f64> = beams.iter().map(|beam| in_place(beam, pond)).collect();
    let points: Vec<[f64; 2]> = positions_m(floor.size, floor.extent_m)
        .map(|at| [at[0] + floor.corner_m[0], at[1] + floor.corner_m[1]])
        .collect();
    let at = |point: &[f64; 2]| {
        let spread: f64 = beams
            .iter()
            .filter(|beam| beam.flux > 0.0 && beam.above_m > 0.0)
            .map(|beam| beam.flux * spread(&lobe, beam, *point, surface.extent_m, pond.outside, tiles))
            .sum();
        let resting = below(surface, *point, pond.outside).map_or(0.0, |sample| touching[sample]);
        spread + resting / (surface.pitch_m()[0] * surface.pitch_m()[1])
    };
    let irradiance: Vec<f64> = points.par_iter().map(at).collect();
    let report = FloorReport {
        surface: light.report,
        floor_flux: irradiance.iter().sum::<f64>() * floor.cell_m2(),
        lobe_samples: lobe_samples(surface, pond),
        periodic_tiles: tiles,
        periodic_tail: tail,
    };
    Ok(FloorLight { grid: floor, irradiance, report })
}

/// Light of one sample below the surface.
struct Beam {
    at_m: [f64; 2],
    above_m: f64,
    direction: [f64; 3],
    flux: f64,
}

fn beams(surface: &HeightField, pond: &Pond, light: &SurfaceLight) -> Vec<Beam> {
    positions_m(surface.size, surface.extent_m)
        .zip(&surface.heights_m)
        .zip(light.directions.iter().zip(&light.flux))
        .map(|((at_m, h), (&direction, &flux))| Beam { at_m, above_m: pond.depth_m + h, direction, flux })
        .collect()
}

/// Irradiance per flux of a beam and its periodic copies. Copies are counted from the nearest, so that every point of the floor
/// sums over the same offsets.
#[inline]
fn spread(
    lobe: &Lobe,
    beam: &Beam,
    point: [f64; 2],
    extent_m: [f64; 2],
    outside: Outside,
    tiles: i64,
) -> f64 {
    let mut offset = [point[0] - beam.at_m[0], point[1] - beam.at_m[1]];
    if outside == Outside::Dark {
        return lobe.at(beam.direction, beam.above_m, offset);
    }
    for (k, o) in offset.iter_mut().enumerate() {
        *o -= (*o / extent_m[k] + 0.5).floor() * extent_m[k];
    }
    let mut sum = 0.0;
    for n in -tiles..=tiles {
        for m in -tiles..=tiles {
            let copy = [offset[0] + m as f64 * extent_m[0], offset[1] + n as f64 * extent_m[1]];
            sum += lobe.at(beam.direction, beam.above_m, copy);
        }
    }
    sum
}

/// Flux that a beam whose surface touches the floor leaves right there.
fn in_place(beam: &Beam, pond: &Pond) -> f64 {
    if beam.above_m > 0.0 || beam.flux == 0.0 {
        return 0.0;
    }
    beam.flux * downward_share(-beam.direction[2], pond.scattering)
}

/// The sample of the surface above a point of the floor.
fn below(surface: &HeightField, point: [f64; 2], outside: Outside) -> Option<usize> {
    let mut cell = [0; 2];
    for k in 0..2 {
        let mut at = point[k] / surface.extent_m[k];
        if outside == Outside::Periodic {
            at -= at.floor();
        } else if !(0.0..1.0).contains(&at) {
            return None;
        }
        cell[k] = ((at * surface.size[k] as f64) as usize).min(surface.size[k] - 1);
    }
    Some(cell[1] * surface.size[0] + cell[0])
}

/// Whether the surface is above the floor everywhere.
pub(crate) fn check_clear_of_floor(surface: &HeightField, pond: &Pond) -> Result<(), PondError> {
    crate::height_field::check_values(
        "height",
        surface.size,
        &surface.heights_m,
        "above the floor and not on it: here only `exact` in the physical form has a limit",
        |h| pond.depth_m + h > 0.0,
    )
}

/// Largest angle between a beam and straight down, radians.
pub(crate) fn largest_tilt(light: &SurfaceLight) -> f64 {
    let flattest = light.directions.iter().fold(1.0_f64, |flattest, direction| flattest.min(-direction[2]));
    flattest.clamp(-1.0, 1.0).acos()
}

/// Standard deviation of the lobe on the floor, in samples: cos^(2a) is nearly a Gaussian of variance 1 / (2a) in angle.
pub(crate) fn lobe_samples(surface: &HeightField, pond: &Pond) -> f64 {
    let sigma_m = pond.depth_m / (2.0 * pond.scattering).max(1.0).sqrt();
    let [dx, dy] = surface.pitch_m();
    sigma_m / dx.max(dy)
}
