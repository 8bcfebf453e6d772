//! Maps as PNG pictures inside the HTML.

use spectral_cli::output::png;
use spectral_cli::values::Size;
use spectral_core::display::{Display, ToneMap, srgb8_from_linear_srgb};
use xtask::metrics::Map;

/// An encoded picture.
pub(crate) struct Png {
    /// Pixels across and down.
    pub(super) size: [usize; 2],
    bytes: Vec<u8>,
}

impl Png {
    /// Encode 8-bit sRGB.
    pub(crate) fn encode(size: [usize; 2], srgb8: &[[u8; 3]]) -> Self {
        let [width, height] = size.map(|n| n as u32);
        let bytes = png::bytes(Size { width, height }, srgb8).expect("one triple a pixel, into memory");
        Self { size, bytes }
    }

    /// As an URI that needs no file.
    pub(super) fn data_uri(&self) -> String {
        format!("data:image/png;base64,{}", base64(&self.bytes))
    }
}

/// The map as a screen shows it: `exposure`, then everything above white cut, one gamut map.
pub(crate) fn shown(map: &Map<'_>, exposure: f64) -> Png {
    let display = Display { exposure, tone_map: ToneMap::Clip };
    let pixels: Vec<_> = map.xyz.iter().map(|xyz| display.srgb8_from_xyz(xyz.map(f64::from))).collect();
    Png::encode(map.size, &pixels)
}

/// Y of `map` less Y of `reference`, `full_scale` lux being the strongest colour: red above, blue below, white equal.
pub(crate) fn difference(map: &Map<'_>, reference: &Map<'_>, full_scale: f64) -> Png {
    Png::encode(map.size, &difference_pixels(map, reference, full_scale))
}

fn difference_pixels(map: &Map<'_>, reference: &Map<'_>, full_scale: f64) -> Vec<[u8; 3]> {
    let pixel = |(m, r): (&[f32; 3], &[f32; 3])| {
        let share = ((f64::from(m[1]) - f64::from(r[1])) / full_scale).clamp(-1.0, 1.0);
        let (more, less) = (share.max(0.0), (-share).max(0.0));
        srgb8_from_linear_srgb([1.0 - less, 1.0 - more.max(less), 1.0 - more])
    };
    map.xyz.iter().zip(reference.xyz).map(pixel).collect()
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, i| bits << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[(bits >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        // RFC 4648, section 10.
        let vectors = [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (text, expected) in vectors {
            assert_eq!(base64(text.as_bytes()), expected);
        }
    }

    #[test]
    fn differences_are_white_red_and_blue() {
        let reference = [[1.0_f32; 3]; 3];
        let map = [[1.0; 3], [1.5; 3], [0.0; 3]];
        let [map, reference] = [&map, &reference].map(|xyz| Map { size: [3, 1], xyz });
        assert_eq!(difference_pixels(&map, &reference, 0.5), [[255; 3], [255, 0, 0], [0, 0, 255]]);
    }
}
