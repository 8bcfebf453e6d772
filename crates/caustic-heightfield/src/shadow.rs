//! Where the surface shades itself. The paper assumes that it does not.

use rayon::prelude::*;

use crate::height_field::HeightField;
use crate::pond::Outside;

/// Steps along a ray per sample that it crosses.
const STEPS_PER_SAMPLE: f64 = 2.0;
/// Share of the pitch by which a shadow must be deep, so that a facet does not shade itself by rounding.
const DEPTH: f64 = 1e-6;

/// Which samples do not see the light, whose unit direction of travel is `light`.
///
/// Rays are marched over the bilinear surface, half a sample at a time.
pub(crate) fn self_shadowed(surface: &HeightField, light: [f64; 3], outside: Outside) -> Vec<bool> {
    let [width, height] = surface.size;
    let pitch_m = surface.pitch_m();
    let across = light[0].hypot(light[1]);
    let [lowest, highest] = surface.range_m();
    if across == 0.0 || !may_shade(surface, -light[2] / across) {
        return vec![false; width * height];
    }
    // Towards the light, in samples per step, and how much the ray rises in one.
    let step_m = pitch_m[0].min(pitch_m[1]) / STEPS_PER_SAMPLE;
    let step = [0, 1].map(|k| -light[k] / across * step_m / pitch_m[k]);
    let rise_m = -light[2] / across * step_m;
    let steps = (((highest - lowest) / rise_m).ceil()).min(1e7) as usize;
    let lit = |i: usize, j: usize| {
        let start_m = surface.heights_m[j * width + i];
        (1..=steps).all(|n| {
            let n = n as f64;
            let ray_m = start_m + n * rise_m;
            match interpolated(surface, [i as f64 + n * step[0], j as f64 + n * step[1]], outside) {
                Some(h) => h <= ray_m + DEPTH * step_m,
                None => true,
            }
        })
    };
    (0..width * height).into_par_iter().map(|s| !lit(s % width, s / width)).collect()
}

/// Whether any slope between neighbours, on the torus too, is steeper than the light.
fn may_shade(surface: &HeightField, tangent: f64) -> bool {
    let [width, height] = surface.size;
    let pitch_m = surface.pitch_m();
    let h = &surface.heights_m;
    let steepest = (0..width * height).fold(0.0_f64, |steepest, s| {
        let (i, j) = (s % width, s / width);
        let east = (h[j * width + (i + 1) % width] - h[s]) / pitch_m[0];
        let north = (h[(j + 1) % height * width + i] - h[s]) / pitch_m[1];
        steepest.max(east.abs()).max(north.abs())
    });
    // Both slopes of a bilinear cell at once.
    steepest * std::f64::consts::SQRT_2 > tangent
}

/// The height at a place in samples; `None` outside of a pond that ends.
fn interpolated(surface: &HeightField, at: [f64; 2], outside: Outside) -> Option<f64> {
    let size = surface.size;
    let corner = |k: usize| -> Option<(usize, usize, f64)> {
        let (low, side) = (at[k].floor(), size[k]);
        let inside = (0.0..=(side - 1) as f64).contains(&at[k]);
        if outside == Outside::Dark && !inside {
            return None;
        }
        let low_index = low.rem_euclid(side as f64) as usize % side;
        let high_index = match outside {
            Outside::Dark => (low_index + 1).min(side - 1),
            Outside::Periodic => (low_index + 1) % side,
        };
        Some((low_index, high_index, at[k] - low))
    };
    let ((west, east, u), (south, north, v)) = (corner(0)?, corner(1)?);
    let h = |i: usize, j: usize| surface.heights_m[j * size[0] + i];
    let row = |j: usize| h(west, j) * (1.0 - u) + h(east, j) * u;
    Some(row(south) * (1.0 - v) + row(north) * v)
}
