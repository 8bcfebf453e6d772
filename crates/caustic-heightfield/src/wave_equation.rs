//! Waves by the linear wave equation of shallow water: h_tt = c^2 (h_xx + h_yy) - 2 delta h_t.
//!
//! Explicit central differences in space and time, second order in both. Stable while c dt sqrt(1/dx^2 + 1/dy^2) <= 1.

use serde::{Deserialize, Serialize};

use crate::error::{PondError, check_at_least, check_finite, check_positive};
use crate::height_field::{HeightField, positions_m};

/// What waves do at the edge of the pond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Walls {
    /// They are thrown back: no water passes, so the surface meets the wall level.
    #[default]
    Reflecting,
    /// They come in again on the other side.
    Periodic,
}

/// A surface in motion.
#[derive(Clone, Debug)]
pub struct WaveEquation {
    now: HeightField,
    before_m: Vec<f64>,
    speed_m_s: f64,
    damping_per_s: f64,
    walls: Walls,
    step_s: f64,
    time_s: f64,
}

impl WaveEquation {
    /// Water that is let go from `heights` without speed at time 0, in steps of `step_s`.
    ///
    /// `speed_m_s` is sqrt(g depth) in shallow water; heights decay as exp(-`damping_per_s` t).
    ///
    /// # Errors
    /// A speed that is not above 0, a negative damping, a step that is unstable.
    pub fn new(
        heights: HeightField,
        speed_m_s: f64,
        damping_per_s: f64,
        walls: Walls,
        step_s: f64,
    ) -> Result<Self, PondError> {
        heights.check()?;
        check_positive("wave speed, m/s,", speed_m_s)?;
        check_at_least("damping, 1/s,", damping_per_s, 0.0, "finite and not negative")?;
        let [dx, dy] = heights.pitch_m();
        let max_s = 1.0 / (speed_m_s * (dx.powi(-2) + dy.powi(-2)).sqrt());
        if !(step_s > 0.0 && step_s <= max_s) {
            return Err(PondError::TimeStep { got_s: step_s, max_s });
        }
        let before_m = heights.heights_m.clone();
        let mut waves = Self { now: heights, before_m, speed_m_s, damping_per_s, walls, step_s, time_s: 0.0 };
        // At rest h(-dt) = h(dt), so h(-dt) is half an undamped step away.
        let accelerated = waves.accelerations();
        for (before, a) in waves.before_m.iter_mut().zip(accelerated) {
            *before += 0.5 * step_s * step_s * a;
        }
        Ok(waves)
    }

    /// The surface now.
    #[must_use]
    pub fn heights(&self) -> &HeightField {
        &self.now
    }

    /// Time since the water was let go, seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Push the surface at a sample by `height_m`, as a pebble does; indices beyond the grid touch nothing.
    pub fn push(&mut self, column: usize, row: usize, height_m: f64) {
        let [width, height] = self.now.size;
        if column < width && row < height && height_m.is_finite() {
            // Both levels, so that the water there is moved and not given speed.
            self.now.heights_m[row * width + column] += height_m;
            self.before_m[row * width + column] += height_m;
        }
    }

    /// Drop a pebble: a hump round `at_m`, metres from the corner, in a trough that takes as much water away, so that none is made; its height falls
    /// with the distance r as (1 - r^2 / (2 radius^2)) exp(-r^2 / (2 radius^2)).
    ///
    /// # Errors
    /// A place or a height that is no finite number, a radius that is not above 0.
    pub fn drop_pebble(&mut self, at_m: [f64; 2], height_m: f64, radius_m: f64) -> Result<(), PondError> {
        check_finite("place of a pebble in x, metres,", at_m[0])?;
        check_finite("place of a pebble in y, metres,", at_m[1])?;
        check_finite("height of a pebble's hump, metres,", height_m)?;
        check_positive("radius of a pebble's hump, metres,", radius_m)?;
        let [width, height] = self.now.size;
        let places = positions_m([width, height], self.now.extent_m);
        for (sample, [x, y]) in places.enumerate() {
            let share = ((x - at_m[0]).powi(2) + (y - at_m[1]).powi(2)) / (2.0 * radius_m * radius_m);
            self.push(sample % width, sample / width, height_m * (1.0 - share) * (-share).exp());
        }
        Ok(())
    }

    /// One step of time.
    pub fn advance(&mut self) {
        let accelerated = self.accelerations();
        let drag = self.damping_per_s * self.step_s;
        let step2 = self.step_s * self.step_s;
        for ((now, before), a) in self.now.heights_m.iter_mut().zip(&mut self.before_m).zip(accelerated) {
            let next = (2.0 * *now - (1.0 - drag) * *before + step2 * a) / (1.0 + drag);
            *before = std::mem::replace(now, next);
        }
        self.time_s += self.step_s;
    }

    /// c^2 times the Laplacian, m/s^2.
    fn accelerations(&self) -> Vec<f64> {
        let [width, height] = self.now.size;
        let [cx, cy] = self.now.pitch_m().map(|pitch| (self.speed_m_s / pitch).powi(2));
        let h = &self.now.heights_m;
        let neighbours = |i: usize, side: usize| match self.walls {
            // A sample beyond the wall mirrors the one before it.
            Walls::Reflecting => [i.saturating_sub(1), (i + 1).min(side - 1)],
            Walls::Periodic => [(i + side - 1) % side, (i + 1) % side],
        };
        (0..height)
            .flat_map(|j| (0..width).map(move |i| (i, j)))
            .map(|(i, j)| {
                let here = 2.0 * h[j * width + i];
                let [west, east] = neighbours(i, width);
                let [south, north] = neighbours(j, height);
                cx * (h[j * width + west] + h[j * width + east] - here)
                    + cy * (h[south * width + i] + h[north * width + i] - here)
            })
            .collect()
    }
}
