//! Options that take one of a few names.

use std::fmt;
use std::str::FromStr;

use asm_core::{GapFilling, GlassView, MapFit, Reflections, Refraction, RefractionRule};
use caustic_heightfield::Accumulation;
use caustic_heightfield::adjusted::{Fixed, Format};
use serde::{Serialize, Serializer};
use spectral_core::display::{MIDDLE_GREY, ToneMap};

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The f64 oracle.
    Reference,
    /// Caustics mapping (Shah, Konttinen & Pattanaik).
    CausticsMap,
    /// Adaptive caustic maps (Wyman & Nichols).
    Acm,
    /// Adaptive spectral mapping (Blanchette & Agu).
    Asm,
    /// Spectral footprints along traced paths.
    Footprint,
}

impl Method {
    /// All that are built.
    pub const ALL: [Self; 5] = [Self::Reference, Self::CausticsMap, Self::Acm, Self::Asm, Self::Footprint];

    /// The method of plans; the reference has none.
    #[must_use]
    pub fn planned(self) -> Option<asm_core::Method> {
        match self {
            Self::Reference => None,
            Self::CausticsMap => Some(asm_core::Method::CausticsMap),
            Self::Acm => Some(asm_core::Method::Acm),
            Self::Asm => Some(asm_core::Method::Asm),
            Self::Footprint => Some(asm_core::Method::Footprint),
        }
    }

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::CausticsMap => "caustics-map",
            Self::Acm => "acm",
            Self::Asm => "asm",
            Self::Footprint => "footprint",
        }
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        choose(text, &Self::ALL.map(|m| (m.name(), m)))
    }
}

/// What runs a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// wgpu on a real GPU, else the CPU.
    Auto,
    /// The CPU executor.
    Cpu,
    /// The wgpu executor.
    Wgpu,
    /// The Vulkan executor.
    Vulkan,
}

impl FromStr for Backend {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let built =
            [("auto", Self::Auto), ("cpu", Self::Cpu), ("wgpu", Self::Wgpu), ("vulkan", Self::Vulkan)];
        choose(text, &built)
    }
}

/// How light finds its way through glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Way(pub(crate) Refraction);

impl FromStr for Way {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        choose(text, &Refraction::ALL.map(|r| (r.name(), r))).map(Self)
    }
}

/// How gaps between wavelengths are filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gaps(pub(crate) GapFilling);

/// The rules of gap filling by their names on the command line.
pub const GAP_FILLINGS: [(&str, GapFilling); 4] = [
    ("none", GapFilling::None),
    ("paper", GapFilling::Paper),
    ("paper-literal", GapFilling::PaperLiteral),
    ("disc", GapFilling::Disc),
];

impl FromStr for Gaps {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        choose(text, &GAP_FILLINGS).map(Self)
    }
}

/// What a light's map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fit(pub(crate) MapFit);

impl FromStr for Fit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let built = [("receivers", MapFit::Receivers), ("landings", MapFit::Landings)];
        choose(text, &built).map(Self)
    }
}

/// How a camera sees glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Glass(pub(crate) GlassView);

impl FromStr for Glass {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let built = [("straight", GlassView::Straight), ("deferred", GlassView::Deferred)];
        choose(text, &built).map(Self)
    }
}

/// Which reflections throw caustics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reflected(pub(crate) Reflections);

impl FromStr for Reflected {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let built =
            [("none", Reflections::None), ("mirrors", Reflections::Mirrors), ("all", Reflections::All)];
        choose(text, &built).map(Self)
    }
}

/// What an interface does with light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Rule(pub(crate) RefractionRule);

impl FromStr for Rule {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let built = [("fresnel", RefractionRule::Fresnel), ("glsl", RefractionRule::Glsl)];
        choose(text, &built).map(Self)
    }
}

/// How the light on a pond's floor is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PondMethod {
    /// The paper's three convolutions (Trendall & Stewart).
    Convolution,
    /// Separable terms of the exact lobe.
    LowRank,
    /// Direct summation.
    Exact,
    /// The water as a refractor, by spectral footprints.
    Photon,
}

impl PondMethod {
    /// All that are built.
    pub const ALL: [Self; 4] = [Self::Convolution, Self::LowRank, Self::Exact, Self::Photon];

    /// Its name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Convolution => "convolution",
            Self::LowRank => "low-rank",
            Self::Exact => "exact",
            Self::Photon => "photon",
        }
    }

    /// The numbers it is computed in where `asked` is asked for, or nothing.
    ///
    /// # Errors
    /// Why it is not computed in those.
    pub fn precision(self, asked: Option<Precision>) -> Result<Precision, &'static str> {
        match (self, asked) {
            (Self::Exact, Some(Precision::F16 | Precision::F32 | Precision::Fixed(_))) => {
                Err("--precision: --method exact is what others are held against, and is f64")
            }
            (Self::Photon, Some(Precision::F16 | Precision::F64 | Precision::Fixed(_))) => {
                Err("--precision: --method photon traces light in f32 and in nothing else")
            }
            (Self::LowRank, Some(Precision::F16 | Precision::Fixed(_))) => {
                Err("--precision f16 and fixed point are for --method convolution")
            }
            (Self::Exact, _) => Ok(Precision::F64),
            (_, asked) => Ok(asked.unwrap_or(Precision::F32)),
        }
    }
}

impl FromStr for PondMethod {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        choose(text, &Self::ALL.map(|m| (m.name(), m)))
    }
}

/// Numbers that a pond is computed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Frame buffers of so many bits, with the paper's scaled and biased arithmetic.
    Fixed(Fixed),
    /// Frame buffers of 16-bit floating point.
    F16,
    /// 32-bit floating point.
    F32,
    /// 64-bit floating point.
    F64,
}

impl Precision {
    /// Whether the paper's six passes are run in frame buffers.
    pub(crate) fn is_frame_buffer(self) -> bool {
        matches!(self, Self::Fixed(_) | Self::F16)
    }
}

impl fmt::Display for Precision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fixed(format) => f.write_str(&format.name()),
            Self::F16 => f.write_str("f16"),
            Self::F32 => f.write_str("f32"),
            Self::F64 => f.write_str("f64"),
        }
    }
}

impl Serialize for Precision {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl FromStr for Precision {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some(bits) = text.strip_prefix("fixed") {
            let (least, most) = (Fixed::BITS.start(), Fixed::BITS.end());
            return bits
                .parse()
                .ok()
                .and_then(Fixed::new)
                .map(Self::Fixed)
                .ok_or_else(|| format!("fixed point has {least} to {most} bits: fixed8, fixed12"));
        }
        match choose(text, &[("f16", Self::F16), ("f32", Self::F32), ("f64", Self::F64)]) {
            Ok(precision) => Ok(precision),
            Err(problem) => Err(format!("{problem}, fixed8, fixed12")),
        }
    }
}

/// Where the paper's last pass rounds its sums.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sums(pub(crate) Accumulation);

impl FromStr for Sums {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let built = [("per-term", Accumulation::PerTerm), ("per-tap", Accumulation::PerTap)];
        choose(text, &built).map(Self)
    }
}

/// Whether the pond's water refracts wavelengths apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dispersed {
    On,
    Off,
    /// Where it is visible.
    Auto,
}

impl FromStr for Dispersed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        choose(text, &[("on", Self::On), ("off", Self::Off), ("auto", Self::Auto)])
    }
}

/// How a spectral basis is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// The singular vectors of the spectra themselves (Peercy 1993).
    Peercy,
    /// The best for the colours that are shown.
    Optimal,
}

impl Basis {
    /// Both, by their names on the command line.
    pub const ALL: [(&'static str, Self); 2] = [("peercy", Self::Peercy), ("optimal", Self::Optimal)];
}

impl FromStr for Basis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        choose(text, &Self::ALL)
    }
}

/// A tone map by its name on the command line: `clip` or `sigmoid`, which has slope 1 of log against log where it leaves middle grey.
///
/// # Errors
/// The names that there are.
pub(crate) fn tone_map(text: &str) -> Result<ToneMap, String> {
    let sigmoid = ToneMap::Sigmoid { contrast: 1.0 / (1.0 - MIDDLE_GREY) };
    choose(text, &[("clip", ToneMap::Clip), ("sigmoid", sigmoid)])
}

fn choose<T: Copy>(text: &str, built: &[(&str, T)]) -> Result<T, String> {
    if let Some((_, value)) = built.iter().find(|(name, _)| *name == text) {
        return Ok(*value);
    }
    let names = built.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    Err(format!("no such name; there is: {names}"))
}
