//! Irradiance of vertices in the spectral basis (Schwenk et al. 2010, the inner sum of eq. 5). Twin of
//! `shaders/prt_vertex.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::Vec4;
use rayon::prelude::*;

use super::{binding, wgsl};

/// Uniform of the pass; mirrors `PrtVertex` in `shaders/prt_vertex.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtVertex {
    /// How many there are.
    pub vertices: u32,
    /// Workgroups in x.
    pub groups_per_row: u32,
    /// Coefficients of transfer.
    pub harmonics: u32,
    /// Blocks of four spectral coefficients.
    pub blocks: u32,
    /// All blocks of a vertex: those of its functions come first.
    pub vertex_blocks: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// Vertices of a workgroup.
pub(crate) const PER_GROUP: u32 = 64;

/// All that an executor needs to build and run `prt_vertex`.
pub const PRT_VERTEX: PassInfo = PassInfo {
    name: "prt_vertex",
    wgsl: wgsl::PRT_VERTEX,
    params_struct: "PrtVertex",
    params_bytes: size_of::<PrtVertex>() as u32,
    bindings: &[
        binding("transfer", BindingKind::Read),
        binding("light", BindingKind::Read),
        binding("irradiance", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [PER_GROUP, 1, 1],
        mirror: |args| {
            let functions = args.groups()[2];
            let (transfer, light) = (args.read("transfer"), args.read("light"));
            prt_vertex(&args.params(), functions, transfer, light, args.write("irradiance"));
        },
    },
};

/// Vertices that the mirror takes together.
const CHUNK: usize = 256;

/// CPU mirror: `functions` of transfer.
pub fn prt_vertex(
    params: &PrtVertex,
    functions: u32,
    transfer: &[f32],
    light: &[Vec4],
    irradiance: &mut [Vec4],
) {
    let (vertices, harmonics) = (params.vertices as usize, params.harmonics as usize);
    let (functions, blocks) = (functions as usize, params.blocks as usize);
    let of_vertex = params.vertex_blocks as usize;
    irradiance[..vertices * of_vertex].par_chunks_mut(CHUNK * of_vertex).enumerate().for_each(
        |(chunk, irradiance)| {
            irradiance.fill(Vec4::ZERO);
            for function in 0..functions {
                for k in 0..harmonics {
                    let first = (function * harmonics + k) * vertices + chunk * CHUNK;
                    for (sums, t) in irradiance.chunks_exact_mut(of_vertex).zip(&transfer[first..]) {
                        for block in 0..blocks {
                            sums[function * blocks + block] += *t * light[block * harmonics + k];
                        }
                    }
                }
            }
        },
    );
}
