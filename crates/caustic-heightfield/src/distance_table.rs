//! Heights of impulses as graphics hardware had to make them (section 4.3 of the paper): a texture T(u, v) of distances
//! from its centre, and for each impulse one row h(t, .) through which T is looked up.

use crate::error::PondError;
use crate::height_field::HeightField;
use crate::impulse::{Impulse, Ripple, checked_sources};
use crate::walls::WallImages;

/// Entries beyond this would be gigabytes.
const MAX_LEVELS: usize = 1 << 20;

/// T(u, v) = sqrt((u - c_u)^2 + (v - c_v)^2), quantised to a number of levels.
///
/// It is four times as wide and high as the pond, which is enough for the paper's four images of an impulse in the pond.
#[derive(Clone, Debug)]
pub struct DistanceTable {
    size: [usize; 2],
    extent_m: [f64; 2],
    /// Metres from one level to the next.
    level_m: f64,
    levels: usize,
    codes: Vec<u32>,
}

impl DistanceTable {
    /// The table of a pond, in `levels` steps from 0 to its farthest corner: 256 for the paper's 8-bit textures.
    ///
    /// # Errors
    /// A grid without samples, fewer than 2 or more than 2^20 levels.
    pub fn new(size: [usize; 2], extent_m: [f64; 2], levels: usize) -> Result<Self, PondError> {
        crate::height_field::check_grid(size, extent_m)?;
        if !(2..=MAX_LEVELS).contains(&levels) {
            let got = levels as f64;
            return Err(PondError::Setting { name: "levels of distance", got, expected: "2 to 2^20" });
        }
        let level_m = (2.0 * extent_m[0]).hypot(2.0 * extent_m[1]) / (levels - 1) as f64;
        let table = size.map(|side| 4 * side);
        let pitch_m = [0, 1].map(|k| extent_m[k] / size[k] as f64);
        let offset_m = |k: usize, u: usize| (u as f64 - (table[k] / 2) as f64) * pitch_m[k];
        let codes = (0..table[1])
            .flat_map(|v| (0..table[0]).map(move |u| (u, v)))
            .map(|(u, v)| (offset_m(0, u).hypot(offset_m(1, v)) / level_m).round() as u32)
            .collect();
        Ok(Self { size, extent_m, level_m, levels, codes })
    }

    /// Metres from one level of distance to the next.
    #[must_use]
    pub fn level_m(&self) -> f64 {
        self.level_m
    }

    /// Levels of distance, row by row.
    pub(crate) fn codes(&self) -> &[u32] {
        &self.codes
    }
}

/// The entry for an offset in samples from the impulse, if the table of a pond of this `size` reaches that far.
pub(crate) fn entry(size: [usize; 2], offset: [i64; 2]) -> Option<usize> {
    let [width, height] = size.map(|side| 4 * side as i64);
    let [u, v] = [offset[0] + width / 2, offset[1] + height / 2];
    let inside = (0..width).contains(&u) && (0..height).contains(&v);
    inside.then(|| (v * width + u) as usize)
}

/// The sample that an impulse falls on; it may lie outside of the pond.
pub(crate) fn nearest_sample(size: [usize; 2], extent_m: [f64; 2], position_m: [f64; 2]) -> [i64; 2] {
    [0, 1].map(|k| (position_m[k] / (extent_m[k] / size[k] as f64) - 0.5).round() as i64)
}

/// The surface at `time_s` through the table: impulses fall on the nearest sample and distances are the table's, otherwise as
/// [`crate::impulse_heights`]. Images that lie beyond the table's reach add nothing, as on the paper's hardware.
///
/// # Errors
/// A ripple or impulse with a number outside its range.
pub fn heights_by_table(
    table: &DistanceTable,
    ripple: &Ripple,
    impulses: &[Impulse],
    images: WallImages,
    time_s: f64,
) -> Result<HeightField, PondError> {
    let (size, extent_m) = (table.size, table.extent_m);
    let sources = checked_sources(size, extent_m, ripple, impulses, images, time_s)?;
    let mut heights_m = vec![0.0; size[0] * size[1]];
    let mut row_of_h = vec![0.0; table.levels];
    for source in sources {
        let age_s = time_s - source.start_s;
        for (level, h) in row_of_h.iter_mut().enumerate() {
            *h = source.amplitude_m * ripple.at(age_s, level as f64 * table.level_m);
        }
        let sample = nearest_sample(size, extent_m, source.position_m);
        for (i, height) in heights_m.iter_mut().enumerate() {
            let offset = [(i % size[0]) as i64 - sample[0], (i / size[0]) as i64 - sample[1]];
            if let Some(entry) = entry(size, offset) {
                *height += row_of_h[table.codes[entry] as usize];
            }
        }
    }
    HeightField::from_values(size, extent_m, heights_m)
}
