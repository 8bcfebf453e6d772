//! The light on the floor as a picture. Twin of `shaders/pond_picture.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::{PondGrid, binding, wgsl};

/// Uniform of the pass; mirrors `PondPicture` in `shaders/pond_picture.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondPicture {
    /// The samples.
    pub grid: PondGrid,
    /// CIE 1931 XYZ of light with Y = 1.
    pub white_xyz: [f32; 3],
    /// Padding.
    pub reserved: u32,
}

/// All that an executor needs to build and run `pond_picture`.
pub const POND_PICTURE: PassInfo = PassInfo {
    name: "pond_picture",
    wgsl: wgsl::POND_PICTURE,
    params_struct: "PondPicture",
    params_bytes: size_of::<PondPicture>() as u32,
    bindings: &[binding("irradiance", BindingKind::Read), binding("picture", BindingKind::Write)],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| pond_picture(&args.params(), args.read("irradiance"), args.write("picture")),
    },
};

/// CPU mirror.
pub fn pond_picture(params: &PondPicture, irradiance: &[f32], picture: &mut [[f32; 4]]) {
    picture[..params.grid.samples()].par_iter_mut().zip(irradiance).for_each(|(pixel, y)| {
        let [x, y, z] = params.white_xyz.map(|white| white * y);
        *pixel = [x, y, z, 0.0];
    });
}
