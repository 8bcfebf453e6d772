//! Refractive index as a function of the vacuum wavelength.
//!
//! Two conventions for the Abbe number are in use here and are kept apart by [`OffsetConvention`]: glTF's, on the
//! helium d line, and SPECGEN's, on the sodium D line.

mod fit;

use alloc::vec::Vec;
use core::fmt;
use core::str::FromStr;

use num_traits::Float;
use serde::{Deserialize, Serialize};

pub use fit::{CauchyTerms, Fit};

use crate::observer::VISIBLE_NM;

/// n(lambda) of a medium. Every value made by the constructors or by deserialising has 1 <= n < infinity from 380 to
/// 780 nm; check one that was put together by hand with [`Dispersion::validate`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", try_from = "Unchecked")]
pub enum Dispersion {
    /// The same index at every wavelength.
    Constant {
        /// Refractive index.
        n: f64,
    },
    /// n = a + b / lambda^2 + c / lambda^4, lambda in um.
    Cauchy {
        /// Index at infinite wavelength.
        a: f64,
        /// Second coefficient, um^2.
        b_um2: f64,
        /// Third coefficient, um^4; 0 for the two-term form.
        c_um4: f64,
    },
    /// n^2 = 1 + sum of B lambda^2 / (lambda^2 - C), lambda in um (Sellmeier 1871).
    Sellmeier {
        /// Pairs of B and C in um^2.
        terms: Vec<[f64; 2]>,
    },
}

/// What a file may hold before [`Dispersion::validate`] has seen it.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Unchecked {
    Constant { n: f64 },
    Cauchy { a: f64, b_um2: f64, c_um4: f64 },
    Sellmeier { terms: Vec<[f64; 2]> },
}

impl TryFrom<Unchecked> for Dispersion {
    type Error = DispersionError;

    fn try_from(unchecked: Unchecked) -> Result<Self, DispersionError> {
        match unchecked {
            Unchecked::Constant { n } => Self::Constant { n },
            Unchecked::Cauchy { a, b_um2, c_um4 } => Self::Cauchy { a, b_um2, c_um4 },
            Unchecked::Sellmeier { terms } => Self::Sellmeier { terms },
        }
        .validated()
    }
}

/// Why numbers are not a refractive index.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DispersionError {
    /// A coefficient is NaN or infinite.
    #[error("{coefficient} is {got}: it must be finite")]
    NotFinite {
        /// Which one, such as `Cauchy A`.
        coefficient: &'static str,
        /// Its value.
        got: f64,
    },
    /// The index falls below that of vacuum.
    #[error("the refractive index is {n} at {lambda_nm} nm: it must be at least 1 from 380 to 780 nm")]
    BelowOne {
        /// The index found.
        n: f64,
        /// Where, nm.
        lambda_nm: f64,
    },
    /// The index is too large for f64.
    #[error("the refractive index overflows at {lambda_nm} nm")]
    Overflow {
        /// Where, nm.
        lambda_nm: f64,
    },
    /// An absorption line of a Sellmeier term lies among the visible wavelengths.
    #[error(
        "Sellmeier term {term} (from 0) has its pole at {lambda_nm} nm: it must lie outside 380 to 780 nm"
    )]
    PoleInRange {
        /// Index of the term.
        term: usize,
        /// Where, nm.
        lambda_nm: f64,
    },
    /// Not 2 or 3 Cauchy coefficients.
    #[error("got {got} Cauchy coefficients: expected 2 or 3, [A, B_um2] or [A, B_um2, C_um4]")]
    CauchyCount {
        /// How many there were.
        got: usize,
    },
    /// A Sellmeier formula without terms.
    #[error("a Sellmeier formula needs at least one pair [B, C_um2]")]
    NoSellmeierTerms,
    /// KHR_materials_dispersion takes no such value.
    #[error("dispersion (20 / V_d) is {got}: it must be finite and at least 0")]
    KhrDispersion {
        /// The value.
        got: f64,
    },
    /// No medium has such an Abbe number.
    #[error("the Abbe number is {got}: it must be above 0, infinity for a medium without dispersion")]
    AbbeNumber {
        /// The value.
        got: f64,
    },
}

impl Dispersion {
    /// The same index at every wavelength.
    ///
    /// # Errors
    /// If `n` is not finite or below 1.
    pub fn constant(n: f64) -> Result<Self, DispersionError> {
        Self::Constant { n }.validated()
    }

    /// Cauchy's formula from `[A, B_um2]` or `[A, B_um2, C_um4]`.
    ///
    /// # Errors
    /// For another number of coefficients, and as [`Dispersion::validate`].
    pub fn cauchy(coefficients: &[f64]) -> Result<Self, DispersionError> {
        let (a, b_um2, c_um4) = match *coefficients {
            [a, b_um2] => (a, b_um2, 0.0),
            [a, b_um2, c_um4] => (a, b_um2, c_um4),
            _ => return Err(DispersionError::CauchyCount { got: coefficients.len() }),
        };
        Self::Cauchy { a, b_um2, c_um4 }.validated()
    }

    /// Sellmeier's formula from pairs of B and C in um^2.
    ///
    /// # Errors
    /// If there is no pair, and as [`Dispersion::validate`].
    pub fn sellmeier(terms: impl Into<Vec<[f64; 2]>>) -> Result<Self, DispersionError> {
        Self::Sellmeier { terms: terms.into() }.validated()
    }

    /// The two-term Cauchy medium with index `n` at the convention's reference line and this Abbe number there;
    /// an infinite one gives a [`Dispersion::Constant`].
    ///
    /// # Errors
    /// If the Abbe number is not above 0, and as [`Dispersion::validate`]: an Abbe number below about 0.66 takes n
    /// below 1 at the red end.
    pub fn from_abbe(convention: OffsetConvention, n: f64, abbe: f64) -> Result<Self, DispersionError> {
        if abbe.is_nan() || abbe <= 0.0 {
            return Err(DispersionError::AbbeNumber { got: abbe });
        }
        Self::from_reciprocal_abbe(convention, n, 1.0 / abbe)
    }

    /// The medium of KHR_materials_ior's `ior` (n_d) and KHR_materials_dispersion's `dispersion` (20 / V_d), which
    /// states the Cauchy form; dispersion 0 gives a [`Dispersion::Constant`].
    ///
    /// # Errors
    /// If `dispersion` is negative or not finite, and as [`Dispersion::validate`]. KHR_materials_ior's special value
    /// 0 is not an index and is refused here too.
    pub fn from_khr(ior: f64, dispersion: f64) -> Result<Self, DispersionError> {
        if !(dispersion >= 0.0 && dispersion.is_finite()) {
            return Err(DispersionError::KhrDispersion { got: dispersion });
        }
        Self::from_reciprocal_abbe(OffsetConvention::Gltf, ior, dispersion / 20.0)
    }

    fn from_reciprocal_abbe(
        convention: OffsetConvention,
        n: f64,
        reciprocal: f64,
    ) -> Result<Self, DispersionError> {
        if reciprocal == 0.0 {
            return Self::constant(n);
        }
        let (f, reference, c) = convention.wavenumbers_squared_um2();
        let b_um2 = (n - 1.0) * reciprocal / (f - c);
        Self::Cauchy { a: n - b_um2 * reference, b_um2, c_um4: 0.0 }.validated()
    }

    /// Refractive index at a vacuum wavelength in nm. Meant for 380 to 780 nm; outside, the formula is evaluated as
    /// it stands, which may be meaningless.
    pub fn ior(&self, lambda_nm: f64) -> f64 {
        let lambda_um2 = (lambda_nm * 1e-3) * (lambda_nm * 1e-3);
        match self {
            Self::Constant { n } => *n,
            Self::Cauchy { a, b_um2, c_um4 } => a + (b_um2 + c_um4 / lambda_um2) / lambda_um2,
            Self::Sellmeier { terms } => {
                let n_squared_minus_1: f64 =
                    terms.iter().map(|[b, c_um2]| b * lambda_um2 / (lambda_um2 - c_um2)).sum();
                Float::sqrt(1.0 + n_squared_minus_1)
            }
        }
    }

    /// Whether the index depends on the wavelength at all.
    pub fn is_dispersive(&self) -> bool {
        match self {
            Self::Constant { .. } => false,
            Self::Cauchy { b_um2, c_um4, .. } => *b_um2 != 0.0 || *c_um4 != 0.0,
            Self::Sellmeier { terms } => terms.iter().any(|[b, c_um2]| *b != 0.0 && *c_um2 != 0.0),
        }
    }

    /// Index at glTF's d line, 587.56 nm.
    pub fn n_d(&self) -> f64 {
        self.ior(OffsetConvention::Gltf.lines_nm().1)
    }

    /// Abbe number V_d = (n_d - 1) / (n_F - n_C) at glTF's d, F and C; infinite without dispersion.
    pub fn abbe_v_d(&self) -> f64 {
        self.abbe(OffsetConvention::Gltf)
    }

    /// Abbe number at the lines of `convention`; infinite where n_F = n_C.
    pub fn abbe(&self, convention: OffsetConvention) -> f64 {
        let (f_nm, reference_nm, c_nm) = convention.lines_nm();
        let spread = if self.is_dispersive() { self.ior(f_nm) - self.ior(c_nm) } else { 0.0 };
        if spread == 0.0 { f64::INFINITY } else { (self.ior(reference_nm) - 1.0) / spread }
    }

    /// KHR_materials_dispersion's value, 20 / V_d: 0 without dispersion, and where n_d is 1 or the dispersion
    /// anomalous (n_F < n_C), which the extension cannot say.
    pub fn khr_dispersion(&self) -> f64 {
        let v_d = self.abbe_v_d();
        if v_d > 0.0 { 20.0 / v_d } else { 0.0 }
    }

    /// Checks what the rest of the project relies on: coefficients finite, no Sellmeier pole from 380 to 780 nm, and
    /// 1 <= n < infinity there (at every nm and, for Cauchy, where n is extreme).
    ///
    /// # Errors
    /// The first violation, with the wavelength.
    pub fn validate(&self) -> Result<(), DispersionError> {
        let finite = |coefficient, got: f64| {
            if got.is_finite() { Ok(()) } else { Err(DispersionError::NotFinite { coefficient, got }) }
        };
        let mut extremum_nm = None;
        match self {
            Self::Constant { n } => finite("the refractive index", *n)?,
            Self::Cauchy { a, b_um2, c_um4 } => {
                finite("Cauchy A", *a)?;
                finite("Cauchy B", *b_um2)?;
                finite("Cauchy C", *c_um4)?;
                // dn / d(1 / lambda^2) = 0
                extremum_nm = Some(1e3 * Float::sqrt(-2.0 * c_um4 / b_um2));
            }
            Self::Sellmeier { terms } => {
                if terms.is_empty() {
                    return Err(DispersionError::NoSellmeierTerms);
                }
                for (term, [b, c_um2]) in terms.iter().enumerate() {
                    finite("Sellmeier B", *b)?;
                    finite("Sellmeier C", *c_um2)?;
                    let lambda_nm = 1e3 * Float::sqrt(*c_um2);
                    if *b != 0.0 && in_range(lambda_nm) {
                        return Err(DispersionError::PoleInRange { term, lambda_nm });
                    }
                }
            }
        }
        for lambda_nm in visible_nm().chain(extremum_nm.filter(|nm| in_range(*nm))) {
            let n = self.ior(lambda_nm);
            // NaN is the root of a negative number.
            if n.is_nan() || n < 1.0 {
                return Err(DispersionError::BelowOne { n, lambda_nm });
            }
            if n.is_infinite() {
                return Err(DispersionError::Overflow { lambda_nm });
            }
        }
        Ok(())
    }

    fn validated(self) -> Result<Self, DispersionError> {
        self.validate().map(|()| self)
    }
}

/// False for NaN.
fn in_range(lambda_nm: f64) -> bool {
    (VISIBLE_NM.0..=VISIBLE_NM.1).contains(&lambda_nm)
}

/// 380 to 780 nm by 1.
fn visible_nm() -> impl Iterator<Item = f64> {
    (0..=400).map(|i| VISIBLE_NM.0 + f64::from(i))
}

/// The three lines that an Abbe number and IOR offsets refer to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OffsetConvention {
    /// SPECGEN's: sodium D = 589.3 nm with F = 486.1 and C = 656.3 nm.
    Specgen,
    /// KHR_materials_dispersion's: helium d = 587.56 nm with F = 486.13 and C = 656.27 nm.
    #[default]
    Gltf,
}

impl OffsetConvention {
    /// Both conventions.
    pub const ALL: [Self; 2] = [Self::Specgen, Self::Gltf];

    /// Its name on the command line and in JSON: `specgen`, `gltf`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Specgen => "specgen",
            Self::Gltf => "gltf",
        }
    }

    /// F, the reference line and C, nm.
    pub fn lines_nm(self) -> (f64, f64, f64) {
        match self {
            Self::Specgen => (486.1, 589.3, 656.3),
            Self::Gltf => (486.13, 587.56, 656.27),
        }
    }

    /// IOR offset of SPECGEN section 4: n(lambda) = n_ref + (n_ref - 1) / V * offset(lambda) with
    /// offset = (1/lambda^2 - 1/lambda_ref^2) / (1/lambda_F^2 - 1/lambda_C^2). Zero at the reference line; one more
    /// at F than at C.
    pub fn ior_offset(self, lambda_nm: f64) -> f64 {
        let (f, reference, c) = self.wavenumbers_squared_um2();
        (inverse_square_um2(lambda_nm) - reference) / (f - c)
    }

    /// 1 / lambda^2 of F, the reference and C, um^-2.
    fn wavenumbers_squared_um2(self) -> (f64, f64, f64) {
        let (f_nm, reference_nm, c_nm) = self.lines_nm();
        (inverse_square_um2(f_nm), inverse_square_um2(reference_nm), inverse_square_um2(c_nm))
    }
}

impl fmt::Display for OffsetConvention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no offset convention's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown IOR offsets: expected specgen or gltf")]
pub struct UnknownOffsetConvention;

impl FromStr for OffsetConvention {
    type Err = UnknownOffsetConvention;

    fn from_str(name: &str) -> Result<Self, UnknownOffsetConvention> {
        Self::ALL.into_iter().find(|c| c.name() == name).ok_or(UnknownOffsetConvention)
    }
}

/// [`OffsetConvention::Specgen`]'s IOR offset.
pub fn ior_offset_specgen(lambda_nm: f64) -> f64 {
    OffsetConvention::Specgen.ior_offset(lambda_nm)
}

/// [`OffsetConvention::Gltf`]'s IOR offset.
pub fn ior_offset_gltf(lambda_nm: f64) -> f64 {
    OffsetConvention::Gltf.ior_offset(lambda_nm)
}

fn inverse_square_um2(lambda_nm: f64) -> f64 {
    1e6 / (lambda_nm * lambda_nm)
}

#[cfg(test)]
mod tests;
