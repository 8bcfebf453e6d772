//! What light is in: refractive index, absorption, and the rule for nested and overlapping glass.

use spectral_core::dispersion::Dispersion;
use spectral_core::upsample::SmoothSpectrum;
use spectral_scene::Material;

/// A refracting material as the tracer needs it.
#[derive(Clone, Debug)]
pub(crate) struct Medium {
    dispersion: Dispersion,
    /// Wavelengths take different ways from here on.
    pub(crate) dispersive: bool,
    /// Transmittance over a distance in metres.
    attenuation: Option<(SmoothSpectrum, f64)>,
    /// Share of refracted light that the surface lets pass, before its colour.
    surface_share: f64,
    surface_color: SmoothSpectrum,
}

impl Medium {
    pub(crate) fn new(material: &Material) -> Self {
        Self {
            dispersive: material.dispersion.is_dispersive(),
            dispersion: material.dispersion.clone(),
            attenuation: material.attenuation.map(|a| (SmoothSpectrum::reflectance(a.color), a.distance_m)),
            surface_share: material.transmission,
            surface_color: SmoothSpectrum::reflectance(material.base_color),
        }
    }

    pub(crate) fn ior(&self, lambda_nm: f64) -> f64 {
        self.dispersion.ior(lambda_nm)
    }

    /// Beer-Lambert: what is left after a way of `length_m`. A power, so that black glass of no thickness is clear
    /// instead of 0 times infinity.
    pub(crate) fn transmittance(&self, lambda_nm: f64, length_m: f64) -> f64 {
        match &self.attenuation {
            Some((color, distance_m)) => color.at(lambda_nm).powf(length_m / distance_m),
            None => 1.0,
        }
    }

    pub(crate) fn absorbs(&self) -> bool {
        self.attenuation.is_some()
    }

    /// The surface itself takes something.
    pub(crate) fn tints(&self) -> bool {
        self.surface_share != 1.0 || self.surface_color != SmoothSpectrum::ONE
    }

    /// Share of refracted light that survives one passage of the surface: glTF's transmission factor times base
    /// colour. The rest counts as absorbed.
    pub(crate) fn surface_transmittance(&self, lambda_nm: f64) -> f64 {
        self.surface_share * self.surface_color.at(lambda_nm)
    }
}

/// How many refractors may contain one point.
const MAX_NESTED: usize = 6;

/// The refractors that a path is inside of, in the order of entry.
///
/// The medium is the one entered last among those not left yet. A body inside another thus acts as one would think,
/// and where two overlap the later one fills the overlap: leaving the earlier there is no interface. A surface may be
/// entered more often than once (a mesh that overlaps itself) and must be left as often.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Nesting {
    objects: [u32; MAX_NESTED],
    len: u8,
}

impl Nesting {
    /// The object whose medium this is; `None` is vacuum.
    pub(crate) fn medium(&self) -> Option<u32> {
        self.objects[..usize::from(self.len)].last().copied()
    }

    pub(crate) fn contains(&self, object: u32) -> bool {
        self.objects[..usize::from(self.len)].contains(&object)
    }

    /// After crossing into `object`; `None` if that is too deep.
    pub(crate) fn entered(mut self, object: u32) -> Option<Self> {
        *self.objects.get_mut(usize::from(self.len))? = object;
        self.len += 1;
        Some(self)
    }

    /// After crossing out of `object`; unchanged if it was never entered.
    pub(crate) fn left(mut self, object: u32) -> Self {
        let len = usize::from(self.len);
        if let Some(at) = self.objects[..len].iter().rposition(|&o| o == object) {
            self.objects.copy_within(at + 1..len, at);
            self.len -= 1;
            self.objects[usize::from(self.len)] = 0;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_entered_is_the_medium() {
        let outer = Nesting::default().entered(7).unwrap();
        let inner = outer.entered(3).unwrap();
        assert_eq!(inner.medium(), Some(3));
        assert_eq!(inner.left(3), outer);
        // An overlap: leaving the first entered does not change the medium.
        assert_eq!(inner.left(7).medium(), Some(3));
        assert_eq!(inner.left(7).left(3), Nesting::default());
        assert_eq!(outer.left(99), outer);
    }

    #[test]
    fn too_deep_is_none() {
        let mut nesting = Nesting::default();
        for object in 0..MAX_NESTED as u32 {
            nesting = nesting.entered(object).unwrap();
        }
        assert_eq!(nesting.entered(9), None);
    }
}
