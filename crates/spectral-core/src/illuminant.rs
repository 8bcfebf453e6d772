//! Relative spectral power of CIE illuminants, daylight and black bodies.
//!
//! Everything here is 100 at 560 nm except the FL series, whose published tables are on their own scale; only the
//! shape matters, since light is scaled to a stated luminance where it is used.

use core::fmt;
use core::str::FromStr;

use num_traits::Float;
use serde::{Deserialize, Serialize};

use crate::csv_table::{interpolate, parse_csv};

/// A CIE standard illuminant, tabulated every 5 nm from 380 to 780 nm (CIE 15).
///
/// Its name, in [`fmt::Display`], [`FromStr`] and serde alike, is the CIE's: `A`, `D50`, `D65`, `E`, `FL1` to `FL12`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
#[expect(missing_docs, reason = "the variants are the CIE's names")]
pub enum Illuminant {
    A,
    D50,
    D65,
    E,
    Fl1,
    Fl2,
    Fl3,
    Fl4,
    Fl5,
    Fl6,
    Fl7,
    Fl8,
    Fl9,
    Fl10,
    Fl11,
    Fl12,
}

/// 380 to 780 nm by 5; columns as in [`Illuminant::ALL`].
static TABLE: [[f64; 17]; 81] = parse_csv(include_str!("../data/cie_illuminants_5nm.csv"));

/// 300 to 830 nm by 10; columns S0, S1, S2 (CIE 15, table T.2).
static DAYLIGHT_BASIS: [[f64; 4]; 54] = parse_csv(include_str!("../data/cie_daylight_basis_10nm.csv"));

impl Illuminant {
    /// Every illuminant, in the order of the table's columns.
    pub const ALL: [Self; 16] = [
        Self::A,
        Self::D50,
        Self::D65,
        Self::E,
        Self::Fl1,
        Self::Fl2,
        Self::Fl3,
        Self::Fl4,
        Self::Fl5,
        Self::Fl6,
        Self::Fl7,
        Self::Fl8,
        Self::Fl9,
        Self::Fl10,
        Self::Fl11,
        Self::Fl12,
    ];

    /// The CIE's name of it.
    pub fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::D50 => "D50",
            Self::D65 => "D65",
            Self::E => "E",
            Self::Fl1 => "FL1",
            Self::Fl2 => "FL2",
            Self::Fl3 => "FL3",
            Self::Fl4 => "FL4",
            Self::Fl5 => "FL5",
            Self::Fl6 => "FL6",
            Self::Fl7 => "FL7",
            Self::Fl8 => "FL8",
            Self::Fl9 => "FL9",
            Self::Fl10 => "FL10",
            Self::Fl11 => "FL11",
            Self::Fl12 => "FL12",
        }
    }

    /// Relative spectral power at `lambda_nm`, linear between the 5 nm entries; zero outside 380 to 780 nm.
    ///
    /// Between two entries the sharp lines of the FL series are as wide as the table's step.
    pub fn relative_power(self, lambda_nm: f64) -> f64 {
        interpolate(&TABLE, 1 + self as usize, lambda_nm)
    }
}

impl fmt::Display for Illuminant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Illuminant {
    type Err = UnknownIlluminant;

    /// The CIE's name in any case.
    fn from_str(name: &str) -> Result<Self, UnknownIlluminant> {
        Self::ALL.into_iter().find(|i| i.name().eq_ignore_ascii_case(name)).ok_or(UnknownIlluminant)
    }
}

/// The correlated colour temperature of CIE daylight by its name, kelvin: `D55`, `D75` or `D100` in hundreds of
/// kelvin, `D5500` or `D10000` in kelvin; `None` for other names.
///
/// The nominal temperature times 1.4388 / 1.4380, see [`daylight`], which says what temperatures there are.
pub fn daylight_cct_k(name: &str) -> Option<f64> {
    let digits = name.strip_prefix(['D', 'd']).filter(|d| d.bytes().all(|b| b.is_ascii_digit()))?;
    let number: f64 = digits.parse().ok()?;
    let nominal_k = match digits.len() {
        2 | 3 => 100.0 * number,
        4 | 5 => number,
        _ => return None,
    };
    Some(nominal_k * 1.4388 / 1.4380)
}

/// A name that is no illuminant's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown illuminant: expected A, E, FL1 to FL12, D50, D65 or another Dxx, daylight of xx hundred kelvin, such as D55"
)]
pub struct UnknownIlluminant;

/// A colour temperature out of the range where the formula holds.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{what} is defined from {min_k} to {max_k} K, got {got_k} K")]
pub struct TemperatureError {
    /// Which spectrum was asked for.
    pub what: &'static str,
    /// The temperature asked for, kelvin.
    pub got_k: f64,
    /// Lowest valid temperature, kelvin.
    pub min_k: f64,
    /// Highest valid temperature, kelvin.
    pub max_k: f64,
}

impl TemperatureError {
    fn check(what: &'static str, got_k: f64, (min_k, max_k): (f64, f64)) -> Result<(), Self> {
        if (min_k..=max_k).contains(&got_k) { Ok(()) } else { Err(Self { what, got_k, min_k, max_k }) }
    }
}

/// A phase of daylight, from [`daylight`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Daylight {
    m1: f64,
    m2: f64,
}

/// Correlated colour temperatures for which CIE daylight is defined, kelvin.
pub const DAYLIGHT_RANGE_K: (f64, f64) = (4000.0, 25000.0);

/// CIE daylight of correlated colour temperature `cct_k` (CIE 15:2004, section 3.1).
///
/// The nominal temperatures of D50, D65 predate today's second radiation constant: D65 is at
/// 6500 x 1.4388 / 1.4380 = 6503.6 K. M1 and M2 are rounded to three decimals, as the CIE prescribes.
///
/// # Errors
/// Outside 4000 to 25000 K, and for NaN.
pub fn daylight(cct_k: f64) -> Result<Daylight, TemperatureError> {
    TemperatureError::check("daylight", cct_k, DAYLIGHT_RANGE_K)?;
    let t = 1000.0 / cct_k;
    let x = if cct_k <= 7000.0 {
        ((-4.6070 * t + 2.9678) * t + 0.09911) * t + 0.244063
    } else {
        ((-2.0064 * t + 1.9018) * t + 0.24748) * t + 0.237040
    };
    let y = (-3.0 * x + 2.870) * x - 0.275;
    let m = 0.0241 + 0.2562 * x - 0.7341 * y;
    let three_decimals = |v: f64| Float::round(v * 1000.0) / 1000.0;
    Ok(Daylight {
        m1: three_decimals((-1.3515 - 1.7703 * x + 5.9114 * y) / m),
        m2: three_decimals((0.0300 - 31.4424 * x + 30.0717 * y) / m),
    })
}

impl Daylight {
    /// Relative spectral power, linear between the 10 nm entries of the basis; zero outside 300 to 830 nm.
    pub fn relative_power(&self, lambda_nm: f64) -> f64 {
        let s = |column| interpolate(&DAYLIGHT_BASIS, column, lambda_nm);
        // Rounding leaves a few -1e-15 where the spectrum is zero.
        Float::max(s(1) + self.m1 * s(2) + self.m2 * s(3), 0.0)
    }
}

/// A Planckian radiator, from [`black_body`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlackBody {
    temperature_k: f64,
}

/// Temperatures that [`black_body`] takes, kelvin. Colder ones radiate nothing to speak of between 360 and 830 nm.
pub const BLACK_BODY_RANGE_K: (f64, f64) = (100.0, 1e9);

/// The second radiation constant h c / k, nm K (SI of 2019).
const C2_NM_K: f64 = 1.438_776_877e7;

/// A black body at `temperature_k` (Planck's law).
///
/// # Errors
/// Outside 100 to 1e9 K, and for NaN.
pub fn black_body(temperature_k: f64) -> Result<BlackBody, TemperatureError> {
    TemperatureError::check("a black body", temperature_k, BLACK_BODY_RANGE_K)?;
    Ok(BlackBody { temperature_k })
}

impl BlackBody {
    /// Spectral radiance relative to the one at 560 nm, times 100; zero for wavelengths that are not positive.
    pub fn relative_power(&self, lambda_nm: f64) -> f64 {
        if lambda_nm.is_nan() || lambda_nm <= 0.0 {
            return 0.0;
        }
        let ln_occupancy = |lambda: f64| {
            let x = C2_NM_K / (lambda * self.temperature_k);
            // ln(e^x - 1), without overflow for cold bodies or cancellation for hot ones.
            x + Float::ln(-Float::exp_m1(-x))
        };
        100.0 * Float::exp(5.0 * Float::ln(560.0 / lambda_nm) + ln_occupancy(560.0) - ln_occupancy(lambda_nm))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn names_round_trip() {
        for illuminant in Illuminant::ALL {
            assert_eq!(illuminant.to_string().parse(), Ok(illuminant));
            assert_eq!(illuminant.to_string().to_lowercase().parse(), Ok(illuminant));
        }
        assert_eq!("FL13".parse::<Illuminant>(), Err(UnknownIlluminant));
    }

    #[test]
    fn columns_belong_to_their_names() {
        // From CIE 15: A and the D series are 100 at 560 nm, FL1's mercury line at 435 nm is 43.67.
        for i in [Illuminant::A, Illuminant::D50, Illuminant::D65, Illuminant::E] {
            assert_eq!(i.relative_power(560.0), 100.0);
        }
        assert_eq!(Illuminant::D65.relative_power(380.0), 49.9755);
        assert_eq!(Illuminant::Fl1.relative_power(435.0), 43.67);
        assert_eq!(Illuminant::Fl12.relative_power(780.0), 0.05);
        assert_eq!(Illuminant::D65.relative_power(379.9), 0.0);
    }

    #[test]
    fn daylight_formula_gives_the_published_d65_and_d50() {
        for (illuminant, nominal_k) in [(Illuminant::D65, 6500.0), (Illuminant::D50, 5000.0)] {
            let d = daylight(nominal_k * 1.4388 / 1.4380).unwrap();
            for i in 0..=80 {
                let lambda_nm = 380.0 + 5.0 * f64::from(i);
                let (formula, table) = (d.relative_power(lambda_nm), illuminant.relative_power(lambda_nm));
                // Both tables are rounded to the third or fourth decimal.
                assert!((formula - table).abs() < 2e-3, "{illuminant} {lambda_nm} nm: {formula} {table}");
            }
        }
    }

    #[test]
    fn daylight_is_never_negative_in_its_range() {
        for cct_k in [4000.0, 7000.0, 25000.0] {
            let d = daylight(cct_k).unwrap();
            assert!((300..=830).all(|l| d.relative_power(f64::from(l)) >= 0.0), "{cct_k}");
        }
    }

    #[test]
    fn temperatures_out_of_range_are_refused_with_the_numbers() {
        for bad in [3999.0, 25001.0, f64::NAN, -1.0] {
            assert!(daylight(bad).is_err());
        }
        assert_eq!(
            daylight(3000.0).unwrap_err().to_string(),
            "daylight is defined from 4000 to 25000 K, got 3000 K"
        );
        for bad in [0.0, 99.0, f64::NAN, f64::INFINITY] {
            assert!(black_body(bad).is_err());
        }
    }

    #[test]
    fn illuminant_a_is_the_black_body_of_its_definition() {
        // ISO 11664-2: 2848 K with c2 = 1.435e7 nm K, so the temperature scales with today's c2.
        let body = black_body(2848.0 * C2_NM_K / 1.435e7).unwrap();
        for i in 0..=80 {
            let lambda_nm = 380.0 + 5.0 * f64::from(i);
            let (planck, table) = (body.relative_power(lambda_nm), Illuminant::A.relative_power(lambda_nm));
            // Six digits are tabulated.
            assert!((planck / table - 1.0).abs() < 6e-6, "{lambda_nm} nm: {planck} {table}");
        }
    }

    #[test]
    fn black_body_peaks_where_wien_says() {
        for temperature_k in [4000.0, 5000.0, 7000.0] {
            let body = black_body(temperature_k).unwrap();
            let peak_nm = 2.897_771_955e6 / temperature_k;
            let at = |offset_nm: f64| body.relative_power(peak_nm + offset_nm);
            assert!(at(0.0) > at(1.0) && at(0.0) > at(-1.0), "{temperature_k}");
        }
    }

    #[test]
    fn black_body_is_finite_from_coldest_to_hottest() {
        for temperature_k in [100.0, 1e9] {
            let body = black_body(temperature_k).unwrap();
            for lambda_nm in [360.0, 560.0, 830.0] {
                let power = body.relative_power(lambda_nm);
                assert!(power.is_finite() && power > 0.0, "{temperature_k} {lambda_nm}");
            }
        }
        // Rayleigh-Jeans: lambda^-4.
        let ratio = black_body(1e9).unwrap().relative_power(280.0) / 1600.0;
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }
}
