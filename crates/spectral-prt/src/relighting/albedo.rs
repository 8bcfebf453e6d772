//! What surfaces reflect, in the coefficients that frames multiply irradiance with.

use spectral_core::basis::SpectralBasis;
use spectral_core::grid::SpectralGrid;
use spectral_core::observer::Observer;
use spectral_core::patch::{rgb_albedo, rgb_light, sampled_xyz};

use super::error::RelightingError;
use crate::bounces::SpectralTransfer;

/// Coefficients of an albedo, three each: for every function g_q of transfer those of R g_q in the spectral basis. Transfer
/// without interreflection has one function, 1.
pub type AlbedoTerms = Vec<Vec<[f64; 3]>>;

/// From spectra to coefficients.
#[derive(Clone, Copy, Debug)]
pub enum Projection<'a> {
    /// Of a spectral basis, for transfer without interreflection.
    Spectral(&'a SpectralBasis),
    /// Of a spectral basis, for transfer with interreflection.
    Bounced(&'a SpectralBasis, &'a SpectralTransfer),
    /// Linear sRGB in place of a basis: RGB transfer, for comparison. Three coefficients.
    Rgb(SpectralGrid, Observer),
    /// No basis, but every wavelength of the grid (Schwenk et al. 2010, eq. 3): what the others are compared with. As many
    /// coefficients as wavelengths.
    Sampled(SpectralGrid, Observer),
}

impl Projection<'_> {
    /// The wavelengths that spectra are sampled at.
    pub fn grid(&self) -> &SpectralGrid {
        match self {
            Self::Spectral(basis) | Self::Bounced(basis, _) => basis.grid(),
            Self::Rgb(grid, _) | Self::Sampled(grid, _) => grid,
        }
    }

    /// Whose eyes.
    pub fn observer(&self) -> Observer {
        match self {
            Self::Spectral(basis) | Self::Bounced(basis, _) => basis.observer(),
            Self::Rgb(_, observer) | Self::Sampled(_, observer) => *observer,
        }
    }

    /// Coefficients of a light.
    pub fn coefficients(&self) -> usize {
        match self {
            Self::Spectral(basis) | Self::Bounced(basis, _) => basis.coefficients(),
            Self::Rgb(..) => 3,
            Self::Sampled(grid, _) => grid.samples(),
        }
    }

    /// Functions of the wavelength that transfer has.
    pub fn functions(&self) -> usize {
        if let Self::Bounced(_, transfer) = self { transfer.functions().len() } else { 1 }
    }

    /// A light's coefficients, for [`crate::Sky`].
    ///
    /// # Panics
    /// If `light` has not one value per wavelength of the grid.
    pub fn light(&self, light: &[f64]) -> Vec<f64> {
        match self {
            Self::Spectral(basis) | Self::Bounced(basis, _) => basis.light_coefficients(light),
            Self::Rgb(grid, observer) => rgb_light(grid, *observer, light).to_vec(),
            Self::Sampled(grid, _) => {
                assert_eq!(light.len(), grid.samples(), "a light on another grid");
                light.to_vec()
            }
        }
    }

    /// An albedo's coefficients.
    ///
    /// # Panics
    /// If `reflectance` has not one value per wavelength of the grid, or basis and transfer are on two grids.
    pub fn albedo(&self, reflectance: &[f64]) -> AlbedoTerms {
        match self {
            Self::Bounced(basis, transfer) => transfer.albedo_coefficients(basis, reflectance),
            _ => vec![self.plain_albedo(reflectance)],
        }
    }

    /// XYZ of a flat patch under a light, in the light's unit times nm: what a frame shows of it under an even sky, where
    /// nothing else is near.
    ///
    /// # Panics
    /// If a spectrum has not one value per wavelength of the grid.
    pub fn seen(&self, reflectance: &[f64], light: &[f64]) -> [f64; 3] {
        SpectralBasis::xyz(&self.plain_albedo(reflectance), &self.light(light))
    }

    /// An albedo's coefficients for light straight from the sky.
    fn plain_albedo(&self, reflectance: &[f64]) -> Vec<[f64; 3]> {
        match self {
            Self::Spectral(basis) | Self::Bounced(basis, _) => basis.albedo_coefficients(reflectance),
            Self::Rgb(grid, observer) => rgb_albedo(grid, *observer, reflectance),
            Self::Sampled(grid, observer) => sampled_albedo(grid, *observer, reflectance),
        }
    }
}

/// XYZ of a reflectance at each wavelength under light of unit power there.
fn sampled_albedo(grid: &SpectralGrid, observer: Observer, reflectance: &[f64]) -> Vec<[f64; 3]> {
    assert_eq!(reflectance.len(), grid.samples(), "a reflectance on another grid");
    let at = |(i, r): (usize, &f64)| observer.xyz_bar(grid.lambda_nm(i)).map(|bar| bar * r * grid.step_nm());
    reflectance.iter().enumerate().map(at).collect()
}

/// Albedos by their indices: what index maps name.
#[derive(Clone, Debug, PartialEq)]
pub struct Palette {
    pub(super) functions: usize,
    pub(super) coefficients: usize,
    pub(super) entries: Vec<AlbedoTerms>,
}

impl Palette {
    /// One entry for each reflectance, in their order.
    ///
    /// # Panics
    /// As [`Projection::albedo`].
    pub fn new(projection: &Projection<'_>, reflectances: &[Vec<f64>]) -> Self {
        Self {
            functions: projection.functions(),
            coefficients: projection.coefficients(),
            entries: reflectances.iter().map(|r| projection.albedo(r)).collect(),
        }
    }

    /// Exact under one light: each reflectance's XYZ by sampling. A sky in this palette has one coefficient, its
    /// radiance as a multiple of `light`.
    ///
    /// # Panics
    /// If a spectrum has not one value per wavelength of the grid.
    pub fn sampled(
        grid: &SpectralGrid,
        observer: Observer,
        light: &[f64],
        reflectances: &[Vec<f64>],
    ) -> Self {
        let entry = |r: &Vec<f64>| vec![vec![sampled_xyz(grid, observer, r, light)]];
        Self { functions: 1, coefficients: 1, entries: reflectances.iter().map(entry).collect() }
    }

    /// And what the lobe of each entry reflects, 0 to 1; 0 at all wavelengths where it has none.
    ///
    /// # Panics
    /// If there is not one for each entry, or the projection has another number of coefficients than the palette's; as [`Projection::albedo`].
    #[must_use]
    pub fn with_gloss(mut self, projection: &Projection<'_>, reflectances: &[Vec<f64>]) -> Self {
        assert_eq!(reflectances.len(), self.len(), "reflectances of lobes for other entries");
        assert_eq!(projection.coefficients(), self.coefficients, "another projection than the palette's");
        for (entry, reflectance) in self.entries.iter_mut().zip(reflectances) {
            entry.extend(projection.albedo(reflectance));
        }
        self.functions += projection.functions();
        self
    }

    /// How many albedos there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// A map of entries of a palette over texture coordinates. The nearest texel counts: there is nothing between two paints.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexMap {
    pub(super) size: [u32; 2],
    pub(super) entries: Vec<u32>,
}

impl IndexMap {
    /// A map of `size` columns and rows, row after row from v = 0.
    ///
    /// # Errors
    /// [`RelightingError::MapSize`] without texels, and for another number of them.
    pub fn new(size: [u32; 2], entries: Vec<u32>) -> Result<Self, RelightingError> {
        check_texels(size, entries.len())?;
        Ok(Self { size, entries })
    }

    /// The entry at texture coordinates, which go on beyond 0..1.
    pub fn nearest(&self, uv: [f64; 2]) -> u32 {
        let texel = |axis: usize| {
            let texels = self.size[axis];
            // Rounding may take a fraction to 1.
            ((uv[axis].rem_euclid(1.0) * f64::from(texels)) as u32).min(texels - 1)
        };
        self.entries[(texel(1) * self.size[0] + texel(0)) as usize]
    }
}

/// A map with a spectrum of its own at every texel, linear between them.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectralMap {
    pub(super) size: [u32; 2],
    pub(super) functions: usize,
    pub(super) coefficients: usize,
    /// Different albedos.
    pub(super) albedos: Vec<AlbedoTerms>,
    /// Which of them each texel has.
    pub(super) texels: Vec<u32>,
}

impl SpectralMap {
    /// A map of `size` columns and rows, row after row from v = 0; each texel has one of `reflectances`.
    ///
    /// # Errors
    /// [`RelightingError::MapSize`] without texels, and for another number of them; [`RelightingError::NoSuch`] for a texel
    /// without reflectance.
    ///
    /// # Panics
    /// As [`Projection::albedo`].
    pub fn new(
        projection: &Projection<'_>,
        size: [u32; 2],
        texels: Vec<u32>,
        reflectances: &[Vec<f64>],
    ) -> Result<Self, RelightingError> {
        check_texels(size, texels.len())?;
        check_entries("a texel", &texels, "reflectance", reflectances.len())?;
        let Palette { functions, coefficients, entries } = Palette::new(projection, reflectances);
        Ok(Self { size, functions, coefficients, albedos: entries, texels })
    }

    /// And what the lobe reflects, 0 to 1, everywhere the same.
    ///
    /// # Panics
    /// If the projection has another number of coefficients than the map's; as [`Projection::albedo`].
    #[must_use]
    pub fn with_gloss(mut self, projection: &Projection<'_>, reflectance: &[f64]) -> Self {
        assert_eq!(projection.coefficients(), self.coefficients, "another projection than the map's");
        for albedo in &mut self.albedos {
            albedo.extend(projection.albedo(reflectance));
        }
        self.functions += projection.functions();
        self
    }
}

/// What a surface reflects. Texture coordinates are one pair per vertex of the [`crate::Surface`] (see
/// [`crate::Surface::gather`]); v = 0 is the first row, and maps go on beyond 0..1.
#[derive(Clone, Debug, PartialEq)]
pub enum Albedo {
    /// The same everywhere: an entry of the palette.
    Entry(u32),
    /// Entries of the palette by an index map.
    Indexed {
        /// Which of [`super::RelitScene::index_maps`].
        map: usize,
        /// Texture coordinates.
        uvs: Vec<[f32; 2]>,
    },
    /// A spectral map.
    Mapped {
        /// Which of [`super::RelitScene::spectral_maps`].
        map: usize,
        /// Texture coordinates.
        uvs: Vec<[f32; 2]>,
    },
}

fn check_texels(size: [u32; 2], texels: usize) -> Result<(), RelightingError> {
    let expected = u64::from(size[0]) * u64::from(size[1]);
    if expected > 0 && expected == texels as u64 {
        Ok(())
    } else {
        Err(RelightingError::MapSize { size, texels })
    }
}

/// Every index is below `count`.
pub(super) fn check_entries(
    by: &str,
    entries: &[u32],
    what: &'static str,
    count: usize,
) -> Result<(), RelightingError> {
    match entries.iter().find(|&&entry| entry as usize >= count) {
        Some(&index) => Err(RelightingError::NoSuch { by: by.into(), what, index: index as usize, count }),
        None => Ok(()),
    }
}
