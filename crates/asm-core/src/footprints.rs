//! The steps of [`crate::Method::Footprint`]: paths from the corners of all cells, footprints of those that belong together, and
//! rounds of the same for the cells that were split.

use frame_plan::{Bound, ResourceId, Step};
use glam::DVec2;

use crate::caustics::Caustics;
use crate::footprint_work::{FootprintWork, WorkBooks};
use crate::lights::{LightSetup, texel_extent};
use crate::passes::footprint_queue::FootprintQueue;
use crate::passes::footprint_splat::{FootprintSplat, MOST_STEPS};
use crate::passes::footprint_split::FootprintSplit;
use crate::passes::map_resolve::MapResolve;
use crate::passes::path_trace::PathTrace;
use crate::resources::Resources;
use crate::shared::emission::{PATH_REFLECTED, PATH_REFRACTED};
use crate::shared::flux::QUANTUM;
use crate::shared::footprint::{
    LEAST_BINS, NO_QUEUE, PATCH_CELLS, PATCH_PLACES, PATCH_ROW, PATCH_WORDS, PATCHES_HEAD, PathEnds,
    PathLanding, WORK_WORDS,
};
use crate::shared::footprint_cells::{FootprintCells, QUEUES_HEAD, cell_groups};
use crate::shared::footprint_light::FootprintLight;
use crate::shared::light_path::MOST_ASIDES;
use crate::shared::photon_queue::QUEUE_GROUPS;
use crate::shared::triangle::{TRIANGLE_MIRROR, TRIANGLE_REFRACTS};
use crate::view_fit::Source;
use crate::{Method, PlanError, Settings};

/// Bytes of the arguments of an indirect dispatch.
const ARGUMENTS_BYTES: u64 = 12;

/// Bytes of what was done for one path of light.
const WORK_ROW_BYTES: u64 = 4 * WORK_WORDS as u64;

/// Splits across an edge along a side of a cell, beyond those of cells in general.
const MORE_EDGE_SPLITS: u32 = 6;

/// Cells along each side of the emission view, were all as small as can be: a queued patch has 16 bits for either number of one.
const MOST_CELLS: u32 = 1 << 16;

/// Patches that a queue holds.
const CAPACITY: u32 = 4096;

/// Cells along a side of a tile, while there are not too many of them. Every tile has queues of its own, so that memory does not grow
/// with what has to be split, which does with the cells. Every tile takes dispatches of its own, too. Tiles are interleaved: light
/// through a slit is all in a few columns of cells, and would be in a few tiles otherwise, whose queues were too short for it.
const TILE_SIDE: u32 = 32;

/// Nodes that are told by what is around lie off by so many texels of the map at most.
const NODE_TEXELS: f64 = 0.1;

/// Corners of the emission view in x and y from one whose nodes are all traced to the next, where what lies between is told.
const LATTICE: u32 = 8;

/// Most tiles along a side.
const MOST_TILES: u32 = 8;

/// Resources of footprints, which lights use in turn.
pub(crate) struct Footprints {
    bvh: ResourceId,
    /// Queues of patches, tile x round, and what cells are split into.
    queues: ResourceId,
    /// Of the dispatches over them, tile x round.
    arguments: ResourceId,
    landings: ResourceId,
    ends: ResourceId,
    /// What was done: light x path.
    pub(crate) work: ResourceId,
    /// Places of the emission view.
    texels: u32,
    /// Most cells of a tile.
    tile_cells: u32,
    tiles_across: u32,
    rounds: u32,
    /// Landings of a path.
    orders: u32,
    /// Of these, those of what was thrown back behind the first glass.
    asides: u32,
}

impl Footprints {
    /// `None` for other methods, and where no light needs them: then there is no tree either.
    pub(crate) fn new(
        resources: &mut Resources<'_>,
        settings: &Settings,
        setups: &[LightSetup],
        bvh: Option<ResourceId>,
    ) -> Result<Option<Self>, PlanError> {
        let (Method::Footprint, Some(bvh)) = (settings.method, bvh) else { return Ok(None) };
        let refracted = setups.iter().any(|s| s.refracted);
        // Who follows no reflection follows none behind the first glass either.
        let asides = if refracted { settings.bounces.min(MOST_ASIDES as u32) } else { 0 };
        let orders = if refracted { settings.bounces + 1 + asides } else { 1 };
        let nodes = setups.iter().map(|s| s.bands.wavelengths_nm.len()).max().unwrap_or(1) as u64;
        let texels = settings.emission_size.pow(2);
        // What is not to be split in x and y is not to be split at all.
        let rounds = if settings.cell_splits == 0 { 0 } else { settings.cell_splits + MORE_EDGE_SPLITS };
        // A round needs its own corners and its parents'.
        let places = u64::from(texels) + 2 * u64::from(PATCH_PLACES * CAPACITY);
        let paths = places * nodes;
        let cells = settings.emission_size - 1;
        let tiles_across = cells.div_ceil(TILE_SIDE).clamp(1, MOST_TILES);
        let tile_cells = cells.div_ceil(tiles_across).pow(2);
        let splits = u64::from(tile_cells.max(PATCH_CELLS * CAPACITY));
        let queues = u64::from(tiles_across.pow(2) * rounds);
        let words = QUEUES_HEAD as u64 + queues * QUEUE_WORDS + splits;
        let remedy = "emission_size";
        let work = resources.buffer("footprint work", WORK_ROW_BYTES * 2 * setups.len() as u64, "lights")?;
        resources.make_readable(work);
        Ok(Some(Self {
            bvh,
            queues: resources.buffer("cell queues", 4 * words, remedy)?,
            arguments: resources.buffer("cell dispatches", ARGUMENTS_BYTES * queues.max(1), remedy)?,
            landings: resources.buffer(
                "path landings",
                size_of::<PathLanding>() as u64 * paths * u64::from(orders),
                remedy,
            )?,
            ends: resources.buffer("path ends", size_of::<PathEnds>() as u64 * paths, remedy)?,
            work,
            texels,
            tile_cells,
            tiles_across,
            rounds,
            orders,
            asides,
        }))
    }

    /// What the host needs to read the work of light `i`.
    pub(crate) fn books(&self, i: usize, setup: &LightSetup, settings: &Settings) -> WorkBooks {
        let (nodes, bins) = (setup.bands.wavelengths_nm.len() as u32, setup.bands.bins());
        let ranges = (bins / LEAST_BINS).max(1);
        let uniform_cells =
            u64::from(settings.emission_size << settings.cell_splits).pow(2) * u64::from(ranges);
        let uniform = FootprintWork {
            uniform_rays: uniform_cells * u64::from(nodes),
            uniform_wavelengths_per_cell: f64::from(nodes * ranges),
            uniform_deposits: uniform_cells * u64::from(self.orders) * MOST_STEPS as u64,
            ..FootprintWork::default()
        };
        WorkBooks { first_row: 2 * i as u32, rows: 2, bins, uniform }
    }

    fn tiles(&self) -> u32 {
        self.tiles_across.pow(2)
    }

    /// First word of a round's queue; none behind the last.
    fn queue(&self, tile: u32, round: u32) -> u32 {
        if round < self.rounds { self.words_before(tile * self.rounds + round) } else { NO_QUEUE }
    }

    /// Words of `queues` before one of them, or before what cells are split into.
    fn words_before(&self, queue: u32) -> u32 {
        QUEUES_HEAD as u32 + queue * QUEUE_WORDS as u32
    }

    /// First place of a round's patches: their parents' are still there.
    fn first_place(&self, round: u32) -> u32 {
        self.texels + round % 2 * PATCH_PLACES * CAPACITY
    }
}

/// Words of a queue.
const QUEUE_WORDS: u64 = PATCHES_HEAD as u64 + PATCH_WORDS as u64 * CAPACITY as u64;

/// Parameters of the passes over cells, of one light path.
#[derive(Clone, Copy)]
struct OverCells {
    trace: PathTrace,
    split: FootprintSplit,
    splat: FootprintSplat,
}

impl OverCells {
    fn with(&self, cells: FootprintCells) -> Self {
        Self {
            split: FootprintSplit { cells, ..self.split },
            splat: FootprintSplat { cells, ..self.splat },
            ..*self
        }
    }

    /// As those of the cells of a tile.
    fn of_tile(&self, footprints: &Footprints, tile: u32) -> Self {
        let across = footprints.tiles_across;
        let (next, tile) = (footprints.queue(tile, 0), (tile % across) | (tile / across) << 16);
        self.with(FootprintCells { next, tile, tile_stride: across, ..self.splat.cells })
    }

    /// As those of what these cells are split into.
    fn of_round(&self, footprints: &Footprints, tile: u32, round: u32) -> Self {
        let (queue, next) = (footprints.queue(tile, round), footprints.queue(tile, round + 1));
        let first_place = footprints.first_place(round);
        let trace = PathTrace {
            queue,
            first_place,
            parent_row: if round == 0 { self.trace.parent_row } else { PATCH_ROW },
            keeps_bounds: 0,
            ..self.trace
        };
        Self { trace, ..self.with(FootprintCells { queue, first_place, next, tile: 0, ..self.splat.cells }) }
    }
}

impl Caustics<'_> {
    /// The steps of light `i` from its paths to its map.
    pub(crate) fn lay_footprints(
        &mut self,
        footprints: &Footprints,
        i: usize,
        label: &str,
    ) -> Result<(), PlanError> {
        let setup = &self.setups[i];
        let (landing_view, faces, map_view) = (setup.landing_view, setup.faces, setup.map_view);
        let (refracted, reflecting) = (setup.refracted, setup.reflecting);
        let nodes = setup.bands.wavelengths_nm.len() as u32;
        let emission = self.view(setup.views.start);
        let map = self.view(landing_view);
        let materials = self.scene.materials.len() as u32;
        let trace = PathTrace {
            emission_view: setup.views.start,
            landing_view,
            landing_faces: faces,
            nodes,
            orders: footprints.orders,
            bins: setup.bands.bins(),
            materials,
            first_optics: setup.first_band,
            queue: NO_QUEUE,
            first_place: 0,
            parent_row: emission.size.x,
            max_groups: self.resources.max_groups(),
            path: PATH_REFRACTED,
            casters: TRIANGLE_REFRACTS,
            rule: self.settings.refraction_rule.code(),
            range: setup.range,
            keeps_bounds: u32::from(map_view != landing_view),
            asides: footprints.asides,
            lattice: 1,
            tolerance: 0.0,
        };
        let cells = FootprintCells {
            emission_view: setup.views.start,
            landing_view,
            map_view,
            nodes,
            orders: footprints.orders,
            materials,
            first_optics: setup.first_band,
            bins: setup.bands.bins(),
            queue: NO_QUEUE,
            first_place: 0,
            splits: footprints.words_before(footprints.tiles() * footprints.rounds),
            next: NO_QUEUE,
            capacity: CAPACITY,
            max_groups: self.resources.max_groups(),
            tile: 0,
            tile_stride: 1,
        };
        let deepest = (MOST_CELLS / self.settings.emission_size).ilog2();
        let split = FootprintSplit {
            cells,
            most_level: self.settings.cell_splits.min(deepest),
            most_edge_level: (self.settings.cell_splits + MORE_EDGE_SPLITS).min(deepest),
            silhouette_view: setup.silhouette_view,
            first_caster: self.geometry.opaque,
            end_caster: self.geometry.triangles.len() as u32,
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
        let splat = FootprintSplat {
            cells,
            light: FootprintLight {
                spot_axis: setup.spot_axis,
                spot_scale: setup.spot_scale,
                spot_offset: setup.spot_offset,
                first_band: setup.first_band,
                first_ledger: setup.first_ledger,
                reserved0: 0,
            },
        };
        let over = OverCells { trace, split, splat };
        let through = setup.bands.largest * texel_extent(&emission) / f64::from(QUANTUM);
        // Flux of parallel rays is per area in working units, of an eye's per solid angle; maps seen from the light are alike.
        let area = match (setup.receiver_view, setup.source) {
            (Some(_), Source::Eye(_)) => self.space.metres_per_unit.powi(2),
            _ => 1.0,
        };
        let scale = through / texel_extent(&map) / area;
        let resolve = MapResolve {
            view: map_view,
            faces,
            scale: scale as f32,
            power: self.settings.artistic_power.unwrap_or(1.0) as f32,
            first_texel: 0,
            scale_view: landing_view,
            reserved0: 0,
            reserved1: 0,
        };
        let first_reflected = self.first_reflected(setup);
        let reflected_ledger = setup.first_ledger + if refracted { self.wavelengths() } else { 0 };
        let reflected_landing = self.reflected_landing(setup);
        if refracted {
            let fitted = (map_view != landing_view).then_some(self.landing_bounds).flatten();
            self.lay_path(footprints, label, over, resolve, self.shared.landing, fitted)?;
            self.keep_work(footprints, 2 * i);
        }
        if reflecting != 0 {
            let trace = PathTrace {
                orders: 1,
                asides: 0,
                path: PATH_REFLECTED,
                casters: reflecting,
                keeps_bounds: 0,
                ..trace
            };
            // Reflected light goes far: its map shows all receivers.
            let mirrors = reflecting & TRIANGLE_REFRACTS == 0;
            let cells = FootprintCells { orders: 1, map_view: landing_view, ..cells };
            let split = FootprintSplit {
                cells,
                first_caster: if reflecting & TRIANGLE_MIRROR != 0 {
                    self.geometry.matt
                } else {
                    self.geometry.opaque
                },
                end_caster: if mirrors { self.geometry.opaque } else { split.end_caster },
                ..split
            };
            let light = FootprintLight { first_ledger: reflected_ledger, ..splat.light };
            let splat = FootprintSplat { cells, light };
            let over = OverCells { trace, split, splat };
            let resolve = MapResolve { view: landing_view, first_texel: first_reflected, ..resolve };
            let label = format!("{label}, reflected");
            self.lay_path(footprints, &label, over, resolve, reflected_landing, None)?;
            self.keep_work(footprints, 2 * i + 1);
        }
        Ok(())
    }

    fn lay_path(
        &mut self,
        footprints: &Footprints,
        label: &str,
        over: OverCells,
        resolve: MapResolve,
        landing: ResourceId,
        fitted: Option<ResourceId>,
    ) -> Result<(), PlanError> {
        let ledger = self.ledger.expect("plans with caustics have a ledger");
        let shared = &self.shared;
        let (map_buffer, caustic) = (shared.map, shared.caustic);
        let trace_bindings = [
            self.triangles,
            footprints.bvh,
            self.views,
            shared.optics,
            landing,
            footprints.queues,
            footprints.landings,
            footprints.ends,
            fitted.unwrap_or(shared.no_queue),
        ]
        .map(Bound::from);
        let split_bindings = [
            footprints.landings,
            footprints.ends,
            self.views,
            shared.optics,
            footprints.queues,
            shared.entry,
        ]
        .map(Bound::from);
        let queue_bindings = [self.views, footprints.queues].map(Bound::from);
        let splat_bindings = [
            footprints.landings,
            footprints.ends,
            self.views,
            self.bands,
            shared.optics,
            map_buffer,
            ledger,
            footprints.queues,
        ]
        .map(Bound::from);
        let resolve_bindings = [self.views, map_buffer, caustic].map(Bound::from);
        let OverCells { trace, split, splat } = over;
        let emission = self.view(trace.emission_view);
        let map_size = self.view(trace.landing_view).size;
        let max_groups = self.resources.max_groups();
        let texels = emission.size.x * emission.size.y;
        let cells = (emission.size.x - 1) * (emission.size.y - 1);
        let resolve_groups = self.resources.groups(map_size.to_array(), trace.landing_faces, "map_size")?;

        self.resources.plan.steps.push(Step::ClearBuffer { buffer: footprints.queues });
        if let Some(bounds) = fitted {
            self.resources.plan.steps.push(Step::ClearBuffer { buffer: bounds });
        }
        let groups = cell_groups(texels, trace.nodes, max_groups);
        // A fitted map may be finer than the view that it is fitted in, in a picture by any factor: there nothing is told. Nor does one node
        // tell anything.
        let zoom = fitted.map_or(1.0, |_| self.most_zoom);
        let lattice = if trace.nodes > 1 && zoom.is_finite() { LATTICE } else { 1 };
        let first = PathTrace { lattice, tolerance: 0.0, ..trace };
        self.dispatch("path_trace", label, &first, trace_bindings.to_vec(), groups);
        for lattice in
            std::iter::successors(Some(lattice), |step| Some(step / 2)).take_while(|step| *step > 1)
        {
            let rest = PathTrace { lattice, tolerance: (NODE_TEXELS / zoom) as f32, ..trace };
            let label = format!("{label}, between corners {lattice} apart");
            self.dispatch("path_trace", &label, &rest, trace_bindings.to_vec(), groups);
        }
        if let Some(bounds) = fitted {
            let views = [trace.landing_view, splat.cells.map_view, trace.landing_faces];
            self.fit_views(bounds, label, views, DVec2::splat(self.most_zoom), map_size.x as f32);
        }
        self.resources.plan.steps.push(Step::ClearBuffer { buffer: map_buffer });
        let groups = cell_groups(cells, splat.cells.orders, max_groups);
        if footprints.rounds == 0 {
            self.dispatch("footprint_splat", label, &splat, splat_bindings.to_vec(), groups);
        } else {
            self.dispatch("footprint_split", label, &split, split_bindings.to_vec(), groups);
            let bindings: [&[Bound]; 4] =
                [&trace_bindings, &split_bindings, &queue_bindings, &splat_bindings];
            self.lay_tiles(footprints, label, over, bindings);
        }
        self.dispatch("map_resolve", label, &resolve, resolve_bindings.to_vec(), resolve_groups);
        Ok(())
    }

    /// The queues' counts of what was done are the next path's before long.
    fn keep_work(&mut self, footprints: &Footprints, row: usize) {
        self.resources.plan.steps.push(Step::CopyBuffer {
            source: footprints.queues,
            source_offset_bytes: 0,
            target: footprints.work,
            target_offset_bytes: WORK_ROW_BYTES * row as u64,
            size_bytes: WORK_ROW_BYTES,
        });
    }

    /// The cells of each tile, and rounds over the queues of patches that these are split into.
    fn lay_tiles(
        &mut self,
        footprints: &Footprints,
        label: &str,
        over: OverCells,
        [trace_bindings, split_bindings, queue_bindings, splat_bindings]: [&[Bound]; 4],
    ) {
        let max_groups = self.resources.max_groups();
        let groups = cell_groups(footprints.tile_cells, over.splat.cells.orders, max_groups);
        let each: Vec<_> = (0..footprints.tiles())
            .flat_map(|tile| {
                let over = over.of_tile(footprints, tile);
                let rounds = (0..footprints.rounds).map(move |round| over.of_round(footprints, tile, round));
                std::iter::once(over).chain(rounds)
            })
            .collect();
        let plan = &mut self.resources.plan;
        let label = format!("{label}, tiles");
        let traces: Vec<_> = each.iter().map(|over| over.trace).collect();
        let splits: Vec<_> = each.iter().map(|over| over.split).collect();
        let queues: Vec<_> = splits.iter().map(|split| FootprintQueue { cells: split.cells }).collect();
        let splats: Vec<_> = each.iter().map(|over| over.splat).collect();
        let traces = plan.add_params_per_iteration(format!("path_trace: {label}"), &traces);
        let splits = plan.add_params_per_iteration(format!("footprint_split: {label}"), &splits);
        let queues = plan.add_params_per_iteration(format!("footprint_queue: {label}"), &queues);
        let splats = plan.add_params_per_iteration(format!("footprint_splat: {label}"), &splats);
        let pass = |pass: &str, params, bindings: &[Bound]| frame_plan::PassStep {
            pass: pass.into(),
            label: label.clone(),
            params: Some(params),
            bindings: bindings.to_vec(),
        };
        let (mut iterations, mut queues_before) = (Vec::new(), 0);
        for over in &each {
            let queue = over.splat.cells.queue;
            let offset_bytes = ARGUMENTS_BYTES * queues_before;
            let over_cells = |pass| match queue {
                NO_QUEUE => Step::Dispatch { pass, groups },
                _ => Step::DispatchIndirect { pass, arguments: footprints.arguments, offset_bytes },
            };
            let mut steps = Vec::new();
            if queue != NO_QUEUE {
                queues_before += 1;
                // A pass cannot take its own arguments from a buffer that it writes.
                steps.push(Step::CopyBuffer {
                    source: footprints.queues,
                    source_offset_bytes: 4 * (u64::from(queue) + QUEUE_GROUPS as u64),
                    target: footprints.arguments,
                    target_offset_bytes: offset_bytes,
                    size_bytes: ARGUMENTS_BYTES,
                });
                steps.push(over_cells(pass("path_trace", traces, trace_bindings)));
            }
            if over.splat.cells.next != NO_QUEUE {
                steps.push(over_cells(pass("footprint_split", splits, split_bindings)));
                steps.push(over_cells(pass("footprint_queue", queues, queue_bindings)));
            }
            steps.push(over_cells(pass("footprint_splat", splats, splat_bindings)));
            iterations.push(steps);
        }
        plan.steps.push(Step::Repeat { label: format!("footprints ({label})"), iterations });
    }
}
