//! Footprints of cells into the map: where all paths of a cell belong together, its light is laid down as a continuous function of
//! place and wavelength; where they do not and the cell is not split further, every path is put down for itself. Twin of
//! `shaders/footprint_splat.wgsl`; terms in `shared/footprint.rs`.
//!
//! The idea has a literature: spectral ray differentials (Elek et al. 2014), photon differentials (Frisvad et al. 2014). Positions
//! follow the curved sides of the cell and a polynomial in the index of refraction through its nodes; the light of a step along the
//! spectrum is a difference of running integrals, so colour is exact whatever the step.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{
    EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_BOOKS_WGSL, FOOTPRINT_CELLS_WGSL, FOOTPRINT_LANDINGS_WGSL,
    FOOTPRINT_LIGHT_WGSL, FOOTPRINT_WGSL, FOOTPRINT_WIDE_WGSL, LEDGER_WGSL, OPTICS_WGSL, PHOTON_QUEUE_WGSL,
    SPLAT_TENT_WGSL, VIEW_WGSL, binding,
};
use crate::shared::flux::{add_64, flux_part, part_from};
use crate::shared::footprint::*;
use crate::shared::footprint_books::Sums;
use crate::shared::footprint_cells::*;
use crate::shared::footprint_landings::*;
use crate::shared::footprint_light::*;
use crate::shared::ledger::*;
use crate::shared::splat_tent::splat_tent;

/// Uniform of the pass; mirrors `FootprintSplat` in `shaders/footprint_splat.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FootprintSplat {
    /// The cells.
    pub cells: FootprintCells,
    /// Whose light they have.
    pub light: FootprintLight,
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
        FOOTPRINT_LIGHT_WGSL,
        FOOTPRINT_WIDE_WGSL,
        FOOTPRINT_BOOKS_WGSL,
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
            let (bands, ends) = (args.read("bands"), args.read("ends"));
            let cells = CellLight { light: params.light, landings, bands, ends };
            footprint_splat(&cells, args.atomics("map"), args.atomics("ledger"));
        },
    },
};

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

/// Steps that a cell's light is laid down in.
struct Steps {
    across: u32,
    down: u32,
    bands: u32,
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

/// Counts of cells, the first ones of all.
const CELL_COUNTS: usize = 3;

/// CPU mirror: the cells of the emission view or of the queue that are not split further.
pub fn footprint_splat(light: &CellLight<'_>, map: &[AtomicU32], ledger: &[AtomicU32]) {
    let cells = light.count();
    (0..cells.div_ceil(CELLS_PER_GROUP)).into_par_iter().for_each(|group| {
        let mut sums: Sums = [[(0, 0); LEDGER_ROWS]; MOST_NODES];
        let mut work = [0; CELL_COUNTS];
        for i in group * CELLS_PER_GROUP..cells.min((group + 1) * CELLS_PER_GROUP) {
            let Some(emitted) = light.emitted(i) else { continue };
            if light.split(i) == TOGETHER {
                work[WORK_CELLS] += 1;
                work[WORK_BINS] += u64::from(emitted.cell.bins);
                work[WORK_DEPOSITS] += light.lay(&emitted, map, &mut sums);
            }
        }
        for (words, count) in light.queues.chunks_exact(2).zip(work) {
            add_64(words, count);
        }
        for (node, rows) in sums.iter().enumerate().take(light.params.nodes as usize) {
            for (row, &(flux, cells)) in rows.iter().enumerate() {
                let index = LEDGER_WORDS * (LEDGER_ROWS * (light.light.first_ledger as usize + node) + row);
                add_64(&ledger[index..index + 2], flux);
                ledger[index + 2].fetch_add(cells, Ordering::Relaxed);
            }
        }
    });
}

impl CellLight<'_> {
    /// Number of deposits.
    fn lay(&self, emitted: &Emitted, map: &[AtomicU32], sums: &mut Sums) -> u64 {
        let flux = self.cell_flux(&emitted.cell);
        self.keep_books(emitted, flux, sums);
        let mut deposits = 0;
        for order in 0..self.params.orders {
            if self.belonging(emitted, order) != TOGETHER {
                deposits += self.lay_points(emitted, flux, order, map);
            } else if self.landing(emitted, 0, 0, order).end == END_LANDED {
                deposits += self.lay_footprint(emitted, flux, order, map);
            }
        }
        deposits
    }

    /// All paths belong together: light between them lies between their landings.
    fn lay_footprint(&self, emitted: &Emitted, cell_flux: u32, order: u32, map: &[AtomicU32]) -> u64 {
        let first = self.landing(emitted, 0, 0, order);
        let face = first.place & 0xff;
        let cell = &emitted.cell;
        let spread = self.gather(emitted, order, face);
        let extent = spread.extent();
        let curves = self.curves(emitted, order);
        if spread.is_wide(&extent) && curves.bend().max_element() <= MOST_BEND {
            return self.lay_wide(&spread, emitted, cell_flux, first, map);
        }
        let texels = self.views[self.params.emission_view as usize].size;
        // As fine as this one.
        let cells = (texels.x * texels.y) as f32 * (1 << cell.level.x) as f32 * (1 << cell.level.y) as f32;
        let part_of_light = spread.parts[0][0] / cells;
        let Steps { across, down, bands } = extent.steps(part_of_light, cell.bins);
        let bins = cell.bins / bands;
        let count = across * down * bands;
        // Long steps are not made even where there are many of them: no invocation goes round for ever.
        let widest = Vec2::splat(if count > FEW_STEPS { MANY_WIDEST } else { FEW_WIDEST });
        let size = self.views[(self.params.map_view + face) as usize].size;
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
        let abscissa = |bin: f32| self.abscissa(cell, medium, bin);
        let [from_x, to_x] = [bin, bin + bins].map(|edge| abscissa(edge as f32));
        let center = abscissa(self.centroids(bin, bins, lit)[1]);
        let moved = |corner: usize| spread.place_at(corner, to_x) - spread.place_at(corner, from_x);
        LandedBand {
            at: std::array::from_fn(|corner| spread.place_at(corner, center)),
            along: 0.25 * (moved(0) + moved(1) + moved(2) + moved(3)),
            weight: self.weight_between(bin, bin + bins, lit),
            passes: self.passes(spread, cell, bin, bins, first),
        }
    }

    /// Paths go apart, and the cell is not split further: every path is put down where it lands.
    fn lay_points(&self, emitted: &Emitted, cell_flux: u32, order: u32, map: &[AtomicU32]) -> u64 {
        let mut deposits = 0;
        for (corner, node) in self.paths() {
            let landing = self.landing(emitted, corner, node, order);
            if landing.end == END_LANDED {
                deposits += 1;
                let face = landing.place & 0xff;
                let passed = flux_part((cell_flux + corner) / 4, landing.part);
                let [start, end] = self.share(&emitted.cell, node);
                let weight = self.weight_between(start, end, landing.place >> 8);
                let through = self.comes_through(landing, [start, end], landing.place >> 8);
                let own = std::array::from_fn(|c| flux_part(flux_part(passed, through[c]), weight[c]));
                let size = self.views[(self.params.map_view + face) as usize].size;
                splat_tent(size, face, self.map_texel(face, landing.texel), Vec2::ONE, own, map);
            }
        }
        deposits
    }
}
