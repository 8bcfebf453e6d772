//! Footprints of cells into the map: where all paths of a cell belong together, its light is laid down as a continuous function of
//! place and wavelength; where they do not and the cell is not split further, every path is put down for itself. Twin of
//! `shaders/footprint_splat.wgsl`; terms in `shared/footprint.rs`.
//!
//! The idea has a literature: spectral ray differentials (Elek et al. 2014), photon differentials (Frisvad et al. 2014). Positions
//! are bilinear in the cell and a polynomial in 1 / wavelength^2 through its nodes; the light of a step along the spectrum is a
//! difference of running integrals, so colour is exact whatever the step.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{IVec2, UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::{
    EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_CELLS_WGSL, FOOTPRINT_LANDINGS_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL,
    OPTICS_WGSL, PHOTON_QUEUE_WGSL, SPLAT_TENT_WGSL, VIEW_WGSL, binding,
};
use crate::shared::emission::spot_falloff;
use crate::shared::flux::{QUANTUM, WHOLE, add_64, flux_part, part_from};
use crate::shared::footprint::*;
use crate::shared::footprint_cells::*;
use crate::shared::footprint_landings::*;
use crate::shared::ledger::*;
use crate::shared::splat_tent::splat_tent;

/// Uniform of the pass; mirrors `FootprintSplat` in `shaders/footprint_splat.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FootprintSplat {
    /// The cells.
    pub cells: FootprintCells,
    /// Row of this light, in `bands`.
    pub first_band: u32,
    /// Row of this light and path.
    pub first_ledger: u32,
    /// Squared clamp(cosine * scale + offset) is the cone's falloff.
    pub spot_scale: f32,
    /// Padding.
    pub reserved0: u32,
    /// Unit axis of the cone.
    pub spot_axis: Vec3,
    /// See `spot_scale`.
    pub spot_offset: f32,
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

/// All that an executor needs to build and run `footprint_splat`.
pub const FOOTPRINT_SPLAT: PassInfo = PassInfo {
    name: "footprint_splat",
    wgsl: &[
        VIEW_WGSL,
        OPTICS_WGSL,
        EMISSION_WGSL,
        FLUX_WGSL,
        LEDGER_WGSL,
        PHOTON_QUEUE_WGSL,
        FOOTPRINT_WGSL,
        FOOTPRINT_CELLS_WGSL,
        FOOTPRINT_LANDINGS_WGSL,
        SPLAT_TENT_WGSL,
        include_str!("../../../../shaders/footprint_splat.wgsl"),
    ],
    params_struct: "FootprintSplat",
    params_bytes: size_of::<FootprintSplat>() as u32,
    bindings: &[
        binding("landings", BindingKind::Read),
        binding("ends", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("bands", BindingKind::Read),
        binding("optics", BindingKind::Read),
        binding("map", BindingKind::Atomic),
        binding("ledger", BindingKind::Atomic),
        binding("queues", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [CELLS_PER_GROUP, 1, 1],
        mirror: |args| {
            let params: FootprintSplat = args.params();
            let (views, queues) = (args.read("views"), args.atomics("queues"));
            let cells = Cells { params: params.cells, views, queues };
            let landings = Landings { cells, landings: args.read("landings"), optics: args.read("optics") };
            let inputs = Inputs { params, landings, ends: args.read("ends"), bands: args.read("bands") };
            footprint_splat(&inputs, args.atomics("map"), args.atomics("ledger"));
        },
    },
};

/// What `footprint_splat` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: FootprintSplat,
    /// The cells, and where they land.
    pub landings: Landings<'a>,
    /// Of paths.
    pub ends: &'a [PathEnds],
    /// Bin x material where light lands.
    pub bands: &'a [RunningBand],
}

/// Shortest step that a cell's light is laid down in, texels.
const STEP_TEXELS: f32 = 0.25;

/// A cell's light is laid down in about so many steps at most: beyond, they are longer.
pub const MOST_STEPS: f32 = 128.0;

/// Tents of up to so many steps may reach [`FEW_WIDEST`] texels to either side; those of more [`MANY_WIDEST`].
const FEW_STEPS: u32 = 32;
/// See [`FEW_STEPS`].
const FEW_WIDEST: f32 = 7.5;
/// See [`FEW_STEPS`].
const MANY_WIDEST: f32 = 3.5;

/// Fewer where it has less light, down to these.
const LEAST_STEPS: f32 = 4.0;

/// Steps of all light of the emission view, were it evenly spread over its cells.
const ALL_STEPS: f32 = 2.5e6;

/// Texels gather light from triangles that cover at least twice as many.
const LEAST_AREA: f32 = 4.0;

/// And that lie within so many along each side: no invocation goes round for ever.
const MOST_GATHERED: f32 = 40.0;

/// Pieces of a range within which triangles only move along a line.
const PIECES: u32 = 4;

/// Texels take their light just beside their centres: sides of footprints that run through centres are on one side of them.
const BESIDE_CENTRE: Vec2 = Vec2::new(1.37e-3, 0.71e-3);

/// What glass absorbs is averaged over so many parts of a range.
const ABSORBING_BANDS: u32 = 8;

/// Flux and cells of each node and row of the ledger.
type Sums = [[(u64, u32); LEDGER_ROWS]; MOST_NODES];

/// The triangles of a cell, by their corners.
const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 3], [0, 3, 2]];

/// Steps that a cell's light is laid down in.
struct Steps {
    across: u32,
    down: u32,
    bands: u32,
}

/// What a first surface's material does to each channel.
struct Colour {
    /// Per working unit.
    absorptions: Vec3,
    /// What its surface lets through or throws back.
    surfaces: Vec3,
}

/// Some bins of a cell's light, by corner.
struct LandedBand {
    /// Texels of the map.
    at: [Vec2; 4],
    /// From their first to their last.
    along: Vec2,
    /// XYZ, as parts of all light.
    weight: [u32; 3],
    /// Share of the flux of each channel that comes through.
    passes: [Vec3; 4],
}

impl Extent {
    /// Steps of a cell that has this part of all light: such that none is longer than a quarter of a texel, unless there were too many.
    fn steps(&self, part_of_light: f32, bins: u32) -> Steps {
        let most = (ALL_STEPS * part_of_light).clamp(LEAST_STEPS, MOST_STEPS);
        let [across, down, along] =
            [self.across, self.down, self.along].map(|texels| texels.max(STEP_TEXELS));
        let longest = (across * down * along / most).powf(1.0 / 3.0).max(STEP_TEXELS);
        let mut bands = 1;
        while bands < bins && (bands as f32) * longest < along {
            bands *= 2;
        }
        let steps = |texels: f32| (texels / longest).ceil().clamp(1.0, MOST_STEPS) as u32;
        Steps { across: steps(across), down: steps(down), bands }
    }
}

impl Spread {
    /// Both triangles are large and neither is turned over, at any node: texels can gather their light.
    fn is_wide(&self, extent: &Extent) -> bool {
        if extent.across.max(extent.down) + extent.along / PIECES as f32 > MOST_GATHERED {
            return false;
        }
        let area = |node: usize, [a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| self.places[corner][node]);
            (b - a).perp_dot(c - a)
        };
        let turned = area(0, TRIANGLES[0]).signum();
        (0..self.nodes).all(|node| TRIANGLES.into_iter().all(|t| turned * area(node, t) >= 2.0 * LEAST_AREA))
    }

    /// Share of the flux of each channel that comes through at a corner. What depends on the wavelength through the first surface's
    /// material is not interpolated between nodes: that is taken off there, and put back here.
    fn passes(&self, corner: usize, x: f32, colour: &Colour) -> Vec3 {
        let (mut part, mut inside) = (0.0, 0.0_f32);
        for (node, share) in self.weights(x).into_iter().enumerate() {
            part += share / self.surfaces[node] * self.parts[corner][node];
            inside += share * self.lengths[corner][node];
        }
        let passes = (part * colour.surfaces).clamp(Vec3::ZERO, Vec3::ONE);
        passes * (-colour.absorptions * inside.max(0.0)).exp()
    }
}

/// What is left of a piece where a corner's weight, which falls so much over all of it, is not below 0.
fn seen_of([from, to]: [f32; 2], (weight, falls): (f32, f32)) -> [f32; 2] {
    if falls > 0.0 {
        [from, to.min(weight / falls)]
    } else if falls < 0.0 {
        [from.max(weight / falls), to]
    } else if weight < 0.0 {
        [from, from]
    } else {
        [from, to]
    }
}

/// CPU mirror: the cells of the emission view or of the queue that are not split further.
pub fn footprint_splat(inputs: &Inputs<'_>, map: &[AtomicU32], ledger: &[AtomicU32]) {
    let params = &inputs.params;
    let cells = inputs.landings.count();
    (0..cells.div_ceil(CELLS_PER_GROUP)).into_par_iter().for_each(|group| {
        let mut sums: Sums = [[(0, 0); LEDGER_ROWS]; MOST_NODES];
        let mut work = [0; WORK_COUNTS];
        for i in group * CELLS_PER_GROUP..cells.min((group + 1) * CELLS_PER_GROUP) {
            let Some(emitted) = inputs.landings.emitted(i) else { continue };
            work[WORK_CORNERS] += u64::from(emitted.traced);
            if inputs.landings.split(i) == TOGETHER {
                work[WORK_CELLS] += 1;
                work[WORK_BINS] += u64::from(emitted.cell.bins);
                work[WORK_DEPOSITS] += inputs.lay(&emitted, map, &mut sums);
            }
        }
        for (words, count) in inputs.landings.queues.chunks_exact(2).zip(work) {
            add_64(words, count);
        }
        for (node, rows) in sums.iter().enumerate().take(params.cells.nodes as usize) {
            for (row, &(flux, cells)) in rows.iter().enumerate() {
                let index = LEDGER_WORDS * (LEDGER_ROWS * (params.first_ledger as usize + node) + row);
                add_64(&ledger[index..index + 2], flux);
                ledger[index + 2].fetch_add(cells, Ordering::Relaxed);
            }
        }
    });
}

impl Inputs<'_> {
    /// Flux at a texel's centre.
    fn texel_flux(&self, texel: UVec2) -> f32 {
        let params = &self.params;
        let view = &self.landings.views[params.cells.emission_view as usize];
        let direction = view.ray(texel.as_vec2() + 0.5).direction;
        let falloff = spot_falloff(direction, params.spot_axis, params.spot_scale, params.spot_offset);
        QUANTUM * view.texel_measure(texel) * falloff
    }

    /// All wavelengths of a cell; the flux of cells that one is split into adds up to its own.
    fn cell_flux(&self, cell: &FootprintCell) -> u32 {
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
        let params = &self.params;
        &self.bands[((params.first_band + bin) * (params.cells.materials + 1) + material) as usize]
    }

    /// Where the light of some bins lies on the whole, as a bin, channel by channel.
    fn centroids(&self, bin: u32, bins: u32, material: u32) -> [f32; 3] {
        let [start, end] = [bin, bin + bins].map(|edge| self.running_band(edge, material));
        std::array::from_fn(|c| {
            let weight = (end.weight[c] - start.weight[c]) as f32;
            let moment = (end.moment[c] - start.moment[c]) as f32;
            let place = if weight > 0.0 {
                self.params.cells.bins as f32 * moment / weight
            } else {
                bin as f32 + 0.5 * bins as f32
            };
            place.clamp(bin as f32, (bin + bins) as f32)
        })
    }

    /// XYZ of all light of the bins before one, where it lands on one material.
    fn band_weight(&self, bin: u32, material: u32) -> [u32; 3] {
        self.running_band(bin, material).weight
    }

    /// XYZ of the bins from one to another.
    fn weight_between(&self, start: u32, end: u32, material: u32) -> [u32; 3] {
        let (before, until) = (self.band_weight(start, material), self.band_weight(end, material));
        std::array::from_fn(|c| until[c] - before[c])
    }

    /// At a place in the spectrum of each channel's own, as a bin.
    fn absorptions(&self, bins: [f32; 3], material: u32) -> Vec3 {
        let at = |bin: f32| {
            let lower = (bin as u32).min(self.params.cells.bins - 1);
            let share = bin - lower as f32;
            self.absorption(lower, material) * (1.0 - share) + self.absorption(lower + 1, material) * share
        };
        Vec3::from_array(bins.map(at))
    }

    /// At a place in the spectrum of each channel's own, as a bin.
    fn colour(&self, bins: [f32; 3], material: u32) -> Colour {
        let surfaces = bins.map(|bin| self.landings.surface_at(bin, material));
        Colour { absorptions: self.absorptions(bins, material), surfaces: Vec3::from_array(surfaces) }
    }

    fn absorption(&self, bin: u32, material: u32) -> f32 {
        let params = &self.params;
        let row = params.cells.first_optics + bin.min(params.cells.bins);
        self.landings.optics[(row * params.cells.materials + material) as usize].absorption
    }

    /// Number of deposits.
    fn lay(&self, emitted: &Emitted, map: &[AtomicU32], sums: &mut Sums) -> u64 {
        let flux = self.cell_flux(&emitted.cell);
        self.keep_books(emitted, flux, sums);
        let mut deposits = 0;
        for order in 0..self.params.cells.orders {
            if self.landings.belonging(emitted, order) != TOGETHER {
                deposits += self.lay_points(emitted, flux, order, map);
            } else if self.landings.landing(emitted, 0, 0, order).end == END_LANDED {
                deposits += self.lay_footprint(emitted, flux, order, map);
            }
        }
        deposits
    }

    /// All paths belong together: light between them lies between their landings.
    fn lay_footprint(&self, emitted: &Emitted, cell_flux: u32, order: u32, map: &[AtomicU32]) -> u64 {
        let first = self.landings.landing(emitted, 0, 0, order);
        let face = first.place & 0xff;
        let cell = &emitted.cell;
        let spread = self.landings.gather(emitted, order, face);
        let extent = spread.extent();
        let curves = self.landings.curves(emitted, order);
        if spread.is_wide(&extent) && curves.bend().max_element() <= MOST_BEND {
            return self.lay_wide(&spread, emitted, cell_flux, first, map);
        }
        let texels = self.landings.views[self.params.cells.emission_view as usize].size;
        let part_of_light =
            spread.parts[0][0] / ((texels.x * texels.y) << (cell.level.x + cell.level.y)) as f32;
        let Steps { across, down, bands } = extent.steps(part_of_light, cell.bins);
        let bins = cell.bins / bands;
        let count = across * down * bands;
        // Long steps are not made even where there are many of them: no invocation goes round for ever.
        let widest = Vec2::splat(if count > FEW_STEPS { MANY_WIDEST } else { FEW_WIDEST });
        let size = self.landings.views[(self.params.cells.map_view + face) as usize].size;
        for band in 0..bands {
            let LandedBand { at, along, weight, passes } =
                self.landed_band(&spread, cell, cell.first + band * bins, bins, first);
            for step in 0..across * down {
                let x = ((step % across) as f32 + 0.5) / across as f32;
                let y = ((step / across) as f32 + 0.5) / down as f32;
                let passed = passes[0].lerp(passes[1], x).lerp(passes[2].lerp(passes[3], x), y);
                let flux = (cell_flux + step) / (across * down);
                let (upper, lower) = (at[0].lerp(at[1], x), at[2].lerp(at[3], x));
                let [beyond, to_right, to_below] = curves.beyond(x, y);
                let step_x = ((at[1] - at[0]).lerp(at[3] - at[2], y) + to_right) / across as f32;
                let step_y = (lower - upper + to_below) / down as f32;
                let width = (step_x * step_x + step_y * step_y + along * along).map(f32::sqrt).min(widest);
                let own =
                    std::array::from_fn(|c| flux_part(flux_part(flux, part_from(passed[c])), weight[c]));
                splat_tent(size, face, upper.lerp(lower, y) + beyond, width, own, map);
            }
        }
        u64::from(count)
    }

    /// Some bins of a cell's light, where all of it lands as one.
    fn landed_band(
        &self,
        spread: &Spread,
        cell: &FootprintCell,
        bin: u32,
        bins: u32,
        first: &PathLanding,
    ) -> LandedBand {
        let (lit, medium) = (first.place >> 8, first.medium);
        let abscissa = |bin: f32| self.landings.abscissa(cell, medium, bin);
        let [from_x, to_x] = [bin, bin + bins].map(|edge| abscissa(edge as f32));
        let center = abscissa(self.centroids(bin, bins, lit)[1]);
        let mut landed = LandedBand {
            at: std::array::from_fn(|corner| spread.place_at(corner, center)),
            along: Vec2::ZERO,
            weight: self.weight_between(bin, bin + bins, lit),
            passes: [Vec3::ZERO; 4],
        };
        for corner in 0..4 {
            landed.along += 0.25 * (spread.place_at(corner, to_x) - spread.place_at(corner, from_x));
        }
        let middle = cell.first + cell.bins / 2;
        let absorbs =
            self.absorption(middle, medium) > 0.0 || self.landings.surface_at(middle as f32, medium) < 1.0;
        let parts = if absorbs { (ABSORBING_BANDS * bins / cell.bins).clamp(1, bins) } else { 1 };
        for part in 0..parts {
            let bin = bin + part * (bins / parts);
            let weight = self.weight_between(bin, bin + bins / parts, lit);
            let centroids = self.centroids(bin, bins / parts, lit);
            let colour = self.colour(centroids, medium);
            let x = abscissa(centroids[1]);
            let share = Vec3::from_array(std::array::from_fn(|c| match landed.weight[c] {
                0 => 0.0,
                all => weight[c] as f32 / all as f32,
            }));
            for (corner, passes) in landed.passes.iter_mut().enumerate() {
                *passes += share * spread.passes(corner, x, &colour);
            }
        }
        landed
    }

    /// The place in the spectrum, as a bin, of an abscissa of a cell's range: two steps of Newton's, since the index is nearly
    /// linear.
    fn bin_at(&self, cell: &FootprintCell, material: u32, x: f32) -> f32 {
        let start = self.landings.index_at(cell.first as f32, material);
        let span = self.landings.index_at((cell.first + cell.bins) as f32, material) - start;
        let bin = cell.first as f32 + x * cell.bins as f32;
        if span.abs() < 1e-6 {
            return bin;
        }
        let last = (cell.first + cell.bins - 1) as f32;
        (0..2).fold(bin, |bin, _| {
            let edge = bin.min(last);
            let slope = self.landings.index_at(edge + 1.0, material) - self.landings.index_at(edge, material);
            let beside = (start + x * span - self.landings.index_at(bin, material)) / slope;
            (bin + beside).clamp(cell.first as f32, last + 1.0)
        })
    }

    /// XYZ of all light before a place in the spectrum, as parts.
    fn weight_before(&self, bin: f32, material: u32) -> Vec3 {
        let lower = (bin as u32).min(self.params.cells.bins - 1);
        let share = bin - lower as f32;
        let [a, b] = [lower, lower + 1].map(|edge| {
            let [x, y, z] = self.band_weight(edge, material).map(|w| w as f32);
            Vec3::new(x, y, z)
        });
        a * (1.0 - share) + b * share
    }

    /// As [`Inputs::lay_footprint`] where the cell covers many texels: each gathers the part of the spectrum that its place sees of
    /// the cell's triangles, which move along with the wavelength. Neighbouring cells share corners, so none is seen twice.
    fn lay_wide(
        &self,
        spread: &Spread,
        emitted: &Emitted,
        cell_flux: u32,
        first: &PathLanding,
        map: &[AtomicU32],
    ) -> u64 {
        let (face, lit, medium) = (first.place & 0xff, first.place >> 8, first.medium);
        let cell = &emitted.cell;
        let size = self.landings.views[(self.params.cells.map_view + face) as usize].size.as_ivec2();
        let mut deposits = 0;
        let pieces = if spread.nodes == 1 { 1 } else { PIECES };
        for piece in 0..pieces {
            let [from_x, middle_x, to_x] =
                [0.0, 0.5, 1.0].map(|share| (piece as f32 + share) / pieces as f32);
            let [first_bin, end_bin] = [from_x, to_x].map(|x| self.bin_at(cell, medium, x).round() as u32);
            let first_bin = first_bin.min(cell.first + cell.bins - 1);
            let centroids = self.centroids(first_bin, (end_bin - first_bin).max(1), lit);
            let colour = self.colour(centroids, medium);
            let at: [Vec2; 4] = std::array::from_fn(|corner| spread.place_at(corner, middle_x));
            let moves: [Vec2; 4] =
                std::array::from_fn(|corner| spread.place_at(corner, to_x) - spread.place_at(corner, from_x));
            let passes: [Vec3; 4] = std::array::from_fn(|corner| spread.passes(corner, middle_x, &colour));
            for corners in TRIANGLES {
                let [a, b, c] = corners.map(|corner| at[corner]);
                let [pass_a, pass_b, pass_c] = corners.map(|corner| passes[corner]);
                let along = corners.map(|corner| moves[corner]).into_iter().sum::<Vec2>() / 3.0;
                let area = (b - a).perp_dot(c - a);
                let per_texel = cell_flux as f32 / area.abs();
                // Weights of b and c at a place, and how they change along with the wavelength.
                let weights = |p: Vec2| Vec2::new(p.perp_dot(c - a), (b - a).perp_dot(p)) / area;
                let slope = weights(along);
                let reach = 0.5 * along.abs();
                let low = (a.min(b).min(c) - reach).floor().as_ivec2().max(IVec2::ZERO);
                let high = (a.max(b).max(c) + reach).ceil().as_ivec2().min(size);
                for y in low.y..high.y {
                    for x in low.x..high.x {
                        let place = IVec2::new(x, y).as_vec2() + 0.5 + BESIDE_CENTRE;
                        let w = weights(place - a);
                        let of_corners =
                            [(w.x, slope.x), (w.y, slope.y), (1.0 - w.x - w.y, -slope.x - slope.y)];
                        let [from, to] = of_corners.into_iter().fold([-0.5, 0.5], seen_of);
                        if to <= from {
                            continue;
                        }
                        let w = w - 0.5 * (from + to) * slope;
                        let passed = pass_a + w.x * (pass_b - pass_a) + w.y * (pass_c - pass_a);
                        let [start, end] = [from, to].map(|u| {
                            let x = middle_x + u * (to_x - from_x);
                            self.weight_before(self.bin_at(cell, medium, x), lit)
                        });
                        let flux =
                            per_texel * passed.clamp(Vec3::ZERO, Vec3::ONE) * (end - start) / WHOLE as f32;
                        deposits += 1;
                        let texel = (face as i32 * size.y + y) * size.x + x;
                        for (c, flux) in flux.to_array().into_iter().enumerate() {
                            let word = 2 * (3 * texel as usize + c);
                            add_64(&map[word..word + 2], (flux.max(0.0) + 0.5) as u64);
                        }
                    }
                }
            }
        }
        deposits
    }

    /// What the first glass lets through of the light of some bins, channel by channel, that falls on a material.
    fn comes_through(&self, landing: &PathLanding, [start, end]: [u32; 2], material: u32) -> [u32; 3] {
        let absorptions = self.absorptions(self.centroids(start, end - start, material), landing.medium);
        (-absorptions * landing.length).exp().to_array().map(part_from)
    }

    /// Bins of a node where nothing can be interpolated.
    fn share(&self, cell: &FootprintCell, node: u32) -> [u32; 2] {
        [node, node + 1].map(|n| cell.first + share_start(self.params.cells.nodes, n, cell.bins))
    }

    /// Paths go apart, and the cell is not split further: every path is put down where it lands.
    fn lay_points(&self, emitted: &Emitted, cell_flux: u32, order: u32, map: &[AtomicU32]) -> u64 {
        let mut deposits = 0;
        for (corner, node) in self.landings.paths() {
            let landing = self.landings.landing(emitted, corner, node, order);
            if landing.end == END_LANDED {
                deposits += 1;
                let face = landing.place & 0xff;
                let passed = flux_part((cell_flux + corner) / 4, landing.part);
                let [start, end] = self.share(&emitted.cell, node);
                let weight = self.weight_between(start, end, landing.place >> 8);
                let through = self.comes_through(landing, [start, end], landing.place >> 8);
                let own = std::array::from_fn(|c| flux_part(flux_part(passed, through[c]), weight[c]));
                let size = self.landings.views[(self.params.cells.map_view + face) as usize].size;
                splat_tent(size, face, self.landings.map_texel(face, landing.texel), Vec2::ONE, own, map);
            }
        }
        deposits
    }

    /// What becomes of a cell's light; parts are taken off in turn, so that all of it is booked.
    fn keep_books(&self, emitted: &Emitted, cell_flux: u32, sums: &mut Sums) {
        let light = self.params.cells.materials;
        for (corner, node) in self.landings.paths() {
            let [start, end] = self
                .share(&emitted.cell, node)
                .map(|bin| flux_part(cell_flux, self.band_weight(bin, light)[1]));
            let flux = (end - start + corner) / 4;
            let mut book = |row: usize, flux: u32| {
                let sum = &mut sums[node as usize][row];
                sum.0 += u64::from(flux);
                sum.1 += u32::from(flux != 0 && corner == 0);
            };
            let of_end = |end: u32| LEDGER_FIRST_END + end as usize;
            book(LEDGER_AIMED, flux);
            let left = &self.ends[self.landings.path(emitted, corner, node)];
            if left.end != END_MISSED && left.end != END_BLOCKED {
                book(LEDGER_EMITTED, flux);
            }
            if left.end != END_LANDED {
                book(of_end(left.end), flux);
                continue;
            }
            let (mut running, mut booked) = (0, 0);
            let mut take = |part: u32| {
                running += part;
                let own = flux_part(flux, running) - booked;
                booked += own;
                own
            };
            book(LEDGER_REFLECTED, take(left.reflected));
            book(LEDGER_ABSORBED, take(left.absorbed));
            book(LEDGER_KEPT_INSIDE, take(left.kept_inside));
            for order in 0..self.params.cells.orders {
                let landing = self.landings.landing(emitted, corner, node, order);
                let own = take(landing.part);
                if landing.end == END_LANDED {
                    let share = self.share(&emitted.cell, node);
                    let lands = flux_part(own, self.comes_through(landing, share, light)[1]);
                    book(LEDGER_ABSORBED, own - lands);
                    book(of_end(END_LANDED), lands);
                } else {
                    book(of_end(landing.end), own);
                }
            }
        }
    }
}
