//! Normals of a height field (pass 1 of the paper).

use num_traits::Float;
use rayon::prelude::*;

use crate::height_field::{CHUNK, HeightField, Heights};
use crate::pond::{Normals, Outside};

/// Slopes (dh/dx, dh/dy) at every sample.
pub(crate) fn slopes(surface: &HeightField, rule: Normals, outside: Outside) -> Vec<[f64; 2]> {
    let heights = surface.view(outside);
    let width = surface.size[0];
    (0..heights.heights_m.len())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(|s| slopes_at(&heights, rule, s % width, s / width))
        .collect()
}

/// Slopes at sample (i, j).
///
/// At the edge of a periodic pond the neighbour is the sample on the other side; else the difference is taken inwards. A pond of
/// one sample is level.
pub(crate) fn slopes_at<T: Float>(surface: &Heights<'_, T>, rule: Normals, i: usize, j: usize) -> [T; 2] {
    let [width, height] = surface.size;
    let slope = |low: T, high: T, steps: usize, pitch: T| {
        let steps = if steps == 2 { T::one() + T::one() } else { T::one() };
        (high - low) / (steps * pitch)
    };
    let [west, east, across] = ends(i, width, rule, surface.outside);
    let [south, north, up] = ends(j, height, rule, surface.outside);
    [
        slope(surface.at(west, j), surface.at(east, j), across, surface.pitch_m[0]),
        slope(surface.at(i, south), surface.at(i, north), up, surface.pitch_m[1]),
    ]
}

/// The two samples of `side` whose difference is taken at sample `i`, and how many steps they are apart.
pub(crate) fn ends(i: usize, side: usize, rule: Normals, outside: Outside) -> [usize; 3] {
    match (rule, outside) {
        (Normals::Central, Outside::Periodic) => [(i + side - 1) % side, (i + 1) % side, 2],
        (Normals::OneSided, Outside::Periodic) => [i, (i + 1) % side, 1],
        (Normals::Central, Outside::Dark) => {
            let [low, high] = [i.saturating_sub(1), (i + 1).min(side - 1)];
            [low, high, (high - low).max(1)]
        }
        (Normals::OneSided, Outside::Dark) => {
            let low = i.min(side.saturating_sub(2));
            [low, (low + 1).min(side - 1), 1]
        }
    }
}

/// The unit normal of a surface with these slopes, upwards.
pub(crate) fn normal_of_slopes<T: Float>([sx, sy]: [T; 2]) -> [T; 3] {
    let length = (T::one() + sx * sx + sy * sy).sqrt();
    [-sx / length, -sy / length, T::one() / length]
}
