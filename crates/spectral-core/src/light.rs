//! Spectra of lights, scaled so that luminance is 1.
//!
//! A light's strength is kept apart from its spectrum: an unblocked receiver perpendicular to it gets
//! [`LightSpectrum::unit_xyz`] times intensity and luminance of the colour.

use alloc::vec::Vec;

use num_traits::Float;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::illuminant::{
    DAYLIGHT_RANGE_K, Illuminant, TemperatureError, UnknownIlluminant, black_body, daylight, daylight_cct_k,
};
use crate::observer::{Observer, VISIBLE_NM};
use crate::rgb::{D65_WHITE_XYZ, luminance, xyz_from_linear_srgb};
use crate::upsample::SmoothSpectrum;

/// Relative spectral power of a light. The constructors and deserialising check wavelengths and temperatures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LightSpectrum {
    /// D65 times a smooth upsampling of a colour: what a light has without `extras.spectral`.
    UpsampledD65 {
        /// The colour as authored; its scale does not matter here.
        linear_srgb: [f64; 3],
        /// Upsampling of the colour divided by its largest component.
        shape: SmoothSpectrum,
    },
    /// A CIE illuminant.
    Illuminant(Illuminant),
    /// A Planckian radiator.
    BlackBody {
        /// Its temperature, kelvin.
        #[serde(deserialize_with = "black_body_kelvin")]
        cct_k: f64,
    },
    /// CIE daylight.
    Daylight {
        /// Its correlated colour temperature, kelvin.
        #[serde(deserialize_with = "daylight_kelvin")]
        cct_k: f64,
    },
    /// A single wavelength.
    Line {
        /// Vacuum wavelength, nm.
        #[serde(deserialize_with = "visible_line_nm")]
        lambda_nm: f64,
    },
}

/// Why something is no light's spectrum.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// No illuminant has that name.
    #[error(transparent)]
    Illuminant(#[from] UnknownIlluminant),
    /// The temperature has no defined spectrum.
    #[error(transparent)]
    Temperature(#[from] TemperatureError),
    /// A line nobody sees.
    #[error("the line is at {got_nm} nm: it must be from 380 to 780 nm")]
    LineInvisible {
        /// Where it is, nm.
        got_nm: f64,
    },
}

impl Default for LightSpectrum {
    /// White D65.
    fn default() -> Self {
        Self::UpsampledD65 { linear_srgb: [1.0; 3], shape: SmoothSpectrum::ONE }
    }
}

impl LightSpectrum {
    /// D65 times the smooth upsampling of `linear_srgb` at any scale. Negative and NaN components count as 0; a
    /// black or infinite colour has no chromaticity and gets white.
    pub fn d65_upsampled(linear_srgb: [f64; 3]) -> Self {
        // f64::max turns NaN into 0.
        let linear_srgb = linear_srgb.map(|c| c.max(0.0));
        let largest = linear_srgb.into_iter().fold(0.0, f64::max);
        if !(largest > 0.0 && largest.is_finite()) {
            return Self::default();
        }
        Self::UpsampledD65 {
            linear_srgb,
            shape: SmoothSpectrum::reflectance(linear_srgb.map(|c| c / largest)),
        }
    }

    /// A CIE illuminant by its name, such as `E`, `FL11` or `D55`. D50 and D65 are the CIE's tables, every other D its
    /// formula of daylight, see [`daylight_cct_k`].
    ///
    /// # Errors
    /// If there is none of that name, and for daylight below 4000 K and above 25000 K.
    pub fn illuminant(name: &str) -> Result<Self, LightError> {
        match (name.parse(), daylight_cct_k(name)) {
            (Ok(tabulated), _) => Ok(Self::Illuminant(tabulated)),
            (Err(_), Some(cct_k)) => Ok(daylight(cct_k).map(|_| Self::Daylight { cct_k })?),
            (Err(unknown), None) => Err(unknown.into()),
        }
    }

    /// Light of a correlated colour temperature: a black body below 4000 K, where CIE daylight is not defined, and
    /// CIE daylight from there to 25000 K.
    ///
    /// # Errors
    /// Below 100 K and above 25000 K, and for NaN.
    pub fn cct(cct_k: f64) -> Result<Self, LightError> {
        if cct_k < DAYLIGHT_RANGE_K.0 {
            black_body(cct_k)?;
            Ok(Self::BlackBody { cct_k })
        } else {
            daylight(cct_k)?;
            Ok(Self::Daylight { cct_k })
        }
    }

    /// Light of a single wavelength.
    ///
    /// # Errors
    /// Outside 380 to 780 nm, and for NaN.
    pub fn line(lambda_nm: f64) -> Result<Self, LightError> {
        if (VISIBLE_NM.0..=VISIBLE_NM.1).contains(&lambda_nm) {
            Ok(Self::Line { lambda_nm })
        } else {
            Err(LightError::LineInvisible { got_nm: lambda_nm })
        }
    }

    /// Spectral power at a wavelength in nm on an arbitrary scale. 0 for a line, whose power is not a density: ask
    /// [`LightSpectrum::line_nm`] first. 0 for a temperature that its constructor would have refused.
    pub fn relative_power(&self, lambda_nm: f64) -> f64 {
        match self {
            Self::UpsampledD65 { shape, .. } => {
                Illuminant::D65.relative_power(lambda_nm) * shape.at(lambda_nm)
            }
            Self::Illuminant(illuminant) => illuminant.relative_power(lambda_nm),
            Self::BlackBody { cct_k } => {
                black_body(*cct_k).map_or(0.0, |body| body.relative_power(lambda_nm))
            }
            Self::Daylight { cct_k } => daylight(*cct_k).map_or(0.0, |phase| phase.relative_power(lambda_nm)),
            Self::Line { .. } => 0.0,
        }
    }

    /// The wavelength of a line, nm.
    pub fn line_nm(&self) -> Option<f64> {
        match self {
            Self::Line { lambda_nm } => Some(*lambda_nm),
            _ => None,
        }
    }

    /// XYZ of the light at Y = 1.
    ///
    /// An upsampled colour has the XYZ of that colour, for any observer, since the colour is what was authored, and
    /// D65 is the project's white: both give (0.95047, 1, 1.08883) exactly for white. Every other spectrum is
    /// integrated over 380 to 780 nm; a line has its colour-matching values divided by y. A spectrum without any
    /// visible power, which no constructor makes, counts as white.
    pub fn unit_xyz(&self, observer: Observer) -> [f64; 3] {
        let xyz = match self {
            Self::UpsampledD65 { linear_srgb: [r, g, b], .. } if r == g && g == b => D65_WHITE_XYZ,
            Self::UpsampledD65 { linear_srgb, .. } => {
                // Y is 1 by the same sum that the matrix takes.
                let y = luminance(*linear_srgb);
                xyz_from_linear_srgb(*linear_srgb).map(|v| v / y)
            }
            Self::Illuminant(Illuminant::D65) => D65_WHITE_XYZ,
            Self::Line { lambda_nm } => per_luminance(observer.xyz_bar(*lambda_nm)),
            _ => per_luminance(self.integrate(observer, VISIBLE_NM)),
        };
        if xyz.iter().all(|v| v.is_finite()) { xyz } else { D65_WHITE_XYZ }
    }

    /// XYZ that each wavelength of a grid carries, so that the sum over the grid is [`LightSpectrum::unit_xyz`] up to
    /// rounding in every channel.
    ///
    /// Each wavelength gets the integral of spectrum times colour-matching functions over `step_nm` around it, cut to
    /// 380 to 780 nm; then each channel is scaled to its sum. A channel to which the whole grid is blind is shared
    /// out like Y, or evenly where Y vanishes too, so the sum still holds. A line goes to the nearest grid wavelength
    /// as a whole: to place it right, use a grid of just [`LightSpectrum::line_nm`].
    pub fn spectral_lux(&self, observer: Observer, grid_nm: &[f64], step_nm: f64) -> Vec<[f64; 3]> {
        let unit_xyz = self.unit_xyz(observer);
        let mut weights: Vec<[f64; 3]> = match self.line_nm() {
            Some(line_nm) => {
                let distance = |nm: &f64| (nm - line_nm).abs();
                let nearest = (0..grid_nm.len())
                    .min_by(|&i, &j| distance(&grid_nm[i]).total_cmp(&distance(&grid_nm[j])));
                (0..grid_nm.len()).map(|i| if Some(i) == nearest { [1.0; 3] } else { [0.0; 3] }).collect()
            }
            None => grid_nm
                .iter()
                .map(|nm| self.integrate(observer, (nm - 0.5 * step_nm, nm + 0.5 * step_nm)))
                .collect(),
        };
        let sums = [0, 1, 2].map(|channel| weights.iter().map(|w| w[channel]).sum::<f64>());
        let even = 1.0 / grid_nm.len() as f64;
        for weight in &mut weights {
            let like_y = if sums[1] > 0.0 { weight[1] / sums[1] } else { even };
            for channel in 0..3 {
                let share = if sums[channel] > 0.0 { weight[channel] / sums[channel] } else { like_y };
                weight[channel] = share * unit_xyz[channel];
            }
        }
        weights
    }

    /// Integral of spectrum times colour-matching functions over a range, cut to 380 to 780 nm.
    fn integrate(&self, observer: Observer, (lo_nm, hi_nm): (f64, f64)) -> [f64; 3] {
        let (lo_nm, hi_nm) = (lo_nm.max(VISIBLE_NM.0), hi_nm.min(VISIBLE_NM.1));
        let at = |nm: f64| {
            let power = self.relative_power(nm);
            observer.xyz_bar(nm).map(|bar| bar * power)
        };
        // All tables are linear between whole nanometres, so Simpson's rule on such pieces is exact for their product.
        let mut integral = [0.0; 3];
        let (mut a_nm, mut a) = (lo_nm, at(lo_nm));
        while a_nm < hi_nm {
            let b_nm = Float::min(Float::floor(a_nm) + 1.0, hi_nm);
            let (middle, b) = (at(0.5 * (a_nm + b_nm)), at(b_nm));
            for channel in 0..3 {
                integral[channel] += (a[channel] + 4.0 * middle[channel] + b[channel]) * (b_nm - a_nm) / 6.0;
            }
            (a_nm, a) = (b_nm, b);
        }
        integral
    }
}

fn per_luminance(xyz: [f64; 3]) -> [f64; 3] {
    xyz.map(|v| v / xyz[1])
}

fn black_body_kelvin<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let cct_k = f64::deserialize(deserializer)?;
    black_body(cct_k).map(|_| cct_k).map_err(D::Error::custom)
}

fn daylight_kelvin<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let cct_k = f64::deserialize(deserializer)?;
    daylight(cct_k).map(|_| cct_k).map_err(D::Error::custom)
}

fn visible_line_nm<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let lambda_nm = f64::deserialize(deserializer)?;
    LightSpectrum::line(lambda_nm).map(|_| lambda_nm).map_err(D::Error::custom)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    const FIVE_NM: f64 = 5.0;

    fn grid(step_nm: f64) -> Vec<f64> {
        (0..=(400.0 / step_nm) as u32).map(|i| 380.0 + step_nm * f64::from(i)).collect()
    }

    fn sum(weights: &[[f64; 3]]) -> [f64; 3] {
        [0, 1, 2].map(|c| weights.iter().map(|w| w[c]).sum())
    }

    fn every_kind() -> [LightSpectrum; 7] {
        [
            LightSpectrum::default(),
            LightSpectrum::d65_upsampled([1.0, 0.25, 0.0]),
            LightSpectrum::illuminant("E").unwrap(),
            LightSpectrum::illuminant("FL4").unwrap(),
            LightSpectrum::cct(3200.0).unwrap(),
            LightSpectrum::cct(9300.0).unwrap(),
            LightSpectrum::line(546.1).unwrap(),
        ]
    }

    #[test]
    fn white_is_d65_exactly() {
        for observer in Observer::ALL {
            assert_eq!(LightSpectrum::default().unit_xyz(observer), D65_WHITE_XYZ);
            for grey in [1.0, 0.3, 1e5] {
                assert_eq!(LightSpectrum::d65_upsampled([grey; 3]).unit_xyz(observer), D65_WHITE_XYZ);
            }
            assert_eq!(LightSpectrum::Illuminant(Illuminant::D65).unit_xyz(observer), D65_WHITE_XYZ);
        }
    }

    /// What the external references in shared/reference state for illuminant E over 380 to 780 nm.
    #[test]
    fn equal_energy_is_what_the_references_use() {
        let [x, y, z] = LightSpectrum::illuminant("E").unwrap().unit_xyz(Observer::Cie1931);
        assert_eq!(y, 1.0);
        assert!((x - 0.99998).abs() < 6e-6 && (z - 0.99987).abs() < 6e-6, "{x} {z}");
    }

    /// White points of CIE 15:2004, table T.3, from chromaticities x, y to five digits.
    #[test]
    fn illuminants_have_their_published_chromaticities() {
        for (name, x, y) in [
            ("A", 0.44758, 0.40745),
            ("D50", 0.34567, 0.35851),
            ("FL2", 0.37208, 0.37529),
            ("FL11", 0.38052, 0.37713),
        ] {
            let xyz = LightSpectrum::illuminant(name).unwrap().unit_xyz(Observer::Cie1931);
            let total: f64 = xyz.iter().sum();
            assert!((xyz[0] / total - x).abs() < 3e-5 && (xyz[1] / total - y).abs() < 3e-5, "{name} {xyz:?}");
        }
    }

    /// The defined white is D65's sum at 5 nm; the integral between the entries is 2.5e-4 away at most.
    #[test]
    fn integrated_d65_is_the_defined_white() {
        let xyz = per_luminance(LightSpectrum::default().integrate(Observer::Cie1931, VISIBLE_NM));
        for c in 0..3 {
            assert!((xyz[c] - D65_WHITE_XYZ[c]).abs() < 2.5e-4, "{xyz:?}");
        }
    }

    #[test]
    fn colored_light_has_its_color_whatever_its_scale() {
        for scale in [1.0, 1e-6, 37.0] {
            let light = LightSpectrum::d65_upsampled([0.9, 0.3, 0.1].map(|c| c * scale));
            let xyz = light.unit_xyz(Observer::Cie1931);
            let y = luminance([0.9, 0.3, 0.1]);
            let expected = xyz_from_linear_srgb([0.9, 0.3, 0.1]).map(|v| v / y);
            for c in 0..3 {
                assert!((xyz[c] - expected[c]).abs() < 1e-12, "{xyz:?} {expected:?}");
            }
            assert_eq!(xyz[1], 1.0);
        }
    }

    /// The scaling to the target colour must be a correction of rounding size, not a cover for a wrong spectrum.
    #[test]
    fn spectrum_of_a_colored_light_has_the_color_before_any_scaling() {
        let light = LightSpectrum::d65_upsampled([0.2, 0.5, 1.0]);
        let white = LightSpectrum::default();
        let (raw, raw_white) =
            (light.integrate(Observer::Cie1931, VISIBLE_NM), white.integrate(Observer::Cie1931, VISIBLE_NM));
        let relative_to_white = [0, 1, 2].map(|c| raw[c] / raw_white[c] * D65_WHITE_XYZ[c]);
        let expected = xyz_from_linear_srgb([0.2, 0.5, 1.0]);
        for c in 0..3 {
            assert!((relative_to_white[c] - expected[c]).abs() < 2e-5, "{relative_to_white:?} {expected:?}");
        }
    }

    #[test]
    fn grid_weights_add_up_to_the_light() {
        for light in every_kind() {
            for observer in Observer::ALL {
                for step_nm in [1.0, FIVE_NM, 50.0, 400.0] {
                    let weights = light.spectral_lux(observer, &grid(step_nm), step_nm);
                    let (sum, unit) = (sum(&weights), light.unit_xyz(observer));
                    for c in 0..3 {
                        assert!(
                            (sum[c] - unit[c]).abs() < 1e-12 * unit[c].max(1.0),
                            "{light:?} {sum:?} {unit:?}"
                        );
                    }
                    assert!(weights.iter().flatten().all(|w| *w >= 0.0));
                }
            }
        }
    }

    /// Z has no response at 700 nm and beyond; its weight follows Y, then an even share where Y has gone too.
    #[test]
    fn a_channel_blind_to_the_grid_is_shared_out() {
        let light = LightSpectrum::default();
        let red = light.spectral_lux(Observer::Cie1931, &[700.0, 710.0, 720.0], 10.0);
        for w in &red {
            assert!((w[2] / D65_WHITE_XYZ[2] - w[1]).abs() < 1e-15, "{red:?}");
        }
        let dark = light.spectral_lux(Observer::Cie1931, &[200.0, 250.0], 10.0);
        assert_eq!(dark, [D65_WHITE_XYZ.map(|v| v / 2.0); 2]);
        assert!(light.spectral_lux(Observer::Cie1931, &[], 10.0).is_empty());
        assert_eq!(light.spectral_lux(Observer::Cie1931, &[550.0], 10.0), [D65_WHITE_XYZ]);
    }

    #[test]
    fn a_line_lands_on_one_wavelength_as_a_whole() {
        let line = LightSpectrum::line(546.1).unwrap();
        assert_eq!((line.line_nm(), line.relative_power(546.1)), (Some(546.1), 0.0));
        let bar = Observer::Cie1931.xyz_bar(546.1);
        assert_eq!(line.unit_xyz(Observer::Cie1931), [bar[0] / bar[1], 1.0, bar[2] / bar[1]]);
        let weights = line.spectral_lux(Observer::Cie1931, &grid(FIVE_NM), FIVE_NM);
        assert_eq!(weights[33], line.unit_xyz(Observer::Cie1931)); // 545 nm
        assert!(weights.iter().enumerate().all(|(i, w)| i == 33 || *w == [0.0; 3]));
    }

    #[test]
    fn ends_of_the_visible_range_are_lines_too() {
        for nm in [380.0, 780.0] {
            let xyz = LightSpectrum::line(nm).unwrap().unit_xyz(Observer::Cie1931);
            assert!(xyz.iter().all(|v| v.is_finite() && *v >= 0.0) && xyz[1] == 1.0, "{nm} {xyz:?}");
        }
    }

    #[test]
    fn invalid_lights_are_refused_with_what_would_be_right() {
        let message = |result: Result<LightSpectrum, LightError>| result.unwrap_err().to_string();
        assert_eq!(
            message(LightSpectrum::line(900.0)),
            "the line is at 900 nm: it must be from 380 to 780 nm"
        );
        assert!(message(LightSpectrum::line(f64::NAN)).contains("380 to 780"));
        assert!(message(LightSpectrum::illuminant("F4")).contains("FL1 to FL12"));
        assert_eq!(
            message(LightSpectrum::cct(30000.0)),
            "daylight is defined from 4000 to 25000 K, got 30000 K"
        );
        assert!(message(LightSpectrum::cct(-1.0)).contains("got -1 K"));
        assert!(LightSpectrum::cct(f64::NAN).is_err());
    }

    #[test]
    fn color_temperatures_switch_from_planck_to_daylight_at_4000_k() {
        assert_eq!(LightSpectrum::cct(3999.0), Ok(LightSpectrum::BlackBody { cct_k: 3999.0 }));
        assert_eq!(LightSpectrum::cct(4000.0), Ok(LightSpectrum::Daylight { cct_k: 4000.0 }));
        // Planckian locus at 3200 K, CIE 1931: x 0.4234, y 0.3990.
        let xyz = LightSpectrum::cct(3200.0).unwrap().unit_xyz(Observer::Cie1931);
        let total: f64 = xyz.iter().sum();
        assert!((xyz[0] / total - 0.4234).abs() < 2e-4 && (xyz[1] / total - 0.3990).abs() < 2e-4, "{xyz:?}");
    }

    #[test]
    fn colors_without_chromaticity_become_white() {
        for color in [[0.0; 3], [f64::NAN; 3], [-1.0, -2.0, 0.0], [f64::INFINITY, 1.0, 1.0]] {
            assert_eq!(LightSpectrum::d65_upsampled(color), LightSpectrum::default());
        }
    }

    #[test]
    fn a_spectrum_put_together_by_hand_never_gives_nan() {
        let dark = LightSpectrum::BlackBody { cct_k: -5.0 };
        assert_eq!(dark.unit_xyz(Observer::Cie1931), D65_WHITE_XYZ);
        let invisible = LightSpectrum::Line { lambda_nm: f64::NAN };
        assert_eq!(invisible.unit_xyz(Observer::Cie1931), D65_WHITE_XYZ);
        assert!(
            invisible
                .spectral_lux(Observer::Cie1931, &[500.0, 600.0], 1.0)
                .iter()
                .flatten()
                .all(|w| w.is_finite())
        );
    }

    #[test]
    fn json_round_trips_and_is_checked() {
        for light in every_kind() {
            let json = serde_json::to_string(&light).unwrap();
            assert_eq!(serde_json::from_str::<LightSpectrum>(&json).unwrap(), light, "{json}");
        }
        for (json, complaint) in [
            (r#"{"line":{"lambda_nm":900}}"#, "900 nm"),
            (r#"{"black-body":{"cct_k":-3}}"#, "-3 K"),
            (r#"{"daylight":{"cct_k":3000}}"#, "4000 to 25000 K"),
        ] {
            let error = serde_json::from_str::<LightSpectrum>(json).unwrap_err().to_string();
            assert!(error.contains(complaint), "{error}");
        }
    }

    proptest! {
        #[test]
        fn any_color_lights_up_without_nan(color in prop::array::uniform3(prop::num::f64::ANY)) {
            let light = LightSpectrum::d65_upsampled(color);
            let weights = light.spectral_lux(Observer::Cie1931, &grid(50.0), 50.0);
            prop_assert!(weights.iter().flatten().all(|w| w.is_finite() && *w >= 0.0), "{:?} {:?}", light, weights);
        }
    }

    /// Chromaticities from CIE 15:2004, table T.3.
    #[test]
    fn daylight_has_the_published_chromaticity_by_any_of_its_names() {
        for (names, x, y) in [(["D55", "d5500"], 0.33242, 0.34743), (["D75", "D7500"], 0.29902, 0.31485)] {
            for name in names {
                let [cx, cy, cz] = LightSpectrum::illuminant(name).unwrap().unit_xyz(Observer::Cie1931);
                let sum = cx + cy + cz;
                let (got_x, got_y) = (cx / sum, cy / sum);
                assert!((got_x - x).abs() < 1e-4 && (got_y - y).abs() < 1e-4, "{name}: {got_x} {got_y}");
            }
        }
        assert_eq!(LightSpectrum::illuminant("D100"), LightSpectrum::illuminant("d10000"));
        assert_eq!(LightSpectrum::illuminant("d65"), Ok(LightSpectrum::Illuminant(Illuminant::D65)));
        for (name, words) in [
            ("D39", "from 4000 to 25000 K"),
            ("D260", "from 4000 to 25000 K"),
            ("D5", "such as D55"),
            ("D", "such as D55"),
            ("D+55", "such as D55"),
            ("D5.5", "such as D55"),
            ("D100000", "such as D55"),
            ("G55", "such as D55"),
        ] {
            let message = LightSpectrum::illuminant(name).expect_err(name).to_string();
            assert!(message.contains(words), "{name}: {message}");
        }
    }
}
