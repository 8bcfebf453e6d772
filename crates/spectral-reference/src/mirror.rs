//! Polished metal.

use spectral_core::upsample::SmoothSpectrum;
use spectral_scene::Material;

/// A mirror as the tracer needs it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mirror {
    /// F0, the reflectance at normal incidence.
    f0: SmoothSpectrum,
    /// F0 depends on the wavelength.
    pub(crate) colored: bool,
}

impl Mirror {
    /// `None` for anything but a mirror.
    pub(crate) fn new(material: &Material) -> Option<Self> {
        let [r, g, b] = material.base_color;
        let f0 = SmoothSpectrum::reflectance(material.base_color);
        material.is_mirror().then_some(Self { f0, colored: r != g || g != b })
    }

    /// F0 + (1 - F0) (1 - cos_i)^5: Schlick 1994, equation 15, as glTF 2.0, appendix B.3.4, has it for metals.
    pub(crate) fn reflectance(&self, lambda_nm: f64, cos_i: f64) -> f64 {
        let f0 = self.f0.at(lambda_nm);
        f0 + (1.0 - f0) * (1.0 - cos_i.clamp(0.0, 1.0)).powi(5)
    }
}
