//! Normals of a height field (pass 1 of the paper).

use crate::height_field::HeightField;
use crate::pond::{Normals, Outside};

/// Slopes (dh/dx, dh/dy) at every sample.
///
/// At the edge of a periodic pond the neighbour is the sample on the other side; else the difference is taken inwards. A pond of
/// one sample is level.
pub(crate) fn slopes(surface: &HeightField, rule: Normals, outside: Outside) -> Vec<[f64; 2]> {
    let [width, height] = surface.size;
    let pitch_m = surface.pitch_m();
    let h = &surface.heights_m;
    let slope = |low: f64, high: f64, steps: usize, pitch: f64| (high - low) / (steps as f64 * pitch);
    (0..height)
        .flat_map(|j| (0..width).map(move |i| (i, j)))
        .map(|(i, j)| {
            let [west, east, across] = ends(i, width, rule, outside);
            let [south, north, up] = ends(j, height, rule, outside);
            [
                slope(h[j * width + west], h[j * width + east], across, pitch_m[0]),
                slope(h[south * width + i], h[north * width + i], up, pitch_m[1]),
            ]
        })
        .collect()
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
pub(crate) fn normal_of_slopes([sx, sy]: [f64; 2]) -> [f64; 3] {
    let length = (1.0 + sx * sx + sy * sy).sqrt();
    [-sx / length, -sy / length, 1.0 / length]
}
