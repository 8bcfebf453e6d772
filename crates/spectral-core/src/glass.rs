//! A catalogue of real media, as Sellmeier formulas with the n_d and V_d that their sources print.

use alloc::string::String;
use core::fmt;

use crate::dispersion::Dispersion;

/// One medium of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    /// Name as listed.
    pub name: &'static str,
    /// Other names that [`find`] takes.
    pub aliases: &'static [&'static str],
    /// Sellmeier B and C in um^2; see [`Dispersion::Sellmeier`].
    pub sellmeier: &'static [[f64; 2]],
    /// Index at the d line as the source prints it, to the digits printed.
    pub n_d: f64,
    /// Abbe number as the source prints it, to the digits printed.
    pub v_d: f64,
    /// Where the coefficients come from.
    pub source: &'static str,
}

/// Every medium known by name.
pub const CATALOGUE: [Glass; 12] = [
    Glass {
        name: "N-BK7",
        aliases: &["BK7"],
        sellmeier: &[
            [1.039_612_12, 0.006_000_698_67],
            [0.231_792_344, 0.020_017_914_4],
            [1.010_469_45, 103.560_653],
        ],
        n_d: 1.51680,
        v_d: 64.17,
        source: "SCHOTT data sheet",
    },
    Glass {
        name: "N-SF11",
        aliases: &[],
        sellmeier: &[
            [1.737_596_95, 0.013_188_707],
            [0.313_747_346, 0.062_306_814_2],
            [1.898_781_01, 155.236_29],
        ],
        n_d: 1.78472,
        v_d: 25.68,
        source: "SCHOTT data sheet",
    },
    Glass {
        name: "N-F2",
        aliases: &[],
        sellmeier: &[
            [1.397_570_37, 0.009_959_061_43],
            [0.159_201_403, 0.054_693_175_2],
            [1.268_654_3, 119.248_346],
        ],
        n_d: 1.62005,
        v_d: 36.43,
        source: "SCHOTT data sheet",
    },
    Glass {
        name: "N-SF66",
        aliases: &[],
        sellmeier: &[
            [2.024_597_6, 0.014_705_322_5],
            [0.470_187_196, 0.069_299_827_6],
            [2.599_704_33, 161.817_601],
        ],
        n_d: 1.92286,
        v_d: 20.88,
        source: "SCHOTT data sheet",
    },
    Glass {
        name: "N-LAK8",
        aliases: &[],
        sellmeier: &[
            [1.331_831_67, 0.006_200_238_71],
            [0.546_623_206, 0.021_646_543_9],
            [1.190_840_15, 82.582_773_6],
        ],
        n_d: 1.71300,
        v_d: 53.83,
        source: "SCHOTT data sheet",
    },
    Glass {
        name: "fused-silica",
        aliases: &["silica", "SiO2"],
        sellmeier: &[
            [0.696_166_3, 0.068_404_3 * 0.068_404_3],
            [0.407_942_6, 0.116_241_4 * 0.116_241_4],
            [0.897_479_4, 9.896_161 * 9.896_161],
        ],
        n_d: 1.45846,
        v_d: 67.82,
        source: "Malitson 1965, J. Opt. Soc. Am. 55, 1205",
    },
    Glass {
        name: "PMMA",
        aliases: &["acrylic", "plexiglass"],
        sellmeier: &[[1.1819, 0.011_313]],
        n_d: 1.49062,
        v_d: 53.18,
        source: "Sultanova et al. 2009, Acta Phys. Pol. A 116, 585",
    },
    Glass {
        name: "polycarbonate",
        aliases: &["PC"],
        // The formula's V_d; from the same paper's indices rounded to 0.001 it would be 29 to 30.
        sellmeier: &[[1.4182, 0.021_304]],
        n_d: 1.5848,
        v_d: 27.86,
        source: "Sultanova et al. 2009, Acta Phys. Pol. A 116, 585",
    },
    Glass {
        name: "diamond",
        aliases: &[],
        sellmeier: &[[0.3306, 0.175 * 0.175], [4.3356, 0.106 * 0.106]],
        n_d: 2.41749,
        v_d: 55.30,
        source: "Peter 1923, Z. Phys. 15, 358",
    },
    Glass {
        name: "sapphire",
        aliases: &["Al2O3"],
        sellmeier: &[
            [1.431_349_3, 0.072_663_1 * 0.072_663_1],
            [0.650_547_13, 0.119_324_2 * 0.119_324_2],
            [5.341_402_1, 18.028_251 * 18.028_251],
        ],
        n_d: 1.7682,
        v_d: 72.31,
        source: "ordinary ray, Malitson & Dodge 1972, J. Opt. Soc. Am. 62, 1405",
    },
    Glass {
        name: "water",
        aliases: &["H2O"],
        sellmeier: &[
            [0.568_402_756_5, 0.005_101_829_712],
            [0.172_617_739_1, 0.018_211_539_36],
            [0.020_861_895_78, 0.026_207_222_93],
            [0.113_074_868_8, 10.697_927_21],
        ],
        n_d: 1.33340,
        v_d: 55.76,
        source: "20 C, Daimon & Masumura 2007, Appl. Opt. 46, 3811",
    },
    Glass {
        name: "ice",
        aliases: &[],
        // Our least-squares fit to the table's n from 350 to 780 nm with the infrared C fixed at 10 um^2; within
        // 8e-5 of the table, which is rounded to 1e-4.
        sellmeier: &[[0.700_471_04, 0.009_08], [0.111_551_01, 10.0]],
        n_d: 1.3097,
        v_d: 53.3,
        source: "-7 C, fit to Warren & Brandt 2008, J. Geophys. Res. 113, D14220",
    },
];

impl Glass {
    /// Its refractive index.
    pub fn dispersion(&self) -> Dispersion {
        Dispersion::Sellmeier { terms: self.sellmeier.to_vec() }
    }
}

/// The medium of that name or alias; case, spaces, hyphens and underscores do not matter.
///
/// # Errors
/// If there is none; the message lists all names.
pub fn find(name: &str) -> Result<&'static Glass, UnknownGlass> {
    static MEDIA: [Glass; 12] = CATALOGUE;
    let same = |listed: &&str| significant(listed).eq(significant(name));
    MEDIA
        .iter()
        .find(|glass| same(&glass.name) || glass.aliases.iter().any(same))
        .ok_or_else(|| UnknownGlass { name: name.into() })
}

/// The refractive index of the medium of that name; see [`find`].
///
/// # Errors
/// As [`find`].
pub fn by_name(name: &str) -> Result<Dispersion, UnknownGlass> {
    find(name).map(Glass::dispersion)
}

/// The characters of a name that tell it from others.
fn significant(name: &str) -> impl Iterator<Item = char> + '_ {
    name.chars().filter(|c| !matches!(c, ' ' | '-' | '_')).map(|c| c.to_ascii_lowercase())
}

/// A name that is not in the catalogue.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown glass {name:?}: expected one of {Names}")]
pub struct UnknownGlass {
    /// The name asked for.
    pub name: String,
}

struct Names;

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, glass) in CATALOGUE.iter().enumerate() {
            write!(f, "{}{}", if i > 0 { ", " } else { "" }, glass.name)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_medium_has_its_published_n_d_and_v_d() {
        for glass in CATALOGUE {
            let medium = glass.dispersion();
            medium.validate().unwrap();
            // Half a unit of the last digit that the source prints, and a little for lines at 587.56 or 587.5618 nm.
            let (n_digit, v_digit) = match glass.name {
                "polycarbonate" | "sapphire" | "ice" => (1e-4, 1e-2),
                _ => (1e-5, 1e-2),
            };
            let v_digit = if glass.name == "ice" { 0.1 } else { v_digit };
            assert!((medium.n_d() - glass.n_d).abs() < 0.55 * n_digit, "{} n_d {}", glass.name, medium.n_d());
            assert!(
                (medium.abbe_v_d() - glass.v_d).abs() < 0.8 * v_digit,
                "{} V_d {}",
                glass.name,
                medium.abbe_v_d()
            );
        }
    }

    #[test]
    fn ice_follows_the_table_it_was_fitted_to() {
        // Warren & Brandt 2008, real part, at um.
        for (um, n) in
            [(0.39, 1.3203), (0.45, 1.3157), (0.50, 1.3130), (0.59, 1.3097), (0.65, 1.3080), (0.78, 1.3053)]
        {
            let fitted = by_name("ice").unwrap().ior(um * 1e3);
            assert!((fitted - n).abs() < 8e-5, "{um} um: {fitted} {n}");
        }
    }

    #[test]
    fn sapphire_is_the_ordinary_ray() {
        // Malitson's table for the ordinary ray: 1.76590 at 632.8 nm (Malitson & Dodge).
        assert!((by_name("sapphire").unwrap().ior(632.8) - 1.7659).abs() < 1e-4);
    }

    #[test]
    fn names_are_found_however_written() {
        for glass in &CATALOGUE {
            for name in glass.aliases.iter().chain([&glass.name]) {
                assert_eq!(find(&name.to_lowercase()), Ok(glass));
                assert_eq!(find(&name.to_uppercase().replace('-', " ")), Ok(glass));
            }
        }
        assert_eq!(find("nbk7").unwrap().name, "N-BK7");
        assert_eq!(find("Fused Silica").unwrap().name, "fused-silica");
    }

    #[test]
    fn names_and_aliases_are_unique() {
        for (i, glass) in CATALOGUE.iter().enumerate() {
            for name in glass.aliases.iter().chain([&glass.name]) {
                assert_eq!(find(name), Ok(&CATALOGUE[i]), "{name}");
            }
        }
    }

    #[test]
    fn an_unknown_name_lists_the_known_ones() {
        let message = by_name("unobtainium").unwrap_err().to_string();
        assert!(
            message.starts_with("unknown glass \"unobtainium\": expected one of N-BK7, N-SF11, "),
            "{message}"
        );
        assert!(message.ends_with("water, ice"), "{message}");
        assert!(by_name("").is_err());
    }
}
