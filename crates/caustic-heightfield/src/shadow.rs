//! Where the surface shades itself. The paper assumes that it does not.

use num_traits::Float;
use rayon::prelude::*;

use crate::height_field::{CHUNK, HeightField, Heights};
use crate::pond::Outside;

/// Steps along a ray per sample that it crosses.
pub(crate) const STEPS_PER_SAMPLE: f64 = 2.0;
/// Share of the pitch by which a shadow must be deep, so that a facet does not shade itself by rounding.
const DEPTH: f64 = 1e-6;
/// Most steps along a ray.
const MAX_STEPS: usize = 10_000_000;

/// What of a surface decides whether it can shade itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Relief<T> {
    /// Its highest sample, metres.
    pub(crate) highest_m: T,
    /// Largest slope between neighbours in x or y, on the torus too.
    pub(crate) steepest: T,
}

impl<T: Float> Relief<T> {
    /// Of the sample (i, j) and its next neighbours.
    pub(crate) fn of(surface: &Heights<'_, T>, i: usize, j: usize) -> Self {
        let [width, height] = surface.size;
        let next = |i: usize, side: usize| if i + 1 == side { 0 } else { i + 1 };
        let here = surface.at(i, j);
        let east = (surface.at(next(i, width), j) - here) / surface.pitch_m[0];
        let north = (surface.at(i, next(j, height)) - here) / surface.pitch_m[1];
        Self { highest_m: here, steepest: east.abs().max(north.abs()) }
    }

    /// Of both.
    pub(crate) fn or(self, other: Self) -> Self {
        Self { highest_m: self.highest_m.max(other.highest_m), steepest: self.steepest.max(other.steepest) }
    }
}

/// Rays from the surface towards the light, in steps of half a sample over the bilinear surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct March<T> {
    /// Samples in x and y per step.
    pub(crate) step: [T; 2],
    /// How much a ray rises in a step, metres.
    pub(crate) rise_m: T,
    /// How deep a shadow must be, metres.
    pub(crate) depth_m: T,
    /// Rise over run of a ray; infinite where the light is vertical, and nothing shades anything.
    pub(crate) tangent: T,
}

impl<T: Float> March<T> {
    /// Towards a light whose unit direction of travel is `light`.
    pub(crate) fn new(pitch_m: [T; 2], light: [T; 3]) -> Self {
        let real = |x: f64| T::from(x).expect("f32 and f64 hold it");
        let across = light[0].hypot(light[1]);
        if across == T::zero() {
            return Self {
                step: [T::zero(); 2],
                rise_m: T::zero(),
                depth_m: T::zero(),
                tangent: T::infinity(),
            };
        }
        let step_m = pitch_m[0].min(pitch_m[1]) / real(STEPS_PER_SAMPLE);
        Self {
            step: [0, 1].map(|k| -light[k] / across * step_m / pitch_m[k]),
            rise_m: -light[2] / across * step_m,
            depth_m: real(DEPTH) * step_m,
            tangent: -light[2] / across,
        }
    }

    /// Whether any slope of a surface, both slopes of a bilinear cell at once, is steeper than the light.
    pub(crate) fn may_shade(&self, relief: &Relief<T>) -> bool {
        let diagonal = T::from(std::f64::consts::SQRT_2).expect("f32 and f64 hold it");
        relief.steepest * diagonal > self.tangent
    }

    /// Whether the surface is between its sample (i, j) and the light, looking no farther than `most_steps`.
    pub(crate) fn meets(
        &self,
        surface: &Heights<'_, T>,
        highest_m: T,
        most_steps: usize,
        [i, j]: [usize; 2],
    ) -> bool {
        let real = |n: usize| T::from(n).expect("f32 and f64 hold it");
        let start_m = surface.at(i, j);
        for step in 1..=most_steps {
            let n = real(step);
            let ray_m = start_m + n * self.rise_m;
            if ray_m > highest_m {
                return false;
            }
            let at = [real(i) + n * self.step[0], real(j) + n * self.step[1]];
            match interpolated(surface, at) {
                Some(h) if h > ray_m + self.depth_m => return true,
                Some(_) => {}
                None => return false,
            }
        }
        false
    }
}

/// Which samples of a surface do not see the light, asked one by one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shadows<'a> {
    surface: Heights<'a, f64>,
    march: March<f64>,
    highest_m: f64,
    may_shade: bool,
}

impl<'a> Shadows<'a> {
    /// Of light whose unit direction of travel is `light`.
    pub(crate) fn new(surface: &'a HeightField, light: [f64; 3], outside: Outside) -> Self {
        let surface = surface.view(outside);
        let [width, height] = surface.size;
        let march = March::new(surface.pitch_m, light);
        let nothing = Relief { highest_m: f64::NEG_INFINITY, steepest: 0.0 };
        let row = |j: usize| (0..width).map(|i| Relief::of(&surface, i, j)).fold(nothing, Relief::or);
        // Vertical light is hidden from nothing.
        let rows = if march.tangent.is_finite() { height } else { 0 };
        let rows = (0..rows).into_par_iter().with_min_len(CHUNK.div_ceil(width));
        let relief = rows.map(row).reduce(|| nothing, Relief::or);
        Self { surface, march, highest_m: relief.highest_m, may_shade: march.may_shade(&relief) }
    }

    /// Whether sample (i, j) is behind other water.
    pub(crate) fn hide(&self, i: usize, j: usize) -> bool {
        self.may_shade && self.march.meets(&self.surface, self.highest_m, MAX_STEPS, [i, j])
    }
}

/// The height at a place in samples; `None` outside of a pond that ends.
fn interpolated<T: Float>(surface: &Heights<'_, T>, at: [T; 2]) -> Option<T> {
    let corner = |k: usize| -> Option<(usize, usize, T)> {
        let (low, side) = (at[k].floor(), surface.size[k] as i64);
        let index = low.to_i64()?;
        let share = at[k] - low;
        let inside = index >= 0 && (index < side - 1 || (index == side - 1 && share == T::zero()));
        match surface.outside {
            Outside::Dark if !inside => None,
            Outside::Dark => Some((index as usize, (index + 1).min(side - 1) as usize, share)),
            Outside::Periodic => {
                Some((index.rem_euclid(side) as usize, (index + 1).rem_euclid(side) as usize, share))
            }
        }
    };
    let ((west, east, u), (south, north, v)) = (corner(0)?, corner(1)?);
    let row = |j: usize| surface.at(west, j) * (T::one() - u) + surface.at(east, j) * u;
    Some(row(south) * (T::one() - v) + row(north) * v)
}
