//! The passes: per stem a WGSL file in `shaders/` and here its parameters, bindings and CPU mirror.

use bytemuck::{Pod, Zeroable};
use frame_plan::{Binding, BindingKind, PassSet};

use crate::height_field::Heights;
use crate::pond::Outside;

pub mod pond_coefficients;
pub mod pond_convolve;
pub mod pond_crop;
pub mod pond_fft;
pub mod pond_heights;
pub mod pond_picture;
pub mod pond_product;
pub mod pond_relief;
pub mod pond_spectrum;
pub mod pond_surface;
pub(crate) mod report;
mod wgsl;

/// Every pass that plans of this crate name.
pub const PASSES: PassSet = PassSet(&[
    &pond_heights::POND_HEIGHTS,
    &pond_relief::POND_RELIEF,
    &pond_surface::POND_SURFACE,
    &pond_product::POND_PRODUCT,
    &pond_coefficients::POND_COEFFICIENTS,
    &pond_convolve::POND_CONVOLVE,
    &pond_fft::POND_FFT,
    &pond_spectrum::POND_SPECTRUM,
    &pond_crop::POND_CROP,
    &pond_picture::POND_PICTURE,
]);

/// The passes with their SPIR-V, compiled when this crate was built.
#[cfg(feature = "spirv")]
pub const SPIRV_PASSES: frame_plan::spirv::SpirvPasses = frame_plan::spirv::SpirvPasses {
    passes: PASSES,
    modules: std::borrow::Cow::Borrowed(include!(concat!(env!("OUT_DIR"), "/pond_passes.rs"))),
};

/// Samples across a pond; mirrors `PondGrid` in `shaders/shared/pond.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondGrid {
    /// Samples in x and y.
    pub size: [u32; 2],
    /// Distance between neighbours in x and y, metres.
    pub pitch_m: [f32; 2],
}

impl PondGrid {
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size.map(|side| side as usize)
    }

    pub(crate) fn samples(&self) -> usize {
        self.size().iter().product()
    }

    /// Heights of this grid.
    pub(crate) fn heights<'a>(&self, heights_m: &'a [f32], outside: Outside) -> Heights<'a, f32> {
        Heights { size: self.size(), pitch_m: self.pitch_m, outside, heights_m }
    }
}

/// Workgroups of 8 x 8 invocations that cover a grid.
pub(crate) fn groups_of_grid(size: [usize; 2]) -> [u32; 3] {
    let [x, y] = size.map(|side| side.div_ceil(8) as u32);
    [x, y, 1]
}

/// Invocations of a workgroup of passes that take samples one by one.
pub(crate) const SAMPLES_PER_GROUP: u32 = 64;

/// Workgroups of [`SAMPLES_PER_GROUP`] invocations, in rows of at most as many as every device takes.
pub(crate) fn groups_of_samples(samples: usize) -> [u32; 3] {
    const MOST_IN_A_ROW: u32 = 65_535;
    let groups = (samples as u32).div_ceil(SAMPLES_PER_GROUP);
    let x = groups.min(MOST_IN_A_ROW);
    [x, groups.div_ceil(x), 1]
}

/// Samples that mirrors take together.
const ROW: usize = 1024;

/// Images of `samples` each, which lie one after the other, in rows of [`ROW`] samples of all of them.
fn rows_of_images(images: &mut [f32], samples: usize) -> Vec<Vec<&mut [f32]>> {
    let mut rows: Vec<Vec<&mut [f32]>> = Vec::new();
    rows.resize_with(samples.div_ceil(ROW), Vec::new);
    for image in images.chunks_mut(samples) {
        for (row, part) in rows.iter_mut().zip(image.chunks_mut(ROW)) {
            row.push(part);
        }
    }
    rows
}

/// 1 where the pond goes on outside of its grid, as shaders have it.
pub(crate) fn periodic(outside: Outside) -> u32 {
    u32::from(outside == Outside::Periodic)
}

/// The other way round.
pub(crate) fn outside(periodic: u32) -> Outside {
    if periodic == 1 { Outside::Periodic } else { Outside::Dark }
}

const fn binding(name: &'static str, kind: BindingKind) -> Binding {
    Binding { name, kind }
}
