//! Spectra of lights, scaled so that luminance is 1.
//!
//! A light's strength is kept apart from its spectrum: an unblocked receiver perpendicular to it gets
//! [`LightSpectrum::unit_xyz`] times intensity and luminance of the colour.

use alloc::vec::Vec;

use num_traits::Float;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::illuminant::{
    DAYLIGHT_RANGE_K, Illuminant, TemperatureError, UnknownIlluminant, black_body, daylight,
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

    /// A CIE illuminant by its name, such as `E` or `FL11`.
    ///
    /// # Errors
    /// If there is none of that name.
    pub fn illuminant(name: &str) -> Result<Self, LightError> {
        Ok(Self::Illuminant(name.parse()?))
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
