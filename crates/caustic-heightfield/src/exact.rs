//! The integral itself, by direct summation over the surface in f64: what every other method is held against.
//!
//! It makes none of the paper's approximations but one: the surface is a grid of facets, each of which is a point with the area
//! and normal of its sample. That is exact to rounding as long as the lobe spans a sample or two on the floor
//! ([`FloorReport::lobe_samples`]), since a sum over a grid of a smooth function converges faster than any power of the pitch.

use rayon::prelude::*;

use crate::error::PondError;
use crate::floor::{FloorGrid, FloorLight, floor_light};
use crate::height_field::{HeightField, check_grid, positions_m};
use crate::lobe::{Lobe, downward_share};
use crate::pond::{Form, Outside, Pond};
use crate::surface_light::SurfaceLight;

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
    let blocks = blocks(&beams, surface.size[0], &lobe, pond.outside);
    let points: Vec<[f64; 2]> = positions_m(floor.size, floor.extent_m)
        .map(|at| [at[0] + floor.corner_m[0], at[1] + floor.corner_m[1]])
        .collect();
    let at = |point: &[f64; 2]| {
        let spread: f64 = blocks
            .iter()
            .filter(|block| block.reaches(*point))
            .flat_map(|block| &block.beams)
            .map(|beam| beam.flux * spread(&lobe, beam, *point, surface.extent_m, pond.outside, tiles))
            .sum();
        let resting = below(surface, *point, pond.outside).map_or(0.0, |sample| touching[sample]);
        spread + resting / (surface.pitch_m()[0] * surface.pitch_m()[1])
    };
    let irradiance: Vec<f64> = points.par_iter().map(at).collect();
    Ok(floor_light(surface.pitch_m(), pond, light.report, floor, irradiance, (tiles, tail)))
}

/// Samples along each side of a block.
const BLOCK: usize = 16;

/// Beams of neighbouring samples, and where their lobes are on the floor.
struct Block<'a> {
    beams: Vec<&'a Beam>,
    low_m: [f64; 2],
    high_m: [f64; 2],
}

impl Block<'_> {
    /// Whether it may light a point of the floor.
    fn reaches(&self, point: [f64; 2]) -> bool {
        (0..2).all(|k| (self.low_m[k]..=self.high_m[k]).contains(&point[k]))
    }
}

/// All beams with light in them that are above the floor, in blocks: of narrow lobes most are nowhere near a point.
fn blocks<'a>(beams: &'a [Beam], width: usize, lobe: &Lobe, outside: Outside) -> Vec<Block<'a>> {
    let extent_m = |beam: &Beam, k: usize| match outside {
        Outside::Dark => lobe.extent_m(beam.direction, beam.above_m, k).map(|end| beam.at_m[k] + end),
        Outside::Periodic => [f64::NEG_INFINITY, f64::INFINITY],
    };
    let block = |first_row: usize, first: usize| {
        let mut block =
            Block { beams: Vec::new(), low_m: [f64::INFINITY; 2], high_m: [f64::NEG_INFINITY; 2] };
        for row in beams.chunks(width).skip(first_row).take(BLOCK) {
            let lit = |beam: &&Beam| beam.flux > 0.0 && beam.above_m > 0.0;
            for beam in row.iter().skip(first).take(BLOCK).filter(lit) {
                for k in 0..2 {
                    let [low, high] = extent_m(beam, k);
                    block.low_m[k] = block.low_m[k].min(low);
                    block.high_m[k] = block.high_m[k].max(high);
                }
                block.beams.push(beam);
            }
        }
        block
    };
    let rows = (0..beams.len() / width).step_by(BLOCK);
    rows.flat_map(|row| (0..width).step_by(BLOCK).map(move |first| (row, first)))
        .map(|(row, first)| block(row, first))
        .collect()
}

/// Light of one sample below the surface.
#[derive(Clone, Copy)]
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
