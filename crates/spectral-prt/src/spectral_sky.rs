//! Distant light at every wavelength, before a basis.

use std::f64::consts::PI;

use glam::DVec3;
use spectral_core::grid::SpectralGrid;
use spectral_core::observer::Observer;
use spectral_core::patch::light_xyz;

use crate::bands::Bands;
use crate::equirectangular;
use crate::panorama::Panorama;
use crate::relighting::Projection;
use crate::resampling::{Resampling, WavelengthsError};
use crate::sh;
use crate::sky::Sky;
use crate::spectral_panorama::SpectralPanorama;
use crate::upsampled::Upsampled;

/// Light from far away on the wavelengths of a grid: for each harmonic coefficient its spectrum, L_k(lambda).
#[derive(Clone, Debug, PartialEq)]
pub struct SpectralSky {
    bands: Bands,
    grid: SpectralGrid,
    /// [`Bands::coefficients`] spectra.
    spectra: Vec<Vec<f64>>,
}

/// Why numbers are no shape in harmonics.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// No bands, or more than there are harmonics for.
    #[error("{got} bands of harmonics; 1 to {} are possible", Bands::MAX.count())]
    Bands {
        /// Bands there are.
        got: usize,
    },
    /// A band with too few or too many coefficients.
    #[error("band {band} has {got} coefficients; it has {}, of the orders -{band} to {band}", 2 * band + 1)]
    Coefficients {
        /// Which band, from 0.
        band: usize,
        /// Coefficients it has.
        got: usize,
    },
    /// An undefined or infinite coefficient.
    #[error("coefficient {index} of band {band} is {got}; it is finite")]
    Value {
        /// Which band, from 0.
        band: usize,
        /// Which coefficient of it, from 0.
        index: usize,
        /// What it is.
        got: f64,
    },
    /// As much is taken away as is given.
    #[error("the coefficient of band 0, the mean over all directions, is {got}; light has one above 0")]
    Dark {
        /// What it is.
        got: f64,
    },
}

/// The harmonic coefficients of a shape that is written down band by band, band l with 2 l + 1 coefficients of the orders -l to l
/// (see [`crate::sh`]). Bands beyond `bands` are left out, missing ones are 0.
///
/// # Errors
/// [`ShapeError`].
pub fn shape_of_bands(bands: Bands, written: &[Vec<f64>]) -> Result<Vec<f64>, ShapeError> {
    if !(1..=Bands::MAX.count()).contains(&written.len()) {
        return Err(ShapeError::Bands { got: written.len() });
    }
    for (band, coefficients) in written.iter().enumerate() {
        if coefficients.len() != 2 * band + 1 {
            return Err(ShapeError::Coefficients { band, got: coefficients.len() });
        }
        if let Some(index) = coefficients.iter().position(|c| !c.is_finite()) {
            return Err(ShapeError::Value { band, index, got: coefficients[index] });
        }
    }
    let mean = written[0][0];
    if mean <= 0.0 {
        return Err(ShapeError::Dark { got: mean });
    }
    let mut shape = written.concat();
    shape.resize(bands.coefficients(), 0.0);
    Ok(shape)
}

impl SpectralSky {
    /// The same light from all directions; `light` is its radiance on the grid.
    ///
    /// # Panics
    /// If it has not one value per wavelength.
    pub fn even(bands: Bands, grid: SpectralGrid, light: &[f64]) -> Self {
        let mut shape = vec![0.0; bands.coefficients()];
        shape[0] = 2.0 * PI.sqrt();
        Self::of_shape(bands, grid, &shape, light)
    }

    /// One spectrum whose strength varies as the function with the harmonic coefficients `shape`.
    ///
    /// # Panics
    /// If `shape` has not [`Bands::coefficients`] numbers, or `light` not one value per wavelength.
    pub fn of_shape(bands: Bands, grid: SpectralGrid, shape: &[f64], light: &[f64]) -> Self {
        assert_eq!(shape.len(), bands.coefficients(), "a shape of another number of bands");
        assert_eq!(light.len(), grid.samples(), "a light on another grid");
        let spectra = shape.iter().map(|s| light.iter().map(|l| s * l).collect()).collect();
        Self { bands, grid, spectra }
    }

    /// The surroundings of a picture, each texel as D65 times the smooth spectrum of its colour; white has Y = 1.
    pub fn from_panorama(bands: Bands, grid: SpectralGrid, observer: Observer, panorama: &Panorama) -> Self {
        let table = Upsampled::new(&grid, observer);
        let texels = panorama.linear_srgb();
        let by_wavelength =
            equirectangular::projected(bands, panorama.size(), grid.samples(), |texel, spectrum| {
                table.add(texels[texel].map(f64::from), spectrum);
            });
        Self { bands, grid, spectra: (0..bands.coefficients()).map(|k| column(&by_wavelength, k)).collect() }
    }

    /// The surroundings of a picture with spectra, in its unit, brought to the grid as [`Resampling`] does.
    ///
    /// # Errors
    /// [`WavelengthsError`] for a picture that leaves out a part of the grid.
    pub fn from_spectral_panorama(
        bands: Bands,
        grid: SpectralGrid,
        panorama: &SpectralPanorama,
    ) -> Result<Self, WavelengthsError> {
        let resampling = Resampling::new(panorama.wavelengths_nm(), &grid)?;
        let channels = panorama.channels();
        let by_channel =
            equirectangular::projected(bands, panorama.size(), channels.len(), |texel, values| {
                values.iter_mut().zip(channels).for_each(|(value, channel)| *value = channel[texel].into());
            });
        let spectrum = |k| resampling.apply(&column(&by_channel, k));
        Ok(Self { bands, grid, spectra: (0..bands.coefficients()).map(spectrum).collect() })
    }

    /// Both at once.
    ///
    /// # Panics
    /// If they have another number of bands or another grid.
    pub fn plus(mut self, other: &Self) -> Self {
        assert_eq!((self.bands, self.grid), (other.bands, other.grid), "skies of two kinds");
        for (sum, more) in self.spectra.iter_mut().zip(&other.spectra) {
            sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
        self
    }

    /// Light of one spectrum, which has luminance, distributed as the luminance is here.
    ///
    /// # Panics
    /// If `light` has not one value per wavelength.
    pub fn in_light(&self, observer: Observer, light: &[f64]) -> Self {
        let luminance = |spectrum: &Vec<f64>| light_xyz(&self.grid, observer, spectrum)[1];
        let shape: Vec<f64> = self.spectra.iter().map(luminance).collect();
        let unit = luminance(&light.to_vec());
        let light: Vec<f64> = light.iter().map(|l| l / unit).collect();
        Self::of_shape(self.bands, self.grid, &shape, &light)
    }

    /// The mean radiance over all directions: what an adapted eye calls white.
    pub fn mean(&self) -> Vec<f64> {
        self.spectra[0].iter().map(|l| l / (2.0 * PI.sqrt())).collect()
    }

    /// The radiance from a unit direction, as far as the bands have it: near strong light it may be negative.
    pub fn radiance(&self, direction: DVec3) -> Vec<f64> {
        let harmonics = sh::harmonics(self.bands, direction);
        let at = |i: usize| self.spectra.iter().zip(&harmonics).map(|(l, y)| l[i] * y).sum();
        (0..self.grid.samples()).map(at).collect()
    }

    /// XYZ of radiance: of each harmonic coefficient, in the light's unit times nm.
    pub fn xyz(&self, observer: Observer) -> Vec<[f64; 3]> {
        self.spectra.iter().map(|spectrum| light_xyz(&self.grid, observer, spectrum)).collect()
    }

    /// Bands of spherical harmonics.
    pub fn bands(&self) -> Bands {
        self.bands
    }

    /// In the coefficients of a frame.
    ///
    /// # Panics
    /// If the projection is on another grid.
    pub fn projected(&self, projection: &Projection<'_>) -> Sky {
        assert_eq!(projection.grid(), &self.grid, "a projection on another grid");
        let by_harmonic: Vec<Vec<f64>> = self.spectra.iter().map(|l| projection.light(l)).collect();
        Sky::of_light(self.bands, (0..projection.coefficients()).map(|j| column(&by_harmonic, j)).collect())
    }
}

fn column(rows: &[Vec<f64>], at: usize) -> Vec<f64> {
    rows.iter().map(|row| row[at]).collect()
}
