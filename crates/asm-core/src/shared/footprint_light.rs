//! Host side of `shaders/shared/footprint_light.wgsl`: how much light a cell has, of which wavelengths, and what the first surface's
//! material takes of it.

use std::ops::Deref;

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec3};

use super::emission::spot_falloff;
use super::flux::{QUANTUM, part_from};
use super::footprint::*;
use super::footprint_landings::*;
use super::optics::Optics;

/// A light whose cells are laid down; mirrors `FootprintLight`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FootprintLight {
    /// Unit axis of the cone.
    pub spot_axis: Vec3,
    /// Squared clamp(cosine * scale + offset) is the cone's falloff.
    pub spot_scale: f32,
    /// See `spot_scale`.
    pub spot_offset: f32,
    /// Row of this light, in `bands`.
    pub first_band: u32,
    /// Row of this light and path.
    pub first_ledger: u32,
    /// Padding.
    pub reserved0: u32,
}

/// All light of the bins before one, where it lands on one material; mirrors `RunningBand`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct RunningBand {
    /// XYZ as parts, see [`part_from`].
    pub weight: [u32; 3],
    /// Padding.
    pub reserved0: u32,
    /// Integral of place in the spectrum, 0 to 1, times XYZ, as parts.
    pub moment: [u32; 3],
    /// Padding.
    pub reserved1: u32,
}

/// What passes over the light of cells read.
#[derive(Clone, Copy)]
pub struct CellLight<'a> {
    /// Of the uniform.
    pub light: FootprintLight,
    /// The cells, and where they land.
    pub landings: Landings<'a>,
    /// Bin x material where light lands.
    pub bands: &'a [RunningBand],
    /// Of paths.
    pub ends: &'a [PathEnds],
}

impl<'a> Deref for CellLight<'a> {
    type Target = Landings<'a>;

    fn deref(&self) -> &Landings<'a> {
        &self.landings
    }
}

/// What glass absorbs of a range is averaged over so many parts of it.
const ABSORBING_BANDS: u32 = 8;

/// What a surface takes, which may be steeper.
const SURFACE_BANDS: u32 = 32;

/// What a first surface's material does to each channel.
struct Colour {
    /// Per working unit.
    absorptions: Vec3,
    /// What its surface lets through or throws back.
    surfaces: Vec3,
}

impl Spread {
    /// Share of the flux of each channel that comes through at a corner, each at its own abscissa. What depends on the wavelength
    /// through the first surface's material is not interpolated between nodes: that is taken off there, and put back here.
    fn passes(&self, corner: usize, x: [f32; 3], colour: &Colour) -> Vec3 {
        let (mut parts, mut inside) = (Vec3::ZERO, Vec3::ZERO);
        for (c, x) in x.into_iter().enumerate() {
            for (node, share) in self.weights(x).into_iter().enumerate() {
                parts[c] += share / self.surfaces[node] * self.parts[corner][node];
                inside[c] += share * self.lengths[corner][node];
            }
        }
        let passes = (parts * colour.surfaces).clamp(Vec3::ZERO, Vec3::ONE);
        passes * (-colour.absorptions * inside.max(Vec3::ZERO)).exp()
    }
}

impl CellLight<'_> {
    /// Flux at a texel's centre.
    fn texel_flux(&self, texel: UVec2) -> f32 {
        let view = &self.views[self.params.emission_view as usize];
        let direction = view.ray(texel.as_vec2() + 0.5).direction;
        let FootprintLight { spot_axis, spot_scale, spot_offset, .. } = self.light;
        let falloff = spot_falloff(direction, spot_axis, spot_scale, spot_offset);
        QUANTUM * view.texel_measure(texel) * falloff
    }

    /// All wavelengths of a cell; the flux of cells that one is split into adds up to its own.
    pub fn cell_flux(&self, cell: &FootprintCell) -> u32 {
        let whole = cell.at >> cell.level;
        let sum = self.texel_flux(whole)
            + self.texel_flux(whole + UVec2::X)
            + self.texel_flux(whole + UVec2::Y)
            + self.texel_flux(whole + 1);
        let half =
            |at: u32, level: u32| move |flux: u32, split: u32| (flux + (at >> (level - split) & 1)) / 2;
        let in_x = (1..=cell.level.x).fold((0.25 * sum + 0.5) as u32, half(cell.at.x, cell.level.x));
        (1..=cell.level.y).fold(in_x, half(cell.at.y, cell.level.y))
    }

    fn running_band(&self, bin: u32, material: u32) -> &RunningBand {
        &self.bands[((self.light.first_band + bin) * (self.params.materials + 1) + material) as usize]
    }

    /// Where the light of some bins lies on the whole, as a bin, channel by channel.
    pub fn centroids(&self, bin: u32, bins: u32, material: u32) -> [f32; 3] {
        let [start, end] = [bin, bin + bins].map(|edge| self.running_band(edge, material));
        std::array::from_fn(|c| {
            let weight = (end.weight[c] - start.weight[c]) as f32;
            let moment = (end.moment[c] - start.moment[c]) as f32;
            let place = if weight > 0.0 {
                self.params.bins as f32 * moment / weight
            } else {
                bin as f32 + 0.5 * bins as f32
            };
            place.clamp(bin as f32, (bin + bins) as f32)
        })
    }

    /// XYZ of all light of the bins before one, where it lands on one material.
    pub fn band_weight(&self, bin: u32, material: u32) -> [u32; 3] {
        self.running_band(bin, material).weight
    }

    /// XYZ of the bins from one to another.
    pub fn weight_between(&self, start: u32, end: u32, material: u32) -> [u32; 3] {
        let (before, until) = (self.band_weight(start, material), self.band_weight(end, material));
        std::array::from_fn(|c| until[c] - before[c])
    }

    /// XYZ of all light before a place in the spectrum, as parts.
    pub fn weight_before(&self, bin: f32, material: u32) -> Vec3 {
        let lower = (bin as u32).min(self.params.bins - 1);
        let share = bin - lower as f32;
        let [a, b] = [lower, lower + 1].map(|edge| {
            let [x, y, z] = self.band_weight(edge, material).map(|w| w as f32);
            Vec3::new(x, y, z)
        });
        a * (1.0 - share) + b * share
    }

    /// At a place in the spectrum of each channel's own, as a bin.
    fn colour(&self, bins: [f32; 3], material: u32) -> Colour {
        let [x, y, z] = bins.map(|bin| self.optics_at(bin, material));
        Colour {
            absorptions: Vec3::new(x.absorption, y.absorption, z.absorption),
            surfaces: Vec3::new(x.surface, y.surface, z.surface),
        }
    }

    /// Share of the flux of each channel of some bins that comes through, by corner, where all of the cell lands as one.
    pub fn passes(
        &self,
        spread: &Spread,
        cell: &FootprintCell,
        bin: u32,
        bins: u32,
        first: &PathLanding,
    ) -> [Vec3; 4] {
        let (lit, medium) = (first.place >> 8, first.medium);
        let middle = self.optics_at((cell.first + cell.bins / 2) as f32, medium);
        let parts_of_range = match middle {
            Optics { surface, .. } if surface < 1.0 => SURFACE_BANDS,
            Optics { absorption, .. } if absorption > 0.0 => ABSORBING_BANDS,
            _ => 1,
        };
        let parts = (parts_of_range * bins / cell.bins).clamp(1, bins);
        let all = self.weight_between(bin, bin + bins, lit);
        let mut passes = [Vec3::ZERO; 4];
        for part in 0..parts {
            let [start, end] = [part, part + 1].map(|edge| bin + edge * bins / parts);
            let weight = self.weight_between(start, end, lit);
            let centroids = self.centroids(start, end - start, lit);
            let colour = self.colour(centroids, medium);
            let x = centroids.map(|bin| self.abscissa(cell, medium, bin));
            let share = std::array::from_fn(|c| match all[c] {
                0 => 0.0,
                all => weight[c] as f32 / all as f32,
            });
            for (corner, passes) in passes.iter_mut().enumerate() {
                *passes += Vec3::from_array(share) * spread.passes(corner, x, &colour);
            }
        }
        passes
    }

    /// What the first glass lets through of the light of some bins, channel by channel, that falls on a material.
    pub fn comes_through(&self, landing: &PathLanding, [start, end]: [u32; 2], material: u32) -> [u32; 3] {
        let Colour { absorptions, .. } =
            self.colour(self.centroids(start, end - start, material), landing.medium);
        (-absorptions * landing.length).exp().to_array().map(part_from)
    }

    /// Bins of a node where nothing can be interpolated.
    pub fn share(&self, cell: &FootprintCell, node: u32) -> [u32; 2] {
        [node, node + 1].map(|n| cell.first + share_start(self.params.nodes, n, cell.bins))
    }
}
