//! Spectral matrices as source text: headers for shaders and hosts, JSON, and a table to read.
//!
//! All formats carry the same f32 values: the matrices with nine significant digits, which f32 survives, everything
//! else with as many digits as it needs (in JSON those of f64, of which the others are the nearest f32). Matrices are written the
//! way each language multiplies matrix times column vector: column by column in GLSL, WGSL and MSL, row by row elsewhere.

mod json;
mod languages;
mod text;

use alloc::format;
use alloc::string::String;
use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::dispersion::OffsetConvention;
use crate::matrices::SpectralMatrices;
use crate::quality::{EdgeReport, SPREADS_PX};
use crate::wavelengths::WavelengthSet;

/// A format that matrices are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Format {
    /// GLSL 3.30, GLSL ES 3.00 or later; `mat3`, column-major.
    Glsl,
    /// HLSL; `float3x3` by rows, for `mul(K, colour)`.
    Hlsl,
    /// WGSL; `mat3x3<f32>`, column-major.
    Wgsl,
    /// Metal; `float3x3` of three columns.
    Msl,
    /// C99 and C++; `float[3][3]` by rows.
    C,
    /// Rust; `[[f32; 3]; 3]` by rows.
    Rust,
    /// JSON; matrices by rows.
    Json,
    /// A table to read.
    Text,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 8] =
        [Self::Glsl, Self::Hlsl, Self::Wgsl, Self::Msl, Self::C, Self::Rust, Self::Json, Self::Text];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
            Self::Wgsl => "wgsl",
            Self::Msl => "msl",
            Self::C => "c",
            Self::Rust => "rust",
            Self::Json => "json",
            Self::Text => "text",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no format's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown format: expected glsl, hlsl, wgsl, msl, c, rust, json or text")]
pub struct UnknownFormat;

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        Self::ALL.into_iter().find(|f| f.name() == name).ok_or(UnknownFormat)
    }
}

/// Writes a set of wavelengths and the matrices made from it, with IOR offsets by `offsets`.
///
/// Holds the count, wavelengths, weights, matrices and IOR offsets, and says how they came about: scheme, range,
/// colour-matching functions, residual of the sum and colour error of a dispersed line.
pub fn write(
    set: &WavelengthSet,
    matrices: &SpectralMatrices,
    offsets: OffsetConvention,
    format: Format,
) -> String {
    let content = Content { set, matrices, offsets, edge: EdgeReport::new(set) };
    match format {
        Format::Glsl => languages::write(&content, &languages::GLSL),
        Format::Hlsl => languages::write(&content, &languages::HLSL),
        Format::Wgsl => languages::write(&content, &languages::WGSL),
        Format::Msl => languages::write(&content, &languages::MSL),
        Format::C => languages::write(&content, &languages::C),
        Format::Rust => languages::write(&content, &languages::RUST),
        Format::Json => json::write(&content),
        Format::Text => text::write(&content),
    }
}

/// What every format says.
struct Content<'a> {
    set: &'a WavelengthSet,
    matrices: &'a SpectralMatrices,
    offsets: OffsetConvention,
    edge: EdgeReport,
}

impl Content<'_> {
    fn ior_offsets(&self) -> impl Iterator<Item = f64> {
        self.set.wavelengths_nm.iter().map(|&nm| self.offsets.ior_offset(nm))
    }

    /// How the numbers came about and how to use them; one line each, without anything that could end a comment.
    fn provenance(&self) -> [String; 5] {
        let set = self.set;
        let (f_nm, reference_nm, c_nm) = self.offsets.lines_nm();
        let spreads = SPREADS_PX.map(|px| format!("{px}")).join(", ");
        let errors = self.edge.delta_e.map(|e| format!("{e:.2}")).join(", ");
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let sum = if self.matrices.sum == identity { "the identity" } else { "the light's colour" };
        let rgb_space: String = self.matrices.rgb_space.chars().filter(|c| !c.is_control()).collect();
        [
            format!(
                "Spectral matrices by spectral-core {}: {} wavelengths, scheme {}, {} to {} nm, {}, linear {}.",
                env!("CARGO_PKG_VERSION"),
                set.len(),
                set.scheme,
                set.range_nm.0,
                set.range_nm.1,
                set.observer,
                rgb_space,
            ),
            format!(
                "Colour = sum of K_n * colour_n, clamped only after the sum. All K_n sum to {sum} in f32, in any order \
                 (residual {:?}).",
                self.matrices.sum_residual()
            ),
            format!(
                "IOR of wavelength n = ior + (ior - 1) / V * offset_n, V the Abbe number; convention {}: \
                 F {f_nm}, reference {reference_nm}, C {c_nm} nm.",
                self.offsets
            ),
            match self.matrices.weights_xyz {
                Some(_) => "Weights: XYZ weights are never negative; RGB weights are K_n * white.".into(),
                None => "Weights: RGB only, from a published table; the matrices are diagonal.".into(),
            },
            format!(
                "Mean CIEDE2000 of a line with {spreads} px between F and C, against 1 nm sampling: {errors}."
            ),
        ]
    }
}

/// A number with nine significant digits, which identify every f32; always with a point or an exponent.
fn nine_digits(value: f32) -> String {
    let scientific = format!("{value:.8e}");
    let exponent: i32 = scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0);
    match usize::try_from(8 - exponent) {
        Ok(decimals) if (1..=13).contains(&decimals) => format!("{value:.decimals$}"),
        _ => scientific,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn nine_digits_are_nine() {
        for (value, expected) in [
            (0.0, "0.00000000"),
            (1.0, "1.00000000"),
            (-0.1, "-0.100000001"),
            (9.999_999_9, "10.0000000"),
            (1.192_092_9e-7, "1.19209290e-7"),
            (123_456_790.0, "1.23456792e8"),
        ] {
            assert_eq!(nine_digits(value), expected);
        }
    }

    proptest! {
        #[test]
        fn nine_digits_identify_every_f32(value in proptest::num::f32::NORMAL | proptest::num::f32::SUBNORMAL) {
            let text = nine_digits(value);
            prop_assert_eq!(text.parse::<f32>().unwrap().to_bits(), value.to_bits());
            prop_assert!(text.contains(['.', 'e']));
        }
    }
}
