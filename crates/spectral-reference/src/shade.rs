//! What an eye ray sees where it ends: diffuse surfaces lit directly, through glass and by mirrors.

use std::f64::consts::PI;

use glam::DVec3;
use spectral_core::upsample::SmoothSpectrum;
use spectral_scene::Scene;

use crate::direct;
use crate::lamp::Lamp;
use crate::medium::Medium;
use crate::shoot::Film;
use crate::texels::Texels;
use crate::trace::{Landing, Layer, Sink};
use crate::tree::Pending;
use crate::world::{Hit, World};

/// Bands of a lamp's spectrum that maps keep apart, each with the same share of the wavelength samples.
const BANDS: usize = 20;

/// An opaque object as the eye sees it.
struct Matte {
    reflectance: SmoothSpectrum,
    /// `None` for glass and mirrors, and where no light comes from either.
    texels: Option<Texels>,
}

/// Light from glass and mirrors on every matt object, by lamp and band.
///
/// A texel holds, per band, the illuminance in lux that the lamp would give if all of its spectrum fared like the
/// band. So an eye ray's wavelength takes what its own band got, and coloured walls, absorption, metal and dispersion
/// seen through glass come out right up to the width of a band.
pub(crate) struct LightMaps<'a> {
    world: &'a World,
    mattes: Vec<Matte>,
    /// Bands of each lamp.
    bands: Vec<usize>,
    /// By lamp and object, row-major texels of bands; empty until something lands.
    sums: Vec<Vec<Vec<f64>>>,
}

/// Lumens in one band of one texel.
pub(crate) struct BandDeposit {
    lamp: u32,
    object: u32,
    /// Texel times bands plus band.
    at: u64,
    flux: f64,
}

impl<'a> LightMaps<'a> {
    /// `size` is about how many texels each object gets; `None` if no light will come from glass or mirrors.
    pub(crate) fn new(scene: &Scene, world: &'a World, lamps: &[Lamp], size: Option<[u32; 2]>) -> Self {
        let mattes = (0..scene.objects.len())
            .map(|object| Matte {
                reflectance: SmoothSpectrum::reflectance(scene.material_of(object).base_color),
                texels: size
                    .filter(|_| world.media[object].is_none() && world.mirrors[object].is_none())
                    .map(|size| Texels::of_surface(scene, world, object, size)),
            })
            .collect();
        // Where glass and mirrors treat all wavelengths alike one band is enough.
        let colored = world.media.iter().flatten().any(|m| m.dispersive || m.absorbs() || m.tints())
            || world.mirrors.iter().flatten().any(|m| m.colored);
        let bands = lamps.iter().map(|l| if colored && !l.spectrum.is_line() { BANDS } else { 1 }).collect();
        let sums = vec![vec![Vec::new(); scene.objects.len()]; lamps.len()];
        Self { world, mattes, bands, sums }
    }

    fn band(&self, lamp: usize, quantile: f64) -> usize {
        let bands = self.bands[lamp];
        ((quantile * bands as f64) as usize).min(bands - 1)
    }

    /// Turns sums of flux into illuminance; `scale` is for the number of paths.
    pub(crate) fn finish(&mut self, scale: f64) {
        for (lamp, objects) in self.sums.iter_mut().enumerate() {
            let bands = self.bands[lamp];
            for (object, map) in objects.iter_mut().enumerate() {
                let Some(texels) = &self.mattes[object].texels else { continue };
                for (at, value) in map.iter_mut().enumerate() {
                    let area = texels.areas[at / bands];
                    *value *= if area > 0.0 { scale * bands as f64 / area } else { 0.0 };
                }
            }
        }
    }

    /// Texels and weights around a hit, by distance and by how much surface a texel has: at an edge most of a texel
    /// may lie outside, and what little lands on it says little.
    fn taps(texels: &Texels, world: &World, hit: &Hit) -> [(usize, f64); 4] {
        let position = texels.texel_position(world, hit);
        let grid = texels.grid(world, hit.triangle as usize);
        let corner = (position - 0.5).floor();
        let part = position - 0.5 - corner;
        let mut taps = [(0, 0.0); 4];
        for (k, tap) in taps.iter_mut().enumerate() {
            let (dx, dy) = ((k & 1) as f64, (k >> 1) as f64);
            let texel = grid.texel(corner.x + dx, corner.y + dy) as usize;
            let weight = (1.0 - (part.x - dx).abs()) * (1.0 - (part.y - dy).abs());
            *tap = (texel, weight * texels.areas[texel]);
        }
        let total: f64 = taps.iter().map(|t| t.1).sum();
        if total > 0.0 {
            taps.iter_mut().for_each(|t| t.1 /= total);
        }
        taps
    }
}

impl Film for LightMaps<'_> {
    type Deposit = BandDeposit;

    fn expose(&self, lamp: usize, landing: &Landing, deposits: &mut Vec<BandDeposit>) -> bool {
        let object = self.world.faces[landing.hit.triangle as usize].object;
        let Some(texels) = &self.mattes[object as usize].texels else { return false };
        let Some(texel) = texels.texel(self.world, landing.hit) else { return false };
        let bands = self.bands[lamp];
        for (lane, power) in landing.lanes.iter().zip(landing.powers) {
            deposits.push(BandDeposit {
                lamp: lamp as u32,
                object,
                at: u64::from(texel) * bands as u64 + self.band(lamp, lane.quantile) as u64,
                flux: landing.flux * power / landing.lanes_of_path as f64,
            });
        }
        true
    }

    fn flux(deposit: &BandDeposit) -> f64 {
        deposit.flux
    }

    fn add(&mut self, _replicate: usize, deposits: Vec<BandDeposit>) {
        for BandDeposit { lamp, object, at, flux } in deposits {
            let (lamp, object) = (lamp as usize, object as usize);
            let map = &mut self.sums[lamp][object];
            if map.is_empty() {
                let texels = self.mattes[object].texels.as_ref().map_or(0, |t| t.areas.len());
                map.resize(texels * self.bands[lamp], 0.0);
            }
            map[at as usize] += flux;
        }
    }
}

/// Adds up one pixel for one lamp.
pub(crate) struct EyeSink<'a> {
    pub(crate) maps: &'a LightMaps<'a>,
    pub(crate) lamp: &'a Lamp,
    pub(crate) lamp_index: usize,
    /// What the eye is in.
    pub(crate) medium: Option<&'a Medium>,
    pub(crate) pending: Pending,
    /// Luminance as XYZ, Y in cd/m^2.
    pub(crate) xyz: [f64; 3],
}

impl EyeSink<'_> {
    /// Illuminance by light from glass and mirrors at one wavelength's band.
    fn by_detour(&self, taps: &[(usize, f64); 4], object: usize, quantile: f64) -> f64 {
        let map = &self.maps.sums[self.lamp_index][object];
        if map.is_empty() {
            return 0.0;
        }
        let (bands, band) = (self.maps.bands[self.lamp_index], self.maps.band(self.lamp_index, quantile));
        taps.iter().map(|(texel, weight)| weight * map[texel * bands + band]).sum()
    }
}

impl Sink for EyeSink<'_> {
    /// Reflected radiance of a diffuse surface, L = rho E / pi, towards where the path came from.
    fn land(&mut self, landing: &Landing) -> bool {
        let world = self.maps.world;
        let face = &world.faces[landing.hit.triangle as usize];
        let object = face.object as usize;
        let matte = &self.maps.mattes[object];
        let point: DVec3 = world.position(landing.hit);
        let seen = if landing.hit.front { face.normal } else { -face.normal };
        let triangle = landing.hit.triangle;
        let direct = direct::illuminance(world, self.lamp, point, seen, triangle, &mut self.pending);
        let texels = matte.texels.as_ref().filter(|_| landing.hit.front);
        let taps = texels.map(|t| LightMaps::taps(t, world, landing.hit));
        for (lane, power) in landing.lanes.iter().zip(landing.powers) {
            let through = taps.map_or(0.0, |taps| self.by_detour(&taps, object, lane.quantile));
            // Radiance over n^2 is what stays the same along a ray (Nicodemus 1963).
            let [n, n_eye] = [world.medium(landing.medium), self.medium]
                .map(|medium| medium.map_or(1.0, |m| m.ior(lane.lambda_nm)));
            let radiance =
                matte.reflectance.at(lane.lambda_nm) * (direct + through) / PI * (n_eye / n).powi(2);
            for (sum, xyz) in self.xyz.iter_mut().zip(lane.xyz) {
                *sum += xyz * radiance * power * landing.flux;
            }
        }
        landing.layer != Layer::Direct
    }
}
