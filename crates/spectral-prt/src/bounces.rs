//! Interreflection: what surfaces throw on each other.

use std::convert::Infallible;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spectral_core::basis::SpectralBasis;
use spectral_core::grid::SpectralGrid;

use crate::bands::Bands;
use crate::error::PrtError;
use crate::hemisphere::Directions;
use crate::reflected::ReflectedSpectra;
use crate::surface::Surface;
use crate::transfer::{Point, Transfer, TransferSettings, Work};

/// The most bounces that are followed.
const MAX_BOUNCES: u32 = 256;

/// How interreflection is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BounceSettings {
    /// Rays per vertex and bounce, 1 to 2^20.
    pub rays: u32,
    /// Reflections followed, 0 to 256.
    pub bounces: u32,
}

/// Transfer with interreflection. It has a colour, since every reflection multiplies light with a reflectance:
///
/// ```text
/// T_k(lambda) = sum_q g_q(lambda) T_qk        E(lambda) = sum_k T_k(lambda) L_k(lambda)
/// ```
///
/// with as few functions g_q as the products of the scene's reflectances need; one, a constant, where all are grey.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectralTransfer {
    bands: Bands,
    grid: SpectralGrid,
    /// g_q, one value per wavelength each.
    functions: Vec<Vec<f64>>,
    pub(crate) vertices: Vec<usize>,
    /// Surface after surface, vertex after vertex, function after function.
    pub(crate) coefficients: Vec<f32>,
    /// Likewise what leaves each vertex, times pi as irradiance is: reflections of all that arrives but of the last bounce.
    leaving: Vec<f32>,
    last_bounce_share: f64,
}

impl SpectralTransfer {
    /// Bands of spherical harmonics.
    pub fn bands(&self) -> Bands {
        self.bands
    }

    /// The functions g_q: orthonormal as vectors of one value per wavelength.
    pub fn functions(&self) -> &[Vec<f64>] {
        &self.functions
    }

    /// The share of the mean irradiance under an even white sky that the last bounce added: what following one more would
    /// add at most, times the largest reflectance, and so on.
    pub fn last_bounce_share(&self) -> f64 {
        self.last_bounce_share
    }

    /// The coefficients of a surface's vertices: for each vertex, for each function, [`Bands::coefficients`] numbers.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn surface(&self, surface: usize) -> &[f32] {
        let n = self.bands.coefficients() * self.functions.len();
        let first: usize = self.vertices[..surface].iter().sum();
        &self.coefficients[first * n..(first + self.vertices[surface]) * n]
    }

    /// What leaves a vertex, counted through all surfaces: for each function as many numbers as harmonics, times pi as irradiance is.
    pub(crate) fn leaving(&self, vertex: usize) -> &[f32] {
        let n = self.bands.coefficients() * self.functions.len();
        &self.leaving[vertex * n..(vertex + 1) * n]
    }

    /// The coordinates of the constant 1: light as it came.
    pub(crate) fn one(&self) -> Vec<f64> {
        self.functions.iter().map(|g| g.iter().sum()).collect()
    }

    /// Transfer at one wavelength of the grid, vertex after vertex.
    ///
    /// # Panics
    /// If there is no such surface or sample.
    pub fn at_sample(&self, surface: usize, sample: usize) -> Vec<f64> {
        let n = self.bands.coefficients();
        self.surface(surface)
            .chunks_exact(n * self.functions.len())
            .flat_map(|vertex| {
                (0..n).map(move |k| {
                    self.functions
                        .iter()
                        .enumerate()
                        .map(|(q, g)| g[sample] * f64::from(vertex[q * n + k]))
                        .sum()
                })
            })
            .collect()
    }

    /// The coefficients of an albedo for each function g_q: those of R g_q, in a basis on the same grid.
    ///
    /// A basis that is optimal for the colours shown should know the products of reflectances as well.
    ///
    /// # Panics
    /// If the basis or the reflectance is on another grid.
    pub fn albedo_coefficients(&self, basis: &SpectralBasis, reflectance: &[f64]) -> Vec<Vec<[f64; 3]>> {
        assert_eq!(basis.grid(), &self.grid, "a basis on another grid");
        let product = |g: &Vec<f64>| g.iter().zip(reflectance).map(|(g, r)| g * r).collect::<Vec<f64>>();
        self.functions.iter().map(|g| basis.albedo_coefficients(&product(g))).collect()
    }
}

/// Adds to the transfer of the open sky what `settings.bounces` reflections bring.
///
/// `reflectances` has a spectrum for each surface, 0 to 1 on `grid`. Surfaces are matt and reflect on the side their normals
/// are on; seen from behind they are black. Irradiance is linear over a triangle. The result does not depend on the
/// number of threads. `progress` hears shares of the work, 0 to 1, in order.
///
/// # Errors
/// [`PrtError`] for too many rays or bounces, for reflectances that are none, and for a transfer of other surfaces.
pub fn add_bounces(
    surfaces: &[Surface],
    direct: &Transfer,
    grid: SpectralGrid,
    reflectances: &[Vec<f64>],
    settings: &BounceSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<SpectralTransfer, PrtError> {
    let bounces = Bounces::new(surfaces, direct, grid, reflectances, settings)?;
    let computed = bounces.follow(|_, compute| Ok::<_, Infallible>(compute()), progress);
    Ok(computed.unwrap_or_else(|never| match never {}))
}

/// A request, in bounces of chunks that do not depend on each other.
pub(crate) struct Bounces {
    work: Work,
    grid: SpectralGrid,
    spectra: ReflectedSpectra,
    /// What each surface does to the coordinates of a spectrum.
    reflections: Vec<Vec<f64>>,
    count: usize,
    /// From the sky.
    arriving: Vec<f64>,
}

impl Bounces {
    pub(crate) fn new(
        surfaces: &[Surface],
        direct: &Transfer,
        grid: SpectralGrid,
        reflectances: &[Vec<f64>],
        settings: &BounceSettings,
    ) -> Result<Self, PrtError> {
        let rays = TransferSettings { bands: direct.bands, rays: settings.rays };
        rays.check()?;
        check(surfaces, direct, grid, reflectances, settings)?;
        let spectra = ReflectedSpectra::new(&grid, reflectances, settings.bounces);
        let one = spectra.one();
        let arriving = direct
            .coefficients
            .chunks_exact(direct.bands.coefficients())
            .flat_map(|t| one.iter().flat_map(move |c| t.iter().map(move |t| c * f64::from(*t))))
            .collect();
        let reflections = reflectances.iter().map(|r| spectra.reflection(r)).collect();
        let work = Work::new(surfaces, rays);
        Ok(Self { work, grid, spectra, reflections, count: settings.bounces as usize, arriving })
    }

    /// Numbers of each record: of each bounce its chunks.
    pub(crate) fn records(&self) -> Vec<usize> {
        let chunks = (0..self.work.chunks()).map(|chunk| self.work.chunk_len(chunk) * self.spectra.count());
        let of_bounce: Vec<usize> = chunks.collect();
        of_bounce.repeat(self.count)
    }

    /// The functions of the wavelength that numbers belong to.
    pub(crate) fn functions(&self) -> Vec<Vec<f64>> {
        self.spectra.functions()
    }

    /// All bounces. `record` hears which one comes, and what computes it; numbers go from bounce to bounce in f32, so that those that come
    /// from elsewhere are the same.
    pub(crate) fn follow<E>(
        mut self,
        mut record: impl FnMut(usize, &dyn Fn() -> Vec<f32>) -> Result<Vec<f32>, E>,
        progress: &mut dyn FnMut(f64),
    ) -> Result<SpectralTransfer, E> {
        let bands = self.work.settings.bands;
        let (n, q) = (bands.coefficients(), self.spectra.count());
        let mut arriving = std::mem::take(&mut self.arriving);
        let mut sum = arriving.clone();
        let mut all_leaving = vec![0.0_f32; sum.len()];
        let chunks = self.work.chunks();
        progress(0.0);
        for bounce in 0..self.count {
            let leaving = reflected(&arriving, &self.work.vertices, &self.reflections, n);
            all_leaving.iter_mut().zip(&leaving).for_each(|(all, more)| *all += *more as f32);
            let mut next = Vec::with_capacity(arriving.len());
            for chunk in 0..chunks {
                let compute = || self.chunk(chunk, &leaving);
                next.extend(record(bounce * chunks + chunk, &compute)?.into_iter().map(f64::from));
                progress((bounce * chunks + chunk + 1) as f64 / (self.count * chunks) as f64);
            }
            arriving = next;
            sum.iter_mut().zip(&arriving).for_each(|(s, a)| *s += a);
        }
        // Coefficient 0 of what is left of a white sky: integral of g_q over the wavelengths, which is `one`.
        let one = self.spectra.one();
        let even = |values: &[f64]| -> f64 {
            values.chunks_exact(n * q).map(|v| (0..q).map(|f| one[f] * v[f * n]).sum::<f64>()).sum()
        };
        let last_bounce_share =
            if self.count == 0 { 1.0 } else { even(&arriving) / even(&sum).max(f64::MIN_POSITIVE) };
        Ok(SpectralTransfer {
            bands,
            grid: self.grid,
            functions: self.spectra.functions(),
            vertices: self.work.vertices,
            coefficients: sum.into_iter().map(|v| v as f32).collect(),
            leaving: all_leaving,
            last_bounce_share,
        })
    }

    /// What arrives at the vertices of a chunk, by all threads of rayon's current pool.
    fn chunk(&self, chunk: usize, leaving: &[f64]) -> Vec<f32> {
        let of_vertex = self.work.settings.bands.coefficients() * self.spectra.count();
        let points = self.work.chunk_points(chunk);
        let mut arriving = vec![0.0; points.len() * of_vertex];
        arriving.par_chunks_mut(of_vertex).zip(points).for_each_init(
            || (vec![0.0; self.work.points.len()], vec![0.0; of_vertex]),
            |(weights, sums), (out, point)| {
                gather(&self.work, point, leaving, weights, sums);
                out.iter_mut().zip(sums).for_each(|(out, sum)| *out = *sum as f32);
            },
        );
        arriving
    }
}

fn check(
    surfaces: &[Surface],
    direct: &Transfer,
    grid: SpectralGrid,
    reflectances: &[Vec<f64>],
    settings: &BounceSettings,
) -> Result<(), PrtError> {
    if settings.bounces > MAX_BOUNCES {
        return Err(PrtError::Bounces { got: settings.bounces, max: MAX_BOUNCES });
    }
    if reflectances.len() != surfaces.len() {
        return Err(PrtError::ReflectanceCount { got: reflectances.len(), surfaces: surfaces.len() });
    }
    for (surface, reflectance) in reflectances.iter().enumerate() {
        let (got, expected) = (reflectance.len(), grid.samples());
        if got != expected {
            return Err(PrtError::ReflectanceSamples { surface, got, expected });
        }
        if let Some(at) = reflectance.iter().position(|r| !(0.0..=1.0).contains(r)) {
            return Err(PrtError::Reflectance {
                surface,
                lambda_nm: grid.lambda_nm(at),
                got: reflectance[at],
            });
        }
    }
    let vertices: usize = surfaces.iter().map(|s| s.positions().len()).sum();
    let (got, expected) = (direct.coefficients.len(), vertices * direct.bands.coefficients());
    if got == expected { Ok(()) } else { Err(PrtError::OtherTransfer { got, expected }) }
}

/// What leaves each vertex: its surface's reflection of what arrives.
fn reflected(arriving: &[f64], vertices: &[usize], reflections: &[Vec<f64>], n: usize) -> Vec<f64> {
    let mut leaving = vec![0.0; arriving.len()];
    let mut first = 0;
    for (count, matrix) in vertices.iter().zip(reflections) {
        let q = matrix.len().isqrt();
        let range = first * n * q..(first + count) * n * q;
        leaving[range.clone()].par_chunks_mut(n * q).zip(arriving[range].par_chunks(n * q)).for_each(
            |(out, from)| {
                for (out, row) in out.chunks_exact_mut(n).zip(matrix.chunks_exact(q)) {
                    for (from, factor) in from.chunks_exact(n).zip(row) {
                        out.iter_mut().zip(from).for_each(|(o, f)| *o += factor * f);
                    }
                }
            },
        );
        first += count;
    }
    leaving
}

/// What arrives at a vertex: the mean over cosine-weighted directions of what leaves there, as integral (E / pi) cos.
/// `weights` has a zero for every vertex, before and after.
fn gather(work: &Work, point: &Point, leaving: &[f64], weights: &mut [f64], out: &mut [f64]) {
    out.fill(0.0);
    if point.normal == glam::DVec3::ZERO {
        return;
    }
    let mut met = Vec::new();
    for direction in Directions::new(work.settings.rays, point.stream).about(point.normal) {
        let Some(seen) = work.seen(point.origin, direction) else { continue };
        for (v, weight) in seen {
            if weights[v] == 0.0 {
                met.push(v);
            }
            weights[v] += weight;
        }
    }
    for v in met {
        // A weight that has come back to 0 is met twice, and adds nothing the second time.
        let weight = std::mem::take(&mut weights[v]) / f64::from(work.settings.rays);
        let from = &leaving[v * out.len()..(v + 1) * out.len()];
        out.iter_mut().zip(from).for_each(|(o, f)| *o += weight * f);
    }
}

#[cfg(test)]
mod tests;
