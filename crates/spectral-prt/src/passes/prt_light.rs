//! The light of a frame: a stored sky, turned. Twin of `shaders/prt_light.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::Vec4;

use super::{binding, wgsl};

/// Uniform of the pass; mirrors `PrtLight` in `shaders/prt_light.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PrtLight {
    /// Bands of spherical harmonics.
    pub bands: u32,
    /// Blocks of four spectral coefficients.
    pub blocks: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
}

/// Harmonics of all blocks that a workgroup turns.
pub(crate) const PER_GROUP: u32 = 64;

/// All that an executor needs to build and run `prt_light`.
pub const PRT_LIGHT: PassInfo = PassInfo {
    name: "prt_light",
    wgsl: wgsl::PRT_LIGHT,
    params_struct: "PrtLight",
    params_bytes: size_of::<PrtLight>() as u32,
    bindings: &[
        binding("sky", BindingKind::Read),
        binding("rotation", BindingKind::Read),
        binding("light", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [PER_GROUP, 1, 1],
        mirror: |args| {
            prt_light(&args.params(), args.read("sky"), args.read("rotation"), args.write("light"))
        },
    },
};

/// CPU mirror.
pub fn prt_light(params: &PrtLight, sky: &[Vec4], rotation: &[f32], light: &mut [Vec4]) {
    let bands = params.bands as usize;
    let of_blocks = sky.chunks_exact(bands * bands).zip(light.chunks_exact_mut(bands * bands));
    for (sky, light) in of_blocks.take(params.blocks as usize) {
        let mut matrices = rotation;
        for l in 0..bands {
            let orders = 2 * l + 1;
            let degree = l * l..l * l + orders;
            let (matrix, others) = matrices.split_at(orders * orders);
            for (out, row) in light[degree.clone()].iter_mut().zip(matrix.chunks_exact(orders)) {
                *out = row.iter().zip(&sky[degree.clone()]).fold(Vec4::ZERO, |sum, (r, s)| sum + *r * *s);
            }
            matrices = others;
        }
    }
}
