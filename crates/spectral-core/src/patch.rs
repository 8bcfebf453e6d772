//! The colour of a flat patch under a light: sampled, as RGB would have it, and the difference that is seen.
//!
//! This is the yardstick of spectral bases: one matt patch, evenly lit, white-balanced to the display. XYZ here is the
//! integral of reflectance, light and colour-matching functions on a [`SpectralGrid`], in the light's unit times nm.

use alloc::vec::Vec;

use crate::basis::SpectralBasis;
use crate::color::{bradford, bradford_responses, delta_e_94, lab_from_xyz};
use crate::grid::SpectralGrid;
use crate::illuminant::Illuminant;
use crate::mat3;
use crate::observer::Observer;
use crate::rgb::{D65_WHITE_XYZ, linear_srgb_from_xyz, xyz_from_linear_srgb};

/// XYZ of a patch by sampling (Schwenk et al. 2010, eq. 3): the reference. A reflectance of 1 gives the light's own.
///
/// # Panics
/// If a spectrum has not one value per wavelength of the grid.
pub fn sampled_xyz(grid: &SpectralGrid, observer: Observer, reflectance: &[f64], light: &[f64]) -> [f64; 3] {
    assert_eq!((reflectance.len(), light.len()), (grid.samples(), grid.samples()), "spectra on another grid");
    let mut xyz = [0.0; 3];
    for (i, (r, l)) in reflectance.iter().zip(light).enumerate() {
        let bar = observer.xyz_bar(grid.lambda_nm(i));
        for c in 0..3 {
            xyz[c] += bar[c] * r * l * grid.step_nm();
        }
    }
    xyz
}

/// XYZ of the light itself.
///
/// # Panics
/// As [`sampled_xyz`].
pub fn light_xyz(grid: &SpectralGrid, observer: Observer, light: &[f64]) -> [f64; 3] {
    sampled_xyz(grid, observer, &grid.sample(|_| 1.0), light)
}

/// XYZ of a patch as an RGB renderer has it: the reflectance's linear sRGB under D65 times the light's linear sRGB,
/// negative components kept.
///
/// # Panics
/// As [`sampled_xyz`].
pub fn rgb_rendered_xyz(
    grid: &SpectralGrid,
    observer: Observer,
    reflectance: &[f64],
    light: &[f64],
) -> [f64; 3] {
    SpectralBasis::xyz(&rgb_albedo(grid, observer, reflectance), &rgb_light(grid, observer, light))
}

/// What an RGB renderer multiplies light with, in the form of three coefficients of a [`SpectralBasis`]: XYZ of each
/// component of the reflectance's linear sRGB under D65, balanced so that a reflectance of 1 is (1, 1, 1).
///
/// # Panics
/// As [`sampled_xyz`].
pub fn rgb_albedo(grid: &SpectralGrid, observer: Observer, reflectance: &[f64]) -> Vec<[f64; 3]> {
    let d65 = grid.sample(|lambda_nm| Illuminant::D65.relative_power(lambda_nm));
    let white = light_xyz(grid, observer, &d65);
    let seen = sampled_xyz(grid, observer, reflectance, &d65).map(|v| v / white[1]);
    let balanced = mat3::apply(&bradford(white.map(|v| v / white[1]), D65_WHITE_XYZ), seen);
    let albedo = linear_srgb_from_xyz(balanced);
    let component = |c: usize| xyz_from_linear_srgb([0, 1, 2].map(|k| if k == c { albedo[c] } else { 0.0 }));
    (0..3).map(component).collect()
}

/// Linear sRGB of a light, negative components kept: its three coefficients for [`rgb_albedo`].
///
/// # Panics
/// As [`sampled_xyz`].
pub fn rgb_light(grid: &SpectralGrid, observer: Observer, light: &[f64]) -> [f64; 3] {
    linear_srgb_from_xyz(light_xyz(grid, observer, light))
}

/// The least a cone response of a light's white, Y = 1, may be in absolute value for Bradford to have a gain.
const LEAST_RESPONSE: f64 = 1e-9;

/// How colours under one light are shown: scaled so that the light has Y = 1, then white-balanced by Bradford to D65.
///
/// A single line may have a negative cone response in Bradford's space. Its gain is then negative as well; since all
/// colours under a single line are multiples of its own, they come out as multiples of D65, which is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// From the light's own XYZ to D65-relative XYZ with white at Y = 1.
    display_from_light: mat3::Mat3,
}

impl Shown {
    /// For the light whose own XYZ, in the unit of the colours to show, is `light_xyz`; `None` without luminance, and
    /// where Bradford has no finite gain.
    pub fn under(light_xyz: [f64; 3]) -> Option<Self> {
        if !(light_xyz[1] > 0.0 && light_xyz.iter().all(|v| v.is_finite())) {
            return None;
        }
        let white = light_xyz.map(|v| v / light_xyz[1]);
        if !bradford_responses(white).iter().all(|r| r.abs() > LEAST_RESPONSE && r.is_finite()) {
            return None;
        }
        let scale = mat3::diagonal([1.0 / light_xyz[1]; 3]);
        Some(Self { display_from_light: mat3::multiply(&bradford(white, D65_WHITE_XYZ), &scale) })
    }

    /// The matrix to D65-relative XYZ with white at Y = 1.
    pub fn display_from_light(&self) -> mat3::Mat3 {
        self.display_from_light
    }

    /// CIELAB, relative to D65, of a colour.
    pub fn lab(&self, xyz: [f64; 3]) -> [f64; 3] {
        lab_from_xyz(mat3::apply(&self.display_from_light, xyz), D65_WHITE_XYZ)
    }

    /// CIE94 difference of `xyz` from the colour `standard_xyz`.
    pub fn delta_e_94(&self, standard_xyz: [f64; 3], xyz: [f64; 3]) -> f64 {
        delta_e_94(self.lab(standard_xyz), self.lab(xyz))
    }
}
