//! Sets of wavelengths with the weights that turn them into colour.
//!
//! Every set holds vacuum wavelengths in ascending order and, per wavelength, XYZ weights that are never negative and
//! sum to 1 in each channel: carrying light of colour XYZ, wavelength i deposits weight times XYZ, and all of them
//! together what came in.

mod gauss;
mod light;
mod optimal;
mod quantiles;

use alloc::vec;
use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::observer::{Observer, TABLE_NM};
use crate::rgb::{D65_WHITE_XYZ, linear_srgb_from_xyz, xyz_from_linear_srgb};

/// How wavelengths are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// SPECGEN's spectral lines, equal weights. Three are F 486.1, D 589.3 and C 656.3 nm; four add e 546.1 nm.
    /// The range does not matter: it is that of the lines.
    Fraunhofer,
    /// Gauss-Legendre nodes and weights.
    Gauss,
    /// Equal steps with the range's ends included, equal weights (SPECGEN's "linear"); a single one is the middle.
    Uniform,
    /// Nodes at the quantiles (i + 1/2) / N of x + y + z, with equal weights in that measure: channel c of node i
    /// weighs c(lambda_i) / (x + y + z)(lambda_i), normalised.
    EqualEnergy,
    /// Table 1 of Blanchette & Agu 2013: seven wavelengths, 380 to 680 nm by 50, with RGB weights instead of XYZ
    /// ones. The range does not matter.
    Asm2013,
    /// Nodes and weights that minimise the colour error of a dispersed line, averaged over spreads of 1, 4 and 16 px
    /// (see [`crate::quality`]).
    #[default]
    Optimal,
}

impl Scheme {
    /// Every scheme.
    pub const ALL: [Self; 6] =
        [Self::Fraunhofer, Self::Gauss, Self::Uniform, Self::EqualEnergy, Self::Asm2013, Self::Optimal];

    /// Its name on the command line and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fraunhofer => "fraunhofer",
            Self::Gauss => "gauss",
            Self::Uniform => "uniform",
            Self::EqualEnergy => "equal-energy",
            Self::Asm2013 => "asm2013",
            Self::Optimal => "optimal",
        }
    }

    /// Whether a set of `n` wavelengths exists, and what would be right otherwise.
    fn check_count(self, n: usize) -> Result<(), WavelengthError> {
        let (ok, allowed) = match self {
            Self::Fraunhofer => (n == 3 || n == 4, "3 or 4"),
            Self::Asm2013 => (n == 7, "7"),
            _ => ((1..=MAX_COUNT).contains(&n), "1 to 4096"),
        };
        if ok { Ok(()) } else { Err(WavelengthError::BadCount { scheme: self, got: n, allowed }) }
    }
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no scheme's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown scheme: expected fraunhofer, gauss, uniform, equal-energy, asm2013 or optimal")]
pub struct UnknownScheme;

impl FromStr for Scheme {
    type Err = UnknownScheme;

    fn from_str(name: &str) -> Result<Self, UnknownScheme> {
        Self::ALL.into_iter().find(|s| s.name() == name).ok_or(UnknownScheme)
    }
}

/// Most wavelengths in a set.
pub const MAX_COUNT: usize = 4096;

/// SPECGEN's default range, nm.
pub const DEFAULT_RANGE_NM: (f64, f64) = (420.0, 680.0);

/// Table 1 of Blanchette & Agu 2013: red, green and blue of 380, 430, ... 680 nm; each channel totals 893.
const ASM_2013_TABLE_1: [[f64; 3]; 7] = [
    [77.0, 0.0, 204.0],
    [51.0, 51.0, 255.0],
    [0.0, 229.5, 255.0],
    [76.5, 255.0, 102.0],
    [204.0, 229.5, 77.0],
    [229.5, 128.0, 0.0],
    [255.0, 0.0, 0.0],
];

/// Why there is no such set of wavelengths.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WavelengthError {
    /// The scheme has no set of that size.
    #[error("scheme {scheme} has {allowed} wavelengths, got {got}")]
    BadCount {
        /// The scheme asked for.
        scheme: Scheme,
        /// The count asked for.
        got: usize,
        /// The counts it has.
        allowed: &'static str,
    },
    /// The range is reversed, empty or not a number.
    #[error("the range {lo_nm}..{hi_nm} nm is empty: its start must be below its end")]
    EmptyRange {
        /// Its start, nm.
        lo_nm: f64,
        /// Its end, nm.
        hi_nm: f64,
    },
    /// The range leaves the colour-matching tables.
    #[error("the range {lo_nm}..{hi_nm} nm is outside the colour-matching tables, {} to {} nm", TABLE_NM.0, TABLE_NM.1)]
    RangeOutsideTable {
        /// Its start, nm.
        lo_nm: f64,
        /// Its end, nm.
        hi_nm: f64,
    },
    /// One of the colour-matching functions is zero at all wavelengths of the set, so it cannot sum to white.
    #[error(
        "{observer} has no {channel} at any of the {n} wavelengths of {scheme} in {lo_nm}..{hi_nm} nm: they cannot sum to white"
    )]
    ChannelVanishes {
        /// The colour-matching functions.
        observer: Observer,
        /// The scheme asked for.
        scheme: Scheme,
        /// The count asked for.
        n: usize,
        /// X, Y or Z.
        channel: char,
        /// Start of the range, nm.
        lo_nm: f64,
        /// End of the range, nm.
        hi_nm: f64,
    },
}

/// Wavelengths and their weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WavelengthSet {
    /// How they were chosen.
    pub scheme: Scheme,
    /// The colour-matching functions behind the weights.
    pub observer: Observer,
    /// The range they were chosen from, nm. Schemes with fixed wavelengths state their own.
    pub range_nm: (f64, f64),
    /// Vacuum wavelengths, nm, ascending.
    pub wavelengths_nm: Vec<f64>,
    /// XYZ weights, none negative, each channel with sum 1. `None` for [`Scheme::Asm2013`], which has RGB ones only.
    pub weights_xyz: Option<Vec<[f64; 3]>>,
    /// Linear sRGB weights, each channel with sum 1: what of white (1, 1, 1) falls to each wavelength. Those of
    /// wavelengths outside the sRGB gamut have negative parts, except in Table 1 of [`Scheme::Asm2013`].
    pub weights_rgb: Vec<[f64; 3]>,
    /// Weights for integrals over wavelength, nm: the share of the range that each wavelength stands for.
    pub quadrature: Vec<f64>,
}

impl WavelengthSet {
    /// The set of `n` wavelengths that `scheme` chooses from `range_nm` for `observer`.
    ///
    /// [`Scheme::Fraunhofer`] and [`Scheme::Asm2013`] have fixed wavelengths: they take any valid range and state
    /// their own in the set.
    ///
    /// # Errors
    /// If the scheme has no set of that size, the range is empty or outside 360 to 830 nm, or a colour-matching
    /// function vanishes at every one of several wavelengths.
    pub fn new(
        scheme: Scheme,
        n: usize,
        range_nm: (f64, f64),
        observer: Observer,
    ) -> Result<Self, WavelengthError> {
        scheme.check_count(n)?;
        let (lo_nm, hi_nm) = range_nm;
        if lo_nm.is_nan() || hi_nm.is_nan() || lo_nm >= hi_nm {
            return Err(WavelengthError::EmptyRange { lo_nm, hi_nm });
        }
        if lo_nm < TABLE_NM.0 || hi_nm > TABLE_NM.1 {
            return Err(WavelengthError::RangeOutsideTable { lo_nm, hi_nm });
        }
        match scheme {
            Scheme::Fraunhofer => {
                let wavelengths_nm =
                    if n == 3 { vec![486.1, 589.3, 656.3] } else { vec![486.1, 546.1, 589.3, 656.3] };
                let range_nm = (486.1, 656.3);
                let quadrature = vec![(range_nm.1 - range_nm.0) / n as f64; n];
                Self::from_quadrature(scheme, range_nm, observer, wavelengths_nm, quadrature)
            }
            Scheme::Gauss => {
                let (wavelengths_nm, quadrature) = gauss::gauss_legendre(n, range_nm);
                Self::from_quadrature(scheme, range_nm, observer, wavelengths_nm, quadrature)
            }
            Scheme::Uniform => {
                let quadrature = vec![(hi_nm - lo_nm) / n as f64; n];
                Self::from_quadrature(scheme, range_nm, observer, evenly_spaced(n, range_nm), quadrature)
            }
            Scheme::EqualEnergy => {
                let (wavelengths_nm, quadrature) = quantiles::equal_energy(n, range_nm, observer);
                Self::from_quadrature(scheme, range_nm, observer, wavelengths_nm, quadrature)
            }
            Scheme::Asm2013 => Ok(Self::asm_2013(observer)),
            Scheme::Optimal => optimal::optimal(n, range_nm, observer),
        }
    }

    /// Number of wavelengths.
    pub fn len(&self) -> usize {
        self.wavelengths_nm.len()
    }

    /// Whether there are none; no constructor makes such a set.
    pub fn is_empty(&self) -> bool {
        self.wavelengths_nm.is_empty()
    }

    /// XYZ weights relative to D65 white, each channel with sum 1: [`WavelengthSet::weights_xyz`], or what the RGB
    /// weights come to where there are none.
    pub fn relative_weights_xyz(&self) -> Vec<[f64; 3]> {
        match &self.weights_xyz {
            Some(weights) => weights.clone(),
            None => self
                .weights_rgb
                .iter()
                .map(|&rgb| {
                    let xyz = xyz_from_linear_srgb(rgb);
                    core::array::from_fn(|c| xyz[c] / D65_WHITE_XYZ[c])
                })
                .collect(),
        }
    }

    /// Weights from nodes and a quadrature: colour-matching function times quadrature, each channel divided by its sum.
    fn from_quadrature(
        scheme: Scheme,
        range_nm: (f64, f64),
        observer: Observer,
        wavelengths_nm: Vec<f64>,
        quadrature: Vec<f64>,
    ) -> Result<Self, WavelengthError> {
        let raw = wavelengths_nm
            .iter()
            .zip(&quadrature)
            .map(|(&nm, q)| observer.xyz_bar(nm).map(|bar| bar * q))
            .collect();
        Self::from_weights(scheme, range_nm, observer, wavelengths_nm, raw, quadrature)
    }

    /// Normalises XYZ weights and derives the RGB ones.
    fn from_weights(
        scheme: Scheme,
        range_nm: (f64, f64),
        observer: Observer,
        wavelengths_nm: Vec<f64>,
        mut weights_xyz: Vec<[f64; 3]>,
        quadrature: Vec<f64>,
    ) -> Result<Self, WavelengthError> {
        // A single wavelength carries all of white, whatever its own colour.
        if let [only] = weights_xyz.as_mut_slice() {
            *only = [1.0; 3];
        }
        let sums = [0, 1, 2].map(|c| weights_xyz.iter().map(|w| w[c]).sum::<f64>());
        if let Some(vanished) = sums.iter().position(|&sum| sum <= 0.0) {
            return Err(WavelengthError::ChannelVanishes {
                observer,
                scheme,
                n: wavelengths_nm.len(),
                channel: ['X', 'Y', 'Z'][vanished],
                lo_nm: range_nm.0,
                hi_nm: range_nm.1,
            });
        }
        for weight in &mut weights_xyz {
            for c in 0..3 {
                weight[c] /= sums[c];
            }
        }
        let weights_rgb = weights_xyz
            .iter()
            .map(|w| linear_srgb_from_xyz(core::array::from_fn(|c| w[c] * D65_WHITE_XYZ[c])))
            .collect();
        Ok(Self {
            scheme,
            observer,
            range_nm,
            wavelengths_nm,
            weights_xyz: Some(weights_xyz),
            weights_rgb,
            quadrature,
        })
    }

    fn asm_2013(observer: Observer) -> Self {
        let totals = [0, 1, 2].map(|c| ASM_2013_TABLE_1.iter().map(|rgb| rgb[c]).sum::<f64>());
        let range_nm = (380.0, 680.0);
        Self {
            scheme: Scheme::Asm2013,
            observer,
            range_nm,
            wavelengths_nm: evenly_spaced(7, range_nm),
            weights_xyz: None,
            weights_rgb: ASM_2013_TABLE_1
                .iter()
                .map(|rgb| core::array::from_fn(|c| rgb[c] / totals[c]))
                .collect(),
            quadrature: vec![(range_nm.1 - range_nm.0) / 7.0; 7],
        }
    }
}

/// `n` wavelengths in equal steps with both ends; the middle if there is only one.
fn evenly_spaced(n: usize, (lo_nm, hi_nm): (f64, f64)) -> Vec<f64> {
    if n == 1 {
        return vec![0.5 * (lo_nm + hi_nm)];
    }
    let last = (n - 1) as f64;
    let step = |i: usize| (lo_nm * (last - i as f64) + hi_nm * i as f64) / last;
    let mut wavelengths_nm: Vec<f64> = (0..n).map(step).collect();
    // Rounding must not move the ends.
    (wavelengths_nm[0], wavelengths_nm[n - 1]) = (lo_nm, hi_nm);
    wavelengths_nm
}

/// The part of the table's range that is nearer to each wavelength than to any other, nm; wavelengths ascend.
fn neighbourhoods_nm(wavelengths_nm: &[f64]) -> Vec<(f64, f64)> {
    let last = wavelengths_nm.len().saturating_sub(1);
    let middle = |i: usize| 0.5 * (wavelengths_nm[i] + wavelengths_nm[i + 1]);
    (0..wavelengths_nm.len())
        .map(|i| {
            (if i == 0 { TABLE_NM.0 } else { middle(i - 1) }, if i == last { TABLE_NM.1 } else { middle(i) })
        })
        .collect()
}
