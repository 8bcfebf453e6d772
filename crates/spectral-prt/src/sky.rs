//! Distant light, in spherical harmonics and a spectral basis, and what it does to surfaces.

use std::f64::consts::PI;

use glam::DVec3;
use spectral_core::basis::SpectralBasis;

use crate::bands::Bands;
use crate::bounces::SpectralTransfer;
use crate::equirectangular;
use crate::gloss::GlossTransfer;
use crate::panorama::Panorama;
use crate::sh::ShRotation;
use crate::transfer::Transfer;

/// Light from far away: for each coefficient of a spectral basis, the coefficients of its directions.
///
/// That is L_jk of Schwenk et al. 2010, eq. 5. With linear sRGB in place of a basis, three coefficients, the very same
/// frame is classical RGB transfer: see [`Sky::rgb_from_panorama`] and [`spectral_core::patch::rgb_albedo`].
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    bands: Bands,
    /// One list of [`Bands::coefficients`] numbers for each spectral coefficient.
    light: Vec<Vec<f64>>,
}

impl Sky {
    /// The same light from all directions: `light` has the spectral coefficients of its radiance.
    pub fn even(bands: Bands, light: &[f64]) -> Self {
        let mut shape = vec![0.0; bands.coefficients()];
        shape[0] = 2.0 * PI.sqrt();
        Self::of_shape(bands, &shape, light)
    }

    /// One spectrum, `light`, whose strength varies as the function with the harmonic coefficients `shape`.
    ///
    /// # Panics
    /// If `shape` has not [`Bands::coefficients`] numbers.
    pub fn of_shape(bands: Bands, shape: &[f64], light: &[f64]) -> Self {
        assert_eq!(shape.len(), bands.coefficients(), "a shape of another number of bands");
        Self { bands, light: light.iter().map(|l| shape.iter().map(|s| s * l).collect()).collect() }
    }

    /// The surroundings of a picture in linear sRGB: three spectral coefficients.
    pub fn rgb_from_panorama(bands: Bands, panorama: &Panorama) -> Self {
        let texels = panorama.linear_srgb();
        let light = equirectangular::projected(bands, panorama.size(), 3, |texel, value| {
            value.copy_from_slice(&texels[texel].map(f64::from));
        });
        Self { bands, light }
    }

    /// Any light: for each spectral coefficient the harmonic coefficients.
    pub(crate) fn of_light(bands: Bands, light: Vec<Vec<f64>>) -> Self {
        Self { bands, light }
    }

    /// Bands of spherical harmonics.
    pub fn bands(&self) -> Bands {
        self.bands
    }

    /// For each spectral coefficient the harmonic coefficients.
    pub fn light(&self) -> &[Vec<f64>] {
        &self.light
    }

    /// The surroundings turned.
    ///
    /// # Panics
    /// If the rotation is of another number of bands.
    pub fn rotated(&self, rotation: &ShRotation) -> Self {
        Self { bands: self.bands, light: self.light.iter().map(|l| rotation.rotate(l)).collect() }
    }

    /// XYZ of the radiance of a surface's vertices: `albedo` has its coefficients in the sky's basis.
    ///
    /// Few bands ring: opposite to strong light Y may be slightly negative. Only the display clamps.
    ///
    /// # Panics
    /// If there is no such surface, or the transfer has another number of bands.
    pub fn radiance_xyz(&self, transfer: &Transfer, surface: usize, albedo: &[[f64; 3]]) -> Vec<[f64; 3]> {
        assert_eq!(transfer.bands(), self.bands, "transfer of another number of bands");
        let n = self.bands.coefficients();
        let vertices = transfer.surface(surface).chunks_exact(n);
        vertices.map(|t| SpectralBasis::xyz(albedo, &self.irradiance(t)).map(|v| v / PI)).collect()
    }

    /// The same with interreflection: `albedo` is of [`SpectralTransfer::albedo_coefficients`].
    ///
    /// # Panics
    /// As [`Sky::radiance_xyz`].
    pub fn bounced_radiance_xyz(
        &self,
        transfer: &SpectralTransfer,
        surface: usize,
        albedo: &[Vec<[f64; 3]>],
    ) -> Vec<[f64; 3]> {
        assert_eq!(transfer.bands(), self.bands, "transfer of another number of bands");
        let n = self.bands.coefficients();
        let vertex = |t: &[f32]| {
            let functions = t.chunks_exact(n).zip(albedo);
            functions.fold([0.0; 3], |sum, (t, albedo)| {
                let xyz = SpectralBasis::xyz(albedo, &self.irradiance(t));
                [0, 1, 2].map(|c| sum[c] + xyz[c] / PI)
            })
        };
        transfer.surface(surface).chunks_exact(n * albedo.len()).map(vertex).collect()
    }

    /// XYZ that the lobe of a vertex adds, `mirrored` being the mirrored direction of the view and `albedo` the coefficients of what
    /// the lobe reflects, for each function of the gloss.
    ///
    /// # Panics
    /// As [`GlossTransfer::toward`], or if the gloss has another number of bands.
    pub fn gloss_xyz(
        &self,
        gloss: &GlossTransfer,
        (surface, vertex): (usize, usize),
        mirrored: DVec3,
        albedo: &[Vec<[f64; 3]>],
    ) -> [f64; 3] {
        assert_eq!(gloss.bands(), self.bands, "gloss of another number of bands");
        assert_eq!(gloss.functions(), albedo.len(), "gloss of another number of functions");
        let functions = gloss.toward(surface, vertex, mirrored).into_iter().zip(albedo);
        functions.fold([0.0; 3], |sum, (toward, albedo)| {
            let of = |light: &Vec<f64>| toward.iter().zip(light).map(|(t, l)| t * l).sum();
            let xyz = SpectralBasis::xyz(albedo, &self.light.iter().map(of).collect::<Vec<f64>>());
            [0, 1, 2].map(|c| sum[c] + xyz[c])
        })
    }

    /// E_j = sum_k T_k L_jk.
    fn irradiance(&self, transfer: &[f32]) -> Vec<f64> {
        let sum = |light: &Vec<f64>| transfer.iter().zip(light).map(|(t, l)| f64::from(*t) * l).sum();
        self.light.iter().map(sum).collect()
    }
}
