//! Light of a beam through a sphere onto a plane, without meshes: what everybody in the race is held against.
//!
//! Rays of one impact parameter share one path in their plane of incidence (deflection 2 (i - t) + k (pi - 2 t) after k internal
//! reflections, van de Hulst, *Light Scattering by Small Particles*, section 12.2), so a path is made once for a circle of rays. Rays stand
//! on a shifted lattice over the beam's cross-section.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use spectral_core::dispersion::Dispersion;
use spectral_core::light::LightSpectrum;
use spectral_core::observer::{Observer, VISIBLE_NM};

/// Glass ball, beam and window of the plane y = 0; metres.
pub(super) struct Setting {
    pub(super) center: DVec3,
    pub(super) radius: f64,
    pub(super) dispersion: Dispersion,
    /// Of the beam; a unit vector. Perpendicular to it the light is 1 lux.
    pub(super) direction: DVec3,
    pub(super) spectrum: LightSpectrum,
    /// Middle of the window, x and z.
    pub(super) window: DVec2,
    /// Half its side.
    pub(super) half: f64,
    /// Texels along a side.
    pub(super) size: usize,
}

/// Internal reflections that are followed, as the oracle does.
const BOUNCES: u32 = 3;

/// Width of a cell of wavelengths, nm. Within one, light moves by a small part of a texel.
const STEP_NM: f64 = 2.0;

/// What has been reflected carries less, so fewer rings of rays do: by outside reflection, then by number of internal ones.
const FEWER_RINGS: [usize; 5] = [2, 1, 2, 4, 4];

/// Rays along a ring, by the number of rings: about as far apart along it as across.
const AROUND: usize = 4;

impl Setting {
    /// XYZ per texel, row-major, row 0 at -z; `rings` of rays at each wavelength, `seed` shifts the lattice.
    pub(super) fn irradiance(&self, rings: usize, seed: u64) -> Vec<[f64; 3]> {
        let cells = ((VISIBLE_NM.1 - VISIBLE_NM.0) / STEP_NM).round() as usize;
        let grid_nm: Vec<f64> = (0..cells).map(|i| VISIBLE_NM.0 + (i as f64 + 0.5) * STEP_NM).collect();
        let weights = self.spectrum.spectral_lux(Observer::Cie1931, &grid_nm, STEP_NM);
        let black = || vec![[0.0; 3]; self.size * self.size];
        let add = |mut sum: Vec<[f64; 3]>, (i, weight): (usize, [f64; 3])| {
            let lux =
                self.at(grid_nm[i], rings, Lattice(seed.wrapping_mul(cells as u64).wrapping_add(i as u64)));
            for (sum, lux) in sum.iter_mut().zip(lux) {
                (0..3).for_each(|c| sum[c] += lux * weight[c]);
            }
            sum
        };
        let merge = |mut a: Vec<[f64; 3]>, b: Vec<[f64; 3]>| {
            a.iter_mut().zip(b).for_each(|(a, b)| (0..3).for_each(|c| a[c] += b[c]));
            a
        };
        weights.into_par_iter().enumerate().fold(black, add).reduce(black, merge)
    }

    /// Irradiance per texel of a beam of one wavelength.
    fn at(&self, lambda_nm: f64, rings: usize, mut lattice: Lattice) -> Vec<f64> {
        let mut texels = vec![0.0; self.size * self.size];
        let texel_m = 2.0 * self.half / self.size as f64;
        let beam = PI * self.radius * self.radius / (texel_m * texel_m);
        let ior = self.dispersion.ior(lambda_nm);
        let (e1, e2) = self.direction.any_orthonormal_pair();
        for (order, fewer) in FEWER_RINGS.iter().enumerate() {
            let rings = (rings / fewer).max(1);
            let around = AROUND * rings;
            let [shift_out, shift_along] = [lattice.next(), lattice.next()];
            for ring in 0..rings {
                let sine = ((ring as f64 + shift_out) / rings as f64).sqrt();
                let path = match order.checked_sub(1) {
                    None => Path::reflected(sine, ior),
                    Some(bounces) => Path::transmitted(sine, ior, bounces as u32),
                };
                let share = beam * path.power / (rings * around) as f64;
                let from = path.from * self.radius;
                let start = (shift_along + ring as f64 * GOLDEN).fract();
                for i in 0..around {
                    let (sine, cosine) = (TAU * (i as f64 + start) / around as f64).sin_cos();
                    let out = cosine * e1 + sine * e2;
                    let from = self.center + from.x * self.direction + from.y * out;
                    let along = path.along.x * self.direction + path.along.y * out;
                    if along.y >= 0.0 {
                        continue;
                    }
                    let landed = from - along * (from.y / along.y);
                    let place = (DVec2::new(landed.x, landed.z) - self.window + self.half) / texel_m;
                    let (column, row) = (place.x.floor(), place.y.floor());
                    let inside = 0.0..self.size as f64;
                    if inside.contains(&column) && inside.contains(&row) {
                        texels[row as usize * self.size + column as usize] += share;
                    }
                }
            }
        }
        texels
    }
}

/// Fraction of the golden ratio: turns neighbouring rings against each other.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Shifts of lattices, by `SplitMix64` (Steele, Lea & Flood 2014).
struct Lattice(u64);

impl Lattice {
    /// In 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Where light leaves the unit sphere, and where to: x along the beam, y away from its axis.
struct Path {
    from: DVec2,
    along: DVec2,
    power: f64,
}

impl Path {
    /// `sine` of the angle of incidence.
    fn reflected(sine: f64, ior: f64) -> Self {
        let from = entry(sine);
        Self { from, along: reflected(DVec2::X, from), power: reflectance(sine, ior) }
    }

    fn transmitted(sine: f64, ior: f64, bounces: u32) -> Self {
        let reflectance = reflectance(sine, ior);
        let mut from = entry(sine);
        // Towards the axis by i - t at each refraction.
        let turn = DVec2::from_angle((sine / ior).asin() - sine.asin());
        let mut along = turn.rotate(DVec2::X);
        for bounce in 0..=bounces {
            if bounce > 0 {
                along = reflected(along, from);
            }
            // Rounding would grow from chord to chord.
            from = (from - 2.0 * along.dot(from) * along).normalize();
            along = along.normalize();
        }
        let power = (1.0 - reflectance).powi(2) * reflectance.powi(bounces as i32);
        Self { from, along: turn.rotate(along), power }
    }
}

/// Where a ray along x meets the unit sphere.
fn entry(sine: f64) -> DVec2 {
    DVec2::new(-(1.0 - sine * sine).max(0.0).sqrt(), sine)
}

fn reflected(along: DVec2, normal: DVec2) -> DVec2 {
    along - 2.0 * along.dot(normal) * normal
}

/// Fresnel, unpolarised, from vacuum into glass; from within it is the same at the angle of refraction.
fn reflectance(sine: f64, ior: f64) -> f64 {
    let (cos_i, cos_t) = ((1.0 - sine * sine).max(0.0).sqrt(), (1.0 - (sine / ior).powi(2)).sqrt());
    let rs = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    let rp = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    0.5 * (rs * rs + rp * rp)
}

/// What the lattice follows, for the tests and the order of [`FEWER_RINGS`].
const _: () = assert!(FEWER_RINGS.len() == BOUNCES as usize + 2);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deflections_are_those_of_the_rainbow() {
        // Descartes' ray of a raindrop: cos(i)^2 = (n^2 - 1) / 3.
        let least = (0..1000).map(|i| {
            let path = Path::transmitted(f64::from(i) / 1000.0, 4.0 / 3.0, 1);
            path.along.x.acos().to_degrees()
        });
        let least = least.fold(f64::MAX, f64::min);
        assert!((least - 137.97).abs() < 0.05, "{least}");
    }

    #[test]
    fn light_leaves_where_it_comes_from_the_inside_and_is_not_lost() {
        for sine in [0.0, 0.3, 0.7, 0.99] {
            let paths: Vec<Path> = (0..40).map(|k| Path::transmitted(sine, 1.5, k)).collect();
            for path in &paths[..=BOUNCES as usize] {
                assert!((path.from.length() - 1.0).abs() < 1e-12 && path.along.dot(path.from) >= -1e-12);
            }
            let power = Path::reflected(sine, 1.5).power + paths.iter().map(|path| path.power).sum::<f64>();
            assert!((power - 1.0).abs() < 1e-6, "{power} at {sine}");
        }
    }

    #[test]
    fn refraction_keeps_the_angle_about_the_axis() {
        let path = Path::transmitted(0.5, 1.5, 0);
        let deflection = 2.0 * (0.5_f64.asin() - (0.5_f64 / 1.5).asin());
        assert!((path.along - DVec2::new(deflection.cos(), -deflection.sin())).length() < 1e-12);
    }
}
