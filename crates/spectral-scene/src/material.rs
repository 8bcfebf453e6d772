//! The kinds of materials there are, and how to make one.

use spectral_core::dispersion::Dispersion;

use crate::{Attenuation, Material};

/// Metal of this glTF roughness or more is matt, below it is a mirror.
pub const MIRROR_ROUGHNESS: f64 = 0.25;

impl Material {
    /// An opaque, rough surface of the given linear sRGB reflectance.
    pub fn matt(name: &str, base_color: [f64; 3]) -> Self {
        Self {
            name: name.into(),
            base_color,
            metallic: 0.0,
            roughness: 1.0,
            transmission: 0.0,
            dispersion: Dispersion::Constant { n: 1.5 },
            attenuation: None,
            thickness_m: 0.0,
            iridescence: None,
            emissive: [0.0; 3],
            double_sided: false,
        }
    }

    /// Clear, smooth glass.
    pub fn glass(name: &str, dispersion: Dispersion) -> Self {
        Self { roughness: 0.0, transmission: 1.0, dispersion, ..Self::matt(name, [1.0; 3]) }
    }

    /// Polished metal of the given linear sRGB reflectance at normal incidence.
    pub fn mirror(name: &str, base_color: [f64; 3]) -> Self {
        Self { metallic: 1.0, roughness: 0.0, ..Self::matt(name, base_color) }
    }

    /// This glass, but leaving `color` (linear sRGB) of white light after `distance_m`.
    #[must_use]
    pub fn attenuating(self, color: [f64; 3], distance_m: f64) -> Self {
        Self { attenuation: Some(Attenuation { color, distance_m }), ..self }
    }

    /// Light passes through: `transmission` is above 0.
    pub fn is_refractor(&self) -> bool {
        self.transmission > 0.0
    }

    /// Opaque and metal: glTF's metallicFactor is above one half. There is nothing between metal and not metal here.
    pub fn is_metal(&self) -> bool {
        self.metallic > 0.5 && !self.is_refractor()
    }

    /// Metal of roughness below [`MIRROR_ROUGHNESS`]: a mirror on both of its sides.
    ///
    /// It reflects specularly, as if perfectly smooth, by Schlick's approximation of Fresnel's equations as glTF 2.0 has
    /// it (appendix B.3.4): F = F0 + (1 - F0) (1 - cos)^5, F0 being the base colour at the wavelength; the rest is
    /// absorbed. It has no diffuse part: light does not land on it, and it shows what it reflects. Rougher metal is matt.
    pub fn is_mirror(&self) -> bool {
        self.is_metal() && self.roughness < MIRROR_ROUGHNESS
    }
}
