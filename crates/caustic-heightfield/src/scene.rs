//! A pond with its surface as a JSON file says it.

use std::f64::consts::TAU;
use std::path::Path;

use serde::{Deserialize, Serialize};
use spectral_core::light::LightSpectrum;

use crate::error::{PondError, check_at_least, check_finite};
use crate::height_field::HeightField;
use crate::impulse::{Impulse, Ripple, impulse_heights};
use crate::pond::{Pond, light_tilted_deg};
use crate::walls::WallImages;
use crate::wave_equation::{Walls, WaveEquation};

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
    /// Water that is let go at time 0 and follows the linear wave equation, with what falls into it.
    WaveEquation(Swell),
}

/// Waves by the linear wave equation, computed step by step from time 0 on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Swell {
    /// The surface that is let go; level water if nothing is said.
    #[serde(default)]
    pub from: Option<Box<Surface>>,
    /// What falls into it.
    #[serde(default)]
    pub pebbles: Vec<Pebble>,
    /// Speed of waves, m/s: sqrt(g depth) in shallow water.
    pub speed_m_s: f64,
    /// Heights decay as exp(-damping t), 1/s.
    #[serde(default)]
    pub damping_per_s: f64,
    /// What waves do at the edge of the pond.
    #[serde(default)]
    pub walls: Walls,
    /// Seconds of a step; it is stable while speed step sqrt(1 / dx^2 + 1 / dy^2) <= 1.
    pub step_s: f64,
    /// Seconds; a series begins there. Before 0 the water is held.
    pub time_s: f64,
}

/// A pebble that makes a hump in the water and a trough round it, as much water in both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pebble {
    /// Where it falls, metres from the pond's corner.
    pub position_m: [f64; 2],
    /// When, seconds; the step that is nearest has it.
    #[serde(default)]
    pub start_s: f64,
    /// Height of the hump, metres.
    pub height_m: f64,
    /// Where the hump ends and the trough begins, metres, over the square root of two.
    pub radius_m: f64,
}

/// Most steps to a moment: each takes some nanoseconds a sample.
const MOST_STEPS: f64 = 1e6;

impl Swell {
    /// The heights at `time_s`, of water that was let go as `start`: between two steps they are taken to be straight.
    ///
    /// # Errors
    /// As [`WaveEquation::new`] and [`WaveEquation::drop_pebble`]; more steps than are done in a reasonable time.
    fn heights(&self, start: HeightField, time_s: f64) -> Result<HeightField, PondError> {
        let Self { speed_m_s, damping_per_s, walls, step_s, .. } = *self;
        let mut waves = WaveEquation::new(start, speed_m_s, damping_per_s, walls, step_s)?;
        check_finite("time, seconds,", time_s)?;
        if time_s < 0.0 {
            return Ok(waves.heights().clone());
        }
        let steps = time_s / step_s;
        if steps > MOST_STEPS {
            let expected = "a million at most: a longer step, or an earlier time";
            return Err(PondError::Setting { name: "number of steps", got: steps, expected });
        }
        for pebble in &self.pebbles {
            check_at_least("start of a pebble, seconds,", pebble.start_s, 0.0, "finite and not negative")?;
        }
        for step in 0..=steps as u32 {
            if step > 0 {
                waves.advance();
            }
            let falls = |pebble: &&Pebble| (pebble.start_s / step_s).round() == f64::from(step);
            for pebble in self.pebbles.iter().filter(falls) {
                waves.drop_pebble(pebble.position_m, pebble.height_m, pebble.radius_m)?;
            }
        }
        let mut heights = waves.heights().clone();
        waves.advance();
        let (share, next) = (steps.fract(), waves.heights());
        heights.heights_m.iter_mut().zip(&next.heights_m).for_each(|(h, next)| *h += share * (next - *h));
        Ok(heights)
    }
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
        self.surface.has_own_grid()
    }

    /// Whether the surface is another one at another moment.
    #[must_use]
    pub fn varies(&self) -> bool {
        match &self.surface {
            Surface::Impulses { .. } | Surface::WaveEquation(_) => true,
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
        self.surface.heights(size, self.extent_m, folder, moment)
    }
}

impl Surface {
    fn has_own_grid(&self) -> bool {
        match self {
            Self::Exr(_) | Self::Rows(_) => true,
            Self::Impulses { .. } | Self::Waves(_) => false,
            Self::WaveEquation(swell) => swell.from.as_ref().is_some_and(|from| from.has_own_grid()),
        }
    }

    fn heights(
        &self,
        size: [usize; 2],
        extent_m: [f64; 2],
        folder: &Path,
        moment: Moment,
    ) -> Result<HeightField, PondError> {
        match self {
            Self::Impulses { ripple, impulses, walls, time_s } => {
                impulse_heights(size, extent_m, ripple, impulses, *walls, time_s + moment.after_s)
            }
            Self::Waves(waves) => {
                for wave in waves {
                    check_finite("amplitude of a wave, metres,", wave.amplitude_m)?;
                    check_finite("cycles of a wave in x", wave.cycles[0])?;
                    check_finite("cycles of a wave in y", wave.cycles[1])?;
                    check_finite("phase of a wave, radians,", wave.phase_rad)?;
                    check_finite("angular frequency of a wave, rad/s,", wave.frequency_rad_s)?;
                }
                HeightField::from_fn(size, extent_m, |x, y| {
                    let [u, v] = [x / extent_m[0], y / extent_m[1]];
                    let angle = |wave: &Wave| {
                        let turns = wave.cycles[0] * u + wave.cycles[1] * v;
                        TAU * turns + wave.phase_rad - wave.frequency_rad_s * moment.after_s
                    };
                    waves.iter().map(|wave| wave.amplitude_m * angle(wave).sin()).sum()
                })
            }
            Self::Exr(file) => {
                let numbered = numbered_name(file, moment.frame);
                HeightField::from_exr(&folder.join(numbered.as_ref().unwrap_or(file)), extent_m)
            }
            Self::Rows(rows) => HeightField::from_rows(rows, extent_m),
            Self::WaveEquation(swell) => {
                let start = match &swell.from {
                    Some(from) => from.heights(size, extent_m, folder, Moment::default())?,
                    None => HeightField::flat(size, extent_m)?,
                };
                swell.heights(start, swell.time_s + moment.after_s)
            }
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
