//! Parsers of the values on the command line. Each says what would be right.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;
use spectral_core::observer::TABLE_NM;
use spectral_core::wavelengths::MAX_COUNT;

/// Longest side of an image, texels.
pub const MAX_SIDE: u32 = 8_192;
/// Most wavelengths that light is traced at: one per nanometre of the visible range.
pub const MAX_TRACED_WAVELENGTHS: usize = 400;
/// Most threads a run may ask for.
pub const MAX_THREADS: usize = 1_024;
/// Most photons a run may ask for: more than any machine gets through, and exact in f64.
pub const MAX_PHOTONS: f64 = 1e15;
/// Most frames of a series: more than a minute at any rate that a screen has.
pub const MAX_FRAMES: u32 = 100_000;
/// Deepest chain of internal reflections.
pub const MAX_BOUNCES: u32 = 64;

/// Width and height of an image in texels, each 1 to [`MAX_SIDE`]; written `256x256`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Texels in x or u.
    pub width: u32,
    /// Texels in y or v.
    pub height: u32,
}

impl Size {
    /// Number of texels.
    #[must_use]
    pub fn texels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) =
            text.split_once(['x', 'X']).ok_or("expected WIDTHxHEIGHT in texels, such as 256x256")?;
        let side = |name: &str, digits: &str| match integer(digits) {
            Some(n) if (1..=u64::from(MAX_SIDE)).contains(&n) => Ok(n as u32),
            _ => Err(format!("{name} {digits:?} is not a whole number of texels from 1 to {MAX_SIDE}")),
        };
        Ok(Self { width: side("width", width)?, height: side("height", height)? })
    }
}

/// Wavelengths `low_nm..high_nm`, inside the colour-matching tables; written `420..680`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WavelengthRange {
    /// Shortest wavelength, nm.
    pub low_nm: f64,
    /// Longest wavelength, nm, above `low_nm`.
    pub high_nm: f64,
}

impl fmt::Display for WavelengthRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.low_nm, self.high_nm)
    }
}

impl FromStr for WavelengthRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (low, high) =
            text.split_once("..").ok_or("expected LOW..HIGH in nanometres, such as 420..680")?;
        let end = |digits: &str| match digits.parse::<f64>() {
            Ok(nm) if (TABLE_NM.0..=TABLE_NM.1).contains(&nm) => Ok(nm),
            _ => Err(format!("{digits:?} is not a wavelength from {} to {} nm", TABLE_NM.0, TABLE_NM.1)),
        };
        let (low_nm, high_nm) = (end(low)?, end(high)?);
        if low_nm >= high_nm {
            return Err(format!(
                "the range must run upwards, such as 420..680, and {low_nm} is not below {high_nm}"
            ));
        }
        Ok(Self { low_nm, high_nm })
    }
}

/// What scene-linear values are multiplied by before the tone map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// 1 / the 99th percentile of Y.
    Auto,
    /// This factor, above 0.
    Factor(f64),
}

impl FromStr for Exposure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        match text.parse::<f64>() {
            Ok(factor) if factor.is_normal() && factor > 0.0 => Ok(Self::Factor(factor)),
            _ => Err("expected auto or a factor above 0, such as 0.5".into()),
        }
    }
}

/// How rough what shines is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// As each material says.
    Material,
    /// All of it alike, perceptual as glTF's: 0 is a mirror, 1 the broadest lobe.
    Roughness(f64),
}

impl FromStr for Gloss {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "material" {
            return Ok(Self::Material);
        }
        match text.parse::<f64>() {
            Ok(roughness) if (0.0..=1.0).contains(&roughness) => Ok(Self::Roughness(roughness)),
            _ => Err("expected material or a roughness from 0 to 1, such as 0.5".into()),
        }
    }
}

/// A number of photons from 1 to [`MAX_PHOTONS`]; written `4000000` or `4e6`.
///
/// # Errors
/// Says what would be right.
pub fn photons(text: &str) -> Result<u64, String> {
    let wrong = || format!("expected a whole number of photons from 1 to {MAX_PHOTONS:e}, such as 4e6");
    let number = match integer(text) {
        Some(n) => n as f64,
        None => text.parse::<f64>().map_err(|_| wrong())?,
    };
    if (1.0..=MAX_PHOTONS).contains(&number) && number.fract() == 0.0 {
        Ok(number as u64)
    } else {
        Err(wrong())
    }
}

/// A relative standard error to reach, above 0 and below 1; written `0.01`.
///
/// # Errors
/// Says what would be right.
pub fn noise(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_normal() && x > 0.0 && x < 1.0 => Ok(x),
        _ => Err("expected a relative standard error above 0 and below 1, such as 0.01".into()),
    }
}

/// A number above 0: milliseconds, or a colour difference.
///
/// # Errors
/// Says what would be right.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x.is_normal() && x > 0.0 => Ok(x),
        _ => Err("expected a number above 0, such as 2.5".into()),
    }
}

/// The size of a wavelength set, from 1 to [`MAX_COUNT`].
///
/// # Errors
/// Says what would be right.
pub fn set_wavelengths(text: &str) -> Result<usize, String> {
    whole_number(text, 1, MAX_COUNT as u64).map(|n| n as usize)
}

/// A number of wavelengths to trace light at, from 1 to [`MAX_TRACED_WAVELENGTHS`].
///
/// # Errors
/// Says what would be right.
pub fn traced_wavelengths(text: &str) -> Result<usize, String> {
    whole_number(text, 1, MAX_TRACED_WAVELENGTHS as u64).map(|n| n as usize)
}

/// A number of wavelengths to trace light at, as many as a method may take: each has its own limits.
///
/// # Errors
/// Says what would be right.
pub fn any_wavelengths(text: &str) -> Result<usize, String> {
    whole_number(text, 1, u64::from(u32::MAX)).map(|n| n as usize)
}

/// A part of an adapter's name, not blank: every name has an empty part.
///
/// # Errors
/// Says what would be right.
pub fn adapter(text: &str) -> Result<String, String> {
    if text.trim().is_empty() {
        return Err("expected a part of an adapter's name; `spectral devices` lists them".into());
    }
    Ok(text.to_owned())
}

/// A number of threads from 1 to [`MAX_THREADS`].
///
/// # Errors
/// Says what would be right.
pub fn threads(text: &str) -> Result<usize, String> {
    whole_number(text, 1, MAX_THREADS as u64).map(|n| n as usize)
}

/// A seed of random numbers: any that 64 bits hold.
///
/// # Errors
/// Says what would be right.
pub fn seed(text: &str) -> Result<u64, String> {
    whole_number(text, 0, u64::MAX)
}

/// A number of internal reflections from 0 to [`MAX_BOUNCES`].
///
/// # Errors
/// Says what would be right.
pub fn bounces(text: &str) -> Result<u32, String> {
    whole_number(text, 0, u64::from(MAX_BOUNCES)).map(|n| n as u32)
}

/// Samples on a side of a square grid, from 1 to [`MAX_SIDE`].
///
/// # Errors
/// Says what would be right.
pub fn side(text: &str) -> Result<usize, String> {
    whole_number(text, 1, u64::from(MAX_SIDE)).map(|n| n as usize)
}

/// A number of frames from 1 to [`MAX_FRAMES`].
///
/// # Errors
/// Says what would be right.
pub fn frames(text: &str) -> Result<usize, String> {
    whole_number(text, 1, u64::from(MAX_FRAMES)).map(|n| n as usize)
}

/// Seconds between frames, as an animated PNG can state them: 0.001 to 60.
///
/// # Errors
/// Says what would be right.
pub fn frame_step(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if (1e-3..=60.0).contains(&x) => Ok(x),
        _ => Err("expected seconds from 0.001 to 60, such as 0.04".into()),
    }
}

fn whole_number(text: &str, min: u64, max: u64) -> Result<u64, String> {
    integer(text)
        .filter(|n| (min..=max).contains(n))
        .ok_or_else(|| format!("expected a whole number from {min} to {max}"))
}

/// Digits only: no sign, no blanks, no exponent.
fn integer(text: &str) -> Option<u64> {
    if text.bytes().all(|b| b.is_ascii_digit()) { text.parse().ok() } else { None }
}
