//! Host side of `shaders/shared/harmonics.wgsl`: [`crate::sh`] in f32, by the same steps.

use glam::{Vec2, Vec3};

/// Bands of those who shine.
pub(crate) const MOST_BANDS: usize = 5;
/// Their harmonics.
pub(crate) const MOST_HARMONICS: usize = MOST_BANDS * MOST_BANDS;

/// All harmonics of a unit direction; 0 beyond the bands asked for.
pub(crate) fn harmonics(bands: usize, direction: Vec3) -> [f32; MOST_HARMONICS] {
    let mut out = [0.0; MOST_HARMONICS];
    let mut round = Vec2::X;
    let mut sectoral = (0.25 / std::f32::consts::PI).sqrt();
    for m in 0..bands.min(MOST_BANDS) {
        if m > 0 {
            round = Vec2::new(
                direction.x * round.x - direction.y * round.y,
                direction.x * round.y + direction.y * round.x,
            );
            sectoral *= ((2 * m + 1) as f32 / (2 * m) as f32).sqrt();
        }
        let scale = if m == 0 { 1.0 } else { std::f32::consts::SQRT_2 };
        let (mut before, mut legendre) = (0.0, sectoral);
        for l in m..bands.min(MOST_BANDS) {
            if l > m {
                let a = ((4 * l * l - 1) as f32 / (l * l - m * m) as f32).sqrt();
                let below = (l - 1) * (l - 1);
                // At l = m + 1 nothing lies two degrees below: b is 0.
                let b = ((below - (m * m).min(below)) as f32 / ((4 * below).max(2) - 1) as f32).sqrt();
                (before, legendre) = (legendre, a * (direction.z * legendre - b * before));
            }
            let at = l * l + l;
            out[at + m] = scale * legendre * round.x;
            if m > 0 {
                out[at - m] = scale * legendre * round.y;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::bands::Bands;
    use crate::sh;

    #[test]
    fn harmonics_are_those_in_f64() {
        for bands in 1..=MOST_BANDS {
            for direction in [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::new(0.48, -0.6, 0.64)] {
                let exact = sh::harmonics(Bands::new(bands as u8).expect("up to ten"), direction);
                let found = harmonics(bands, direction.as_vec3());
                for (k, found) in found.into_iter().enumerate() {
                    let exact = exact.get(k).copied().unwrap_or(0.0);
                    assert!(
                        (f64::from(found) - exact).abs() < 2e-6,
                        "{bands} {direction} {k}: {found} {exact}"
                    );
                }
            }
        }
    }
}
