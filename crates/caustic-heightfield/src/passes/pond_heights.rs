//! Heights of impulses (section 4.3 of the paper). Twin of `shaders/pond_heights.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::{PondGrid, binding, wgsl};
use crate::distance_table::entry;
use crate::impulse::Ring;

/// Uniform of the pass; mirrors `PondHeights` in `shaders/pond_heights.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondHeights {
    /// The samples.
    pub grid: PondGrid,
    /// First of the sources; from 1 on, heights are added to what is there.
    pub first: u32,
    /// Number of sources.
    pub count: u32,
    /// Damping behind the wavefront, 1/m.
    pub beta_per_m: f32,
    /// K / (2 pi).
    pub turns_per_m: f32,
    /// Metres from one level of the table of distances to the next.
    pub level_m: f32,
    /// 1: distances are those of the table, from the nearest sample; 0: they are evaluated.
    pub table: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

/// An impulse or its image, at one time; mirrors `RingSource` in `shaders/pond_heights.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct RingSource {
    /// Where it fell, metres.
    pub position_m: [f32; 2],
    /// The sample it fell on, which may lie outside.
    pub sample: [i32; 2],
    /// How far its wave has come, metres.
    pub front_m: f32,
    /// A exp(-alpha t), metres.
    pub amplitude_m: f32,
    /// omega t / (2 pi), without whole turns.
    pub phase_turns: f32,
    /// Padding.
    pub reserved: f32,
}

/// All that an executor needs to build and run `pond_heights`.
pub const POND_HEIGHTS: PassInfo = PassInfo {
    name: "pond_heights",
    wgsl: wgsl::POND_HEIGHTS,
    params_struct: "PondHeights",
    params_bytes: size_of::<PondHeights>() as u32,
    bindings: &[
        binding("sources", BindingKind::Read),
        binding("distances", BindingKind::Read),
        binding("heights", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            pond_heights(&args.params(), args.read("sources"), args.read("distances"), args.write("heights"));
        },
    },
};

/// CPU mirror.
pub fn pond_heights(params: &PondHeights, sources: &[RingSource], distances: &[u32], heights: &mut [f32]) {
    let PondGrid { pitch_m, .. } = params.grid;
    let size = params.grid.size();
    let sources = &sources[params.first as usize..][..params.count as usize];
    heights[..params.grid.samples()].par_chunks_mut(size[0]).enumerate().for_each(|(j, row)| {
        if params.first == 0 {
            row.fill(0.0);
        }
        let y = (j as f32 + 0.5) * pitch_m[1];
        for source in sources {
            let dy = y - source.position_m[1];
            if params.table == 0 && dy.abs() > source.front_m {
                continue;
            }
            let ring = Ring {
                front_m: source.front_m,
                amplitude_m: source.amplitude_m,
                phase_turns: source.phase_turns,
            };
            for (i, height) in row.iter_mut().enumerate() {
                let distance_m = if params.table == 1 {
                    let offset =
                        [i as i64 - i64::from(source.sample[0]), j as i64 - i64::from(source.sample[1])];
                    let Some(entry) = entry(size, offset) else { continue };
                    distances[entry] as f32 * params.level_m
                } else {
                    let dx = (i as f32 + 0.5) * pitch_m[0] - source.position_m[0];
                    (dx * dx + dy * dy).sqrt()
                };
                *height += ring.height(params.beta_per_m, params.turns_per_m, distance_m);
            }
        }
    });
}
