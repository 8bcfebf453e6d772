//! Splatting: each beam's lobe where it is not negligible, added to the floor.
//!
//! It sums what [`crate::exact`] sums, less the outskirts of every lobe, so it needs no terms: what it costs is the number of samples
//! that a lobe covers. Narrow lobes, of which terms need many, cover few.

use rayon::prelude::*;

use crate::convolution::reach;
use crate::error::{PondError, check_positive};
use crate::exact::{check_clear_of_floor, largest_tilt};
use crate::floor::{FloorGrid, FloorLight, floor_light};
use crate::height_field::{HeightField, positions_m};
use crate::lobe::{Lobe, cone_extent_m};
use crate::pond::{Form, Outside, Pond};
use crate::surface_light::SurfaceLight;

/// Rows of the floor that are worth a task of their own.
const ROWS: usize = 8;

/// The method for one pond.
#[derive(Clone, Debug)]
pub struct Splat {
    pond: Pond,
    /// sin^2 of the angle from a beam at which its lobe ends.
    sin2: f64,
}

/// A beam and the samples of the floor that it may light, first and last; outside of the pond, too.
struct Beam {
    at_m: [f64; 2],
    above_m: f64,
    direction: [f64; 3],
    flux: f64,
    low: [i64; 2],
    high: [i64; 2],
}

impl Beam {
    fn samples(&self) -> f64 {
        [0, 1].map(|k| (self.high[k] - self.low[k] + 1) as f64).iter().product()
    }
}

impl Splat {
    /// Lobes that end where they have fallen to the share `target_error` of their peak: nearly Gaussian, they have that share of their
    /// light outside.
    ///
    /// # Errors
    /// A target that is not above 0.
    pub fn new(pond: &Pond, target_error: f64) -> Result<Self, PondError> {
        check_positive("target error", target_error)?;
        let share = target_error.min(0.5);
        let sin2 = match pond.form {
            _ if pond.scattering == 0.0 => 1.0,
            Form::Physical => 1.0 - (share.ln() / pond.scattering).exp(),
            Form::Paper => (-share.ln() / pond.scattering).min(1.0),
        };
        Ok(Self { pond: pond.clone(), sin2 })
    }

    /// Values of the lobe that a floor below this surface takes.
    ///
    /// # Errors
    /// As [`Pond::check`].
    pub fn evaluations(&self, surface: &HeightField) -> Result<f64, PondError> {
        let light = SurfaceLight::new(surface, &self.pond)?;
        Ok(self.beams(surface, &light).0.iter().map(Beam::samples).sum())
    }

    /// The light on the floor below `surface`.
    ///
    /// # Errors
    /// As [`Pond::check`]; a surface that touches the floor.
    pub fn floor(&self, surface: &HeightField) -> Result<FloorLight, PondError> {
        check_clear_of_floor(surface, &self.pond)?;
        let light = SurfaceLight::new(surface, &self.pond)?;
        let (beams, tiles) = self.beams(surface, &light);
        let lobe = Lobe::new(&self.pond);
        let [width, height] = surface.size.map(|side| side as i64);
        let pitch_m = surface.pitch_m();
        let center_m = |i: i64, k: usize| (i as f64 + 0.5) * pitch_m[k];
        let periodic = self.pond.outside == Outside::Periodic;
        let mut irradiance = vec![0.0; surface.heights_m.len()];
        irradiance.par_chunks_mut(ROWS * surface.size[0]).enumerate().for_each(|(band, rows)| {
            let first = (band * ROWS) as i64;
            let mine = first..first + (rows.len() / surface.size[0]) as i64;
            for beam in &beams {
                for j in beam.low[1]..=beam.high[1] {
                    let row = if periodic { j.rem_euclid(height) } else { j };
                    if !mine.contains(&row) {
                        continue;
                    }
                    let row = &mut rows[(row - first) as usize * surface.size[0]..][..surface.size[0]];
                    let y = center_m(j, 1) - beam.at_m[1];
                    for i in beam.low[0]..=beam.high[0] {
                        let offset = [center_m(i, 0) - beam.at_m[0], y];
                        let e = beam.flux * lobe.at(beam.direction, beam.above_m, offset);
                        row[if periodic { i.rem_euclid(width) } else { i } as usize] += e;
                    }
                }
            }
        });
        Ok(floor_light(
            surface.pitch_m(),
            &self.pond,
            light.report,
            FloorGrid::below(surface),
            irradiance,
            tiles,
        ))
    }

    /// All beams with light in them, and the tiles that a periodic pond is summed over.
    fn beams(&self, surface: &HeightField, light: &SurfaceLight) -> (Vec<Beam>, (i64, f64)) {
        let pitch_m = surface.pitch_m();
        let highest_m = self.pond.depth_m + surface.range_m()[1];
        let (tiles, tail, reach) =
            reach(surface.size, surface.extent_m, &self.pond, highest_m, largest_tilt(light));
        let beam = |at_m: [f64; 2], h: f64, direction: [f64; 3], flux: f64| {
            let above_m = self.pond.depth_m + h;
            let mut ends = [[0; 2]; 2];
            for k in 0..2 {
                let own = (at_m[k] / pitch_m[k] - 0.5).round() as i64;
                let (mut low, mut high) = (own - reach[k] as i64, own + reach[k] as i64);
                if let Some([near_m, far_m]) = cone_extent_m(direction, above_m, self.sin2, k) {
                    low = low.max(((at_m[k] + near_m) / pitch_m[k] - 0.5).floor() as i64);
                    high = high.min(((at_m[k] + far_m) / pitch_m[k] - 0.5).ceil() as i64);
                }
                if self.pond.outside == Outside::Dark {
                    (low, high) = (low.max(0), high.min(surface.size[k] as i64 - 1));
                }
                ends[k] = [low, high];
            }
            let [low, high] = [0, 1].map(|end| ends.map(|of| of[end]));
            Beam { at_m, above_m, direction, flux, low, high }
        };
        let beams = positions_m(surface.size, surface.extent_m)
            .zip(&surface.heights_m)
            .zip(light.directions.iter().zip(&light.flux))
            .map(|((at_m, &h), (&direction, &flux))| beam(at_m, h, direction, flux))
            .filter(|beam| beam.flux > 0.0 && (0..2).all(|k| beam.low[k] <= beam.high[k]))
            .collect();
        (beams, (tiles, tail))
    }
}
