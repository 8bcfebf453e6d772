//! Which cells are split for the next round, and how urgently: those whose paths do not belong together, those that hide something
//! narrower than they are, and those that land bent or on many texels. Twin of `shaders/footprint_split.wgsl`; terms in
//! `shared/footprint.rs`.

use std::sync::atomic::Ordering;

use bytemuck::{Pod, Zeroable};
use frame_plan::cpu::TextureView;
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{IVec2, Vec2};
use rayon::prelude::*;

use super::{
    FLUX_WGSL, FOOTPRINT_CELLS_WGSL, FOOTPRINT_LANDINGS_WGSL, FOOTPRINT_WGSL, LEDGER_WGSL, OPTICS_WGSL,
    PHOTON_QUEUE_WGSL, VIEW_WGSL, VISIBILITY_TEXTURE, binding,
};
use crate::shared::flux::WHOLE;
use crate::shared::footprint::*;
use crate::shared::footprint_cells::*;
use crate::shared::footprint_landings::*;
use crate::shared::ledger::*;
use crate::shared::photon_queue::QUEUE_HEAD;

/// Uniform of the pass; mirrors `FootprintSplit` in `shaders/footprint_split.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct FootprintSplit {
    /// The cells.
    pub cells: FootprintCells,
    /// No cell is split in x and y more often.
    pub most_level: u32,
    /// No cell is split more often, where that is across an edge along its other side.
    pub most_edge_level: u32,
    /// Of `silhouette`.
    pub silhouette_view: u32,
    /// Casters are in a row among triangles.
    pub first_caster: u32,
    /// One past the last of them.
    pub end_caster: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// All that an executor needs to build and run `footprint_split`.
pub const FOOTPRINT_SPLIT: PassInfo = PassInfo {
    name: "footprint_split",
    wgsl: &[
        VIEW_WGSL,
        OPTICS_WGSL,
        FLUX_WGSL,
        LEDGER_WGSL,
        PHOTON_QUEUE_WGSL,
        FOOTPRINT_WGSL,
        FOOTPRINT_CELLS_WGSL,
        FOOTPRINT_LANDINGS_WGSL,
        include_str!("../../../../shaders/footprint_split.wgsl"),
    ],
    params_struct: "FootprintSplit",
    params_bytes: size_of::<FootprintSplit>() as u32,
    bindings: &[
        binding("landings", BindingKind::Read),
        binding("ends", BindingKind::Read),
        binding("views", BindingKind::Read),
        binding("optics", BindingKind::Read),
        binding("queues", BindingKind::Atomic),
        binding("silhouette", VISIBILITY_TEXTURE),
    ],
    kind: PassKind::Compute {
        workgroup: [CELLS_PER_GROUP, 1, 1],
        mirror: |args| {
            let params: FootprintSplit = args.params();
            let (views, queues) = (args.read("views"), args.atomics("queues"));
            let cells = Cells { params: params.cells, views, queues };
            let landings = Landings { cells, landings: args.read("landings"), optics: args.read("optics") };
            let (ends, silhouette) = (args.read("ends"), args.texture("silhouette"));
            footprint_split(&Inputs { params, landings, ends, silhouette });
        },
    },
};

/// What `footprint_split` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: FootprintSplit,
    /// The cells, and where they land.
    pub landings: Landings<'a>,
    /// Of paths.
    pub ends: &'a [PathEnds],
    /// First surface from the light, finer than cells.
    pub silhouette: TextureView<'a>,
}

/// A cell that lands on more texels along a side is split while that is allowed.
const MOST_TEXELS: f32 = 32.0;

/// Sides of cells that land on more texels are straight.
const MOST_CURVED: f32 = 4.0;

/// Cells whose flux is further off than it is interpolated, as a share of what was emitted, are split.
const MOST_FADING: f32 = 1.0 / 128.0;

/// Spectra that are longer, texels, are split in two: more nodes lie along them then.
const MOST_ALONG: f32 = 24.0;

/// CPU mirror: the cells of the emission view or of the queue.
pub fn footprint_split(inputs: &Inputs<'_>) {
    let params = &inputs.params.cells;
    let queues = inputs.landings.queues;
    let count = inputs.landings.count();
    (0..count).into_par_iter().with_min_len(CELLS_PER_GROUP as usize).for_each(|i| {
        let Some(emitted) = inputs.landings.emitted(i) else { return };
        if params.next == NO_QUEUE {
            queues[LANDED].fetch_add(inputs.landed(&emitted), Ordering::Relaxed);
            return;
        }
        let (along, stake) = inputs.split(&emitted);
        let class = urgency(stake, &emitted.cell, params.tile_stride);
        let word = if along == TOGETHER { 0 } else { along | class << SPLIT_CLASS };
        queues[(params.splits + i) as usize].store(word, Ordering::Relaxed);
        if along != TOGETHER {
            let patches = 1 + u32::from(along == BANDS_APART);
            queues[params.next as usize + QUEUE_HEAD + class as usize].fetch_add(patches, Ordering::Relaxed);
        }
    });
}

impl Inputs<'_> {
    /// All corners of the cell agree, but what the light sees between them does not: something narrower than a cell is there.
    fn hides_detail(&self, emitted: &Emitted) -> bool {
        let params = &self.params;
        let end = self.ends[self.landings.path(emitted, 0, 0)].end;
        let meets = end != END_MISSED && end != END_BLOCKED;
        let view = &self.landings.views[params.silhouette_view as usize];
        let emission = &self.landings.views[params.cells.emission_view as usize];
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

    /// Light that lands, of all orders, in units of the queues' [`LANDED`].
    fn landed(&self, emitted: &Emitted) -> u32 {
        let params = &self.params.cells;
        let of_order = |order| {
            let landing = self.landings.landing(emitted, 0, middle_node(params.nodes), order);
            if landing.end == END_LANDED { landing.part >> LANDED_SHIFT } else { 0 }
        };
        (0..params.orders).map(of_order).sum()
    }

    /// Halvings of a cell of the emission view, in space and along the spectrum.
    fn splits(&self, cell: &FootprintCell) -> u32 {
        cell.level.x + cell.level.y + (self.params.cells.bins / cell.bins).ilog2()
    }

    /// The most that a path of this order carries, as a part of a whole cell's flux: of those that land, and of all.
    fn stakes(&self, emitted: &Emitted, order: u32) -> [u32; 2] {
        let splits = self.splits(&emitted.cell);
        self.landings.paths().fold([0; 2], |[landed, all], (corner, node)| {
            let landing = self.landings.landing(emitted, corner, node, order);
            let part = landing.part >> splits;
            [if landing.end == END_LANDED { landed.max(part) } else { landed }, all.max(part)]
        })
    }

    /// Along what a cell is split, sums of `APART_*`, and how much light is at stake.
    fn split(&self, emitted: &Emitted) -> (u32, u32) {
        let params = &self.params;
        let cell = &emitted.cell;
        let flag = |apart: bool, flag: u32| if apart { flag } else { 0 };
        let (mut apart, mut at_stake) = (TOGETHER, 0);
        for order in 0..params.cells.orders {
            let [mut part, any] = self.stakes(emitted, order);
            if any < NEGLIGIBLE {
                continue;
            }
            let mut own = self.landings.belonging(emitted, order);
            if part == 0 {
                // None of them lands, but wavelengths between them may.
                own &= BANDS_APART;
                part = any / 4;
            } else if own == TOGETHER {
                let first = self.landings.landing(emitted, 0, 0, order);
                let spread = self.landings.gather(emitted, order, first.place & 0xff);
                let Extent { across, down, along } = spread.extent();
                let curves = self.landings.curves(emitted, order);
                let bend = if across.max(down) > MOST_CURVED { curves.bend() } else { curves.unevenness() };
                let (fading, fading_along) = (curves.fading(), spread.fading_along());
                if across.max(down) <= MOST_TEXELS && along <= MOST_ALONG {
                    let fades = WHOLE as f32 * fading.max_element().max(fading_along);
                    let displaced = part as f32 * bend.max_element().min(1.0);
                    part = displaced.max(fades / (1 << self.splits(cell)) as f32) as u32;
                }
                own = flag(across > MOST_TEXELS || bend.x > MOST_BEND || fading.x > MOST_FADING, APART_IN_X)
                    | flag(down > MOST_TEXELS || bend.y > MOST_BEND || fading.y > MOST_FADING, APART_IN_Y)
                    | flag(along > MOST_ALONG || fading_along > MOST_FADING, BANDS_APART);
            }
            if own != TOGETHER && part >= NEGLIGIBLE {
                apart |= own;
                at_stake = at_stake.max(part);
            }
        }
        let in_space = APART_IN_X | APART_IN_Y;
        if apart & in_space == 0 && self.hides_detail(emitted) {
            apart |= in_space;
            at_stake = at_stake.max(WHOLE >> self.splits(cell));
        }
        // An edge along one side is worth more splits: they do not become more with every one.
        let most = if apart & in_space == in_space { params.most_level } else { params.most_edge_level };
        let in_x = flag(apart & APART_IN_X != 0 && cell.level.x < most, APART_IN_X);
        let in_y = flag(apart & APART_IN_Y != 0 && cell.level.y < most, APART_IN_Y);
        let in_bands = flag(apart & BANDS_APART != 0 && cell.bins > LEAST_BINS, BANDS_APART);
        (if in_x | in_y != 0 { in_x | in_y } else { in_bands }, at_stake)
    }
}
