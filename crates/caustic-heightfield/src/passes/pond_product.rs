//! What the paper convolves (passes 4 and 5). Twin of `shaders/pond_product.wgsl`.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::{ROW, SAMPLES_PER_GROUP, binding, rows_of_images, wgsl};
use crate::convolution::source_products;

/// Uniform of the pass; mirrors `PondProduct` in `shaders/pond_product.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondProduct {
    /// How many there are.
    pub samples: u32,
    /// Workgroups in x.
    pub groups_per_row: u32,
    /// n - 1, where n = 2a is the exponent of the cosine.
    pub exponent: f32,
    /// Padding.
    pub reserved: u32,
}

/// All that an executor needs to build and run `pond_product`.
pub const POND_PRODUCT: PassInfo = PassInfo {
    name: "pond_product",
    wgsl: wgsl::POND_PRODUCT,
    params_struct: "PondProduct",
    params_bytes: size_of::<PondProduct>() as u32,
    bindings: &[binding("beams", BindingKind::Read), binding("terms", BindingKind::Write)],
    kind: PassKind::Compute {
        workgroup: [SAMPLES_PER_GROUP, 1, 1],
        mirror: |args| pond_product(&args.params(), args.read("beams"), args.write("terms")),
    },
};

/// CPU mirror.
pub fn pond_product(params: &PondProduct, beams: &[[f32; 4]], terms: &mut [f32]) {
    let samples = params.samples as usize;
    let rows = rows_of_images(&mut terms[..3 * samples], samples);
    beams[..samples].par_chunks(ROW).zip(rows).for_each(|(beams, mut rows)| {
        for (index, &[x, y, z, flux]) in beams.iter().enumerate() {
            let products = source_products([x, y, z], flux, params.exponent);
            for (row, product) in rows.iter_mut().zip(products) {
                row[index] = product;
            }
        }
    });
}
