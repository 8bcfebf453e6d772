//! The spectrum of the floor: sums of products of spectra of terms and kernels. Twin of `shaders/pond_spectrum.wgsl`, whose head
//! says how terms come in pairs.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;
use rustfft::num_complex::Complex;

use super::{binding, wgsl};

/// Uniform of the pass; mirrors `PondSpectrum` in `shaders/pond_spectrum.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondSpectrum {
    /// Points in x and y.
    pub size: [u32; 2],
    /// Pairs of terms.
    pub pairs: u32,
    /// 1: to what is there.
    pub add: u32,
}

/// All that an executor needs to build and run `pond_spectrum`.
pub const POND_SPECTRUM: PassInfo = PassInfo {
    name: "pond_spectrum",
    wgsl: wgsl::POND_SPECTRUM,
    params_struct: "PondSpectrum",
    params_bytes: size_of::<PondSpectrum>() as u32,
    bindings: &[
        binding("images", BindingKind::Read),
        binding("kernels", BindingKind::Read),
        binding("floor_spectrum", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let (images, kernels) = (args.read("images"), args.read("kernels"));
            pond_spectrum(&args.params(), images, kernels, args.write("floor_spectrum"));
        },
    },
};

/// CPU mirror.
pub fn pond_spectrum(
    params: &PondSpectrum,
    images: &[[f32; 2]],
    kernels: &[[f32; 2]],
    floor_spectrum: &mut [[f32; 2]],
) {
    let [width, height] = params.size.map(|side| side as usize);
    let points = width * height;
    let complex = |[re, im]: [f32; 2]| Complex::new(re, im);
    floor_spectrum[..points].par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            let here = y * width + x;
            let there = (height - y) % height * width + (width - x) % width;
            let mut sum = if params.add == 1 { complex(*value) } else { Complex::default() };
            for pair in 0..params.pairs as usize {
                let a = complex(images[pair * points + here]);
                let b = complex(images[pair * points + there]).conj();
                let (first, difference) = ((a + b) * 0.5, (a - b) * 0.5);
                let second = Complex::new(difference.im, -difference.re);
                sum += first * complex(kernels[2 * pair * points + here]);
                sum += second * complex(kernels[(2 * pair + 1) * points + here]);
            }
            *value = [sum.re, sum.im];
        }
    });
}
