//! Colour-matching functions: how a wavelength becomes XYZ.

use core::f64::consts::{FRAC_PI_2, SQRT_2};
use core::fmt;
use core::str::FromStr;

use num_traits::Float;
use serde::{Deserialize, Serialize};

use crate::csv_table::{interpolate, parse_csv};

/// The range that references integrate over, nm.
pub const VISIBLE_NM: (f64, f64) = (380.0, 780.0);

/// The range of the colour-matching tables, nm. Everything is zero outside it.
pub const TABLE_NM: (f64, f64) = (360.0, 830.0);

/// A set of colour-matching functions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observer {
    /// CIE 1931, 2 degrees, tabulated every 1 nm.
    #[default]
    Cie1931,
    /// CIE 1964, 10 degrees, tabulated every 1 nm.
    Cie1964,
    /// The multi-lobe fit of CIE 1931 by Wyman, Sloan & Shirley 2013 ("Simple Analytic Approximations to the CIE
    /// XYZ Color Matching Functions", JCGT 2(2), listing 1).
    Wyman2013,
}

static CIE_1931: [[f64; 4]; 471] = parse_csv(include_str!("../data/cie_1931_2deg_1nm.csv"));
static CIE_1964: [[f64; 4]; 471] = parse_csv(include_str!("../data/cie_1964_10deg_1nm.csv"));

/// One lobe of the fit: a Gaussian with its own width on each side of its peak.
struct Lobe {
    height: f64,
    peak_nm: f64,
    /// Reciprocal standard deviations below and above the peak, 1/nm.
    inverse_sigma: (f64, f64),
}

const fn lobe(height: f64, peak_nm: f64, below: f64, above: f64) -> Lobe {
    Lobe { height, peak_nm, inverse_sigma: (below, above) }
}

/// Listing 1 of Wyman et al. 2013; the lobes of x, y and z.
static WYMAN_2013: [&[Lobe]; 3] = [
    &[
        lobe(0.362, 442.0, 0.0624, 0.0374),
        lobe(1.056, 599.8, 0.0264, 0.0323),
        lobe(-0.065, 501.1, 0.0490, 0.0382),
    ],
    &[lobe(0.821, 568.8, 0.0213, 0.0247), lobe(0.286, 530.9, 0.0613, 0.0322)],
    &[lobe(1.217, 437.0, 0.0845, 0.0278), lobe(0.681, 459.0, 0.0385, 0.0725)],
];

impl Lobe {
    fn at(&self, lambda_nm: f64) -> f64 {
        let d = lambda_nm - self.peak_nm;
        let t = d * if d < 0.0 { self.inverse_sigma.0 } else { self.inverse_sigma.1 };
        self.height * Float::exp(-0.5 * t * t)
    }

    /// Integral from the peak to `lambda_nm`, nm.
    fn integral_from_peak(&self, lambda_nm: f64) -> f64 {
        let d = lambda_nm - self.peak_nm;
        let inverse_sigma = if d < 0.0 { self.inverse_sigma.0 } else { self.inverse_sigma.1 };
        self.height / inverse_sigma * Float::sqrt(FRAC_PI_2) * libm::erf(d * inverse_sigma / SQRT_2)
    }
}

impl Observer {
    /// Every observer.
    pub const ALL: [Self; 3] = [Self::Cie1931, Self::Cie1964, Self::Wyman2013];

    /// Its name on the command line and in JSON: `cie1931`, `cie1964`, `wyman2013`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cie1931 => "cie1931",
            Self::Cie1964 => "cie1964",
            Self::Wyman2013 => "wyman2013",
        }
    }

    /// The three colour-matching functions at a wavelength in nm: linear in the 1 nm tables, the formula for the
    /// fit; zero outside 360 to 830 nm and for NaN. Never negative.
    pub fn xyz_bar(self, lambda_nm: f64) -> [f64; 3] {
        let table = match self {
            Self::Cie1931 => &CIE_1931,
            Self::Cie1964 => &CIE_1964,
            Self::Wyman2013 => {
                if !(TABLE_NM.0..=TABLE_NM.1).contains(&lambda_nm) {
                    return [0.0; 3];
                }
                return WYMAN_2013.map(|lobes| lobes.iter().map(|l| l.at(lambda_nm)).sum());
            }
        };
        [1, 2, 3].map(|channel| interpolate(table, channel, lambda_nm))
    }

    /// Integrals of the three functions over `lo_nm..hi_nm`, nm: exact for [`Observer::xyz_bar`] as defined above,
    /// so pieces add up to the whole. Swapped limits give the negative, NaN gives zero.
    pub fn xyz_bar_integral(self, lo_nm: f64, hi_nm: f64) -> [f64; 3] {
        if lo_nm.is_nan() || hi_nm.is_nan() {
            return [0.0; 3];
        }
        if hi_nm < lo_nm {
            return self.xyz_bar_integral(hi_nm, lo_nm).map(|v| -v);
        }
        let lo_nm = lo_nm.clamp(TABLE_NM.0, TABLE_NM.1);
        let hi_nm = hi_nm.clamp(TABLE_NM.0, TABLE_NM.1);
        if self == Self::Wyman2013 {
            return WYMAN_2013.map(|lobes| {
                lobes.iter().map(|l| l.integral_from_peak(hi_nm) - l.integral_from_peak(lo_nm)).sum()
            });
        }
        // Trapezia between the entries are exact for a function that is linear between them.
        let mut integral = [0.0; 3];
        let (mut a_nm, mut a) = (lo_nm, self.xyz_bar(lo_nm));
        while a_nm < hi_nm {
            let b_nm = Float::min(Float::floor(a_nm) + 1.0, hi_nm);
            let b = self.xyz_bar(b_nm);
            for c in 0..3 {
                integral[c] += 0.5 * (a[c] + b[c]) * (b_nm - a_nm);
            }
            (a_nm, a) = (b_nm, b);
        }
        integral
    }

    /// Integral of y over `lo_nm..hi_nm`, nm; see [`Observer::xyz_bar_integral`].
    pub fn y_bar_integral(self, lo_nm: f64, hi_nm: f64) -> f64 {
        self.xyz_bar_integral(lo_nm, hi_nm)[1]
    }
}

impl fmt::Display for Observer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is no observer's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown colour-matching functions: expected cie1931, cie1964 or wyman2013")]
pub struct UnknownObserver;

impl FromStr for Observer {
    type Err = UnknownObserver;

    fn from_str(name: &str) -> Result<Self, UnknownObserver> {
        Self::ALL.into_iter().find(|o| o.name() == name).ok_or(UnknownObserver)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::illuminant::Illuminant;
    use proptest::prelude::*;
    use std::string::ToString;

    #[test]
    fn equal_energy_white_is_achromatic() {
        // The CIE scaled x, y and z to equal integrals; 106.857 nm is that integral for 1931.
        for observer in Observer::ALL {
            let [x, y, z] = observer.xyz_bar_integral(360.0, 830.0);
            let bound = if observer == Observer::Wyman2013 { 0.01 } else { 5e-4 };
            assert!((x / y - 1.0).abs() < bound && (z / y - 1.0).abs() < bound, "{observer} {x} {y} {z}");
        }
        let y = Observer::Cie1931.y_bar_integral(360.0, 830.0);
        assert!((y - 106.857).abs() < 1e-3, "{y}");
    }

    #[test]
    fn luminosity_peaks_at_555_nm() {
        let y = |lambda_nm| Observer::Cie1931.xyz_bar(lambda_nm)[1];
        assert_eq!(y(555.0), 1.0);
        assert!((360..=830).all(|l| y(f64::from(l)) <= 1.0));
    }

    #[test]
    fn spectral_chromaticities_match_the_published_locus() {
        // CIE 15, chromaticity coordinates of the 2 degree observer.
        for (lambda_nm, x, y) in
            [(450.0, 0.15664, 0.01771), (520.0, 0.07430, 0.83380), (600.0, 0.62704, 0.37249)]
        {
            let bar = Observer::Cie1931.xyz_bar(lambda_nm);
            let sum: f64 = bar.iter().sum();
            assert!((bar[0] / sum - x).abs() < 5e-5, "{lambda_nm} {}", bar[0] / sum);
            assert!((bar[1] / sum - y).abs() < 5e-5, "{lambda_nm} {}", bar[1] / sum);
        }
    }

    #[test]
    fn illuminants_have_their_published_chromaticities() {
        // CIE 15, tables T.3 and T.8 (FL series: 2 degrees).
        for (observer, illuminant, x, y) in [
            (Observer::Cie1931, Illuminant::A, 0.44758, 0.40745),
            (Observer::Cie1931, Illuminant::D65, 0.31272, 0.32903),
            (Observer::Cie1931, Illuminant::D50, 0.34567, 0.35851),
            (Observer::Cie1964, Illuminant::A, 0.45117, 0.40594),
            (Observer::Cie1964, Illuminant::D65, 0.31381, 0.33098),
            (Observer::Cie1931, Illuminant::Fl2, 0.3721, 0.3751),
            (Observer::Cie1931, Illuminant::Fl4, 0.4402, 0.4031),
            (Observer::Cie1931, Illuminant::Fl11, 0.3805, 0.3769),
        ] {
            let mut xyz = [0.0; 3];
            for i in 0..=80 {
                let lambda_nm = 380.0 + 5.0 * f64::from(i);
                let bar = observer.xyz_bar(lambda_nm);
                for c in 0..3 {
                    xyz[c] += bar[c] * illuminant.relative_power(lambda_nm);
                }
            }
            let sum: f64 = xyz.iter().sum();
            let off = Float::max((xyz[0] / sum - x).abs(), (xyz[1] / sum - y).abs());
            assert!(off < 1e-4, "{observer} {illuminant}: {} {}", xyz[0] / sum, xyz[1] / sum);
        }
    }

    #[test]
    fn fit_follows_the_table_as_its_paper_says() {
        // Wyman et al., table 1: the largest errors are a few percent of the peak (1.78 in z).
        for l in 360..=830 {
            let lambda_nm = f64::from(l);
            let (fit, table) = (Observer::Wyman2013.xyz_bar(lambda_nm), Observer::Cie1931.xyz_bar(lambda_nm));
            for c in 0..3 {
                assert!((fit[c] - table[c]).abs() < 0.07, "{lambda_nm} nm {c}: {} {}", fit[c], table[c]);
                assert!(fit[c] >= 0.0, "{lambda_nm} nm {c}: {}", fit[c]);
            }
        }
    }

    #[test]
    fn nothing_outside_the_table() {
        for observer in Observer::ALL {
            for bad in [359.999, 830.001, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert_eq!(observer.xyz_bar(bad), [0.0; 3]);
            }
            assert_eq!(observer.xyz_bar_integral(f64::NAN, 500.0), [0.0; 3]);
            assert_eq!(observer.y_bar_integral(0.0, 1e4), observer.y_bar_integral(360.0, 830.0));
        }
    }

    #[test]
    fn names_round_trip() {
        for observer in Observer::ALL {
            assert_eq!(observer.to_string().parse(), Ok(observer));
        }
        assert_eq!("cie1932".parse::<Observer>(), Err(UnknownObserver));
    }

    proptest! {
        #[test]
        fn integrals_of_pieces_add_up(a in 350.0..840.0, b in 350.0..840.0, c in 350.0..840.0) {
            for observer in Observer::ALL {
                let whole = observer.xyz_bar_integral(a, c);
                let (first, second) = (observer.xyz_bar_integral(a, b), observer.xyz_bar_integral(b, c));
                for i in 0..3 {
                    prop_assert!((first[i] + second[i] - whole[i]).abs() < 1e-10);
                }
            }
        }

        #[test]
        fn integral_agrees_with_fine_midpoints(lo in 360.0..820.0, width in 0.1..10.0) {
            for observer in Observer::ALL {
                let exact = observer.xyz_bar_integral(lo, lo + width);
                let n = 2000;
                let step = width / f64::from(n);
                let mut sum = [0.0; 3];
                for i in 0..n {
                    let bar = observer.xyz_bar(lo + (f64::from(i) + 0.5) * step);
                    for c in 0..3 {
                        sum[c] += bar[c] * step;
                    }
                }
                for c in 0..3 {
                    prop_assert!((exact[c] - sum[c]).abs() < 1e-5 * width, "{} {} {}", observer, exact[c], sum[c]);
                }
            }
        }
    }
}
