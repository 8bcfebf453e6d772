//! Host side of `shaders/shared/photons.wgsl`: photons of a light, one per texel of its emission view and wavelength, in tiles of
//! 8 x 8; where they start, and what they leave in the map and in the books.
//!
//! The map is 64-bit fixed point per channel. One texel's flux at one wavelength is at most 2^30 units, a plan has fewer
//! than 2^34 texels times wavelengths, so a texel that receives every photon holds less than 2^64. A photon's flux is an
//! integer from the start and every stage takes an integer part of it, so the ledger's rows add up exactly. A deposit is
//! within half a unit of flux x weight per channel, and its Gaussian taps sum to it; weights are parts of the largest of all
//! wavelengths and materials, so none exceeds 1, and each is within half of 2^-31 of that.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::emission::spot_falloff;
use super::flux::{QUANTUM, add_64, flux_part, part_from};
use super::ledger::*;
use super::light_views::{Located, on_map};
use super::photon_queue::{QUEUE_COUNT, QUEUE_HEAD, queue_cell};
use super::splat::splat;
use super::view::{Ray, View};

/// Part of the uniform of passes that trace photons; mirrors `Photons` in `shaders/shared/photons.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Photons {
    /// View fitted to the refractors.
    pub emission_view: u32,
    /// First view of where light may land.
    pub landing_view: u32,
    /// Number of those views.
    pub landing_faces: u32,
    /// First of the map's views, one per view of where light may land.
    pub map_view: u32,
    /// First row of this light, in `bands` and `optics`.
    pub first_band: u32,
    /// Row length of `bands` and `optics`.
    pub materials: u32,
    /// First row of this light and path, in `ledger`.
    pub first_ledger: u32,
    /// [`EMISSION_GRID`], [`EMISSION_QUEUE`] or [`EMISSION_SAMPLE`].
    pub emission: u32,
    /// Of [`EMISSION_SAMPLE`].
    pub sample_stride: u32,
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// `PATH_*`.
    pub path: u32,
    /// `TRIANGLE_*` of the surfaces that photons of this path follow.
    pub casters: u32,
    /// `RULE_*`.
    pub rule: u32,
    /// Guesses at the landing.
    pub landing_iterations: u32,
    /// `LANDING_*`.
    pub landing_update: u32,
    /// Texels to each side of the landing's, 0 is a point; where splats follow the photons' spacing, the most.
    pub splat_taps: u32,
    /// Middle of the receivers' bounds.
    pub landing_center: Vec3,
    /// Light beyond this distance is dark; 0 has no end.
    pub range: f32,
    /// Unit axis of the cone.
    pub spot_axis: Vec3,
    /// Squared clamp(cosine * scale + offset) is the cone's falloff.
    pub spot_scale: f32,
    /// See `spot_scale`.
    pub spot_offset: f32,
    /// Standard deviation, texels; where splats follow the photons' spacing, the least.
    pub splat_sigma: f32,
    /// Standard deviation over the distance to the next photon; 0 keeps `splat_sigma`.
    pub splat_share: f32,
    /// Photons that arrive up to so many texels beside a surface are put down too.
    pub guard_texels: f32,
    /// Distance between photons that nothing bends, texels of the landing view.
    pub splat_spacing: Vec2,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

/// Tiles of the whole emission view.
pub const EMISSION_GRID: u32 = 0;
/// Tiles that the queue holds.
pub const EMISSION_QUEUE: u32 = 1;
/// One texel in [`Photons::sample_stride`] along each side, and `map` holds only where they land: [`BOUNDS_WORDS`] per face.
pub const EMISSION_SAMPLE: u32 = 2;

/// How far the landings lie at most from the right, the left, the bottom and the top of a face, in whole texels.
pub const BOUNDS_WORDS: usize = 4;

/// Of what is not there: no row of the ledger counts it.
pub const NO_END: u32 = (LEDGER_ROWS - LEDGER_FIRST_END) as u32;

/// Photons along each side of a workgroup, which know each other's landings.
const TILE: u32 = 8;

/// Two landings farther apart than this, texels, do not belong to one beam.
const FARTHEST_NEIGHBOUR: f32 = 16.0;

/// Standard deviations that a splat reaches at least, but for this part of a texel.
const REACH_SIGMAS: f32 = 2.5;
const REACH_ROUNDING: f32 = 0.25;

/// Photons at one wavelength of one light where they land on one material; mirrors `Band`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct Band {
    /// XYZ as parts, see [`part_from`].
    pub weight: [u32; 3],
    /// Padding.
    pub reserved: u32,
}

/// One texel's flux at one wavelength.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Photon {
    /// `END_*`, or [`NO_END`].
    pub end: u32,
    /// Before anything.
    pub aimed: u32,
    /// What is left at the end.
    pub flux: u32,
    /// At the entry.
    pub reflected: u32,
    /// At the exit.
    pub kept_inside: u32,
    /// On the way.
    pub absorbed: u32,
    /// Put down away from the surface.
    pub astray: bool,
    /// Put down beside the surface.
    pub beside: bool,
}

/// What a photon leaves in the map, and where.
#[derive(Clone, Copy, Debug)]
pub struct Deposit {
    /// In the map.
    pub at: Located,
    /// XYZ.
    pub flux: [u32; 3],
}

/// What became of a photon, or of a part of it.
#[derive(Clone, Copy, Debug)]
pub struct Traced {
    /// Its books.
    pub photon: Photon,
    /// Nothing where it leaves nothing.
    pub deposit: Option<Deposit>,
}

impl Traced {
    /// Of a photon that leaves nothing.
    pub fn nothing(photon: Photon) -> Self {
        Self { photon, deposit: None }
    }
}

/// The photons of a workgroup that leave something in the map, by their places in it.
type Tile = [Option<Deposit>; (TILE * TILE) as usize];

/// The shorter of the steps from `own` to its two neighbours along x or y, texels of the map; `None` where no neighbour
/// belongs to the same beam.
fn step_to_neighbour(tile: &Tile, own: &Located, place: u32, along_y: bool) -> Option<Vec2> {
    let (index, stride) = if along_y { (place / TILE, TILE) } else { (place % TILE, 1) };
    let before = (index > 0).then(|| place - stride);
    let after = (index + 1 < TILE).then(|| place + stride);
    let step = |other: u32| {
        let deposit = tile[other as usize].filter(|d| d.at.face == own.face)?;
        let step = deposit.at.texel - own.texel;
        (step.length_squared() < FARTHEST_NEIGHBOUR * FARTHEST_NEIGHBOUR).then_some(step)
    };
    match (before.and_then(step), after.and_then(step)) {
        (Some(a), Some(b)) => Some(if b.length_squared() < a.length_squared() { b } else { a }),
        (a, b) => a.or(b),
    }
}

impl Photon {
    /// Keeps a share; the rest is absorbed.
    pub fn absorb(&mut self, passes: f32) {
        let passed = flux_part(self.flux, part_from(passes));
        self.absorbed += self.flux - passed;
        self.flux = passed;
    }

    /// Flux and photons that a row of the ledger counts; what follows the first arrival of a photon sets out no more.
    fn entry_of_row(&self, row: usize, first: bool) -> (u32, u32) {
        let of = |flux: u32| (flux, u32::from(flux != 0));
        match row {
            LEDGER_AIMED if first => (self.aimed, 1),
            LEDGER_EMITTED if first && self.end != END_MISSED && self.end != END_BLOCKED => (self.aimed, 1),
            LEDGER_AIMED | LEDGER_EMITTED => (0, 0),
            LEDGER_REFLECTED => of(self.reflected),
            LEDGER_KEPT_INSIDE => of(self.kept_inside),
            LEDGER_ABSORBED => of(self.absorbed),
            LEDGER_ASTRAY if self.astray => (self.flux, 1),
            LEDGER_BESIDE if self.beside => (self.flux, 1),
            _ if row == LEDGER_FIRST_END + self.end as usize => (self.flux, 1),
            _ => (0, 0),
        }
    }
}

/// A light's photons and the views that they are seen in.
#[derive(Clone, Copy)]
pub struct PhotonTiles<'a> {
    /// The uniform's part.
    pub photons: &'a Photons,
    /// All views.
    pub views: &'a [View],
    /// Band x material where photons land.
    pub bands: &'a [Band],
}

impl PhotonTiles<'_> {
    /// The ray of a texel of the emission view, and its photon before it meets anything.
    pub fn emitted(&self, texel: UVec2) -> (Ray, Photon) {
        let Photons { emission_view, spot_axis, spot_scale, spot_offset, .. } = *self.photons;
        let view = &self.views[emission_view as usize];
        let light_ray = view.ray(texel.as_vec2() + 0.5);
        let falloff = spot_falloff(light_ray.direction, spot_axis, spot_scale, spot_offset);
        let aimed = (QUANTUM * view.texel_measure(texel) * falloff + 0.5) as u32;
        (light_ray, Photon { end: END_MISSED, aimed, flux: aimed, ..Photon::default() })
    }

    /// A photon that arrives at a point of a surface of `material`, `at` being that in the landing views.
    pub fn put_down(&self, photon: Photon, at: Located, point: Vec3, material: u32, band: u32) -> Traced {
        let photons = self.photons;
        let at = on_map(self.views, at, photons.landing_view, photons.map_view, point);
        if !at.found {
            return Traced::nothing(Photon { end: END_OUTSIDE_MAP, beside: false, ..photon });
        }
        let row = (photons.first_band + band) * photons.materials + material;
        let flux = self.bands[row as usize].weight.map(|w| flux_part(photon.flux, w));
        Traced { photon, deposit: Some(Deposit { at, flux }) }
    }

    /// `wavelengths` photons per texel into the map and the books, in tiles of the whole emission view or of the queue if there is
    /// one; `trace` takes a texel and a band, and fills in each of `arrivals`.
    pub(crate) fn lay_down(
        &self,
        wavelengths: u32,
        arrivals: usize,
        queue: Option<&[AtomicU32]>,
        map: &[AtomicU32],
        ledger: &[AtomicU32],
        trace: impl Fn(UVec2, u32, &mut [Traced]) + Sync,
    ) {
        let size = self.views[self.photons.emission_view as usize].size;
        let grid = UVec2::new(size.x.div_ceil(TILE), size.y.div_ceil(TILE));
        let queued = queue.map(|queue| {
            let count = queue[QUEUE_COUNT].load(Ordering::Relaxed) as usize;
            &queue[QUEUE_HEAD..QUEUE_HEAD + count]
        });
        let tiles = queued.map_or(grid.x * grid.y, |tiles| tiles.len() as u32);
        for band in 0..wavelengths {
            (0..tiles.div_ceil(grid.x)).into_par_iter().for_each(|row| {
                let mut sums = [(0u64, 0u32); LEDGER_ROWS];
                let mut left = vec![[None; (TILE * TILE) as usize]; arrivals];
                for i in row * grid.x..tiles.min((row + 1) * grid.x) {
                    let tile = queued.map_or(UVec2::new(i % grid.x, i / grid.x), |tiles| {
                        queue_cell(tiles[i as usize].load(Ordering::Relaxed))
                    });
                    self.trace_tile(TILE * tile, size, &mut left, &mut sums, |texel, traced| {
                        trace(texel, band, traced);
                    });
                    left.iter().for_each(|left| self.lay_down_tile(left, map));
                }
                for (row, (flux, photons)) in sums.into_iter().enumerate() {
                    let index =
                        LEDGER_WORDS * (LEDGER_ROWS * (self.photons.first_ledger + band) as usize + row);
                    add_64(&ledger[index..index + 2], flux);
                    ledger[index + 2].fetch_add(photons, Ordering::Relaxed);
                }
            });
        }
    }

    /// As `lay_down`, of [`EMISSION_SAMPLE`].
    pub(crate) fn bounds(
        &self,
        wavelengths: u32,
        arrivals: usize,
        bounds: &[AtomicU32],
        trace: impl Fn(UVec2, u32, &mut [Traced]) + Sync,
    ) {
        let size = self.views[self.photons.emission_view as usize].size;
        let stride = self.photons.sample_stride;
        let along = |first: u32, texels: u32| (first..texels).step_by(stride as usize);
        for band in 0..wavelengths {
            // Another texel of each square at each wavelength.
            let place = (7 * band + 10) % (stride * stride);
            let (x, y) = (place % stride, place / stride);
            along(y, size.y).collect::<Vec<_>>().into_par_iter().for_each(|y| {
                let mut traced = vec![NO_TRACE; arrivals];
                for x in along(x, size.x) {
                    traced.fill(NO_TRACE);
                    trace(UVec2::new(x, y), band, &mut traced);
                    for deposit in traced.iter().filter_map(|traced| traced.deposit) {
                        let at = deposit.at;
                        landing_bounds_add(self.views[at.view as usize].size, at.face, at.texel, bounds);
                    }
                }
            });
        }
    }

    /// The photons of a workgroup: what each leaves at each arrival.
    fn trace_tile(
        &self,
        first: UVec2,
        size: UVec2,
        left: &mut [Tile],
        sums: &mut [(u64, u32); LEDGER_ROWS],
        trace: impl Fn(UVec2, &mut [Traced]),
    ) {
        let mut traced = vec![NO_TRACE; left.len()];
        left.fill([None; (TILE * TILE) as usize]);
        for place in 0..TILE * TILE {
            let texel = first + UVec2::new(place % TILE, place / TILE);
            if texel.x >= size.x || texel.y >= size.y {
                continue;
            }
            traced.fill(NO_TRACE);
            trace(texel, &mut traced);
            for (arrival, (traced, left)) in traced.iter().zip(&mut *left).enumerate() {
                left[place as usize] = traced.deposit;
                for (row, sum) in sums.iter_mut().enumerate() {
                    let (flux, photons) = traced.photon.entry_of_row(row, arrival == 0);
                    sum.0 += u64::from(flux);
                    sum.1 += photons;
                }
            }
        }
    }

    fn lay_down_tile(&self, tile: &Tile, map: &[AtomicU32]) {
        for place in 0..TILE * TILE {
            if let Some(deposit) = &tile[place as usize] {
                let (reach, sigma) = self.splat_shape(tile, &deposit.at, place);
                splat(self.views, &deposit.at, deposit.flux, reach, sigma, map);
            }
        }
    }

    /// Reach and standard deviation of a photon's splat along x and y: as wide as its beam, told from where its neighbours
    /// land.
    fn splat_shape(&self, tile: &Tile, own: &Located, place: u32) -> (UVec2, Vec2) {
        let params = self.photons;
        if params.splat_share == 0.0 {
            return (UVec2::splat(params.splat_taps), Vec2::splat(params.splat_sigma));
        }
        let texel_slope = |first: u32| self.views[(first + own.face) as usize].texel_slope;
        let finer = texel_slope(params.landing_view) / texel_slope(params.map_view);
        let spacing = params.splat_spacing * finer;
        let alone = [Vec2::new(spacing.x, 0.0), Vec2::new(0.0, spacing.y)];
        let [a, b] =
            [false, true].map(|y| step_to_neighbour(tile, own, place, y).unwrap_or(alone[usize::from(y)]));
        let width = (a * a + b * b).map(f32::sqrt);
        let most = (params.splat_taps as f32 + REACH_ROUNDING) / REACH_SIGMAS;
        let sigma = (params.splat_share * width).clamp(Vec2::splat(params.splat_sigma), Vec2::splat(most));
        ((REACH_SIGMAS * sigma - REACH_ROUNDING).ceil().as_uvec2(), sigma)
    }
}

const NO_TRACE: Traced = Traced {
    photon: Photon {
        end: NO_END,
        aimed: 0,
        flux: 0,
        reflected: 0,
        kept_inside: 0,
        absorbed: 0,
        astray: false,
        beside: false,
    },
    deposit: None,
};

/// A landing on a face of landing views, of `size`, into its words of `bounds`.
pub(crate) fn landing_bounds_add(size: UVec2, face: u32, texel: Vec2, bounds: &[AtomicU32]) {
    let texel = texel.max(Vec2::ZERO).as_uvec2().min(size - 1);
    let from = [size.x - texel.x, texel.x + 1, size.y - texel.y, texel.y + 1];
    for (word, from) in bounds[BOUNDS_WORDS * face as usize..].iter().zip(from) {
        word.fetch_max(from, Ordering::Relaxed);
    }
}
