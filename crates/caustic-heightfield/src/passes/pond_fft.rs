//! Fourier transforms of lines of an image, so many points at a time. Twin of `shaders/pond_fft.wgsl`, whose head says how.

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{FftDirection, FftPlanner};

use super::{binding, wgsl};

/// Points of a workgroup, and the most of a transform; mirrors `POINTS` in `shaders/pond_fft.wgsl`.
pub(crate) const POINTS: u32 = 1024;

/// Uniform of the pass; mirrors `PondFft` in `shaders/pond_fft.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondFft {
    /// 0: lines are rows; 1: columns.
    pub axis: u32,
    /// Points of a transform, a power of two up to 1024.
    pub radix: u32,
    /// Points of a line, a power of two.
    pub length: u32,
    /// Product of earlier passes' radices.
    pub span: u32,
    /// How many there are.
    pub lines: u32,
    /// Points of a line that the input has.
    pub there: u32,
    /// The last so many points are those before the first.
    pub behind: u32,
    /// 1: the input goes on before and after what is there; 0: there it is 0.
    pub periodic: u32,
    /// Points from row to row of the input.
    pub pitch_in: u32,
    /// Points from image to image of the input.
    pub plane_in: u32,
    /// Points from row to row of the output.
    pub pitch_out: u32,
    /// Points from image to image of the output.
    pub plane_out: u32,
    /// 1: the input is complex; 0: its images are real, and parts of complex ones in turn.
    pub complex_in: u32,
    /// First complex image of the input.
    pub first_in: u32,
    /// 1: the transform back, without its factor.
    pub inverse: u32,
    /// Entries of the table of roots.
    pub twiddles: u32,
}

/// All that an executor needs to build and run `pond_fft`.
pub const POND_FFT: PassInfo = PassInfo {
    name: "pond_fft",
    wgsl: wgsl::POND_FFT,
    params_struct: "PondFft",
    params_bytes: size_of::<PondFft>() as u32,
    bindings: &[
        binding("input", BindingKind::Read),
        binding("roots", BindingKind::Read),
        binding("output", BindingKind::Write),
    ],
    kind: PassKind::Compute {
        workgroup: [256, 1, 1],
        mirror: |args| {
            let images = args.groups()[2] as usize;
            pond_fft(&args.params(), images, args.read("input"), args.read("roots"), args.write("output"));
        },
    },
};

/// CPU mirror, of so many images.
pub fn pond_fft(params: &PondFft, images: usize, input: &[f32], roots: &[[f32; 2]], output: &mut [[f32; 2]]) {
    let (length, radix, lines) = (params.length as usize, params.radix as usize, params.lines as usize);
    let direction = if params.inverse == 1 { FftDirection::Inverse } else { FftDirection::Forward };
    let fft = FftPlanner::<f32>::new().plan_fft(radix, direction);
    let columns = params.axis == 1;
    for (image, output) in output.chunks_mut(params.plane_out as usize).take(images).enumerate() {
        let mut done = vec![Complex::default(); lines * length];
        done.par_chunks_mut(length).enumerate().for_each_init(
            || (vec![Complex::default(); radix], vec![Complex::default(); fft.get_inplace_scratch_len()]),
            |(points, scratch), (line, done)| {
                for j in 0..length / radix {
                    for (r, point) in points.iter_mut().enumerate() {
                        let at = j + r * (length / radix);
                        *point = params.point_in(input, image, line, at) * params.twiddle(roots, j, r);
                    }
                    fft.process_with_scratch(points, scratch);
                    let k = j % params.span as usize;
                    for (r, point) in points.iter().enumerate() {
                        done[(j - k) * radix + k + r * params.span as usize] = *point;
                    }
                }
            },
        );
        let value = |line: usize, point: usize| {
            let Complex { re, im } = done[line * length + point];
            [re, im]
        };
        let rows = if columns { length } else { lines };
        output.par_chunks_mut(params.pitch_out as usize).take(rows).enumerate().for_each(|(y, row)| {
            let across = if columns { lines } else { length };
            for (x, to) in row[..across].iter_mut().enumerate() {
                *to = if columns { value(x, y) } else { value(y, x) };
            }
        });
    }
}

impl PondFft {
    fn point_in(&self, input: &[f32], image: usize, line: usize, point: usize) -> Complex<f32> {
        let (there, length) = (i64::from(self.there), i64::from(self.length));
        let mut at = point as i64;
        if at >= length - i64::from(self.behind) {
            at -= length;
        }
        if self.periodic == 1 {
            at = at.rem_euclid(there);
        } else if at >= there {
            return Complex::default();
        }
        let (at, pitch) = (at as usize, self.pitch_in as usize);
        let index = if self.axis == 1 { at * pitch + line } else { line * pitch + at };
        let (complex, plane) = (self.first_in as usize + image, self.plane_in as usize);
        if self.complex_in == 1 {
            let word = 2 * (complex * plane + index);
            return Complex::new(input[word], input[word + 1]);
        }
        let real = 2 * complex * plane + index;
        Complex::new(input[real], input[real + plane])
    }

    /// What the `r`th point of a transform is turned by, from the passes before.
    fn twiddle(&self, roots: &[[f32; 2]], j: usize, r: usize) -> Complex<f32> {
        let span = self.span as usize;
        let step = self.twiddles as usize / (span * self.radix as usize);
        let [re, im] = roots[(j % span) * r * step];
        Complex::new(re, if self.inverse == 1 { -im } else { im })
    }
}
