//! Relit surfaces whose albedos are entries of a palette. Twin of `shaders/prt_shade.wgsl`.

use frame_plan::{PassInfo, PassKind};
use glam::Vec4;

use super::wgsl;
use crate::shared::prt_picture::{BINDINGS, Inputs, PrtPicture};

/// All that an executor needs to build and run `prt_shade`.
pub const PRT_SHADE: PassInfo = PassInfo {
    name: "prt_shade",
    wgsl: wgsl::PRT_SHADE,
    params_struct: "PrtPicture",
    params_bytes: size_of::<PrtPicture>() as u32,
    bindings: &BINDINGS,
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| prt_shade(&Inputs::bound(args), args.write("picture")),
    },
};

/// CPU mirror.
pub fn prt_shade(inputs: &Inputs<'_>, picture: &mut [Vec4]) {
    inputs.shade(picture, Inputs::reflected_by_palette);
}
