//! The steps of [`crate::Method::Footprint`]: paths from the corners of all cells, footprints of those that belong together, and
//! rounds of the same for the cells that were split.

use frame_plan::{Bound, ResourceId, Step};
use glam::DVec2;

use crate::bvh;
use crate::caustics::Caustics;
use crate::geometry::Geometry;
use crate::lights::{LightSetup, texel_extent};
use crate::passes::footprint_splat::{CELLS_PER_GROUP, FootprintSplat, TASK_COUNT, TASK_LAY};
use crate::passes::map_resolve::MapResolve;
use crate::passes::path_trace::{NO_QUEUE, PATHS_PER_GROUP, PathTrace};
use crate::resources::Resources;
use crate::shared::emission::{PATH_REFLECTED, PATH_REFRACTED};
use crate::shared::flux::QUANTUM;
use crate::shared::footprint::{CELL_WORDS, CELLS_HEAD, PathEnds, PathLanding};
use crate::shared::photon_queue::{QUEUE_GROUPS, queue_groups};
use crate::shared::triangle::{TRIANGLE_MIRROR, TRIANGLE_REFRACTS};
use crate::view_fit::Source;
use crate::{Method, PlanError, Settings};

/// Bytes of the arguments of an indirect dispatch.
const ARGUMENTS_BYTES: u64 = 12;

/// Splits across an edge along a side of a cell, beyond those of cells in general.
const MORE_EDGE_SPLITS: u32 = 4;

/// Least cells that a queue holds.
const LEAST_CAPACITY: u32 = 4096;

/// Resources of footprints, which lights use in turn.
pub(crate) struct Footprints {
    bvh: ResourceId,
    /// Queues of split cells, one per round.
    queues: ResourceId,
    /// Of the dispatches over them, one per round.
    arguments: ResourceId,
    landings: ResourceId,
    ends: ResourceId,
    /// Cells of a queue.
    capacity: u32,
    rounds: u32,
    orders: u32,
}

impl Footprints {
    /// `None` for other methods, and where no light needs them.
    pub(crate) fn new(
        resources: &mut Resources<'_>,
        settings: &Settings,
        setups: &[LightSetup],
        geometry: &Geometry,
    ) -> Result<Option<Self>, PlanError> {
        if settings.method != Method::Footprint || !setups.iter().any(|s| s.caustic) {
            return Ok(None);
        }
        let refracted = setups.iter().any(|s| s.refracted);
        let orders = if refracted { settings.bounces + 1 } else { 1 };
        let nodes = setups.iter().map(|s| s.bands.wavelengths_nm.len()).max().unwrap_or(1) as u64;
        let texels = u64::from(settings.emission_size).pow(2);
        let capacity = settings.emission_size.pow(2).max(LEAST_CAPACITY);
        let paths = texels.max(4 * u64::from(capacity)) * nodes;
        // What is not to be split in x and y is not to be split at all.
        let rounds = if settings.cell_splits == 0 { 0 } else { settings.cell_splits + MORE_EDGE_SPLITS };
        let words = (CELLS_HEAD + CELL_WORDS * capacity as usize) as u64;
        let remedy = "emission_size";
        Ok(Some(Self {
            bvh: resources.filled("bvh", &bvh::build(&geometry.triangles)?)?,
            queues: resources.buffer("cell queues", 4 * words * u64::from(rounds.max(1)), remedy)?,
            arguments: resources.buffer(
                "cell dispatches",
                ARGUMENTS_BYTES * u64::from(rounds.max(1)),
                "cell_splits",
            )?,
            landings: resources.buffer(
                "path landings",
                size_of::<PathLanding>() as u64 * paths * u64::from(orders),
                remedy,
            )?,
            ends: resources.buffer("path ends", size_of::<PathEnds>() as u64 * paths, remedy)?,
            capacity,
            rounds,
            orders,
        }))
    }

    /// First word of a round's queue; none behind the last.
    fn queue(&self, round: u32) -> u32 {
        let words = CELLS_HEAD as u32 + CELL_WORDS as u32 * self.capacity;
        if round < self.rounds { round * words } else { NO_QUEUE }
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
            max_groups: self.resources.max_groups(),
            path: PATH_REFRACTED,
            casters: TRIANGLE_REFRACTS,
            rule: self.settings.refraction_rule.code(),
            range: setup.range,
            keeps_bounds: u32::from(map_view != landing_view),
            reserved0: 0,
        };
        let splat = FootprintSplat {
            emission_view: setup.views.start,
            landing_view,
            map_view,
            first_band: setup.first_band,
            nodes,
            orders: footprints.orders,
            materials,
            first_optics: setup.first_band,
            bins: setup.bands.bins(),
            most_level: self.settings.cell_splits,
            queue: NO_QUEUE,
            next: footprints.queue(0),
            capacity: footprints.capacity,
            first_ledger: setup.first_ledger,
            max_groups: self.resources.max_groups(),
            spot_scale: setup.spot_scale,
            spot_axis: setup.spot_axis,
            spot_offset: setup.spot_offset,
            silhouette_view: setup.silhouette_view,
            first_caster: self.geometry.opaque,
            end_caster: self.geometry.triangles.len() as u32,
            most_edge_level: self.settings.cell_splits + MORE_EDGE_SPLITS,
            task: TASK_LAY,
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
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
            self.lay_path(footprints, label, trace, splat, resolve, self.shared.landing, fitted)?;
        }
        if reflecting != 0 {
            let trace =
                PathTrace { orders: 1, path: PATH_REFLECTED, casters: reflecting, keeps_bounds: 0, ..trace };
            // Reflected light goes far: its map shows all receivers.
            let mirrors = reflecting & TRIANGLE_REFRACTS == 0;
            let splat = FootprintSplat {
                orders: 1,
                map_view: landing_view,
                first_ledger: reflected_ledger,
                first_caster: if reflecting & TRIANGLE_MIRROR != 0 {
                    self.geometry.matt
                } else {
                    self.geometry.opaque
                },
                end_caster: if mirrors { self.geometry.opaque } else { splat.end_caster },
                ..splat
            };
            let resolve = MapResolve { view: landing_view, first_texel: first_reflected, ..resolve };
            let label = format!("{label}, reflected");
            self.lay_path(footprints, &label, trace, splat, resolve, reflected_landing, None)?;
        }
        Ok(())
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "the steps of one light path, each with its own parameters"
    )]
    fn lay_path(
        &mut self,
        footprints: &Footprints,
        label: &str,
        trace: PathTrace,
        splat: FootprintSplat,
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
        let splat_bindings = [
            footprints.landings,
            footprints.ends,
            self.views,
            self.bands,
            shared.optics,
            map_buffer,
            ledger,
            footprints.queues,
            shared.entry,
        ]
        .map(Bound::from);
        let resolve_bindings = [self.views, map_buffer, caustic].map(Bound::from);
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
        let groups = queue_groups(texels * trace.nodes, PATHS_PER_GROUP, 1, max_groups);
        self.dispatch("path_trace", label, &trace, trace_bindings.to_vec(), groups);
        if let Some(bounds) = fitted {
            let views = [trace.landing_view, splat.map_view, trace.landing_faces];
            self.fit_views(bounds, label, views, DVec2::splat(self.most_zoom), map_size.x as f32);
        }
        self.resources.plan.steps.push(Step::ClearBuffer { buffer: map_buffer });
        let groups = queue_groups(cells, CELLS_PER_GROUP, 1, max_groups);
        if footprints.rounds > 0 {
            let count = FootprintSplat { task: TASK_COUNT, ..splat };
            let label = format!("{label}, count");
            self.dispatch("footprint_splat", &label, &count, splat_bindings.to_vec(), groups);
        }
        self.dispatch("footprint_splat", label, &splat, splat_bindings.to_vec(), groups);
        self.split_cells(footprints, label, (trace, &trace_bindings), (splat, &splat_bindings));
        self.dispatch("map_resolve", label, &resolve, resolve_bindings.to_vec(), resolve_groups);
        Ok(())
    }

    /// Rounds over the queues of split cells.
    fn split_cells(
        &mut self,
        footprints: &Footprints,
        label: &str,
        (trace, trace_bindings): (PathTrace, &[Bound]),
        (splat, splat_bindings): (FootprintSplat, &[Bound]),
    ) {
        let rounds = 0..footprints.rounds;
        let traces: Vec<PathTrace> = rounds
            .clone()
            .map(|round| PathTrace { queue: footprints.queue(round), keeps_bounds: 0, ..trace })
            .collect();
        let splats: Vec<FootprintSplat> = rounds
            .clone()
            .map(|round| FootprintSplat {
                queue: footprints.queue(round),
                next: footprints.queue(round + 1),
                ..splat
            })
            .collect();
        if footprints.rounds == 0 {
            return;
        }
        let counts: Vec<FootprintSplat> =
            splats.iter().map(|splat| FootprintSplat { task: TASK_COUNT, ..*splat }).collect();
        let plan = &mut self.resources.plan;
        let label = format!("{label}, split");
        let traces = plan.add_params_per_iteration(format!("path_trace: {label}"), &traces);
        let splats = plan.add_params_per_iteration(format!("footprint_splat: {label}"), &splats);
        let counts = plan.add_params_per_iteration(format!("footprint_splat: {label}, count"), &counts);
        let pass = |pass: &str, params, bindings: &[Bound]| frame_plan::PassStep {
            pass: pass.into(),
            label: label.clone(),
            params: Some(params),
            bindings: bindings.to_vec(),
        };
        let iterations = rounds.map(|round| {
            let offset_bytes = ARGUMENTS_BYTES * u64::from(round);
            // A pass cannot take its own arguments from a buffer that it writes.
            let arguments = Step::CopyBuffer {
                source: footprints.queues,
                source_offset_bytes: 4 * (u64::from(footprints.queue(round)) + QUEUE_GROUPS as u64),
                target: footprints.arguments,
                target_offset_bytes: offset_bytes,
                size_bytes: ARGUMENTS_BYTES,
            };
            let over_queue =
                |pass| Step::DispatchIndirect { pass, arguments: footprints.arguments, offset_bytes };
            let mut steps = vec![arguments, over_queue(pass("path_trace", traces, trace_bindings))];
            if round + 1 < footprints.rounds {
                steps.push(over_queue(pass("footprint_splat", counts, splat_bindings)));
            }
            steps.push(over_queue(pass("footprint_splat", splats, splat_bindings)));
            steps
        });
        let iterations = iterations.collect();
        plan.steps.push(Step::Repeat { label: format!("footprints ({label})"), iterations });
    }
}
