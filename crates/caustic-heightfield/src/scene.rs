//! A pond with its surface as a JSON file says it.

use std::f64::consts::TAU;
use std::path::Path;

use serde::{Deserialize, Serialize};

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
        /// Seconds.
        time_s: f64,
    },
    /// A sum of sines.
    Waves(Vec<Wave>),
    /// An EXR file of heights in metres, beside the JSON file.
    Exr(String),
    /// One list of heights in metres per row.
    Rows(Vec<Vec<f64>>),
}

/// A sin(2 pi (`cycles` . (x, y) / extent) + phase).
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
}

impl Default for PondScene {
    /// The gentle waves of the book's page on the pond, with light from 20 degrees off the vertical.
    fn default() -> Self {
        let wave = |share: f64, cycles, phase_rad| Wave { amplitude_m: 0.004 * share, cycles, phase_rad };
        Self {
            extent_m: [1.0, 1.0],
            surface: Surface::Waves(vec![wave(1.0, [3.0, 2.0], 0.0), wave(0.8, [5.0, -4.0], 1.0)]),
            pond: Pond { light_direction: light_tilted_deg(20.0), ..Pond::default() },
        }
    }
}

impl PondScene {
    /// Whether the surface comes on a grid of its own, which no other size can be asked of.
    #[must_use]
    pub fn has_own_grid(&self) -> bool {
        matches!(self.surface, Surface::Exr(_) | Surface::Rows(_))
    }

    /// The heights, on a grid of `size` where the surface has none of its own; files are looked for in `folder`.
    ///
    /// # Errors
    /// Numbers out of range, files that hold no heights.
    pub fn heights(&self, size: [usize; 2], folder: &Path) -> Result<HeightField, PondError> {
        match &self.surface {
            Surface::Impulses { ripple, impulses, walls, time_s } => {
                impulse_heights(size, self.extent_m, ripple, impulses, *walls, *time_s)
            }
            Surface::Waves(waves) => {
                for wave in waves {
                    check_finite("amplitude of a wave, metres,", wave.amplitude_m)?;
                    check_finite("cycles of a wave in x", wave.cycles[0])?;
                    check_finite("cycles of a wave in y", wave.cycles[1])?;
                    check_finite("phase of a wave, radians,", wave.phase_rad)?;
                }
                HeightField::from_fn(size, self.extent_m, |x, y| {
                    let [u, v] = [x / self.extent_m[0], y / self.extent_m[1]];
                    let turns = |wave: &Wave| wave.cycles[0] * u + wave.cycles[1] * v;
                    waves.iter().map(|w| w.amplitude_m * (TAU * turns(w) + w.phase_rad).sin()).sum()
                })
            }
            Surface::Exr(file) => HeightField::from_exr(&folder.join(file), self.extent_m),
            Surface::Rows(rows) => HeightField::from_rows(rows, self.extent_m),
        }
    }
}
