//! Surfaces between their samples, and the integral over facets so small that it is one.

use rayon::prelude::*;

use crate::error::{PondError, check_at_least};
use crate::exact::exact;
use crate::floor::{FloorGrid, FloorLight, lobe_samples};
use crate::height_field::{HeightField, check_grid};
use crate::pond::{Illumination, Outside, Pond};

/// The surface that heights are samples of, on one axis: cubic from sample to sample, with slopes of fourth order where there are
/// samples for them. Continuous with its slope; its curvature is of second order. Beyond the first and the last sample of a pond
/// that ends it is straight.
struct Cubic<'a> {
    heights_m: &'a [f64],
    /// Rises per sample.
    slopes_m: Vec<f64>,
    outside: Outside,
}

impl<'a> Cubic<'a> {
    fn new(heights_m: &'a [f64], outside: Outside) -> Self {
        let count = heights_m.len();
        let at = |i: usize, by: isize| heights_m[(i as isize + by).rem_euclid(count as isize) as usize];
        let slope = |i: usize| {
            let room = match outside {
                Outside::Periodic => count,
                Outside::Dark => i.min(count - 1 - i),
            };
            match room {
                _ if count == 1 => 0.0,
                _ if count == 2 && outside == Outside::Dark => heights_m[1] - heights_m[0],
                0 if i == 0 => 2.0 * at(i, 1) - 1.5 * at(i, 0) - 0.5 * at(i, 2),
                0 => 1.5 * at(i, 0) - 2.0 * at(i, -1) + 0.5 * at(i, -2),
                1 => (at(i, 1) - at(i, -1)) / 2.0,
                _ => (8.0 * (at(i, 1) - at(i, -1)) - (at(i, 2) - at(i, -2))) / 12.0,
            }
        };
        Self { heights_m, slopes_m: (0..count).map(slope).collect(), outside }
    }

    /// The height so many samples from the first.
    fn at(&self, place: f64) -> f64 {
        let count = self.heights_m.len() as isize;
        let first = match self.outside {
            Outside::Periodic => place.floor(),
            Outside::Dark => place.floor().clamp(0.0, (count - 2).max(0) as f64),
        };
        let t = place - first;
        let low = (first as isize).rem_euclid(count) as usize;
        let high = (low + 1) % count as usize;
        let [(h0, m0), (h1, m1)] = [low, high].map(|i| (self.heights_m[i], self.slopes_m[i]));
        if t < 0.0 || count == 1 {
            return h0 + t * m0;
        }
        if t > 1.0 {
            return h1 + (t - 1.0) * m1;
        }
        let rise = h1 - h0;
        h0 + t * (m0 + t * ((3.0 * rise - 2.0 * m0 - m1) + t * (m0 + m1 - 2.0 * rise)))
    }

    /// Centres of `factor` parts of every sample.
    fn divided(&self, factor: usize) -> impl Iterator<Item = f64> + '_ {
        let parts = self.heights_m.len() * factor;
        (0..parts).map(move |i| self.at((i as f64 + 0.5) / factor as f64 - 0.5))
    }
}

impl HeightField {
    /// Slopes (dh/dx, dh/dy) at every sample, of fourth order where there are samples for them.
    pub(crate) fn cubic_slopes(&self, outside: Outside) -> Vec<[f64; 2]> {
        let [width, height] = self.size;
        let [dx, dy] = self.pitch_m();
        let rows = self.heights_m.par_chunks(width);
        let along_x: Vec<f64> = rows.flat_map_iter(|row| Cubic::new(row, outside).slopes_m).collect();
        let column = |i: usize| {
            let column: Vec<f64> = self.heights_m.iter().skip(i).step_by(width).copied().collect();
            Cubic::new(&column, outside).slopes_m
        };
        let along_y: Vec<Vec<f64>> = (0..width).into_par_iter().map(column).collect();
        let samples = (0..height).flat_map(|j| (0..width).map(move |i| (i, j)));
        samples.map(|(i, j)| [along_x[j * width + i] / dx, along_y[i][j] / dy]).collect()
    }

    /// The same surface with `factor` x `factor` samples for each one: cubic between them, and straight beyond the outermost of a
    /// pond that ends.
    ///
    /// # Errors
    /// No heights, or more samples than a grid may have.
    pub fn supersampled(&self, factor: usize, outside: Outside) -> Result<Self, PondError> {
        self.check()?;
        if factor == 1 {
            return Ok(self.clone());
        }
        let [width, height] = self.size;
        let size = [width.saturating_mul(factor), height.saturating_mul(factor)];
        check_grid(size, self.extent_m)?;
        // Row after row along x, then the columns of that along y.
        let wide: Vec<f64> = self
            .heights_m
            .par_chunks(width)
            .flat_map_iter(|row| Cubic::new(row, outside).divided(factor).collect::<Vec<_>>())
            .collect();
        let columns: Vec<Vec<f64>> = (0..size[0])
            .into_par_iter()
            .map(|i| {
                let column: Vec<f64> = wide.iter().skip(i).step_by(size[0]).copied().collect();
                Cubic::new(&column, outside).divided(factor).collect()
            })
            .collect();
        let heights_m = (0..size[1]).flat_map(|j| columns.iter().map(move |column| column[j])).collect();
        Self::from_values(size, self.extent_m, heights_m)
    }
}

impl Pond {
    /// The pond whose surface has `factor` x `factor` samples for each one of a grid with rows of `width`: each is lit as the one
    /// it is a part of.
    #[must_use]
    pub fn supersampled(&self, width: usize, factor: usize) -> Self {
        let Illumination::Map(levels) = &self.illumination else { return self.clone() };
        let row = |row: &[f64]| -> Vec<f64> {
            row.iter().flat_map(|&level| std::iter::repeat_n(level, factor)).collect()
        };
        let rows = levels.chunks(width).flat_map(|levels| std::iter::repeat_n(row(levels), factor));
        Self { illumination: Illumination::Map(rows.flatten().collect()), ..self.clone() }
    }
}

/// As [`exact`], over the surface between the samples: samples are divided until the lobe spans `least_lobe_samples` of the
/// parts, so that the sum is the integral, and a texel of the floor is the mean of points no farther apart than the lobe is wide.
///
/// This is what narrow lobes, and water that scatters nothing, are held against. [`FloorReport::lobe_samples`] says what came of it.
///
/// # Errors
/// As [`exact`]; a lobe that more samples would be needed for than a grid may have.
///
/// [`FloorReport::lobe_samples`]: crate::FloorReport::lobe_samples
pub fn exact_over_facets(
    surface: &HeightField,
    pond: &Pond,
    floor: FloorGrid,
    least_lobe_samples: f64,
) -> Result<FloorLight, PondError> {
    check_at_least("samples that the lobe must span", least_lobe_samples, 0.0, "finite and not negative")?;
    pond.check(surface)?;
    check_grid(floor.size, floor.extent_m)?;
    let parts = |samples: f64, least: f64| ((least / samples).ceil() as usize).max(1);
    let factor = parts(lobe_samples(surface.pitch_m(), pond), least_lobe_samples);
    let texel_m = [0, 1].map(|k| floor.extent_m[k] / floor.size[k] as f64);
    let points = parts(lobe_samples(texel_m, pond), 1.0);
    let fine = FloorGrid { size: floor.size.map(|side| side.saturating_mul(points)), ..floor };
    let surface_parts = surface.supersampled(factor, pond.outside)?;
    let light = exact(&surface_parts, &pond.supersampled(surface.size[0], factor), fine)?;
    Ok(light.texel_means(points))
}
