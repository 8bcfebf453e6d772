//! The sum of convolutions in space (pass 6 of the paper): a part of the window at a time. Twin of
//! `shaders/pond_convolve.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::{PondGrid, binding, outside, wgsl};
use crate::convolve::{Part, Window, sum_row};

/// Uniform of the pass; mirrors `PondConvolve` in `shaders/pond_convolve.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondConvolve {
    /// The samples.
    pub grid: PondGrid,
    /// The window's first offset, in samples.
    pub low: [i32; 2],
    /// Offsets that kernels cover.
    pub window: [u32; 2],
    /// The part's first offset, from `low`; from the second part on, light is added to what is there.
    pub first: [u32; 2],
    /// Offsets of the part.
    pub count: [u32; 2],
    /// How many there are.
    pub terms: u32,
    /// 1: the pond goes on outside of its grid.
    pub periodic: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

/// All that an executor needs to build and run `pond_convolve`.
pub const POND_CONVOLVE: PassInfo = PassInfo {
    name: "pond_convolve",
    wgsl: wgsl::POND_CONVOLVE,
    params_struct: "PondConvolve",
    params_bytes: size_of::<PondConvolve>() as u32,
    bindings: &[
        binding("terms", BindingKind::Read),
        binding("kernels", BindingKind::Read),
        binding("irradiance", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            pond_convolve(&args.params(), args.read("terms"), args.read("kernels"), args.write("irradiance"));
        },
    },
};

/// CPU mirror.
pub fn pond_convolve(params: &PondConvolve, terms: &[f32], kernels: &[f32], irradiance: &mut [f32]) {
    let (size, samples) = (params.grid.size(), params.grid.samples());
    let window =
        Window { low: params.low.map(i64::from), size: params.window.map(|offsets| offsets as usize) };
    let part =
        Part { first: params.first.map(|at| at as usize), count: params.count.map(|count| count as usize) };
    let outside = outside(params.periodic);
    let pairs = kernels.chunks(window.len()).zip(terms.chunks(samples)).take(params.terms as usize);
    irradiance[..samples].par_chunks_mut(size[0]).enumerate().for_each_init(Vec::new, |edge, (j, row)| {
        if part.first == [0, 0] {
            row.fill(0.0);
        }
        sum_row(row, j, size, outside, (window, part), pairs.clone(), edge);
    });
}
