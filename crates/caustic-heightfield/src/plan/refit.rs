//! Low-rank terms of other light in a plan that is prepared: new kernels and coefficients, nothing else.

use frame_plan::Executor;

use super::{Method, PondPlan};
use crate::convolution::check_same_grid;
use crate::convolve::Sample;
use crate::error::PondError;
use crate::height_field::HeightField;
use crate::low_rank::table::Table;
use crate::passes::groups_of_samples;
use crate::passes::pond_coefficients::PondCoefficients;
use crate::pond::Pond;

/// By how much equal states may differ in f32, as a share.
const FLAT_TOLERANCE: f32 = 1e-5;

/// Parameters of the pass that looks up coefficients, of so many terms with those that are only room.
pub(super) fn coefficients<T: Sample>(
    table: &Table<T>,
    terms: usize,
    samples: usize,
    pond: &Pond,
) -> PondCoefficients {
    let grid = table.grid();
    let narrowed = |state: [f64; 3]| state.map(|x| x as f32);
    PondCoefficients {
        low: narrowed(grid.low),
        depth_m: pond.depth_m as f32,
        high: narrowed(grid.high),
        flat_tolerance: FLAT_TOLERANCE,
        table_size: grid.size.map(|states| states as u32),
        terms: terms as u32,
        samples: samples as u32,
        groups_per_row: groups_of_samples(samples)[0],
        reserved0: 0,
        reserved1: 0,
    }
}

/// The table's values with 0 for terms that are only room.
pub(super) fn table_values<T: Sample>(table: &Table<T>, terms: usize) -> Vec<f32> {
    let own = table.values().len() / table.grid().size.iter().product::<usize>();
    let of_state = |values: &[T]| -> Vec<f32> {
        let values = values.iter().map(|value| value.widened() as f32);
        values.chain(std::iter::repeat_n(0.0, terms - own)).collect()
    };
    table.values().chunks(own).flat_map(of_state).collect()
}

impl PondPlan {
    /// The terms of `method` instead of those that the plan has, with the pond that they are for.
    ///
    /// # Errors
    /// As [`crate::LowRank::refit`].
    pub(crate) fn refit<T: Sample>(
        &mut self,
        executor: &mut dyn Executor,
        method: &Method<'_, T>,
    ) -> Result<(), PondError> {
        let (Some((buffer, params)), Some(table)) = (self.ids.coefficients, method.table) else {
            return Err(PondError::OtherKernels { what: "the method" });
        };
        check_same_grid(&HeightField::flat(method.terms.size, method.extent_m)?, self.size, self.extent_m)?;
        self.check_structure(method.pond)?;
        let room = |what, got, max| if got > max { Err(PondError::Room { what, got, max }) } else { Ok(()) };
        room("terms", method.terms.kernels.len(), self.terms)?;
        let bytes = self.plan.resources[buffer.0 as usize].kind.bytes() as usize;
        let states = table.grid().size.iter().product::<usize>();
        room("states of their table", states, bytes / size_of::<f32>() / self.terms)?;
        let kernels = self.kernels.filled(method.terms, self.terms)?;

        for (buffer, bytes) in kernels.buffers {
            executor.write_buffer(buffer, 0, &bytes)?;
        }
        if let Some((params, bytes)) = kernels.params {
            executor.set_params(params, &bytes)?;
        }
        executor.write_buffer(buffer, 0, bytemuck::cast_slice(&table_values(table, self.terms)))?;
        let samples = self.size.iter().product();
        let block = coefficients(table, self.terms, samples, method.pond);
        executor.set_params(params, bytemuck::bytes_of(&block))?;
        self.tiles = method.tiles;
        self.write_pond(executor, method.pond)
    }
}
