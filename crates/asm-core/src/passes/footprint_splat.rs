//! Footprints of cells into the map: where all paths of a cell belong together, its light is laid down as a continuous function of
//! place and wavelength; where they do not, the cell or its part of the spectrum is split for the next round, and in the last
//! one every path is put down for itself. Twin of `shaders/footprint_splat.wgsl`; terms in `shared/footprint.rs`.
//!
//! The idea has a literature: spectral ray differentials (Elek et al. 2014), photon differentials (Frisvad et al. 2014). Positions
//! are bilinear in the cell and a polynomial in 1 / wavelength^2 through its nodes; the light of a step along the spectrum is a
//! difference of running integrals, so colour is exact whatever the step.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{IVec2, UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::path_trace::NO_QUEUE;
use super::{
    EMISSION_WGSL, FLUX_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL, OPTICS_WGSL, PHOTON_QUEUE_WGSL, SPLAT_TENT_WGSL,
    VIEW_WGSL, VISIBILITY_TEXTURE, binding,
};
use crate::shared::emission::spot_falloff;
use crate::shared::flux::{QUANTUM, WHOLE, add_64, flux_part, part_from};
use crate::shared::footprint::*;
use crate::shared::ledger::*;
use crate::shared::optics::Optics;
use crate::shared::photon_queue::{QUEUE_COUNT, QUEUE_GROUPS, QUEUE_HEAD, queue_groups};
use crate::shared::splat_tent::splat_tent;
use crate::shared::view::View;

/// Uniform of the pass; mirrors `FootprintSplat` in `shaders/footprint_splat.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FootprintSplat {
    /// View fitted to the refractors.
    pub emission_view: u32,
    /// First view of where light may land.
    pub landing_view: u32,
    /// First of the map's, one per landing view.
    pub map_view: u32,
    /// Row of this light, in `bands`.
    pub first_band: u32,
    /// Wavelengths of a cell.
    pub nodes: u32,
    /// Landings of a path.
    pub orders: u32,
    /// Row length of `optics`; rows of `bands` have one more, the light itself.
    pub materials: u32,
    /// Row of this light, in `optics`.
    pub first_optics: u32,
    /// Of the whole spectrum.
    pub bins: u32,
    /// No cell is split in x and y more often.
    pub most_level: u32,
    /// First word in `queues`; [`NO_QUEUE`]: cells lie between the texel centres of the emission view.
    pub queue: u32,
    /// First word of the queue that splits go to; [`NO_QUEUE`]: none are made.
    pub next: u32,
    /// Of that queue, cells.
    pub capacity: u32,
    /// Row of this light and path.
    pub first_ledger: u32,
    /// Most workgroups of the device, per dimension.
    pub max_groups: u32,
    /// Squared clamp(cosine * scale + offset) is the cone's falloff.
    pub spot_scale: f32,
    /// Unit axis of the cone.
    pub spot_axis: Vec3,
    /// See `spot_scale`.
    pub spot_offset: f32,
    /// Of `silhouette`.
    pub silhouette_view: u32,
    /// Casters are in a row among triangles.
    pub first_caster: u32,
    /// One past the last of them.
    pub end_caster: u32,
    /// No cell is split more often, where that is across an edge along its other side.
    pub most_edge_level: u32,
    /// [`TASK_COUNT`] or [`TASK_LAY`].
    pub task: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// Count the cells that are to be split.
pub const TASK_COUNT: u32 = 0;
/// Split the most urgent, as many as the next queue holds, and lay down the others.
pub const TASK_LAY: u32 = 1;

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

/// Cells that a workgroup takes.
pub const CELLS_PER_GROUP: u32 = 64;

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
        binding("silhouette", VISIBILITY_TEXTURE),
    ],
    kind: PassKind::Compute {
        workgroup: [CELLS_PER_GROUP, 1, 1],
        mirror: |args| {
            let inputs = Inputs {
                params: args.params(),
                landings: args.read("landings"),
                ends: args.read("ends"),
                views: args.read("views"),
                bands: args.read("bands"),
                optics: args.read("optics"),
                silhouette: args.texture("silhouette"),
            };
            footprint_splat(&inputs, args.atomics("map"), args.atomics("ledger"), args.atomics("queues"));
        },
    },
};

/// What `footprint_splat` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: FootprintSplat,
    /// Path x order.
    pub landings: &'a [PathLanding],
    /// Of paths.
    pub ends: &'a [PathEnds],
    /// All views.
    pub views: &'a [View],
    /// Bin x material where light lands.
    pub bands: &'a [RunningBand],
    /// Bin x material that light goes through.
    pub optics: &'a [Optics],
    /// First surface from the light, finer than cells.
    pub silhouette: TextureView<'a>,
}

/// A cell and its first path.
#[derive(Clone, Copy)]
struct Emitted {
    cell: FootprintCell,
    /// Of the cell's first corner.
    place: u32,
    /// From its upper to its lower corners, places.
    row: u32,
}

/// How paths of a cell go apart: sums of these.
const TOGETHER: u32 = 0;
/// Corners to the left and to the right.
const APART_IN_X: u32 = 1;
/// Above and below.
const APART_IN_Y: u32 = 2;
/// Wavelengths.
const BANDS_APART: u32 = 4;

/// Paths that carry less than this part of a whole cell's flux are not worth a split.
const NEGLIGIBLE: u32 = WHOLE / 128;

/// A cell that lands on more texels along a side is split while that is allowed.
const MOST_TEXELS: f32 = 32.0;

/// A cell's light is laid down in about so many steps at most: beyond, they are longer than a texel.
const MOST_STEPS: f32 = 128.0;

/// Texels gather light from triangles that cover at least twice as many.
const LEAST_AREA: f32 = 4.0;

/// Pieces of a range within which triangles only move along a line.
const PIECES: u32 = 4;

/// Texels take their light just beside their centres: sides of footprints that run through centres are on one side of them.
const BESIDE_CENTRE: Vec2 = Vec2::new(1.37e-3, 0.71e-3);

/// Bands where what the glass absorbs depends on the wavelength.
const ABSORBING_BANDS: u32 = 8;

/// Flux and cells of each node and row of the ledger.
type Sums = [[(u64, u32); LEDGER_ROWS]; MOST_NODES];

/// Where a cell lands, of one order: by corner and node.
struct Spread {
    /// Texels of the map.
    places: [[Vec2; MOST_NODES]; 4],
    parts: [[f32; MOST_NODES]; 4],
    lengths: [[f32; MOST_NODES]; 4],
    /// Of nodes, see [`Inputs::abscissa`].
    nodes_at: [f32; MOST_NODES],
    nodes: usize,
}

/// The triangles of a cell, by their corners.
const TRIANGLES: [[usize; 3]; 2] = [[0, 1, 3], [0, 3, 2]];

/// Texels from one end of a cell to the other.
struct Extent {
    across: f32,
    down: f32,
    /// From one end of its range to the other.
    along: f32,
}

/// Steps that a cell's light is laid down in.
struct Steps {
    across: u32,
    down: u32,
    bands: u32,
}

impl Extent {
    /// Such that none is longer than a texel, unless there were too many.
    fn steps(&self, bins: u32) -> Steps {
        let [across, down, along] = [self.across, self.down, self.along].map(|texels| texels.max(1.0));
        let longest = (across * down * along / MOST_STEPS).powf(1.0 / 3.0).max(1.0);
        let mut bands = 1;
        while bands < bins && (bands as f32) * longest < along {
            bands *= 2;
        }
        let steps = |texels: f32| (texels / longest).ceil().clamp(1.0, MOST_STEPS) as u32;
        Steps { across: steps(across), down: steps(down), bands }
    }
}

fn longest(d: Vec2) -> f32 {
    d.abs().max_element()
}

impl Spread {
    fn weights(&self, x: f32) -> [f32; MOST_NODES] {
        node_weights(self.nodes, &self.nodes_at, x)
    }

    /// Of a corner, at an abscissa of the range.
    fn place_at(&self, corner: usize, x: f32) -> Vec2 {
        self.weights(x).into_iter().zip(self.places[corner]).map(|(weight, place)| weight * place).sum()
    }

    /// Both triangles are large and neither is turned over, at any node: texels can gather their light.
    fn is_wide(&self) -> bool {
        let area = |node: usize, [a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|corner| self.places[corner][node]);
            (b - a).perp_dot(c - a)
        };
        let turned = area(0, TRIANGLES[0]).signum();
        (0..self.nodes).all(|node| TRIANGLES.into_iter().all(|t| turned * area(node, t) >= 2.0 * LEAST_AREA))
    }

    /// Share of the flux that comes through at a corner, of a medium with this absorption.
    fn passes(&self, corner: usize, x: f32, absorption: f32) -> f32 {
        let (mut part, mut inside) = (0.0, 0.0_f32);
        for (node, share) in self.weights(x).into_iter().enumerate() {
            part += share * self.parts[corner][node];
            inside += share * self.lengths[corner][node];
        }
        part.clamp(0.0, 1.0) * (-absorption * inside.max(0.0)).exp()
    }

    fn extent(&self) -> Extent {
        let (mut across, mut down, mut along) = (0.0_f32, 0.0_f32, 0.0_f32);
        for node in 0..self.nodes {
            let [upper_left, upper_right, lower_left, lower_right] = self.places.map(|corner| corner[node]);
            across = across.max(longest(upper_right - upper_left)).max(longest(lower_right - lower_left));
            down = down.max(longest(lower_left - upper_left)).max(longest(lower_right - upper_right));
        }
        for corner in 0..4 {
            let middle = self.place_at(corner, 0.5);
            let ends = [0.0, 1.0].map(|x| longest(self.place_at(corner, x) - middle));
            along = along.max(ends[0] + ends[1]);
        }
        Extent { across, down, along }
    }
}

/// What a cell is split into.
struct Split {
    /// In x and y.
    parts: UVec2,
    /// Of bins.
    ranges: u32,
    stake: u32,
}

/// Two bits behind the first of a stake, and which bit that is.
fn class_of(stake: u32) -> u32 {
    let stake = stake.max(NEGLIGIBLE);
    let bit = stake.ilog2();
    (4 * (bit - NEGLIGIBLE.ilog2()) + (stake >> (bit - 2) & 3)).min(CLASSES as u32 - 1)
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

/// CPU mirror: the cells of the emission view or of the queue.
pub fn footprint_splat(inputs: &Inputs<'_>, map: &[AtomicU32], ledger: &[AtomicU32], queues: &[AtomicU32]) {
    let params = &inputs.params;
    let load = |word: usize| queues[word].load(Ordering::Relaxed);
    let queue = (params.queue != NO_QUEUE).then_some(params.queue as usize);
    let size = inputs.views[params.emission_view as usize].size;
    let across = size.x - 1;
    let cells = queue.map_or(across * (size.y - 1), |queue| load(queue + QUEUE_COUNT));
    (0..cells.div_ceil(CELLS_PER_GROUP)).into_par_iter().for_each(|group| {
        let mut sums: Sums = [[(0, 0); LEDGER_ROWS]; MOST_NODES];
        for i in group * CELLS_PER_GROUP..cells.min((group + 1) * CELLS_PER_GROUP) {
            let emitted = match queue {
                None => {
                    let at = UVec2::new(i % across, i / across);
                    let cell = FootprintCell { at, level: UVec2::ZERO, first: 0, bins: params.bins };
                    Emitted { cell, place: at.y * size.x + at.x, row: size.x }
                }
                Some(queue) => {
                    let word = queue + CELLS_HEAD + CELL_WORDS * i as usize;
                    let cell = FootprintCell::from_words([load(word), load(word + 1)]);
                    Emitted { cell, place: 4 * i, row: 2 }
                }
            };
            if !inputs.splits(&emitted, queues) && params.task == TASK_LAY {
                inputs.lay(&emitted, map, &mut sums);
            }
        }
        for (node, rows) in sums.iter().enumerate().take(params.nodes as usize) {
            for (row, &(flux, cells)) in rows.iter().enumerate() {
                let index = LEDGER_WORDS * (LEDGER_ROWS * (params.first_ledger as usize + node) + row);
                add_64(&ledger[index..index + 2], flux);
                ledger[index + 2].fetch_add(cells, Ordering::Relaxed);
            }
        }
    });
}

impl Inputs<'_> {
    fn path(&self, emitted: &Emitted, corner: u32, node: u32) -> usize {
        let place = emitted.place + (corner & 1) + emitted.row * (corner >> 1);
        (place * self.params.nodes + node) as usize
    }

    fn landing(&self, emitted: &Emitted, corner: u32, node: u32, order: u32) -> &PathLanding {
        &self.landings[self.path(emitted, corner, node) * self.params.orders as usize + order as usize]
    }

    /// Corners and nodes.
    fn paths(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let nodes = self.params.nodes;
        (0..4 * nodes).map(move |path| (path / nodes, path % nodes))
    }

    /// Flux at a texel's centre.
    fn texel_flux(&self, texel: UVec2) -> f32 {
        let params = &self.params;
        let view = &self.views[params.emission_view as usize];
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

    fn belonging(&self, emitted: &Emitted, order: u32) -> u32 {
        let same = |a: &PathLanding, b: &PathLanding| {
            a.way == b.way && a.end == b.end && (a.place ^ b.place) & 0xff == 0
        };
        let first = self.landing(emitted, 0, 0, order);
        (0..self.params.nodes).fold(TOGETHER, |apart, node| {
            let [upper_left, upper_right, lower_left, lower_right] =
                [0, 1, 2, 3].map(|corner| self.landing(emitted, corner, node, order));
            let flag = |together: bool, flag: u32| if together { 0 } else { flag };
            apart
                | flag(same(upper_left, upper_right) && same(lower_left, lower_right), APART_IN_X)
                | flag(same(upper_left, lower_left) && same(upper_right, lower_right), APART_IN_Y)
                | flag(same(first, upper_left), BANDS_APART)
        })
    }

    /// All corners of the cell agree, but what the light sees between them does not: something narrower than a cell is there.
    fn hides_detail(&self, emitted: &Emitted) -> bool {
        let params = &self.params;
        let end = self.ends[self.path(emitted, 0, 0)].end;
        let meets = end != END_MISSED && end != END_BLOCKED;
        let view = &self.views[params.silhouette_view as usize];
        let emission = &self.views[params.emission_view as usize];
        let [low, high] = [2, 1].map(|corner| {
            (emission.slope(emitted.cell.corner(corner)) - view.slope_center) / view.texel_slope
        });
        let half = 0.5 * view.size.as_vec2();
        // Texels whose centres lie in the cell.
        let texel = |x: f32, y: f32| (Vec2::new(half.x + x, half.y - y) - 0.5).ceil().as_ivec2();
        let first = texel(low.x, high.y).max(IVec2::ZERO);
        let last = texel(high.x, low.y).min(view.size.as_ivec2());
        let shows_caster = |x: i32, y: i32| {
            let visible = self.silhouette.load_uint(x as u32, y as u32);
            visible > params.first_caster && visible <= params.end_caster
        };
        (first.y..last.y).any(|y| (first.x..last.x).any(|x| shows_caster(x, y) != meets))
    }

    /// The most that a path of this order carries to where it lands, as a part of a whole cell's flux.
    fn stake(&self, emitted: &Emitted, order: u32) -> u32 {
        let splits = emitted.cell.level.x + emitted.cell.level.y;
        let parts = self.paths().map(|(corner, node)| {
            let landing = self.landing(emitted, corner, node, order);
            if landing.end == END_LANDED { landing.part >> splits } else { 0 }
        });
        parts.fold(0, u32::max)
    }

    /// A place of the landing view on the map.
    fn map_texel(&self, face: u32, texel: Vec2) -> Vec2 {
        let shown = &self.views[(self.params.map_view + face) as usize];
        let slope = self.views[(self.params.landing_view + face) as usize].slope(texel);
        let offset = (slope - shown.slope_center) / shown.texel_slope;
        0.5 * shown.size.as_vec2() + Vec2::new(offset.x, -offset.y)
    }

    fn index_at(&self, bin: f32, material: u32) -> f32 {
        let params = &self.params;
        let lower = (bin as u32).min(params.bins - 1);
        let row = ((params.first_optics + lower) * params.materials + material) as usize;
        let (a, b) = (self.optics[row].index, self.optics[row + params.materials as usize].index);
        let share = bin - lower as f32;
        a * (1.0 - share) + b * share
    }

    /// What landings are interpolated along from one wavelength to another, 0 to 1 within a range: the index of refraction, on
    /// which they depend nearly linearly whatever the glass; without dispersion place in the spectrum.
    fn abscissa(&self, cell: &FootprintCell, material: u32, bin: f32) -> f32 {
        let start = self.index_at(cell.first as f32, material);
        let span = self.index_at((cell.first + cell.bins) as f32, material) - start;
        if span.abs() < 1e-6 {
            return (bin - cell.first as f32) / cell.bins as f32;
        }
        (self.index_at(bin, material) - start) / span
    }

    fn gather(&self, emitted: &Emitted, order: u32, face: u32) -> Spread {
        let (cell, nodes) = (&emitted.cell, self.params.nodes);
        let medium = self.landing(emitted, 0, 0, order).medium;
        let mut spread = Spread {
            places: [[Vec2::ZERO; MOST_NODES]; 4],
            parts: [[0.0; MOST_NODES]; 4],
            lengths: [[0.0; MOST_NODES]; 4],
            nodes_at: [0.0; MOST_NODES],
            nodes: nodes as usize,
        };
        for node in 0..nodes {
            spread.nodes_at[node as usize] = self.abscissa(cell, medium, node_bin(nodes, node, cell) as f32);
        }
        for (corner, node) in self.paths() {
            let landing = self.landing(emitted, corner, node, order);
            let (c, n) = (corner as usize, node as usize);
            spread.places[c][n] = self.map_texel(face, landing.texel);
            spread.parts[c][n] = landing.part as f32 / WHOLE as f32;
            spread.lengths[c][n] = landing.length;
        }
        spread
    }

    fn running_band(&self, bin: u32, material: u32) -> &RunningBand {
        let params = &self.params;
        &self.bands[((params.first_band + bin) * (params.materials + 1) + material) as usize]
    }

    /// Where the light of some bins lies on the whole, as a bin, channel by channel.
    fn centroids(&self, start: &RunningBand, end: &RunningBand, bin: u32, bins: u32) -> [f32; 3] {
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
    fn band_weight(&self, bin: u32, material: u32) -> [u32; 3] {
        self.running_band(bin, material).weight
    }

    /// XYZ of the bins from one to another.
    fn weight_between(&self, start: u32, end: u32, material: u32) -> [u32; 3] {
        let (before, until) = (self.band_weight(start, material), self.band_weight(end, material));
        std::array::from_fn(|c| until[c] - before[c])
    }

    fn absorption(&self, bin: u32, material: u32) -> f32 {
        let params = &self.params;
        let row = params.first_optics + bin.min(params.bins);
        self.optics[(row * params.materials + material) as usize].absorption
    }

    fn lay(&self, emitted: &Emitted, map: &[AtomicU32], sums: &mut Sums) {
        let flux = self.cell_flux(&emitted.cell);
        self.keep_books(emitted, flux, sums);
        for order in 0..self.params.orders {
            if self.belonging(emitted, order) != TOGETHER {
                self.lay_points(emitted, flux, order, map);
            } else if self.landing(emitted, 0, 0, order).end == END_LANDED {
                self.lay_footprint(emitted, flux, order, map);
            }
        }
    }

    fn put_down(&self, face: u32, middle: Vec2, width: Vec2, channel: usize, flux: u32, map: &[AtomicU32]) {
        let size = self.views[(self.params.map_view + face) as usize].size;
        splat_tent(size, face, middle, width, channel as u32, flux, map);
    }

    /// All paths belong together: light between them lies between their landings.
    fn lay_footprint(&self, emitted: &Emitted, cell_flux: u32, order: u32, map: &[AtomicU32]) {
        let first = self.landing(emitted, 0, 0, order);
        let (face, lit, medium) = (first.place & 0xff, first.place >> 8, first.medium);
        let cell = &emitted.cell;
        let spread = self.gather(emitted, order, face);
        if spread.is_wide() {
            return self.lay_wide(&spread, emitted, cell_flux, first, map);
        }
        let mut steps = spread.extent().steps(cell.bins);
        if self.absorption(cell.first + cell.bins / 2, medium) > 0.0 {
            steps.bands = steps.bands.max(ABSORBING_BANDS).min(cell.bins);
        }
        let Steps { across, down, .. } = steps;
        let bins = cell.bins / steps.bands;
        for band in 0..steps.bands {
            let bin = cell.first + band * bins;
            let (start, end) = (self.running_band(bin, lit), self.running_band(bin + bins, lit));
            let absorption = self.absorption(bin + bins / 2, medium);
            let [from_x, to_x] = [bin, bin + bins].map(|edge| self.abscissa(cell, medium, edge as f32));
            let centers =
                self.centroids(start, end, bin, bins).map(|center| self.abscissa(cell, medium, center));
            let mut at = [[Vec2::ZERO; 4]; 3]; // by channel and corner
            let mut passes = [0.0; 4];
            let mut along = Vec2::ZERO;
            for corner in 0..4 {
                for (at, center) in at.iter_mut().zip(centers) {
                    at[corner] = spread.place_at(corner, center);
                }
                along += 0.25 * (spread.place_at(corner, to_x) - spread.place_at(corner, from_x));
                passes[corner] = spread.passes(corner, centers[1], absorption);
            }
            for step in 0..across * down {
                let x = ((step % across) as f32 + 0.5) / across as f32;
                let y = ((step / across) as f32 + 0.5) / down as f32;
                let mix = |a: f32, b: f32, t: f32| a * (1.0 - t) + b * t;
                let passed = mix(mix(passes[0], passes[1], x), mix(passes[2], passes[3], x), y);
                let flux = flux_part((cell_flux + step) / (across * down), part_from(passed));
                for (c, at) in at.iter().enumerate() {
                    let (upper, lower) = (at[0].lerp(at[1], x), at[2].lerp(at[3], x));
                    let step_x = (at[1] - at[0]).lerp(at[3] - at[2], y) / across as f32;
                    let step_y = (lower - upper) / down as f32;
                    let width = (step_x * step_x + step_y * step_y + along * along).map(f32::sqrt);
                    let own = flux_part(flux, end.weight[c] - start.weight[c]);
                    self.put_down(face, upper.lerp(lower, y), width, c, own, map);
                }
            }
        }
    }

    /// The place in the spectrum, as a bin, of an abscissa of a cell's range: four steps of Newton's, since the index is nearly
    /// linear.
    fn bin_at(&self, cell: &FootprintCell, material: u32, x: f32) -> f32 {
        let start = self.index_at(cell.first as f32, material);
        let span = self.index_at((cell.first + cell.bins) as f32, material) - start;
        let bin = cell.first as f32 + x * cell.bins as f32;
        if span.abs() < 1e-6 {
            return bin;
        }
        let last = (cell.first + cell.bins - 1) as f32;
        (0..4).fold(bin, |bin, _| {
            let edge = bin.min(last);
            let slope = self.index_at(edge + 1.0, material) - self.index_at(edge, material);
            let beside = (start + x * span - self.index_at(bin, material)) / slope;
            (bin + beside).clamp(cell.first as f32, last + 1.0)
        })
    }

    /// XYZ of all light before a place in the spectrum, as parts.
    fn weight_before(&self, bin: f32, material: u32) -> Vec3 {
        let lower = (bin as u32).min(self.params.bins - 1);
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
    ) {
        let (face, lit, medium) = (first.place & 0xff, first.place >> 8, first.medium);
        let cell = &emitted.cell;
        let size = self.views[(self.params.map_view + face) as usize].size.as_ivec2();
        let pieces = if spread.nodes == 1 { 1 } else { PIECES };
        for piece in 0..pieces {
            let [from_x, middle_x, to_x] =
                [0.0, 0.5, 1.0].map(|share| (piece as f32 + share) / pieces as f32);
            let absorption = self.absorption(self.bin_at(cell, medium, middle_x) as u32, medium);
            let at: [Vec2; 4] = std::array::from_fn(|corner| spread.place_at(corner, middle_x));
            let moves: [Vec2; 4] =
                std::array::from_fn(|corner| spread.place_at(corner, to_x) - spread.place_at(corner, from_x));
            let passes: [f32; 4] = std::array::from_fn(|corner| spread.passes(corner, middle_x, absorption));
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
                        let flux = per_texel * passed.clamp(0.0, 1.0) * (end - start) / WHOLE as f32;
                        let texel = (face as i32 * size.y + y) * size.x + x;
                        for (c, flux) in flux.to_array().into_iter().enumerate() {
                            let word = 2 * (3 * texel as usize + c);
                            add_64(&map[word..word + 2], (flux.max(0.0) + 0.5) as u64);
                        }
                    }
                }
            }
        }
    }

    fn absorbed_by_medium(&self, landing: &PathLanding, bin: u32) -> u32 {
        part_from((-self.absorption(bin, landing.medium) * landing.length).exp())
    }

    /// Bins of a node where nothing can be interpolated.
    fn share(&self, cell: &FootprintCell, node: u32) -> [u32; 2] {
        [node, node + 1].map(|n| cell.first + share_start(self.params.nodes, n, cell.bins))
    }

    /// Paths go apart, and the cell is not split further: every path is put down where it lands.
    fn lay_points(&self, emitted: &Emitted, cell_flux: u32, order: u32, map: &[AtomicU32]) {
        for (corner, node) in self.paths() {
            let landing = self.landing(emitted, corner, node, order);
            if landing.end == END_LANDED {
                let face = landing.place & 0xff;
                let passed = flux_part((cell_flux + corner) / 4, landing.part);
                let bin = node_bin(self.params.nodes, node, &emitted.cell);
                let flux = flux_part(passed, self.absorbed_by_medium(landing, bin));
                let [start, end] = self.share(&emitted.cell, node);
                let weight = self.weight_between(start, end, landing.place >> 8);
                let at = self.map_texel(face, landing.texel);
                for (c, weight) in weight.into_iter().enumerate() {
                    self.put_down(face, at, Vec2::ONE, c, flux_part(flux, weight), map);
                }
            }
        }
    }

    /// What becomes of a cell's light; parts are taken off in turn, so that all of it is booked.
    fn keep_books(&self, emitted: &Emitted, cell_flux: u32, sums: &mut Sums) {
        let light = self.params.materials;
        for (corner, node) in self.paths() {
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
            let left = &self.ends[self.path(emitted, corner, node)];
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
            for order in 0..self.params.orders {
                let landing = self.landing(emitted, corner, node, order);
                let own = take(landing.part);
                if landing.end == END_LANDED {
                    let bin = node_bin(self.params.nodes, node, &emitted.cell);
                    let lands = flux_part(own, self.absorbed_by_medium(landing, bin));
                    book(LEDGER_ABSORBED, own - lands);
                    book(of_end(END_LANDED), lands);
                } else {
                    book(of_end(landing.end), own);
                }
            }
        }
    }

    fn split(&self, emitted: &Emitted) -> Split {
        let params = &self.params;
        let cell = &emitted.cell;
        let flag = |apart: bool, flag: u32| if apart { flag } else { 0 };
        let (mut apart, mut at_stake) = (TOGETHER, 0);
        for order in 0..params.orders {
            let part = self.stake(emitted, order);
            if part < NEGLIGIBLE {
                continue;
            }
            let own = match self.belonging(emitted, order) {
                TOGETHER => {
                    let first = self.landing(emitted, 0, 0, order);
                    let extent = self.gather(emitted, order, first.place & 0xff).extent();
                    flag(extent.across > MOST_TEXELS, APART_IN_X)
                        | flag(extent.down > MOST_TEXELS, APART_IN_Y)
                }
                own => own,
            };
            if own != TOGETHER {
                apart |= own;
                at_stake = at_stake.max(part);
            }
        }
        let in_space = APART_IN_X | APART_IN_Y;
        if apart & in_space == 0 && self.hides_detail(emitted) {
            apart |= in_space;
            at_stake = at_stake.max(WHOLE >> (cell.level.x + cell.level.y));
        }
        // An edge along one side is worth more splits: they do not become more with every one.
        let most = if apart & in_space == in_space { params.most_level } else { params.most_edge_level };
        let in_x = apart & APART_IN_X != 0 && cell.level.x < most;
        let in_y = apart & APART_IN_Y != 0 && cell.level.y < most;
        let in_bands = !in_x && !in_y && apart & BANDS_APART != 0 && cell.bins > LEAST_BINS;
        Split {
            parts: UVec2::new(1 + u32::from(in_x), 1 + u32::from(in_y)),
            ranges: 1 + u32::from(in_bands),
            stake: at_stake,
        }
    }

    /// No class below this one goes into the next queue: all from it on together do.
    fn least_class(&self, queue: &[AtomicU32]) -> u32 {
        let mut cells = 0;
        for class in (0..CLASSES).rev() {
            cells += queue[QUEUE_HEAD + class].load(Ordering::Relaxed);
            if cells > self.params.capacity {
                return class as u32 + 1;
            }
        }
        0
    }

    /// True where the cell goes on in the next queue, in parts. Which cells do hangs on numbers of cells alone, not on their
    /// order.
    fn splits(&self, emitted: &Emitted, queues: &[AtomicU32]) -> bool {
        let params = &self.params;
        if params.next == NO_QUEUE {
            return false;
        }
        let split = self.split(emitted);
        let cells = split.parts.x * split.parts.y * split.ranges;
        if cells == 1 {
            return false;
        }
        let queue = &queues[params.next as usize..];
        let class = class_of(split.stake);
        if params.task == TASK_COUNT {
            queue[QUEUE_HEAD + class as usize].fetch_add(cells, Ordering::Relaxed);
            return true;
        }
        if class < self.least_class(queue) {
            return false;
        }
        let slot = queue[QUEUE_COUNT].fetch_add(cells, Ordering::Relaxed);
        let paths = (slot + cells) * 4 * params.nodes;
        let groups = queue_groups(paths, CELLS_PER_GROUP, 1, params.max_groups);
        for (i, groups) in groups.into_iter().enumerate() {
            queue[QUEUE_GROUPS + i].fetch_max(groups, Ordering::Relaxed);
        }
        let cell = &emitted.cell;
        let bins = cell.bins / split.ranges;
        let parts = split.parts;
        for part in 0..cells {
            let place = UVec2::new(part % parts.x, part / parts.x % parts.y);
            let own = FootprintCell {
                at: parts * cell.at + place,
                level: cell.level + parts - 1,
                first: cell.first + if split.ranges == 2 { part * bins } else { 0 },
                bins,
            };
            let word = CELLS_HEAD + CELL_WORDS * (slot + part) as usize;
            for (word, value) in queue[word..].iter().zip(own.words()) {
                word.store(value, Ordering::Relaxed);
            }
        }
        true
    }
}
