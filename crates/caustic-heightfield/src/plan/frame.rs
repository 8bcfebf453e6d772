//! What frames write and read.

use frame_plan::{Executor, ResourceId};

use super::surface::source_blocks;
use super::{HeightSource, PondPlan};
use crate::convolution::check_same_grid;
use crate::distance_table::nearest_sample;
use crate::error::PondError;
use crate::exact::check_clear_of_floor;
use crate::floor::{FloorGrid, FloorLight, FloorReport, lobe_samples};
use crate::height_field::HeightField;
use crate::impulse::{Impulse, Ripple, checked_sources};
use crate::passes::pond_heights::{PondHeights, RingSource};
use crate::passes::report::{GROUNDED, OUTSIDE_STATES, UPWARDS, decoded};
use crate::pond::{Illumination, Pond};
use crate::walls::WallImages;

/// The light on the floor after a frame.
#[derive(Clone, Debug)]
pub struct PondFrame {
    /// The light.
    pub light: FloorLight,
    /// Samples of the surface whose state is outside of what low-rank terms were made for; they were given the nearest state.
    pub outside_states: usize,
    /// Beams that do not travel downwards: low-rank terms leave them dark.
    pub upward_beams: usize,
}

impl PondPlan {
    /// Heights of the next frame.
    ///
    /// # Errors
    /// A surface of another grid; one that touches the floor; heights that come from impulses; those of the executor.
    pub fn write_heights(&self, executor: &mut dyn Executor, surface: &HeightField) -> Result<(), PondError> {
        check_same_grid(surface, self.size, self.extent_m)?;
        check_clear_of_floor(surface, &self.pond)?;
        let heights: Vec<f32> = surface.heights_m.iter().map(|&h| h as f32).collect();
        Ok(executor.write_buffer(self.ids.heights, 0, bytemuck::cast_slice(&heights))?)
    }

    /// The impulses of the next frame, their images, and its time. Only those whose waves are in the pond by then take room.
    ///
    /// # Errors
    /// A number outside its range; more impulses than the plan has room for, which is 0 where heights come from the host; those of
    /// the executor.
    pub fn write_impulses(
        &self,
        executor: &mut dyn Executor,
        ripple: &Ripple,
        impulses: &[Impulse],
        images: WallImages,
        time_s: f64,
    ) -> Result<(), PondError> {
        let all = checked_sources(self.size, self.extent_m, ripple, impulses, images, time_s)?;
        let sources: Vec<RingSource> = all
            .iter()
            .filter(|source| self.is_reached(ripple, source, time_s))
            .map(|source| self.ring_source(ripple, source, time_s))
            .collect();
        let (capacity, distance_levels) = match self.settings.heights {
            HeightSource::Host => (0, None),
            HeightSource::Impulses { capacity, distance_levels } => (capacity, distance_levels),
        };
        let Some((buffer, params)) = self.ids.impulses.filter(|_| sources.len() <= capacity) else {
            return Err(PondError::Impulses { got: sources.len(), max: capacity });
        };
        let planned = &self.plan.params[params.0 as usize].bytes[..size_of::<PondHeights>()];
        let block = PondHeights {
            beta_per_m: ripple.beta_per_m as f32,
            turns_per_m: (ripple.wave_number_rad_m / std::f64::consts::TAU) as f32,
            table: u32::from(distance_levels.is_some()),
            ..bytemuck::pod_read_unaligned(planned)
        };
        executor.write_buffer(buffer, 0, bytemuck::cast_slice(&sources))?;
        let blocks = source_blocks(block, capacity, sources.len());
        Ok(executor.set_params(params, bytemuck::cast_slice(&blocks))?)
    }

    /// Whether an impulse has made waves in the pond by then.
    fn is_reached(&self, ripple: &Ripple, source: &Impulse, time_s: f64) -> bool {
        let age_s = time_s - source.start_s;
        let beyond = |k: usize| {
            let at = source.position_m[k];
            // Tables know distances from the nearest sample only.
            (at - at.clamp(0.0, self.extent_m[k])).abs() - self.pitch_m()[k]
        };
        age_s >= 0.0 && beyond(0).max(beyond(1)) <= ripple.front_m_s * age_s
    }

    fn ring_source(&self, ripple: &Ripple, source: &Impulse, time_s: f64) -> RingSource {
        let ring = ripple.ring(time_s - source.start_s, source.amplitude_m);
        RingSource {
            position_m: source.position_m.map(|x| x as f32),
            sample: nearest_sample(self.size, self.extent_m, source.position_m).map(|i| i as i32),
            front_m: ring.front_m as f32,
            amplitude_m: ring.amplitude_m as f32,
            phase_turns: ring.phase_turns as f32,
            reserved: 0.0,
        }
    }

    /// Light, indices of refraction and normals of the next frame are those of `pond`.
    ///
    /// Low-rank terms are made for the beams of some light: [`PondFrame::outside_states`] says how far another is from it.
    ///
    /// # Errors
    /// As [`Pond::check`]; water, form or surroundings that kernels were not made for; an illumination that varies where the plan's
    /// does not, or the other way round; those of the executor.
    pub fn write_light(&mut self, executor: &mut dyn Executor, pond: &Pond) -> Result<(), PondError> {
        let changes = [
            ("the depth", pond.depth_m != self.pond.depth_m),
            ("the scattering", pond.scattering != self.pond.scattering),
            ("the extinction", pond.extinction_per_m != self.pond.extinction_per_m),
        ];
        if let Some((what, _)) = changes.into_iter().find(|(_, changed)| *changed) {
            return Err(PondError::OtherKernels { what });
        }
        self.check_structure(pond)?;
        self.write_pond(executor, pond)
    }

    /// Whether the plan's passes are those of this pond.
    pub(super) fn check_structure(&self, pond: &Pond) -> Result<(), PondError> {
        pond.check(&HeightField::flat(self.size, self.extent_m)?)?;
        let is_map = |pond: &Pond| matches!(pond.illumination, Illumination::Map(_));
        let changes = [
            ("the form", pond.form != self.pond.form),
            ("what is outside", pond.outside != self.pond.outside),
            ("the kind of illumination", is_map(pond) != is_map(&self.pond)),
        ];
        match changes.into_iter().find(|(_, changed)| *changed) {
            Some((what, _)) => Err(PondError::OtherKernels { what }),
            None => Ok(()),
        }
    }

    /// Parameters and buffers that follow the light.
    pub(super) fn write_pond(&mut self, executor: &mut dyn Executor, pond: &Pond) -> Result<(), PondError> {
        let bytes = self.light_bytes(pond);
        executor.set_params(self.ids.surface, &bytes.surface)?;
        executor.write_buffer(self.ids.illumination, 0, &bytes.illumination)?;
        if let Some(table) = bytes.refraction_table {
            executor.write_buffer(self.ids.refraction_table, 0, &table)?;
        }
        self.pond = pond.clone();
        Ok(())
    }

    /// Samples of the surface and the floor in x and y.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The floor's picture on the device, of a plan that was asked for one: XYZ and padding per sample, f32, row-major, x fastest.
    #[must_use]
    pub fn picture(&self) -> Option<ResourceId> {
        self.ids.picture
    }

    /// Have every frame bring the counts of its surface along: for [`PondPlan::latest_outside_states`].
    ///
    /// # Errors
    /// Those of the executor, which runs this plan.
    pub fn watch_states(&self, executor: &mut dyn Executor) -> Result<(), PondError> {
        Ok(executor.watch(&[self.ids.report])?)
    }

    /// [`PondFrame::outside_states`] of the last frame that is known to have finished, without waiting; none if there is no such frame
    /// yet.
    #[must_use]
    pub fn latest_outside_states(&self, executor: &mut dyn Executor) -> Option<usize> {
        let report: Vec<u32> = words(executor.latest(self.ids.report)?);
        Some(report[OUTSIDE_STATES] as usize)
    }

    /// Wait for the last frame and read its light.
    ///
    /// # Errors
    /// Impulses whose waves touch the floor ([`PondPlan::write_heights`] looks by itself); those of the executor.
    pub fn read(&self, executor: &mut dyn Executor) -> Result<PondFrame, PondError> {
        let irradiance: Vec<f32> = words(&executor.read(self.ids.irradiance)?);
        let words: Vec<u32> = words(&executor.read(self.ids.report)?);
        if words[GROUNDED] > 0 {
            return Err(PondError::Grounded { got: words[GROUNDED] as usize, samples: irradiance.len() });
        }
        let grid = FloorGrid { size: self.size, corner_m: [0.0; 2], extent_m: self.extent_m };
        let irradiance: Vec<f64> = irradiance.into_iter().map(f64::from).collect();
        let (periodic_tiles, periodic_tail) = self.tiles;
        let report = FloorReport {
            surface: decoded(&words, irradiance.len(), self.units_per_flux(&self.pond)),
            floor_flux: irradiance.iter().sum::<f64>() * grid.cell_m2(),
            lobe_samples: lobe_samples(self.pitch_m(), &self.pond),
            periodic_tiles,
            periodic_tail,
        };
        Ok(PondFrame {
            light: FloorLight { grid, irradiance, report },
            outside_states: words[OUTSIDE_STATES] as usize,
            upward_beams: words[UPWARDS] as usize,
        })
    }
}

/// The words of a buffer.
fn words<T: bytemuck::AnyBitPattern>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}
