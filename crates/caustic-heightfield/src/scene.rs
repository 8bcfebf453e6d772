//! A pond with its surface as a JSON file says it.

use std::f64::consts::TAU;
use std::path::Path;

use serde::{Deserialize, Serialize};
use spectral_core::light::LightSpectrum;

use crate::error::{PondError, check_finite};
use crate::height_field::HeightField;
use crate::impulse::{Impulse, Ripple, impulse_heights};
use crate::pond::{Pond, light_tilted_deg};
use crate::walls::WallImages;

/// A pond and its surface at one time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PondScene {
    /// Length of the pond in x and y, metres.
    pub extent_m: [f64; 2],
    /// Where its heights come from.
    pub surface: Surface,
    /// Water and light.
    pub pond: Pond,
    /// The light's spectrum, for floors in colour; white D65 if nothing is said.
    pub spectrum: LightSpectrum,
}

/// A moment of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Seconds after the time that the scene states.
    pub after_s: f64,
}

/// Where heights come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Surface {
    /// Pebbles, at a time.
    Impulses {
        /// What their waves are like.
        ripple: Ripple,
        /// The pebbles.
        impulses: Vec<Impulse>,
        /// How walls reflect.
        #[serde(default)]
        walls: WallImages,
        /// Seconds; a series begins there.
        time_s: f64,
    },
    /// A sum of sines.
    Waves(Vec<Wave>),
    /// An EXR file of heights in metres, beside the JSON file; in a series `#` signs stand for the number of the frame, from 0.
    Exr(String),
    /// One list of heights in metres per row.
    Rows(Vec<Vec<f64>>),
}

/// A sin(2 pi (`cycles` . (x, y) / extent) + phase - omega t).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wave {
    /// A, metres.
    pub amplitude_m: f64,
    /// Periods across the pond in x and y: a periodic pond needs whole numbers.
    pub cycles: [f64; 2],
    /// Radians.
    #[serde(default)]
    pub phase_rad: f64,
    /// Angular frequency omega, radians per second; 0 for waves that stand still.
    #[serde(default)]
    pub frequency_rad_s: f64,
}

impl Default for PondScene {
    /// The gentle waves of the book's page on the pond, with light from 20 degrees off the vertical.
    fn default() -> Self {
        let wave = |share: f64, cycles, phase_rad| Wave {
            amplitude_m: 0.004 * share,
            cycles,
            phase_rad,
            frequency_rad_s: 0.0,
        };
        Self {
            extent_m: [1.0, 1.0],
            surface: Surface::Waves(vec![wave(1.0, [3.0, 2.0], 0.0), wave(0.8, [5.0, -4.0], 1.0)]),
            pond: Pond { light_direction: light_tilted_deg(20.0), ..Pond::default() },
            spectrum: LightSpectrum::default(),
        }
    }
}

impl PondScene {
    /// Whether the surface comes on a grid of its own, which no other size can be asked of.
    #[must_use]
    pub fn has_own_grid(&self) -> bool {
        matches!(self.surface, Surface::Exr(_) | Surface::Rows(_))
    }

    /// Whether the surface is another one at another moment.
    #[must_use]
    pub fn varies(&self) -> bool {
        match &self.surface {
            Surface::Impulses { .. } => true,
            Surface::Waves(waves) => waves.iter().any(|wave| wave.frequency_rad_s != 0.0),
            Surface::Exr(file) => numbered_name(file, 0).is_some(),
            Surface::Rows(_) => false,
        }
    }

    /// The heights, on a grid of `size` where the surface has none of its own; files are looked for in `folder`.
    ///
    /// # Errors
    /// Numbers out of range, files that hold no heights.
    pub fn heights(&self, size: [usize; 2], folder: &Path, moment: Moment) -> Result<HeightField, PondError> {
        check_finite("time, seconds,", moment.after_s)?;
        match &self.surface {
            Surface::Impulses { ripple, impulses, walls, time_s } => {
                impulse_heights(size, self.extent_m, ripple, impulses, *walls, time_s + moment.after_s)
            }
            Surface::Waves(waves) => {
                for wave in waves {
                    check_finite("amplitude of a wave, metres,", wave.amplitude_m)?;
                    check_finite("cycles of a wave in x", wave.cycles[0])?;
                    check_finite("cycles of a wave in y", wave.cycles[1])?;
                    check_finite("phase of a wave, radians,", wave.phase_rad)?;
                    check_finite("angular frequency of a wave, rad/s,", wave.frequency_rad_s)?;
                }
                HeightField::from_fn(size, self.extent_m, |x, y| {
                    let [u, v] = [x / self.extent_m[0], y / self.extent_m[1]];
                    let angle = |wave: &Wave| {
                        let turns = wave.cycles[0] * u + wave.cycles[1] * v;
                        TAU * turns + wave.phase_rad - wave.frequency_rad_s * moment.after_s
                    };
                    waves.iter().map(|wave| wave.amplitude_m * angle(wave).sin()).sum()
                })
            }
            Surface::Exr(file) => {
                let numbered = numbered_name(file, moment.frame);
                HeightField::from_exr(&folder.join(numbered.as_ref().unwrap_or(file)), self.extent_m)
            }
            Surface::Rows(rows) => HeightField::from_rows(rows, self.extent_m),
        }
    }
}

/// A name whose last run of `#` signs is the number of a frame, with that number of at least as many digits; `None` if it has none.
#[must_use]
pub fn numbered_name(name: &str, frame: usize) -> Option<String> {
    let end = name.rfind('#')? + 1;
    let start = name[..end].trim_end_matches('#').len();
    let digits = end - start;
    Some(format!("{}{frame:0digits$}{}", &name[..start], &name[end..]))
}
