//! From XYZ to a screen: exposure, tone map, gamut map, sRGB encoding. The one place where XYZ becomes RGB.

use num_traits::Float;
use serde::{Deserialize, Serialize};

use crate::rgb::{D65_WHITE_XYZ, linear_srgb_from_xyz};

/// How luminance is brought below 1. All maps scale XYZ as a whole, so chromaticity stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ToneMap {
    /// Luminance as it is, cut at 1.
    #[default]
    Clip,
    /// Y (1 + Y / W^2) / (1 + Y), cut at 1: nearly linear in the dark, and exactly 1 where Y reaches the white point W
    /// (Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. 4).
    Reinhard {
        /// Luminance W, after exposure, that becomes white; above 0.
        white: f64,
    },
    /// Y^n / (Y^n + s^n), a sigmoid in log Y with [`MIDDLE_GREY`] where it is: dark parts are darkened for n above 1.2, bright ones
    /// come near to 1 (Naka & Rushton 1966; as a tone map, Reinhard & Devlin 2005, "Dynamic Range Reduction Inspired by
    /// Photoreceptor Physiology"). Schwenk et al. 2010 show their pictures by a sigmoid that they do not specify.
    Sigmoid {
        /// n, above 0: 0.82 n is the slope of log against log at middle grey.
        contrast: f64,
    },
}

/// The luminance of a grey that looks half-way between black and white.
pub const MIDDLE_GREY: f64 = 0.18;

impl ToneMap {
    /// Displayed luminance, 0 to 1, of an exposed one. Negative and NaN luminances give 0.
    pub fn luminance(self, y: f64) -> f64 {
        // f64::max turns NaN into 0.
        let y = y.max(0.0);
        match self {
            Self::Clip => y.min(1.0),
            // At and above white the quotient is 1 or more; asking first keeps infinity out of it.
            Self::Reinhard { white } if y >= white => 1.0,
            Self::Reinhard { white } => (y * (1.0 + y / (white * white)) / (1.0 + y)).min(1.0),
            // Powers below 1 on either side of grey, so that none is infinite.
            Self::Sigmoid { contrast } if y < MIDDLE_GREY => {
                let share = Float::powf(y / MIDDLE_GREY, contrast);
                share / (share + (1.0 - MIDDLE_GREY) / MIDDLE_GREY)
            }
            Self::Sigmoid { contrast } => {
                1.0 / (1.0 + Float::powf(MIDDLE_GREY / y, contrast) * (1.0 - MIDDLE_GREY) / MIDDLE_GREY)
            }
        }
    }
}

/// What a picture goes through on its way to the screen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Display {
    /// XYZ is multiplied by this first.
    pub exposure: f64,
    /// How luminance is brought below 1.
    pub tone_map: ToneMap,
}

impl Default for Display {
    fn default() -> Self {
        Self { exposure: 1.0, tone_map: ToneMap::Clip }
    }
}

impl Display {
    /// Linear sRGB in 0..1 of scene XYZ: exposure, tone map, [`gamut_mapped_srgb_from_xyz`]. Black where Y is not
    /// positive, whatever X and Z are.
    pub fn linear_srgb_from_xyz(&self, xyz: [f64; 3]) -> [f64; 3] {
        let exposed = xyz.map(|v| v * self.exposure);
        let y = self.tone_map.luminance(exposed[1]);
        if y == 0.0 {
            return [0.0; 3];
        }
        let scale = y / exposed[1];
        gamut_mapped_srgb_from_xyz([exposed[0] * scale, y, exposed[2] * scale])
    }

    /// 8-bit sRGB of scene XYZ.
    pub fn srgb8_from_xyz(&self, xyz: [f64; 3]) -> [u8; 3] {
        srgb8_from_linear_srgb(self.linear_srgb_from_xyz(xyz))
    }
}

/// The gamut map: linear sRGB in 0..1 with the luminance of `xyz` (Y cut to 0..1).
///
/// A colour that sRGB cannot show is mixed with the grey of its own luminance, by as little as brings every component
/// into 0..1: in the chromaticity diagram it moves straight towards white. So hue direction and luminance stay,
/// neutral and displayable colours are not touched, and the map is continuous.
pub fn gamut_mapped_srgb_from_xyz(xyz: [f64; 3]) -> [f64; 3] {
    if xyz[1].is_nan() || xyz[1] <= 0.0 {
        return [0.0; 3];
    }
    let grey = xyz[1].min(1.0);
    let scale = grey / xyz[1];
    // The chromatic part on its own, so that a neutral colour has none to be scaled.
    let chromatic = linear_srgb_from_xyz([
        xyz[0] * scale - grey * D65_WHITE_XYZ[0],
        0.0,
        xyz[2] * scale - grey * D65_WHITE_XYZ[2],
    ]);
    if !chromatic.iter().all(|c| c.is_finite()) {
        return [grey; 3];
    }
    let mut share = 1.0;
    for c in chromatic {
        let room = if c > 0.0 { 1.0 - grey } else { -grey };
        if c.abs() * share > room.abs() {
            share = room / c;
        }
    }
    chromatic.map(|c| (grey + share * c).clamp(0.0, 1.0))
}

/// sRGB-encoded component of a linear one (IEC 61966-2-1), odd about zero so that it is defined everywhere.
pub fn srgb_from_linear(linear: f64) -> f64 {
    let magnitude = linear.abs();
    let encoded = if magnitude <= 0.003_130_8 {
        12.92 * magnitude
    } else {
        1.055 * Float::powf(magnitude, 1.0 / 2.4) - 0.055
    };
    encoded.copysign(linear)
}

/// Linear component of an sRGB-encoded one: the inverse of [`srgb_from_linear`] to 3e-8, the gap between the two
/// pieces in the standard.
pub fn linear_from_srgb(encoded: f64) -> f64 {
    let magnitude = encoded.abs();
    let linear =
        if magnitude <= 0.040_45 { magnitude / 12.92 } else { Float::powf((magnitude + 0.055) / 1.055, 2.4) };
    linear.copysign(encoded)
}

/// 8-bit sRGB of linear sRGB, rounded to nearest; below 0 gives 0, above 1 gives 255, NaN gives 0.
pub fn srgb8_from_linear_srgb(linear_srgb: [f64; 3]) -> [u8; 3] {
    // A cast saturates and takes NaN to 0; adding a half first makes its truncation round.
    linear_srgb.map(|c| (255.0 * srgb_from_linear(c) + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::lab_from_xyz;
    use crate::observer::Observer;
    use crate::rgb::{luminance, xyz_from_linear_srgb};
    use proptest::prelude::*;

    fn in_gamut(rgb: [f64; 3]) -> bool {
        rgb.iter().all(|c| (0.0..=1.0).contains(c))
    }

    #[test]
    fn greys_are_exact_and_black_and_white_too() {
        for y in [0.0, 1e-6, 0.18, 0.5, 1.0] {
            assert_eq!(gamut_mapped_srgb_from_xyz(D65_WHITE_XYZ.map(|v| v * y)), [y; 3]);
        }
        assert_eq!(gamut_mapped_srgb_from_xyz(D65_WHITE_XYZ.map(|v| v * 7.0)), [1.0; 3]);
        assert_eq!(Display::default().srgb8_from_xyz(D65_WHITE_XYZ), [255; 3]);
    }

    #[test]
    fn spectral_colors_keep_luminance_and_direction_from_white() {
        for nm in (400..=700).step_by(10) {
            let bar = Observer::Cie1931.xyz_bar(f64::from(nm));
            let xyz = bar.map(|v| v / bar[1] * 0.3);
            let mapped = gamut_mapped_srgb_from_xyz(xyz);
            assert!(in_gamut(mapped), "{nm} nm: {mapped:?}");
            assert!((luminance(mapped) - 0.3).abs() < 1e-12, "{nm} nm: {mapped:?}");
            // Something of the colour is left, and it points the same way.
            let (before, after) = (linear_srgb_from_xyz(xyz), mapped);
            let kept = (after[0] - after[1]) / (before[0] - before[1]);
            for (i, j) in [(0, 1), (1, 2), (0, 2)] {
                let same = (after[i] - after[j]) - kept * (before[i] - before[j]);
                assert!(same.abs() < 1e-12, "{nm} nm: {before:?} {after:?}");
            }
            assert!(kept > 0.01 && kept < 1.0, "{nm} nm: {kept}");
        }
    }

    /// A spectrum along a line: violet to red, each with its own hue, no reversals.
    #[test]
    fn mapped_spectrum_keeps_the_order_of_hues() {
        let hue = |nm: i32| {
            let bar = Observer::Cie1931.xyz_bar(f64::from(nm));
            let mapped = gamut_mapped_srgb_from_xyz(bar.map(|v| v / bar[1] * 0.2));
            let [_, a, b] = lab_from_xyz(xyz_from_linear_srgb(mapped), D65_WHITE_XYZ);
            Float::to_degrees(Float::atan2(b, a)).rem_euclid(360.0)
        };
        let mut last = hue(440);
        for nm in (450..=640).step_by(10) {
            let next = hue(nm);
            assert!(next < last, "{nm} nm: {last} to {next}");
            last = next;
        }
    }

    #[test]
    fn tone_maps_are_monotone_and_end_at_one() {
        for map in [
            ToneMap::Clip,
            ToneMap::Reinhard { white: 4.0 },
            ToneMap::Reinhard { white: 0.5 },
            ToneMap::Sigmoid { contrast: 1.5 },
            ToneMap::Sigmoid { contrast: 0.7 },
        ] {
            let mut last = map.luminance(0.0);
            assert_eq!(last, 0.0);
            for i in 1..=1000 {
                let next = map.luminance(f64::from(i) * 0.01);
                assert!(next >= last && next <= 1.0, "{map:?} {i}: {last} {next}");
                last = next;
            }
            assert_eq!(map.luminance(f64::INFINITY), 1.0);
            assert_eq!(map.luminance(f64::NAN), 0.0);
            assert_eq!(map.luminance(-1.0), 0.0);
        }
        let filmic = ToneMap::Reinhard { white: 4.0 };
        assert_eq!(filmic.luminance(4.0), 1.0);
        assert!((filmic.luminance(4.0 - 1e-9) - 1.0).abs() < 1e-9);
        assert!((filmic.luminance(1e-4) / 1e-4 - 1.0).abs() < 1e-3);
    }

    /// A logistic curve over ln Y: symmetric about where it is 1/2, and its slope at middle grey is the contrast's.
    #[test]
    fn the_sigmoid_is_one() {
        for contrast in [0.7, 1.0, 1.5, 3.0] {
            let map = ToneMap::Sigmoid { contrast };
            assert!((map.luminance(MIDDLE_GREY) - MIDDLE_GREY).abs() < 1e-15);
            let half = MIDDLE_GREY * Float::powf((1.0 - MIDDLE_GREY) / MIDDLE_GREY, 1.0 / contrast);
            for factor in [1.0, 1.3, 4.0, 100.0] {
                let pair = map.luminance(half * factor) + map.luminance(half / factor);
                assert!((pair - 1.0).abs() < 1e-12, "{contrast} {factor}: {pair}");
            }
            let step = 1e-6;
            let ends = [1.0 - step, 1.0 + step].map(|f| Float::ln(map.luminance(MIDDLE_GREY * f)));
            let slope = (ends[1] - ends[0]) / (2.0 * step);
            assert!((slope - (1.0 - MIDDLE_GREY) * contrast).abs() < 1e-8, "{contrast}: {slope}");
        }
    }

    #[test]
    fn exposure_multiplies_before_the_tone_map() {
        let xyz = xyz_from_linear_srgb([0.02, 0.01, 0.03]);
        let bright = Display { exposure: 10.0, tone_map: ToneMap::Clip };
        for (got, expected) in bright.linear_srgb_from_xyz(xyz).into_iter().zip([0.2, 0.1, 0.3]) {
            assert!((got - expected).abs() < 1e-14, "{got} {expected}");
        }
    }

    #[test]
    fn srgb_curve_has_its_published_values() {
        assert_eq!(srgb_from_linear(0.0), 0.0);
        assert!((srgb_from_linear(1.0) - 1.0).abs() < 1e-15);
        assert!((srgb_from_linear(0.214_041_14) - 0.5).abs() < 1e-8);
        assert!((linear_from_srgb(0.5) - 0.214_041_14).abs() < 1e-8);
        assert_eq!(srgb_from_linear(-0.5), -srgb_from_linear(0.5));
    }

    #[test]
    fn every_byte_survives_the_way_there_and_back() {
        for byte in 0..=255_u8 {
            let linear = linear_from_srgb(f64::from(byte) / 255.0);
            assert_eq!(srgb8_from_linear_srgb([linear; 3]), [byte; 3]);
        }
        assert_eq!(srgb8_from_linear_srgb([-1.0, f64::NAN, 2.0]), [0, 0, 255]);
    }

    proptest! {
        #[test]
        fn displayable_colors_are_not_touched(r in 0.0..1.0, g in 0.0..1.0, b in 0.0..1.0) {
            let mapped = gamut_mapped_srgb_from_xyz(xyz_from_linear_srgb([r, g, b]));
            for (mapped, c) in mapped.into_iter().zip([r, g, b]) {
                prop_assert!((mapped - c).abs() < 1e-14, "{} {}", mapped, c);
            }
        }

        #[test]
        fn anything_becomes_displayable(xyz in prop::array::uniform3(prop::num::f64::ANY), exposure in 0.0..1e6) {
            for tone_map in [ToneMap::Clip, ToneMap::Reinhard { white: 4.0 }, ToneMap::Sigmoid { contrast: 1.5 }] {
                let rgb = Display { exposure, tone_map }.linear_srgb_from_xyz(xyz);
                prop_assert!(in_gamut(rgb), "{:?} {:?}", xyz, rgb);
            }
            prop_assert!(in_gamut(gamut_mapped_srgb_from_xyz(xyz)));
        }

        #[test]
        fn luminance_survives_the_gamut_map(x in 0.0..2.0, y in 0.01..1.0, z in 0.0..2.0) {
            let mapped = gamut_mapped_srgb_from_xyz([x, y, z]);
            prop_assert!((luminance(mapped) - y).abs() < 1e-12, "{:?}", mapped);
        }

        #[test]
        fn gamut_map_is_continuous(x in 0.0..2.0, y in 0.05..1.5, z in 0.0..2.0) {
            let here = gamut_mapped_srgb_from_xyz([x, y, z]);
            for delta in [[1e-7, 0.0, 0.0], [0.0, 1e-7, 0.0], [0.0, 0.0, 1e-7]] {
                let there = gamut_mapped_srgb_from_xyz([x + delta[0], y + delta[1], z + delta[2]]);
                for c in 0..3 {
                    prop_assert!((here[c] - there[c]).abs() < 1e-5, "{:?} {:?}", here, there);
                }
            }
        }
    }
}
