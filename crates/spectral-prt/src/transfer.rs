//! Transfer by rays.

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::bands::Bands;
use crate::cosine_lobe;
use crate::error::PrtError;
use crate::hemisphere::Directions;
use crate::occlusion::Occluders;
use crate::sh;
use crate::surface::Surface;

/// The most rays per vertex.
const MAX_RAYS: u32 = 1 << 20;
/// How transfer is computed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransferSettings {
    /// Bands of spherical harmonics.
    pub bands: Bands,
    /// Rays per vertex, 1 to 2^20.
    pub rays: u32,
}

impl Default for TransferSettings {
    /// Five bands, 1024 rays.
    fn default() -> Self {
        Self { bands: Bands::default(), rays: 1024 }
    }
}

impl TransferSettings {
    pub(crate) fn check(&self) -> Result<(), PrtError> {
        if (1..=MAX_RAYS).contains(&self.rays) {
            Ok(())
        } else {
            Err(PrtError::Rays { got: self.rays, max: MAX_RAYS })
        }
    }
}

/// Achromatic transfer of all vertices of all surfaces.
///
/// A vertex has [`Bands::coefficients`] numbers T_k, steradians times the cosine: with the light's coefficients L_k,
/// sum T_k L_k is the irradiance, and times reflectance / pi the radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer {
    pub(crate) bands: Bands,
    /// Vertices of each surface.
    pub(crate) vertices: Vec<usize>,
    /// Surface after surface, vertex after vertex.
    pub(crate) coefficients: Vec<f32>,
}

impl Transfer {
    /// Bands of spherical harmonics.
    pub fn bands(&self) -> Bands {
        self.bands
    }

    /// The coefficients of a surface's vertices, vertex after vertex.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn surface(&self, surface: usize) -> &[f32] {
        let n = self.bands.coefficients();
        let first: usize = self.vertices[..surface].iter().sum();
        &self.coefficients[first * n..(first + self.vertices[surface]) * n]
    }

    /// The first of its bands: what [`precompute`] finds with the same rays and no more bands than these.
    ///
    /// # Panics
    /// If there are not so many.
    #[must_use]
    pub fn with_bands(&self, bands: Bands) -> Self {
        assert!(bands <= self.bands, "{} bands of {}", bands.count(), self.bands.count());
        let vertices = self.coefficients.chunks_exact(self.bands.coefficients());
        let coefficients = vertices.flat_map(|vertex| &vertex[..bands.coefficients()]).copied().collect();
        Self { bands, vertices: self.vertices.clone(), coefficients }
    }

    /// The irradiance of a surface's vertices under light with these coefficients, in the unit of the light's radiance.
    ///
    /// Few bands ring: it may be slightly negative opposite to strong light.
    ///
    /// # Panics
    /// If there is no such surface, or the light has another number of bands.
    pub fn irradiance(&self, surface: usize, light: &[f64]) -> Vec<f64> {
        assert_eq!(light.len(), self.bands.coefficients(), "light of another number of bands");
        let vertex = |t: &[f32]| t.iter().zip(light).map(|(t, l)| f64::from(*t) * l).sum();
        self.surface(surface).chunks_exact(light.len()).map(vertex).collect()
    }
}

/// Transfer of every vertex: the clamped cosine's own coefficients, exactly, less what rays find blocked.
///
/// So a vertex that nothing blocks has no error at all, and elsewhere only the blocked part is sampled. Each triangle of
/// each surface blocks from both sides. The result does not depend on the number of threads. `progress` hears shares of
/// the work, 0 to 1, in order.
///
/// # Errors
/// [`PrtError::Rays`].
pub fn precompute(
    surfaces: &[Surface],
    settings: &TransferSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Transfer, PrtError> {
    settings.check()?;
    let work = Work::new(surfaces, *settings);
    let mut coefficients = Vec::with_capacity(work.points.len() * settings.bands.coefficients());
    progress(0.0);
    for chunk in 0..work.chunks() {
        coefficients.extend(work.chunk(chunk));
        progress((chunk + 1) as f64 / work.chunks() as f64);
    }
    Ok(work.transfer(coefficients))
}

/// Vertices whose transfer is found, and stored, at once.
pub(crate) const CHUNK_VERTICES: usize = 1024;

/// A vertex as rays see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Where rays start, metres.
    pub(crate) origin: DVec3,
    /// 0 at isolated vertices.
    pub(crate) normal: DVec3,
    pub(crate) stream: u64,
}

/// A request, in chunks that do not depend on each other.
pub(crate) struct Work {
    pub(crate) settings: TransferSettings,
    pub(crate) points: Vec<Point>,
    pub(crate) vertices: Vec<usize>,
    pub(crate) occluders: Occluders,
}

impl Work {
    pub(crate) fn new(surfaces: &[Surface], settings: TransferSettings) -> Self {
        let mut points = Vec::new();
        for surface in surfaces {
            for (origin, &normal) in surface.ray_origins().into_iter().zip(surface.normals()) {
                let stream = points.len() as u64;
                points.push(match origin {
                    Some(origin) => Point { origin, normal, stream },
                    None => Point { origin: DVec3::ZERO, normal: DVec3::ZERO, stream },
                });
            }
        }
        let vertices = surfaces.iter().map(|s| s.positions().len()).collect();
        Self { settings, points, vertices, occluders: Occluders::new(surfaces) }
    }

    pub(crate) fn chunks(&self) -> usize {
        self.points.len().div_ceil(CHUNK_VERTICES)
    }

    /// Numbers in a chunk.
    pub(crate) fn chunk_len(&self, chunk: usize) -> usize {
        self.chunk_points(chunk).len() * self.settings.bands.coefficients()
    }

    pub(crate) fn chunk_points(&self, chunk: usize) -> &[Point] {
        let first = chunk * CHUNK_VERTICES;
        &self.points[first..self.points.len().min(first + CHUNK_VERTICES)]
    }

    /// The coefficients of a chunk's vertices, by all threads of rayon's current pool.
    pub(crate) fn chunk(&self, chunk: usize) -> Vec<f32> {
        let points = self.chunk_points(chunk);
        let n = self.settings.bands.coefficients();
        let mut coefficients = vec![0.0; points.len() * n];
        coefficients.par_chunks_mut(n).zip(points).for_each_init(
            || (vec![0.0; n], vec![0.0; n]),
            |(sums, harmonics), (out, point)| {
                self.at(point, sums, harmonics);
                out.iter_mut().zip(sums).for_each(|(out, sum)| *out = *sum as f32);
            },
        );
        coefficients
    }

    pub(crate) fn transfer(self, coefficients: Vec<f32>) -> Transfer {
        Transfer { bands: self.settings.bands, vertices: self.vertices, coefficients }
    }

    /// The corners, as vertices of all surfaces, of what a ray meets on its front, and their weights; nothing where it meets a back, which is
    /// black.
    pub(crate) fn seen(&self, origin: DVec3, direction: DVec3) -> Option<[(usize, f64); 3]> {
        let hit = self.occluders.nearest(origin, direction)?;
        let corners = [0, 1, 2].map(|i| (hit.vertices[i] as usize, hit.weights[i]));
        let normal: DVec3 = corners.iter().map(|&(v, weight)| self.points[v].normal * weight).sum();
        (normal.dot(direction) < 0.0).then_some(corners)
    }

    fn at(&self, point: &Point, sums: &mut [f64], harmonics: &mut [f64]) {
        let bands = self.settings.bands;
        if point.normal == DVec3::ZERO {
            sums.fill(0.0);
            return;
        }
        cosine_lobe::evaluate(bands, point.normal, sums);
        let directions = Directions::new(self.settings.rays, point.stream);
        for direction in directions.about(point.normal) {
            if self.occluders.blocks(point.origin, direction) {
                sh::evaluate(bands, direction, harmonics);
                sums.iter_mut().zip(&*harmonics).for_each(|(sum, y)| *sum -= directions.weight() * y);
            }
        }
    }
}
