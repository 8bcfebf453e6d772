//! Steps from impulses to beams, and the parameters that follow the light.

use frame_plan::{ParamsId, Resource, ResourceId, Step};

use super::{Builder, HeightSource, PondPlan, pass};
use crate::distance_table::DistanceTable;
use crate::error::PondError;
use crate::passes::pond_heights::{PondHeights, RingSource};
use crate::passes::pond_relief::PondRelief;
use crate::passes::pond_surface::PondSurface;
use crate::passes::report::units_per_flux;
use crate::passes::{PondGrid, groups_of_grid, periodic};
use crate::pond::{Form, Illumination, Normals, Pond};
use crate::refraction_table::refraction_entries;
use crate::shadow::March;

/// Impulses that an iteration of `pond_heights` takes: what one invocation does must stay far below what drivers allow.
pub(super) const SOURCES_PER_ITERATION: usize = 4096;
/// Steps of a ray towards the light that are followed: half as many samples.
const MOST_STEPS: u32 = 8192;
/// Most entries of a table of Gamma and T.
const MOST_ENTRIES: usize = 1 << 16;

impl Builder {
    /// Heights from impulses, if that is where they come from.
    pub(super) fn heights(
        &mut self,
        extent_m: [f64; 2],
        source: HeightSource,
        heights: ResourceId,
    ) -> Result<Option<(ResourceId, ParamsId)>, PondError> {
        let HeightSource::Impulses { capacity, distance_levels } = source else {
            self.decide("pond_heights", false, "heights come from the host");
            return Ok(None);
        };
        if !(1..=HeightSource::MOST_IMPULSES).contains(&capacity) {
            let got = capacity as f64;
            return Err(PondError::Setting { name: "room for impulses", got, expected: "1 to 2^20" });
        }
        let bytes = (capacity * size_of::<RingSource>()) as u64;
        let sources = self.plan.add_resource(Resource::buffer_with("impulses", &vec![0_u8; bytes as usize]));
        let (codes, level_m) = match distance_levels {
            None => (vec![0], 0.0),
            Some(levels) => {
                let table = DistanceTable::new(self.grid.size(), extent_m, levels)?;
                (table.codes().to_vec(), table.level_m() as f32)
            }
        };
        let distances = self.plan.add_resource(Resource::buffer_with("distances", &codes));
        let block = PondHeights {
            grid: self.grid,
            first: 0,
            count: 0,
            beta_per_m: 0.0,
            turns_per_m: 0.0,
            level_m,
            table: u32::from(distance_levels.is_some()),
            reserved0: 0,
            reserved1: 0,
        };
        let blocks = source_blocks(block, capacity, 0);
        let params = self.plan.add_params_per_iteration("pond_heights", &blocks);
        let step = Step::Dispatch {
            pass: pass("pond_heights", Some(params), &[sources, distances, heights]),
            groups: groups_of_grid(self.grid.size()),
        };
        let iterations = blocks.iter().map(|_| vec![step.clone()]).collect();
        self.plan.steps.push(Step::Repeat { label: "pond_heights".into(), iterations });
        self.decide("pond_heights", true, format!("heights of up to {capacity} impulses and images"));
        Ok(Some((sources, params)))
    }

    /// What of the surface decides about shadows.
    pub(super) fn relief(&mut self, form: Form, heights: ResourceId, relief: ResourceId) {
        if form == Form::Paper {
            self.decide("pond_relief", false, "the paper takes it that the surface does not shade itself");
            return;
        }
        let params = self.plan.add_params("pond_relief", &PondRelief { grid: self.grid });
        self.plan.steps.push(Step::Dispatch {
            pass: pass("pond_relief", Some(params), &[heights, relief]),
            groups: groups_of_grid(self.grid.size()),
        });
        self.decide("pond_relief", true, "the surface may shade itself");
    }

    /// Beams below the surface. Its parameters follow later.
    pub(super) fn surface(
        &mut self,
        [heights, illumination, refraction_table, relief]: [ResourceId; 4],
        beams: ResourceId,
        report: ResourceId,
    ) -> ParamsId {
        let params = self.plan.add_params("pond_surface", &<PondSurface as bytemuck::Zeroable>::zeroed());
        self.plan.steps.push(Step::Dispatch {
            pass: pass(
                "pond_surface",
                Some(params),
                &[heights, illumination, refraction_table, relief, beams, report],
            ),
            groups: groups_of_grid(self.grid.size()),
        });
        self.decide("pond_surface", true, "always");
        params
    }
}

/// The blocks of all iterations for so many sources.
pub(super) fn source_blocks(block: PondHeights, capacity: usize, count: usize) -> Vec<PondHeights> {
    (0..capacity.div_ceil(SOURCES_PER_ITERATION))
        .map(|i| {
            let first = i * SOURCES_PER_ITERATION;
            let count = count.saturating_sub(first).min(SOURCES_PER_ITERATION);
            PondHeights { first: first as u32, count: count as u32, ..block }
        })
        .collect()
}

/// The entries of the tables of Gamma and T; 0 for none.
pub(super) fn check_entries(entries: Option<usize>) -> Result<usize, PondError> {
    match entries {
        Some(count) if !(2..=MOST_ENTRIES).contains(&count) => {
            let got = count as f64;
            Err(PondError::Setting { name: "entries of the table of refraction", got, expected: "2 to 2^16" })
        }
        entries => Ok(entries.unwrap_or(0)),
    }
}

/// What frames write when light changes.
pub(super) struct LightBytes {
    pub(super) surface: Vec<u8>,
    pub(super) illumination: Vec<u8>,
    pub(super) refraction_table: Option<Vec<u8>>,
}

impl PondPlan {
    /// What the passes must be told about the light of `pond`.
    pub(super) fn light_bytes(&self, pond: &Pond) -> LightBytes {
        let illumination: Vec<f32> = match &pond.illumination {
            Illumination::Uniform(level) => vec![*level as f32],
            Illumination::Map(levels) => levels.iter().map(|&level| level as f32).collect(),
        };
        let table = self.settings.refraction_entries.map(|count| {
            let entries = refraction_entries(count, pond.eta());
            let narrowed: Vec<[f32; 2]> = entries.iter().map(|entry| entry.map(|x| x as f32)).collect();
            bytemuck::cast_slice(&narrowed).to_vec()
        });
        LightBytes {
            surface: bytemuck::bytes_of(&self.surface_params(pond)).to_vec(),
            illumination: bytemuck::cast_slice(&illumination).to_vec(),
            refraction_table: table,
        }
    }

    fn surface_params(&self, pond: &Pond) -> PondSurface {
        let light = pond.unit_light_direction();
        let march = March::new(self.pitch_m(), light);
        let tangent = if march.tangent.is_finite() { march.tangent as f32 } else { f32::MAX };
        PondSurface {
            grid: self.grid(),
            light: light.map(|x| x as f32),
            eta: pond.eta() as f32,
            step: march.step.map(|x| x as f32),
            rise_m: march.rise_m as f32,
            depth_m: march.depth_m as f32,
            tangent,
            most_steps: if pond.form == Form::Physical { MOST_STEPS } else { 0 },
            one_sided: u32::from(pond.normals == Normals::OneSided),
            periodic: periodic(pond.outside),
            facets_are_larger: u32::from(pond.form == Form::Physical),
            table_entries: self.settings.refraction_entries.unwrap_or(0) as u32,
            mapped: u32::from(matches!(pond.illumination, Illumination::Map(_))),
            units_per_flux: self.units_per_flux(pond) as f32,
            floor_m: pond.depth_m as f32,
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        }
    }

    /// Units of the report's flux.
    pub(super) fn units_per_flux(&self, pond: &Pond) -> f64 {
        let brightest = match &pond.illumination {
            Illumination::Uniform(level) => *level,
            Illumination::Map(levels) => levels.iter().copied().fold(0.0, f64::max),
        };
        // As the passes have it, in f32.
        f64::from(units_per_flux(brightest * self.pitch_m().iter().product::<f64>()) as f32)
    }

    /// Let the plan start with the light of its pond.
    pub(super) fn start_with_light(&mut self) {
        let bytes = self.light_bytes(&self.pond);
        self.plan.params[self.ids.surface.0 as usize].bytes = bytes.surface;
        self.plan.resources[self.ids.illumination.0 as usize].initial = Some(bytes.illumination);
        if let Some(table) = bytes.refraction_table {
            self.plan.resources[self.ids.refraction_table.0 as usize].initial = Some(table);
        }
    }

    pub(super) fn pitch_m(&self) -> [f64; 2] {
        [0, 1].map(|k| self.extent_m[k] / self.size[k] as f64)
    }

    pub(super) fn grid(&self) -> PondGrid {
        PondGrid {
            size: self.size.map(|side| side as u32),
            pitch_m: self.pitch_m().map(|pitch| pitch as f32),
        }
    }
}
