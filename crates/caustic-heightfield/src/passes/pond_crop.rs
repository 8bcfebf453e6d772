//! The floor out of the image that was transformed. Twin of `shaders/pond_crop.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::{PondGrid, binding, wgsl};

/// Uniform of the pass; mirrors `PondCrop` in `shaders/pond_crop.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondCrop {
    /// The samples.
    pub grid: PondGrid,
    /// Points from row to row of the image.
    pub pitch: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// All that an executor needs to build and run `pond_crop`.
pub const POND_CROP: PassInfo = PassInfo {
    name: "pond_crop",
    wgsl: wgsl::POND_CROP,
    params_struct: "PondCrop",
    params_bytes: size_of::<PondCrop>() as u32,
    bindings: &[binding("image", BindingKind::Read), binding("irradiance", BindingKind::Write)],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| pond_crop(&args.params(), args.read("image"), args.write("irradiance")),
    },
};

/// CPU mirror.
pub fn pond_crop(params: &PondCrop, image: &[[f32; 2]], irradiance: &mut [f32]) {
    let rows = image.par_chunks(params.pitch as usize);
    irradiance[..params.grid.samples()].par_chunks_mut(params.grid.size()[0]).zip(rows).for_each(
        |(row, image)| {
            for (light, [re, _]) in row.iter_mut().zip(image) {
                *light = *re;
            }
        },
    );
}
