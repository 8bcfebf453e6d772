//! What a scene's lamps send.

use spectral_core::observer::Observer;
use spectral_core::rgb::{D65_WHITE_XYZ, luminance};
use spectral_scene::{Light, Scene};

/// Lux of a directional light, candela of the others.
#[must_use]
pub fn luminous(light: &Light) -> f64 {
    light.intensity * luminance(light.color)
}

/// XYZ at Y = 1 of unblocked perpendicular light of all lamps together.
#[must_use]
pub fn white_xyz(scene: &Scene) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for light in &scene.lights {
        let unit = light.spectrum.unit_xyz(Observer::default());
        let weight = luminous(light);
        sum.iter_mut().zip(unit).for_each(|(s, u)| *s += weight * u);
    }
    if sum[1] > 0.0 { sum.map(|v| v / sum[1]) } else { D65_WHITE_XYZ }
}
