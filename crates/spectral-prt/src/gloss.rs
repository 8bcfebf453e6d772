//! Glossy lobes over the same transfer.
//!
//! A surface that shines sends, of what a light of radiance 1 per harmonic throws on it, towards the viewer
//!
//! ```text
//! G_i(r) = integral of V(omega) max(n . omega, 0) f(r . omega) Y_i(omega) d omega
//! f(x)   = (s + 2) / (2 pi) max(x, 0)^s              r: the view's direction, mirrored
//! ```
//!
//! where f is the modified Phong lobe (Lafortune & Willems 1994, "Using the modified Phong reflectance model for physically based
//! rendering"): reciprocal, and never more than comes in. f is a sum of harmonics about r, so G is a matrix per vertex times the
//! harmonics of r (Sloan, Kautz & Snyder 2002, section 5). A product of two harmonics of degree l at most is a sum of
//! harmonics of degree 2 l at most: with B bands of light the matrices follow from [`Transfer`] of 2 B - 1 bands, without another ray.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use crate::bands::Bands;
use crate::bounces::SpectralTransfer;
use crate::cosine_power::legendre_integrals;
use crate::error::PrtError;
use crate::hemisphere::Directions;
use crate::sh;
use crate::surface::Surface;
use crate::transfer::{CHUNK_VERTICES, Transfer, TransferSettings, Work};

/// Sharper than any that ten bands can tell from a mirror.
const MAX_EXPONENT: f64 = 1e6;

/// Exponents that are tried from the broadest lobe to the sharpest.
const STEPS: u32 = 200;

/// How sharp a lobe is: the exponent s of its cosine, 0 to 10^6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhongLobe(f64);

impl PhongLobe {
    /// A lobe of exponent s.
    ///
    /// # Errors
    /// [`PrtError::Exponent`] outside 0 to 10^6.
    pub fn new(exponent: f64) -> Result<Self, PrtError> {
        if (0.0..=MAX_EXPONENT).contains(&exponent) {
            Ok(Self(exponent))
        } else {
            Err(PrtError::Exponent { got: exponent, max: MAX_EXPONENT })
        }
    }

    /// The lobe of a glTF roughness, 0 to 1. Its square is alpha, and the facets' normals have the exponent 2 / alpha^2 - 2 (Walter et al. 2007,
    /// "Microfacet models for refraction through rough surfaces", section 5.3); the mirrored direction turns by twice as much as they
    /// do, so its exponent is a quarter of that.
    pub fn of_roughness(roughness: f64) -> Self {
        let alpha = roughness.clamp(0.0, 1.0).powi(2);
        Self((0.5 / (alpha * alpha) - 0.5).min(MAX_EXPONENT))
    }

    /// The sharpest lobe that so many bands hold a share of, if there is one: sharper ones ring, darker than nothing on their sides.
    pub fn sharpest(bands: Bands, share: f64) -> Option<Self> {
        // From the sharpest of these on the share falls with the exponent.
        let mut exponents =
            (0..=STEPS).rev().map(|step| MAX_EXPONENT.powf(f64::from(step) / f64::from(STEPS)) - 1.0);
        let mut held = exponents.find(|&exponent| Self(exponent).held_by(bands) >= share)?;
        let next = (held + 1.0) * MAX_EXPONENT.powf(1.0 / f64::from(STEPS)) - 1.0;
        let mut lost = next.min(MAX_EXPONENT);
        for _ in 0..60 {
            let middle = 0.5 * (held + lost);
            if Self(middle).held_by(bands) >= share { held = middle } else { lost = middle }
        }
        Some(Self(held))
    }

    /// The exponent.
    pub fn exponent(self) -> f64 {
        self.0
    }

    /// The glTF roughness of this lobe.
    pub fn roughness(self) -> f64 {
        (2.0 * self.0 + 1.0).powf(-0.25)
    }

    /// What each degree of harmonics about the mirrored direction is multiplied with (Funk & Hecke): 2 pi times the integral of f P_l.
    pub fn degree_factors(self, bands: Bands) -> Vec<f64> {
        let scale = self.0 + 2.0;
        legendre_integrals(self.0, bands.count()).into_iter().map(|integral| scale * integral).collect()
    }

    /// How much of the lobe so many bands hold: the share of the integral of f^2, 0 to 1.
    pub fn held_by(self, bands: Bands) -> f64 {
        let held: f64 =
            self.degree_factors(bands).iter().enumerate().map(|(l, a)| (2 * l + 1) as f64 * a * a).sum();
        let all = ((self.0 + 2.0) / TAU).powi(2) * TAU / (2.0 * self.0 + 1.0);
        held / (4.0 * PI) / all
    }
}

/// Transfer of the vertices of surfaces that shine, for any lobe about any direction.
///
/// A vertex has a matrix of the integrals of max(n . omega, 0) Y_j times what comes from omega of light in the harmonic i: V(omega) Y_i,
/// and, [with bounces](GlossTransfer::with_bounces), what matt surfaces send from there, which has a colour. Then there is one matrix for
/// each function of the wavelength that [`SpectralTransfer`] has.
#[derive(Clone, Debug, PartialEq)]
pub struct GlossTransfer {
    bands: Bands,
    functions: usize,
    /// Vertices of each surface.
    vertices: Vec<usize>,
    /// Of each surface, if it shines.
    lobes: Vec<Option<PhongLobe>>,
    /// Of the surfaces that shine, vertex after vertex, function after function, row i after row.
    pub(crate) matrices: Vec<f32>,
}

impl GlossTransfer {
    /// The matrices for `bands` of light from the sky, of the surfaces that have a lobe. Other surfaces are black in them.
    ///
    /// # Errors
    /// [`PrtError::GlossBands`] if `transfer` has fewer than 2 `bands` - 1; [`PrtError::Lobes`] if there is not one entry of `lobes` for
    /// each of its surfaces; [`PrtError::NothingShines`] if none has one.
    pub fn new(transfer: &Transfer, bands: Bands, lobes: &[Option<PhongLobe>]) -> Result<Self, PrtError> {
        let needed = 2 * bands.count() - 1;
        if transfer.bands().count() < needed {
            return Err(PrtError::GlossBands { bands: bands.count(), got: transfer.bands().count(), needed });
        }
        let surfaces = transfer.vertices.len();
        if lobes.len() != surfaces {
            return Err(PrtError::Lobes { got: lobes.len(), surfaces });
        }
        if lobes.iter().all(Option::is_none) {
            return Err(PrtError::NothingShines);
        }
        let products = Products::new(bands);
        let shining = lobes.iter().enumerate().filter(|(_, lobe)| lobe.is_some());
        let of_vertices = transfer.bands().coefficients();
        let matrices = shining
            .flat_map(|(surface, _)| {
                let vertices = transfer.surface(surface).par_chunks_exact(of_vertices);
                vertices.flat_map_iter(|t| products.matrix(t)).collect::<Vec<f32>>()
            })
            .collect();
        let vertices = transfer.vertices.clone();
        Ok(Self { bands, functions: 1, vertices, lobes: lobes.to_vec(), matrices })
    }

    /// And what matt surfaces send, lit by the sky and by each other: `bounced` has as many reflections as are seen. It is found by `rays`
    /// per vertex that shines; the result does not depend on the number of threads. `progress` hears shares of the work, 0 to 1, in order.
    ///
    /// # Errors
    /// [`PrtError::Rays`]; [`PrtError::OtherBounces`] for transfer of other surfaces or bands.
    ///
    /// # Panics
    /// If it has bounces already.
    pub fn with_bounces(
        self,
        surfaces: &[Surface],
        bounced: &SpectralTransfer,
        rays: u32,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, PrtError> {
        assert_eq!(self.functions, 1, "gloss that has bounces already");
        let settings = TransferSettings { bands: self.bands, rays };
        settings.check()?;
        let work = Work::new(surfaces, settings);
        if work.vertices != self.vertices
            || bounced.vertices != self.vertices
            || bounced.bands() != self.bands
        {
            return Err(PrtError::OtherBounces);
        }
        let one = bounced.one();
        let (n, q) = (self.bands.coefficients(), one.len());
        let mut shining = Vec::new();
        let mut first = 0;
        for (lobe, count) in self.lobes.iter().zip(&self.vertices) {
            shining.extend((first..first + count).filter(|_| lobe.is_some()));
            first += count;
        }
        let mut matrices = vec![0.0; shining.len() * q * n * n];
        progress(0.0);
        let chunks = shining.len().div_ceil(CHUNK_VERTICES);
        let of_chunks = matrices.chunks_mut(CHUNK_VERTICES * q * n * n).zip(shining.chunks(CHUNK_VERTICES));
        for (chunk, (matrices, shining)) in of_chunks.enumerate() {
            let own = self.matrices[chunk * CHUNK_VERTICES * n * n..].par_chunks(n * n);
            matrices.par_chunks_mut(q * n * n).zip(shining).zip(own).for_each(|((out, &vertex), own)| {
                for (out, one) in out.chunks_exact_mut(n * n).zip(&one) {
                    out.iter_mut().zip(own).for_each(|(out, m)| *out = (one * f64::from(*m)) as f32);
                }
                add_seen(&work, vertex, bounced, out);
            });
            progress((chunk + 1) as f64 / chunks as f64);
        }
        Ok(Self { functions: q, matrices, ..self })
    }

    /// Bands of light.
    pub fn bands(&self) -> Bands {
        self.bands
    }

    /// Functions of the wavelength: 1 without bounces.
    pub fn functions(&self) -> usize {
        self.functions
    }

    /// Vertices of each surface.
    pub fn vertices(&self) -> &[usize] {
        &self.vertices
    }

    /// The lobe of each surface, if it shines.
    pub fn lobes(&self) -> &[Option<PhongLobe>] {
        &self.lobes
    }

    /// How many vertices shine.
    pub fn rows(&self) -> usize {
        self.rows_before(self.lobes.len())
    }

    /// How many vertices shine of the surfaces before one.
    fn rows_before(&self, surface: usize) -> usize {
        let before = self.lobes[..surface].iter().zip(&self.vertices);
        before.filter_map(|(lobe, vertices)| lobe.map(|_| vertices)).sum()
    }

    /// G_qi of one vertex for the mirrored direction r, function after function: with the light's coefficients L_i, sum G_i L_i times the
    /// lobe's reflectance is the radiance towards the viewer. Few bands ring, so it may be slightly negative.
    ///
    /// # Panics
    /// If there is no such vertex, or its surface does not shine.
    pub fn toward(&self, surface: usize, vertex: usize, mirrored: DVec3) -> Vec<Vec<f64>> {
        let lobe = self.lobes[surface].expect("a surface that shines");
        assert!(vertex < self.vertices[surface], "no such vertex");
        let row = self.rows_before(surface) + vertex;
        let n = self.bands.coefficients();
        let of_vertex = self.functions * n * n;
        let mut about = sh::harmonics(self.bands, mirrored);
        for (l, factor) in lobe.degree_factors(self.bands).into_iter().enumerate() {
            about[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|y| *y *= factor);
        }
        let along = |row: &[f32]| row.iter().zip(&about).map(|(m, y)| f64::from(*m) * y).sum();
        let matrices = self.matrices[row * of_vertex..(row + 1) * of_vertex].chunks_exact(n * n);
        matrices.map(|matrix| matrix.chunks_exact(n).map(along).collect()).collect()
    }
}

/// Adds to the matrices of a vertex what it sees of other surfaces.
fn add_seen(work: &Work, vertex: usize, bounced: &SpectralTransfer, matrices: &mut [f32]) {
    let point = &work.points[vertex];
    if point.normal == DVec3::ZERO {
        return;
    }
    let bands = work.settings.bands;
    let n = bands.coefficients();
    // Of each vertex that is seen, the harmonics of where.
    let mut met: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    let mut harmonics = vec![0.0; n];
    for direction in Directions::new(work.settings.rays, point.stream).about(point.normal) {
        let Some(seen) = work.seen(point.origin, direction) else { continue };
        sh::evaluate(bands, direction, &mut harmonics);
        for (v, weight) in seen {
            let sums = met.entry(v).or_insert_with(|| vec![0.0; n]);
            sums.iter_mut().zip(&harmonics).for_each(|(sum, y)| *sum += weight * y);
        }
    }
    // Radiance is what leaves over pi, and a direction's weight pi over their number.
    let mut sums = vec![0.0; matrices.len()];
    for (v, whence) in met {
        for (row, leaving) in sums.chunks_exact_mut(n).zip(bounced.leaving(v)) {
            let share = f64::from(*leaving) / f64::from(work.settings.rays);
            row.iter_mut().zip(&whence).for_each(|(sum, y)| *sum += share * y);
        }
    }
    matrices.iter_mut().zip(sums).for_each(|(out, sum)| *out += sum as f32);
}

/// Integrals of three harmonics, Y_k Y_i Y_j: those that are not 0.
struct Products {
    /// For each entry (i, j), k and the integral.
    terms: Vec<Vec<(usize, f64)>>,
}

impl Products {
    /// For i and j in `bands`, and k in twice as many less one.
    fn new(bands: Bands) -> Self {
        let harmonics = bands.coefficients();
        let degrees = 2 * bands.count() - 1;
        let wide = Bands::new(degrees as u8).expect("as many as transfer has");
        let places = sphere(4 * (bands.count() - 1));
        let values: Vec<(Vec<f64>, f64)> =
            places.into_iter().map(|(direction, weight)| (sh::harmonics(wide, direction), weight)).collect();
        let mut terms = Vec::with_capacity(harmonics * harmonics);
        for i in 0..harmonics {
            for j in 0..harmonics {
                let integral = |k: usize| values.iter().map(|(y, weight)| weight * y[k] * y[i] * y[j]).sum();
                let all = (0..wide.coefficients()).map(|k| (k, integral(k)));
                terms.push(all.filter(|(_, value): &(usize, f64)| value.abs() > 1e-12).collect());
            }
        }
        Self { terms }
    }

    /// Of a vertex with this transfer.
    fn matrix(&self, transfer: &[f32]) -> impl Iterator<Item = f32> {
        let entry = |terms: &Vec<(usize, f64)>| {
            terms.iter().map(|&(k, product)| f64::from(transfer[k]) * product).sum::<f64>() as f32
        };
        self.terms.iter().map(entry).collect::<Vec<_>>().into_iter()
    }
}

/// Directions and weights that integrate polynomials of a degree over the sphere exactly: even steps about z, and along it Fejer's first
/// rule (Waldvogel 2006, "Fast construction of the Fejer and Clenshaw-Curtis quadrature rules").
fn sphere(degree: usize) -> Vec<(DVec3, f64)> {
    let steps = degree + 1;
    let of_ring = |ring: usize| {
        let theta = PI * (ring as f64 + 0.5) / steps as f64;
        let term = |j: usize| (2.0 * j as f64 * theta).cos() / (4 * j * j - 1) as f64;
        let weight = 2.0 / steps as f64 * (1.0 - 2.0 * (1..=steps / 2).map(term).sum::<f64>());
        (0..steps).map(move |step| {
            let (sin, cos) = (TAU * step as f64 / steps as f64).sin_cos();
            let direction = DVec3::new(theta.sin() * cos, theta.sin() * sin, theta.cos());
            (direction, weight * TAU / steps as f64)
        })
    };
    (0..steps).flat_map(of_ring).collect()
}
