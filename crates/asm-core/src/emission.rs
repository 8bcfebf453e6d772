//! Adaptive emission (Wyman & Nichols 2009): the steps from a light's emission view to the queue of tiles that show glass.

use frame_plan::{Bound, PassStep, ResourceId, Step, Subresource, TextureFormat};
use glam::UVec2;

use crate::caustics::Caustics;
use crate::passes::coverage_mip::CoverageMip;
use crate::passes::photon_refine::{PhotonRefine, REFINE_CELLS_PER_GROUP};
use crate::resources::Resources;
use crate::shared::photon_queue::{QUEUE_GROUPS, QUEUE_HEAD, TILE_TEXELS, queue_groups};
use crate::{Emission, PlanError, Settings};

/// Bytes of a queue's head.
const HEAD_BYTES: u64 = 4 * QUEUE_HEAD as u64;

/// Where an indirect dispatch finds its workgroups in a queue.
pub(crate) const QUEUE_ARGUMENTS_BYTES: u64 = 4 * QUEUE_GROUPS as u64;

/// Resources of adaptive emission, which lights use in turn.
pub(crate) struct Refinement {
    /// Mip chain of covered texels; level 0, of tiles, is rounded up so that every level halves without a rest.
    coverage: ResourceId,
    /// Cells along a side of each mip level, finest first.
    sides: Vec<u32>,
    /// What each level fills, coarsest first; the last holds tiles of photons.
    queues: Vec<ResourceId>,
    /// Zeros, as long as a head.
    empty_head: ResourceId,
    /// Heads of all queues, light x level, for the host.
    pub(crate) heads: ResourceId,
}

impl Refinement {
    /// `None` where photons start on a fixed grid.
    pub(crate) fn new(
        resources: &mut Resources<'_>,
        settings: &Settings,
        lights: usize,
    ) -> Result<Option<Self>, PlanError> {
        let Emission::Adaptive { levels } = settings.emission() else { return Ok(None) };
        let remedy = "emission_size";
        let side = settings.emission_size.div_ceil(TILE_TEXELS).next_multiple_of(1 << (levels - 1));
        let sides: Vec<u32> = (0..levels).map(|level| side >> level).collect();
        let coverage =
            resources.mip_texture("coverage", TextureFormat::R32Uint, [side; 2], levels, remedy)?;
        let mut queues = Vec::new();
        for level in 0..levels as usize {
            // Children of the next finer level, or at the finest its own cells.
            let cells = u64::from(sides[(levels as usize - 1 - level).saturating_sub(1)]).pow(2);
            let name = format!("photon queue {level}");
            queues.push(resources.buffer(&name, HEAD_BYTES + 4 * cells, remedy)?);
        }
        let empty_head = resources.filled("empty queue head", &[0_u32; QUEUE_HEAD])?;
        let heads = resources.buffer(
            "photon queue heads",
            HEAD_BYTES * u64::from(levels) * lights as u64,
            "emission levels",
        )?;
        resources.make_readable(heads);
        Ok(Some(Self { coverage, sides, queues, empty_head, heads }))
    }

    pub(crate) fn levels(&self) -> u32 {
        self.sides.len() as u32
    }

    pub(crate) fn coarsest_cells(&self) -> u32 {
        self.sides.last().map_or(0, |side| side * side)
    }

    /// The queue of tiles of photons.
    pub(crate) fn photons(&self) -> ResourceId {
        self.queues[self.queues.len() - 1]
    }
}

/// What the emission of a light looks at.
pub(crate) struct EmissionView {
    pub(crate) entry: ResourceId,
    pub(crate) exit: ResourceId,
    pub(crate) wavelengths: u32,
    /// `TRIANGLE_*` of what photons are for.
    pub(crate) casters: u32,
}

impl Caustics<'_> {
    /// Steps that fill the queue of tiles of a light.
    pub(crate) fn refine(&mut self, refinement: &Refinement, label: &str, view: &EmissionView) {
        self.coverage(refinement, label, view);
        let levels = refinement.sides.len();
        let max_groups = self.resources.max_groups();
        let params: Vec<PhotonRefine> = (0..levels)
            .map(|level| PhotonRefine {
                cells: UVec2::splat(refinement.sides[levels - 1 - level]),
                whole_level: u32::from(level == 0),
                finest: u32::from(level == levels - 1),
                next_depth: if level == levels - 1 { view.wavelengths } else { 1 },
                next_per_group: if level == levels - 1 { 1 } else { REFINE_CELLS_PER_GROUP },
                max_groups,
                reserved0: 0,
            })
            .collect();
        let plan = &mut self.resources.plan;
        let blocks = plan.add_params_per_iteration(format!("photon_refine: {label}"), &params);
        let iterations = (0..levels).map(|level| {
            let next = refinement.queues[level];
            // The first level is looked at whole, there is no queue; another level's stands in for it.
            let queue =
                level.checked_sub(1).map_or(refinement.empty_head, |before| refinement.queues[before]);
            let mip = (levels - 1 - level) as u32;
            let pass = PassStep {
                pass: "photon_refine".into(),
                label: label.into(),
                params: Some(blocks),
                bindings: vec![level_of(refinement.coverage, mip), queue.into(), next.into()],
            };
            let empty = Step::CopyBuffer {
                source: refinement.empty_head,
                source_offset_bytes: 0,
                target: next,
                target_offset_bytes: 0,
                size_bytes: HEAD_BYTES,
            };
            let refine = if level == 0 {
                let cells = refinement.coarsest_cells();
                Step::Dispatch { pass, groups: queue_groups(cells, REFINE_CELLS_PER_GROUP, 1, max_groups) }
            } else {
                Step::DispatchIndirect { pass, arguments: queue, offset_bytes: QUEUE_ARGUMENTS_BYTES }
            };
            vec![empty, refine]
        });
        let refine =
            Step::Repeat { label: format!("photon_refine ({label})"), iterations: iterations.collect() };
        plan.steps.push(refine);
    }

    fn coverage(&mut self, refinement: &Refinement, label: &str, view: &EmissionView) {
        let params: Vec<CoverageMip> = (0..)
            .zip(&refinement.sides)
            .map(|(level, &side)| CoverageMip { level, casters: view.casters, size: UVec2::splat(side) })
            .collect();
        let plan = &mut self.resources.plan;
        let blocks = plan.add_params_per_iteration(format!("coverage_mip: {label}"), &params);
        let iterations = (0..).zip(&refinement.sides).map(|(level, &side)| {
            let source =
                if level == 0 { view.entry.into() } else { level_of(refinement.coverage, level - 1) };
            let target = level_of(refinement.coverage, level);
            let bindings = vec![self.triangles.into(), source, view.exit.into(), target];
            let pass =
                PassStep { pass: "coverage_mip".into(), label: label.into(), params: Some(blocks), bindings };
            let groups = if level == 0 { side } else { side.div_ceil(8) };
            vec![Step::Dispatch { pass, groups: [groups, groups, 1] }]
        });
        let repeat =
            Step::Repeat { label: format!("coverage_mip ({label})"), iterations: iterations.collect() };
        plan.steps.push(repeat);
    }

    /// Keep the heads of this light's queues for the host; `light` counts lights with caustics.
    pub(crate) fn keep_heads(&mut self, refinement: &Refinement, light: usize) {
        let first = light * refinement.queues.len();
        for (i, &queue) in refinement.queues.iter().enumerate() {
            self.resources.plan.steps.push(Step::CopyBuffer {
                source: queue,
                source_offset_bytes: 0,
                target: refinement.heads,
                target_offset_bytes: HEAD_BYTES * (first + i) as u64,
                size_bytes: HEAD_BYTES,
            });
        }
    }
}

fn level_of(texture: ResourceId, mip: u32) -> Bound {
    Bound { resource: texture, part: Some(Subresource { base_mip: mip, mips: 1, base_layer: 0, layers: 1 }) }
}
