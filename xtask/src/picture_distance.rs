//! How far two camera pictures are apart, as a screen shows them.

use spectral_core::display::{Display, ToneMap, srgb_from_linear};

use crate::flip::{PIXELS_PER_DEGREE, Picture, flip};
use crate::metrics::Map;

/// FLIP per pixel of two pictures of one size at an exposure.
#[must_use]
pub fn flip_map(a: &Map<'_>, b: &Map<'_>, exposure: f64) -> Vec<f64> {
    let [srgb_a, srgb_b] = [a, b].map(|map| encoded(map, exposure));
    let [a, b] = [&srgb_a, &srgb_b].map(|srgb| Picture { size: a.size, srgb });
    flip(&a, &b, PIXELS_PER_DEGREE)
}

/// Its mean.
#[must_use]
pub fn mean_flip(a: &Map<'_>, b: &Map<'_>, exposure: f64) -> f64 {
    mean(&flip_map(a, b, exposure))
}

/// Mean of at least one value.
#[must_use]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Display sRGB at an exposure: everything above white cut, one gamut map.
fn encoded(map: &Map<'_>, exposure: f64) -> Vec<[f64; 3]> {
    let display = Display { exposure, tone_map: ToneMap::Clip };
    map.xyz.iter().map(|xyz| display.linear_srgb_from_xyz(xyz.map(f64::from)).map(srgb_from_linear)).collect()
}
