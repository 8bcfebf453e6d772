//! What low-rank terms convolve: flux times the coefficients of the beam's state. Twin of `shaders/pond_coefficients.wgsl`.

use std::sync::atomic::AtomicU32;

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::report::{OUTSIDE_STATES, Tally, UPWARDS};
use super::{ROW, SAMPLES_PER_GROUP, binding, rows_of_images, wgsl};
use crate::low_rank::state::{LEAST_DOWN, state};
use crate::low_rank::table::TableGrid;

/// Uniform of the pass; mirrors `PondCoefficients` in `shaders/pond_coefficients.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondCoefficients {
    /// The table's first state.
    pub low: [f32; 3],
    /// Depth of the floor below the water at rest, metres.
    pub depth_m: f32,
    /// The table's last state.
    pub high: [f32; 3],
    /// Share by which a state may differ where the table has one only.
    pub flat_tolerance: f32,
    /// States in each coordinate.
    pub table_size: [u32; 3],
    /// How many there are.
    pub terms: u32,
    /// How many there are.
    pub samples: u32,
    /// Workgroups in x.
    pub groups_per_row: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

/// All that an executor needs to build and run `pond_coefficients`.
pub const POND_COEFFICIENTS: PassInfo = PassInfo {
    name: "pond_coefficients",
    wgsl: wgsl::POND_COEFFICIENTS,
    params_struct: "PondCoefficients",
    params_bytes: size_of::<PondCoefficients>() as u32,
    bindings: &[
        binding("heights", BindingKind::Read),
        binding("beams", BindingKind::Read),
        binding("coefficients", BindingKind::Read),
        binding("terms", BindingKind::Write),
        binding("report", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [SAMPLES_PER_GROUP, 1, 1],
        mirror: |args| {
            let (heights, beams) = (args.read("heights"), args.read("beams"));
            let (terms, report) = (args.write("terms"), args.atomics("report"));
            pond_coefficients(&args.params(), heights, beams, args.read("coefficients"), terms, report);
        },
    },
};

/// CPU mirror.
pub fn pond_coefficients(
    params: &PondCoefficients,
    heights: &[f32],
    beams: &[[f32; 4]],
    coefficients: &[f32],
    images: &mut [f32],
    report: &[AtomicU32],
) {
    let (samples, terms) = (params.samples as usize, params.terms as usize);
    let grid = TableGrid {
        low: params.low,
        high: params.high,
        size: params.table_size.map(|states| states as usize),
        flat_tolerance: params.flat_tolerance,
    };
    let rows = rows_of_images(&mut images[..terms * samples], samples);
    let inputs = beams[..samples].par_chunks(ROW).zip(heights.par_chunks(ROW));
    inputs.zip(rows).for_each(|((beams, heights), mut rows)| {
        let mut tally = Tally::default();
        for (index, (&[x, y, z, flux], height)) in beams.iter().zip(heights).enumerate() {
            rows.iter_mut().for_each(|row| row[index] = 0.0);
            if f64::from(z) >= -LEAST_DOWN {
                tally.add(UPWARDS);
                continue;
            }
            let place = grid.place(state([x, y, z], params.depth_m + height));
            if !place.inside && flux > 0.0 {
                tally.add(OUTSIDE_STATES);
            }
            for (entry, weight) in place.corners() {
                let weight = weight * flux;
                for (row, value) in rows.iter_mut().zip(&coefficients[entry * terms..][..terms]) {
                    row[index] += weight * value;
                }
            }
        }
        tally.flush(report);
    });
}
