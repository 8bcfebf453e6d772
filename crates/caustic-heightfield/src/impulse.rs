//! Waves of pebbles dropped into the pond (section 4.3 of the paper).
//!
//! h(t, d) = A exp(-beta (f(t) - d)) exp(-alpha t) sin(K d - omega t) behind the wavefront f(t) = c t, and 0 ahead of
//! it (d > f(t)), where the printed exponential would grow, and before the pebble falls (t < 0).

use std::f64::consts::TAU;

use num_traits::{Float, FloatConst};
use serde::{Deserialize, Serialize};

use crate::error::{PondError, check_at_least, check_finite, check_positive};
use crate::height_field::{HeightField, check_grid, positions_m};
use crate::walls::{WallImages, wall_images};

/// What a pebble's wave is like; the same for all pebbles of a pond.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ripple {
    /// Speed of the wavefront, metres per second: f(t) = `front_m_s` t.
    pub front_m_s: f64,
    /// Damping with time (the paper's alpha), 1/s.
    pub alpha_per_s: f64,
    /// Damping with the distance behind the wavefront (beta), 1/m.
    pub beta_per_m: f64,
    /// Wave number K, radians per metre.
    pub wave_number_rad_m: f64,
    /// Angular frequency omega, radians per second.
    pub frequency_rad_s: f64,
}

/// One pebble.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Impulse {
    /// Where it falls, metres from the pond's corner.
    pub position_m: [f64; 2],
    /// When it falls, seconds.
    pub start_s: f64,
    /// Height of the undamped wave, metres; negative for a trough first.
    pub amplitude_m: f64,
}

impl Ripple {
    /// Waves of a pebble in a pond of a metre: 10 cm long, half a metre a second fast.
    pub const PEBBLE: Self = Self {
        front_m_s: 0.5,
        alpha_per_s: 0.4,
        beta_per_m: 3.0,
        wave_number_rad_m: 60.0,
        frequency_rad_s: 30.0,
    };

    /// Whether these are waves: finite, damped and not amplified, with a front that moves outwards.
    ///
    /// # Errors
    /// The first number for which this does not hold.
    pub fn check(&self) -> Result<(), PondError> {
        const DAMPING: &str = "finite and not negative";
        check_positive("speed of the wavefront, m/s,", self.front_m_s)?;
        check_at_least("damping with time (alpha), 1/s,", self.alpha_per_s, 0.0, DAMPING)?;
        check_at_least("damping behind the wavefront (beta), 1/m,", self.beta_per_m, 0.0, DAMPING)?;
        check_finite("wave number, rad/m,", self.wave_number_rad_m)?;
        check_finite("angular frequency, rad/s,", self.frequency_rad_s)
    }

    /// h(t, d) for an amplitude of 1: `age_s` after the pebble fell, at `distance_m` from it.
    #[must_use]
    pub fn at(&self, age_s: f64, distance_m: f64) -> f64 {
        if age_s < 0.0 {
            return 0.0;
        }
        self.ring(age_s, 1.0).height(self.beta_per_m, self.wave_number_rad_m / TAU, distance_m)
    }

    /// The wave of a pebble that fell `age_s` ago, 0 or more.
    pub(crate) fn ring(&self, age_s: f64, amplitude_m: f64) -> Ring<f64> {
        let turns = self.frequency_rad_s * age_s / TAU;
        Ring {
            front_m: self.front_m_s * age_s,
            amplitude_m: amplitude_m * (-self.alpha_per_s * age_s).exp(),
            phase_turns: turns - turns.floor(),
        }
    }
}

/// The wave of one pebble at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ring<T> {
    /// How far it has come, metres.
    pub(crate) front_m: T,
    /// Height at the front, metres: A exp(-alpha t).
    pub(crate) amplitude_m: T,
    /// omega t / (2 pi), without whole turns.
    pub(crate) phase_turns: T,
}

impl<T: Float + FloatConst> Ring<T> {
    /// h(t, d); `turns_per_m` is K / (2 pi).
    pub(crate) fn height(&self, beta_per_m: T, turns_per_m: T, distance_m: T) -> T {
        let behind_m = self.front_m - distance_m;
        if behind_m < T::zero() {
            return T::zero();
        }
        // Without whole turns, so that f32 and GPUs, whose sine is right around 0, know it as well.
        let turns = turns_per_m * distance_m - self.phase_turns;
        let wave = (T::TAU() * (turns - turns.round())).sin();
        self.amplitude_m * (-beta_per_m * behind_m).exp() * wave
    }
}

impl Impulse {
    /// Whether it is a place, a time and a height.
    ///
    /// # Errors
    /// The first number that is not finite.
    pub fn check(&self) -> Result<(), PondError> {
        check_finite("x of an impulse, metres,", self.position_m[0])?;
        check_finite("y of an impulse, metres,", self.position_m[1])?;
        check_finite("time of an impulse, seconds,", self.start_s)?;
        check_finite("amplitude of an impulse, metres,", self.amplitude_m)
    }
}

/// The surface at `time_s`, each impulse and its images evaluated at every sample that its wave has reached.
///
/// # Errors
/// A grid, ripple or impulse with a number outside its range.
pub fn impulse_heights(
    size: [usize; 2],
    extent_m: [f64; 2],
    ripple: &Ripple,
    impulses: &[Impulse],
    images: WallImages,
    time_s: f64,
) -> Result<HeightField, PondError> {
    let sources = checked_sources(size, extent_m, ripple, impulses, images, time_s)?;
    let width = size[0];
    let mut heights_m = vec![0.0; width * size[1]];
    use rayon::prelude::*;
    let positions: Vec<[f64; 2]> = positions_m(size, extent_m).collect();
    heights_m.par_chunks_mut(width).zip(positions.par_chunks(width)).for_each(|(row, at)| {
        for source in &sources {
            let age_s = time_s - source.start_s;
            let front_m = ripple.front_m_s * age_s;
            let dy = at[0][1] - source.position_m[1];
            if age_s < 0.0 || dy.abs() > front_m {
                continue;
            }
            for (height, [x, _]) in row.iter_mut().zip(at) {
                *height += source.amplitude_m * ripple.at(age_s, (x - source.position_m[0]).hypot(dy));
            }
        }
    });
    HeightField::from_values(size, extent_m, heights_m)
}

/// All impulses and their images, if everything about them is in range.
pub(crate) fn checked_sources(
    size: [usize; 2],
    extent_m: [f64; 2],
    ripple: &Ripple,
    impulses: &[Impulse],
    images: WallImages,
    time_s: f64,
) -> Result<Vec<Impulse>, PondError> {
    check_grid(size, extent_m)?;
    check_finite("time, seconds,", time_s)?;
    ripple.check()?;
    impulses.iter().try_for_each(Impulse::check)?;
    images.check()?;
    Ok(impulses.iter().flat_map(|impulse| wall_images(impulse, extent_m, images)).collect())
}
