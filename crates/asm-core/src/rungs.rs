//! The rungs of the ladder from cheap to accurate: plain data, made from small axes.
//!
//! A method is one entry of [`LADDER`]. An axis is a field of [`Rung`] and one of [`Axes`], a loop in [`Axes::rungs`], a line in
//! [`Rung::settings`] and its words in [`Rung`]'s `Display`.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{Emission, GapFilling, Method, Refraction, Settings};

/// What a caller would set: one point of the price list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// How caustics are made.
    pub method: Method,
    /// Wavelengths per photon.
    pub wavelengths: u32,
    /// Texels of the emission view along each side.
    pub emission_size: u32,
    /// Where photons start.
    pub emission: Emission,
    /// How light finds its way through glass.
    pub refraction: Refraction,
    /// How gaps between the wavelengths are filled.
    pub gap_filling: GapFilling,
    /// Texels of the map along each side.
    pub map_size: u32,
}

/// What a method is tried with; every combination is a rung.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// How caustics are made.
    pub method: Method,
    wavelengths: &'static [u32],
    emission_size: &'static [u32],
    emission: &'static [Emission],
    refraction: &'static [Refraction],
    gap_filling: &'static [GapFilling],
    map_size: &'static [u32],
}

/// What most methods are tried with.
const COMMON: Axes = Axes {
    method: Method::CausticsMap,
    wavelengths: &[1, 3, 7, 21],
    emission_size: &[128, 256, 512],
    emission: &[Emission::Grid],
    refraction: &[Refraction::ImageSpace],
    gap_filling: &[GapFilling::None],
    map_size: &[256, 512],
};

/// Every method with its axes.
pub const LADDER: &[Axes] = &[
    Axes { method: Method::CausticsMap, ..COMMON },
    Axes { method: Method::Acm, wavelengths: &[1], emission: &[levels(3), levels(6)], ..COMMON },
    Axes {
        method: Method::Asm,
        wavelengths: &[3, 7, 21],
        emission: &[levels(3)],
        refraction: &Refraction::ALL,
        gap_filling: &[GapFilling::None, GapFilling::Disc],
        ..COMMON
    },
    Axes {
        method: Method::Footprint,
        wavelengths: &[1, 3, 4],
        emission_size: &[64, 128, 256],
        refraction: &[Refraction::Traced],
        map_size: &[256],
        ..COMMON
    },
];

const fn levels(levels: u32) -> Emission {
    Emission::Adaptive { levels }
}

/// Every rung, method by method.
pub fn rungs() -> Vec<Rung> {
    LADDER.iter().flat_map(Axes::rungs).collect()
}

impl Axes {
    fn rungs(&self) -> Vec<Rung> {
        let mut rungs = Vec::new();
        for &wavelengths in self.wavelengths {
            for &emission_size in self.emission_size {
                for &emission in self.emission {
                    for &refraction in self.refraction {
                        for &gap_filling in self.gap_filling {
                            for &map_size in self.map_size {
                                rungs.push(Rung {
                                    method: self.method,
                                    wavelengths,
                                    emission_size,
                                    emission,
                                    refraction,
                                    gap_filling,
                                    map_size,
                                });
                            }
                        }
                    }
                }
            }
        }
        rungs
    }
}

impl Rung {
    /// What a plan is made from.
    pub fn settings(&self) -> Settings {
        Settings {
            wavelengths: Some(self.wavelengths),
            emission_size: self.emission_size,
            emission: Some(self.emission),
            refraction: Some(self.refraction),
            gap_filling: Some(self.gap_filling),
            map_size: Some(self.map_size),
            ..Settings::of(self.method)
        }
    }

    /// Photons that are aimed at most: how rungs are ordered before anything is measured.
    pub fn aimed(&self) -> u64 {
        u64::from(self.wavelengths) * u64::from(self.emission_size).pow(2)
    }

    /// Where photons start, in a word.
    pub fn emission_word(&self) -> String {
        match self.emission {
            Emission::Grid => "grid".into(),
            Emission::Adaptive { levels } => format!("{levels} levels"),
        }
    }
}

impl fmt::Display for Rung {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (size, map) = (self.emission_size, self.map_size);
        let (method, emission) = (self.method.name(), self.emission_word());
        write!(f, "{method} N={}, {size} x {size} {emission}", self.wavelengths)?;
        if self.refraction != Settings::of(self.method).refraction() {
            write!(f, ", {}", self.refraction.name())?;
        }
        f.write_str(match self.gap_filling {
            GapFilling::None => "",
            GapFilling::Paper => ", gaps by the paper's text",
            GapFilling::PaperLiteral => ", gaps by the paper's figure",
            GapFilling::Disc => ", gaps filled",
        })?;
        write!(f, ", map {map} x {map}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_rung_comes_twice() {
        let rungs = rungs();
        for (i, rung) in rungs.iter().enumerate() {
            assert!(!rungs[..i].contains(rung), "{rung}");
        }
        let names: std::collections::HashSet<_> = rungs.iter().map(Rung::to_string).collect();
        assert_eq!(names.len(), rungs.len(), "a name for each");
    }

    #[test]
    fn every_value_of_every_axis_is_tried() {
        let all = rungs();
        for axes in LADDER {
            let of: Vec<_> = all.iter().filter(|rung| rung.method == axes.method).collect();
            let product = axes.wavelengths.len()
                * axes.emission_size.len()
                * axes.emission.len()
                * axes.refraction.len()
                * axes.gap_filling.len()
                * axes.map_size.len();
            assert_eq!(of.len(), product);
            assert!(axes.wavelengths.iter().all(|&v| of.iter().any(|r| r.wavelengths == v)));
            assert!(axes.emission_size.iter().all(|&v| of.iter().any(|r| r.emission_size == v)));
            assert!(axes.emission.iter().all(|&v| of.iter().any(|r| r.emission == v)));
            assert!(axes.refraction.iter().all(|&v| of.iter().any(|r| r.refraction == v)));
            assert!(axes.gap_filling.iter().all(|&v| of.iter().any(|r| r.gap_filling == v)));
            assert!(axes.map_size.iter().all(|&v| of.iter().any(|r| r.map_size == v)));
        }
    }

    #[test]
    fn settings_say_what_the_rung_says() {
        for rung in rungs() {
            let settings = rung.settings();
            assert_eq!(settings.method, rung.method);
            assert_eq!(settings.wavelength_count(), rung.wavelengths);
            assert_eq!(settings.emission_size, rung.emission_size);
            assert_eq!(settings.emission(), rung.emission);
            assert_eq!(settings.refraction(), rung.refraction);
            assert_eq!(settings.gap_filling(), rung.gap_filling);
            assert_eq!(settings.map_size, Some(rung.map_size));
        }
    }
}
