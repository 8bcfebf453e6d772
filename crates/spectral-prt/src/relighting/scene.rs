//! What is relit: surfaces, their transfer and their albedos.

use super::albedo::{Albedo, IndexMap, Palette, SpectralMap, check_entries};
use super::error::RelightingError;
use crate::bands::Bands;
use crate::bounces::SpectralTransfer;
use crate::gloss::GlossTransfer;
use crate::surface::Surface;
use crate::transfer::Transfer;

/// Transfer of all surfaces.
#[derive(Clone, Copy, Debug)]
pub enum SceneTransfer<'a> {
    /// Light of the sky, shadowed: achromatic.
    Direct(&'a Transfer),
    /// And what surfaces throw on each other.
    Bounced(&'a SpectralTransfer),
}

impl SceneTransfer<'_> {
    /// Bands of spherical harmonics.
    pub fn bands(&self) -> Bands {
        match self {
            Self::Direct(transfer) => transfer.bands(),
            Self::Bounced(transfer) => transfer.bands(),
        }
    }

    /// Functions of the wavelength.
    pub(super) fn functions(&self) -> usize {
        match self {
            Self::Direct(_) => 1,
            Self::Bounced(transfer) => transfer.functions().len(),
        }
    }

    /// Vertices of each surface.
    pub(super) fn vertices(&self) -> &[usize] {
        match self {
            Self::Direct(transfer) => &transfer.vertices,
            Self::Bounced(transfer) => &transfer.vertices,
        }
    }

    /// Surface after surface, vertex after vertex, function after function.
    pub(super) fn coefficients(&self) -> &[f32] {
        match self {
            Self::Direct(transfer) => &transfer.coefficients,
            Self::Bounced(transfer) => &transfer.coefficients,
        }
    }
}

/// What is relit. Everything that is the same in all frames.
#[derive(Clone, Copy, Debug)]
pub struct RelitScene<'a> {
    /// The surfaces that transfer was computed for.
    pub surfaces: &'a [Surface],
    /// Their transfer.
    pub transfer: SceneTransfer<'a>,
    /// What shines, under as many bands of light as there are in the transfer, and with as many functions; albedos then have those of
    /// [`Palette::with_gloss`] too.
    pub gloss: Option<&'a GlossTransfer>,
    /// Albedos that surfaces and index maps name.
    pub palette: &'a Palette,
    /// Maps into the palette.
    pub index_maps: &'a [IndexMap],
    /// Maps with a spectrum at every texel; all have one size.
    pub spectral_maps: &'a [SpectralMap],
    /// What each surface reflects.
    pub albedos: &'a [Albedo],
}

impl RelitScene<'_> {
    /// Coefficients of lights.
    pub(super) fn coefficients(&self) -> usize {
        self.palette.coefficients
    }

    /// Functions of albedos: those of transfer, and of gloss.
    pub(super) fn functions(&self) -> usize {
        self.transfer.functions() + self.gloss.map_or(0, GlossTransfer::functions)
    }

    /// Whether everything fits together.
    pub(super) fn check(&self) -> Result<(), RelightingError> {
        let surfaces = self.surfaces.len();
        if surfaces == 0 {
            return Err(RelightingError::NoSurfaces);
        }
        for (what, got) in [("transfers", self.transfer.vertices().len()), ("albedos", self.albedos.len())] {
            if got != surfaces {
                return Err(RelightingError::SurfaceCount { what, got, surfaces });
            }
        }
        for (surface, (of, &got)) in self.surfaces.iter().zip(self.transfer.vertices()).enumerate() {
            let vertices = of.positions().len();
            if got != vertices {
                return Err(RelightingError::VertexCount { surface, what: "transfers", got, vertices });
            }
        }
        if let Some(gloss) = self.gloss {
            if gloss.vertices() != self.transfer.vertices() {
                return Err(RelightingError::OtherGloss);
            }
            let transfer = &self.transfer;
            for (got, unit, expected) in [
                (gloss.bands().count(), "bands of harmonics", transfer.bands().count()),
                (gloss.functions(), "functions of the wavelength", transfer.functions()),
            ] {
                if got != expected {
                    let (what, with) = ("gloss", "the transfer");
                    return Err(RelightingError::Mismatch { what, got, unit, with, expected });
                }
            }
        }
        self.check_terms("the palette", self.palette.functions, self.palette.coefficients)?;
        for (map, indices) in self.index_maps.iter().enumerate() {
            let by = format!("index map {map}");
            check_entries(&by, &indices.entries, "entry of the palette", self.palette.len())?;
        }
        for (map, spectral) in self.spectral_maps.iter().enumerate() {
            self.check_terms("a spectral map", spectral.functions, spectral.coefficients)?;
            let expected = self.spectral_maps[0].size;
            if spectral.size != expected {
                return Err(RelightingError::MapSizes { map, got: spectral.size, expected });
            }
        }
        self.albedos.iter().enumerate().try_for_each(|(surface, albedo)| self.check_albedo(surface, albedo))
    }

    fn check_terms(
        &self,
        what: &'static str,
        functions: usize,
        coefficients: usize,
    ) -> Result<(), RelightingError> {
        let with = if self.gloss.is_some() { "the transfer with gloss" } else { "the transfer" };
        for (got, unit, with, expected) in [
            (functions, "functions of the wavelength", with, self.functions()),
            (coefficients, "spectral coefficients", "the palette", self.coefficients()),
        ] {
            if got != expected {
                return Err(RelightingError::Mismatch { what, got, unit, with, expected });
            }
        }
        Ok(())
    }

    fn check_albedo(&self, surface: usize, albedo: &Albedo) -> Result<(), RelightingError> {
        let by = || format!("surface {surface}");
        let (what, map, count, uvs) = match albedo {
            Albedo::Entry(entry) => {
                return check_entries(&by(), &[*entry], "entry of the palette", self.palette.len());
            }
            Albedo::Indexed { map, uvs } => ("index map", *map, self.index_maps.len(), uvs),
            Albedo::Mapped { map, uvs } => ("spectral map", *map, self.spectral_maps.len(), uvs),
        };
        if map >= count {
            return Err(RelightingError::NoSuch { by: by(), what, index: map, count });
        }
        let vertices = self.surfaces[surface].positions().len();
        if uvs.len() != vertices {
            let (what, got) = ("texture coordinates", uvs.len());
            return Err(RelightingError::VertexCount { surface, what, got, vertices });
        }
        let expected = "finite, as all texture coordinates";
        match uvs.as_flattened().iter().find(|v| !v.is_finite()) {
            Some(&got) => {
                Err(RelightingError::Value { what: "a texture coordinate", got: got.into(), expected })
            }
            None => Ok(()),
        }
    }
}
