//! Wavelengths of every light, with the weights and materials that go with them.

use spectral_core::rgb::luminance;
use spectral_core::upsample::SmoothSpectrum;
use spectral_core::wavelengths::WavelengthSet;
use spectral_scene::{Effects, Light, Material, Scene};

use crate::passes::photon_trace::{Band, Optics};
use crate::shared::flux::WHOLE;
use crate::{PlanError, Settings};

/// d, the wavelength of glTF's index of refraction, nm.
pub(crate) const D_LINE_NM: f64 = 587.56;

/// Absorption that leaves nothing over any length that f32 tells from 0.
const OPAQUE_PER_UNIT: f64 = 1e20;

/// A light's wavelengths.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightBands {
    pub(crate) wavelengths_nm: Vec<f64>,
    /// XYZ lux (directional) or candela that each wavelength carries.
    pub(crate) weights_xyz: Vec<[f64; 3]>,
    /// What all of them, and what lies between, carry together.
    pub(crate) xyz: [f64; 3],
    /// The largest component of any weight, which a whole part stands for.
    pub(crate) largest: f64,
}

impl LightBands {
    pub(crate) fn new(light: &Light, settings: &Settings, one: bool) -> Result<Self, PlanError> {
        let strength = light.intensity * luminance(light.color);
        let unit_xyz = light.spectrum.unit_xyz(settings.observer);
        let (wavelengths_nm, unit_weights) = if let Some(line_nm) = light.spectrum.line_nm() {
            (vec![line_nm], vec![unit_xyz])
        } else if one || settings.wavelength_count() == 1 {
            (vec![D_LINE_NM], vec![unit_xyz])
        } else {
            let count = settings.wavelength_count() as usize;
            let set = WavelengthSet::new(settings.scheme(), count, settings.range_nm(), settings.observer)?;
            let weights = set.light_weights(&light.spectrum);
            (set.wavelengths_nm, weights)
        };
        let weights_xyz: Vec<_> = unit_weights.iter().map(|w| w.map(|c| c.max(0.0) * strength)).collect();
        let largest = weights_xyz.iter().flatten().copied().fold(0.0, f64::max);
        Ok(Self { wavelengths_nm, weights_xyz, xyz: unit_xyz.map(|c| c * strength), largest })
    }

    /// Weights as parts of the largest.
    pub(crate) fn bands(&self) -> impl Iterator<Item = Band> + '_ {
        self.weights_xyz.iter().map(|xyz| Band {
            weight: xyz.map(|c| (c / self.largest * f64::from(WHOLE)).round() as u32),
            reserved: 0,
        })
    }

    /// Materials at each wavelength: wavelength x material.
    pub(crate) fn optics<'a>(
        &'a self,
        materials: &'a [Glass],
        metres_per_unit: f64,
    ) -> impl Iterator<Item = Optics> + 'a {
        self.wavelengths_nm
            .iter()
            .flat_map(move |&nm| materials.iter().map(move |glass| glass.optics(nm, metres_per_unit)))
    }
}

/// Whether one wavelength stands for all: nothing in the scene treats two of them differently.
pub(crate) fn one_wavelength(scene: &Scene, effects: &Effects) -> bool {
    let tints = |m: &Material| m.is_refractor() && m.base_color.iter().any(|c| *c != m.base_color[0]);
    !effects.dispersion.on && !effects.absorption.on && !scene.materials.iter().any(tints)
}

/// A material as photons see it.
pub(crate) struct Glass<'a> {
    material: &'a Material,
    /// Transmittance over a distance in metres.
    attenuation: Option<(SmoothSpectrum, f64)>,
    color: SmoothSpectrum,
}

impl<'a> Glass<'a> {
    pub(crate) fn of(scene: &'a Scene) -> Vec<Self> {
        scene
            .materials
            .iter()
            .map(|material| Self {
                material,
                attenuation: material
                    .attenuation
                    .map(|a| (SmoothSpectrum::reflectance(a.color), a.distance_m)),
                color: SmoothSpectrum::reflectance(material.base_color),
            })
            .collect()
    }

    pub(crate) fn optics(&self, lambda_nm: f64, metres_per_unit: f64) -> Optics {
        if !self.material.is_refractor() {
            return Optics { index: 1.0, absorption: 0.0, surface: 1.0, reserved: 0.0 };
        }
        let absorption = self.attenuation.as_ref().map_or(0.0, |(color, distance_m)| {
            (-color.at(lambda_nm).ln() * metres_per_unit / distance_m).clamp(0.0, OPAQUE_PER_UNIT)
        });
        Optics {
            index: self.material.dispersion.ior(lambda_nm) as f32,
            absorption: absorption as f32,
            surface: (self.material.transmission * self.color.at(lambda_nm)) as f32,
            reserved: 0.0,
        }
    }
}
