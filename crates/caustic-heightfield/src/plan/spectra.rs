//! Steps from terms to the light on the floor through spectra.

use std::f64::consts::TAU;

use frame_plan::{ParamsId, Resource, ResourceId, Step};
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::convolve::Kernels;
use super::{Builder, pass};
use crate::convolve::{Sample, TermSum, Window};
use crate::passes::pond_crop::PondCrop;
use crate::passes::pond_fft::{POINTS, PondFft};
use crate::passes::pond_spectrum::PondSpectrum;
use crate::passes::{groups_of_grid, periodic};
use crate::pond::Outside;

/// Passes that only this way has.
pub(super) const SPECTRAL_PASSES: [&str; 3] = ["pond_fft", "pond_spectrum", "pond_crop"];

/// Bytes of a binding that every device takes.
const MOST_BYTES: usize = 128 << 20;
/// Workgroups in x that every device takes.
const MOST_GROUPS: u32 = 65_535;

/// How images are laid out for transforms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Padding {
    /// Points in x and y, powers of two.
    pub(super) size: [usize; 2],
    /// The last so many points are those before the first, in x and y.
    pub(super) behind: [usize; 2],
}

impl Padding {
    /// Room for images of `size` and for what kernels bring to them from around.
    pub(super) fn new(size: [usize; 2], outside: Outside, window: Window) -> Self {
        let axis = |k: usize| {
            let [low, high] = [window.low[k], window.high()[k]].map(|end| end.unsigned_abs() as usize);
            match outside {
                // What leaves the image on one side must not come in on the other.
                Outside::Dark => ((size[k] + low.max(high)).next_power_of_two(), 0),
                Outside::Periodic if size[k].is_power_of_two() => (size[k], 0),
                // One period before the image and one after are all that there is to see.
                Outside::Periodic => ((3 * size[k]).next_power_of_two(), size[k]),
            }
        };
        let [(width, left), (height, up)] = [axis(0), axis(1)];
        Self { size: [width, height], behind: [left, up] }
    }

    fn points(&self) -> usize {
        self.size[0] * self.size[1]
    }
}

/// An image that a transform reads.
#[derive(Clone, Copy)]
struct Image {
    buffer: ResourceId,
    /// Points in x and y.
    size: [usize; 2],
    complex: bool,
    /// First complex image.
    first: usize,
    /// How many there are.
    count: usize,
}

impl Builder {
    /// The sum of all terms' convolutions as a product of spectra.
    pub(super) fn convolve_spectra<T: Sample>(
        &mut self,
        terms: &TermSum<T>,
        padding: Padding,
        images: ResourceId,
        irradiance: ResourceId,
    ) -> Kernels {
        let points = padding.points();
        let pairs = terms.kernels.len().div_ceil(2);
        let together = (MOST_BYTES / (16 * points)).clamp(1, pairs);
        let longest = padding.size[0].max(padding.size[1]);
        let roots = self.plan.add_resource(Resource::buffer_with("roots", &roots(longest)));
        let fields = ["field_a", "field_b"]
            .map(|name| self.plan.add_resource(Resource::buffer(name, (8 * points * together) as u64)));
        let spectrum = self.plan.add_resource(Resource::buffer("floor_spectrum", 8 * points as u64));
        let mut transforms =
            Transforms { roots, roots_count: longest, fields, padding, outside: terms.outside, made: 0 };
        let mut buffers = Vec::new();
        for first in (0..pairs).step_by(together) {
            let count = together.min(pairs - first);
            let kernels = pair_spectra(terms, padding, first, count);
            let kernels =
                self.plan.add_resource(Resource::buffer_with(format!("kernel_spectra_{first}"), &kernels));
            buffers.push((kernels, first, count));
            let size = self.grid.size();
            let image = Image { buffer: images, size, complex: false, first, count };
            let spectra = transforms.forward(self, image);
            let params = PondSpectrum {
                size: padding.size.map(|side| side as u32),
                pairs: count as u32,
                add: u32::from(first > 0),
            };
            let params = self.plan.add_params(format!("pond_spectrum_{first}"), &params);
            self.plan.steps.push(Step::Dispatch {
                pass: pass("pond_spectrum", Some(params), &[spectra, kernels, spectrum]),
                groups: groups_of_grid(padding.size),
            });
        }
        let image = transforms.back(self, spectrum);
        let params = PondCrop {
            grid: self.grid,
            pitch: padding.size[0] as u32,
            reserved0: 0,
            reserved1: 0,
            reserved2: 0,
        };
        let params = self.plan.add_params("pond_crop", &params);
        self.plan.steps.push(Step::Dispatch {
            pass: pass("pond_crop", Some(params), &[image, irradiance]),
            groups: groups_of_grid(self.grid.size()),
        });
        let [width, height] = padding.size;
        let spectra = format!("{} kernels through spectra of {width} x {height} points", terms.kernels.len());
        for pass in SPECTRAL_PASSES {
            self.decide(pass, true, &*spectra);
        }
        Kernels::Spectra { buffers, padding }
    }
}

/// Spectra of `count` pairs of kernels from the pair `first` on; those that there are not are 0.
pub(super) fn pair_spectra<T: Sample>(
    terms: &TermSum<T>,
    padding: Padding,
    first: usize,
    count: usize,
) -> Vec<[f32; 2]> {
    (2 * first..2 * (first + count))
        .flat_map(|term| match terms.kernels.get(term) {
            Some(kernel) => kernel_spectrum(kernel, terms.window, padding),
            None => vec![[0.0; 2]; padding.points()],
        })
        .collect()
}

/// Transforms between two fields in turn.
struct Transforms {
    roots: ResourceId,
    roots_count: usize,
    fields: [ResourceId; 2],
    padding: Padding,
    outside: Outside,
    /// How many there are, which names their parameters.
    made: usize,
}

impl Transforms {
    /// Rows and then columns of an image that is smaller than its padding; where the spectra are.
    fn forward(&mut self, builder: &mut Builder, image: Image) -> ResourceId {
        let rows = self.line(builder, image, 0, image.size[1], false);
        let [width, _] = self.padding.size;
        let half = Image { buffer: rows, size: [width, image.size[1]], complex: true, first: 0, ..image };
        self.line(builder, half, 1, width, false)
    }

    /// Columns and then those rows that the floor has.
    fn back(&mut self, builder: &mut Builder, spectrum: ResourceId) -> ResourceId {
        let size = self.padding.size;
        let image = Image { buffer: spectrum, size, complex: true, first: 0, count: 1 };
        let columns = self.line(builder, image, 1, size[0], true);
        let rows = builder.grid.size()[1];
        self.line(builder, Image { buffer: columns, ..image }, 0, rows, true)
    }

    /// So many lines along an axis, in one pass or two.
    fn line(
        &mut self,
        builder: &mut Builder,
        image: Image,
        axis: usize,
        lines: usize,
        inverse: bool,
    ) -> ResourceId {
        let size = self.padding.size;
        let length = size[axis];
        let radices = radices(length);
        let (mut image, mut span) = (image, 1);
        for radix in radices {
            let first = span == 1;
            let goes_on = first && image.size[axis] < length && self.outside == Outside::Periodic;
            let params = PondFft {
                axis: axis as u32,
                radix: radix as u32,
                length: length as u32,
                span: span as u32,
                lines: lines as u32,
                there: image.size[axis] as u32,
                behind: if goes_on { self.padding.behind[axis] as u32 } else { 0 },
                periodic: if goes_on { periodic(self.outside) } else { 0 },
                pitch_in: image.size[0] as u32,
                plane_in: self.plane(&image) as u32,
                pitch_out: size[0] as u32,
                plane_out: self.padding.points() as u32,
                complex_in: u32::from(image.complex),
                first_in: image.first as u32,
                inverse: u32::from(inverse),
                twiddles: self.roots_count as u32,
            };
            image.buffer = self.pass(builder, params, &image);
            image = Image { complex: true, first: 0, ..image };
            image.size[axis] = length;
            image.size[0] = size[0];
            span *= radix;
        }
        image.buffer
    }

    /// Points from image to image of an input.
    fn plane(&self, image: &Image) -> usize {
        if image.complex { self.padding.points() } else { image.size[0] * image.size[1] }
    }

    fn pass(&mut self, builder: &mut Builder, params: PondFft, image: &Image) -> ResourceId {
        let output = if image.buffer == self.fields[0] { self.fields[1] } else { self.fields[0] };
        let transforms = params.lines * (params.length / params.radix);
        let groups = transforms.div_ceil(POINTS / params.radix);
        let x = groups.min(MOST_GROUPS);
        let params: ParamsId = builder.plan.add_params(format!("pond_fft_{}", self.made), &params);
        self.made += 1;
        builder.plan.steps.push(Step::Dispatch {
            pass: pass("pond_fft", Some(params), &[image.buffer, self.roots, output]),
            groups: [x, groups.div_ceil(x), image.count as u32],
        });
        output
    }
}

/// What passes over a line of this length, a power of two, have as radices.
fn radices(length: usize) -> Vec<usize> {
    if length <= POINTS as usize {
        return vec![length];
    }
    let first = 1 << length.ilog2().div_ceil(2);
    vec![first, length / first]
}

/// exp(-2 pi i k / n) for all k.
fn roots(n: usize) -> Vec<[f32; 2]> {
    let root = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
        [cos as f32, -sin as f32]
    };
    (0..n).map(root).collect()
}

/// The spectrum of a kernel, with the factor of the transform back.
fn kernel_spectrum<T: Sample>(kernel: &[T], window: Window, padding: Padding) -> Vec<[f32; 2]> {
    let [width, height] = padding.size;
    let scale = 1.0 / padding.points() as f64;
    let mut values = vec![Complex::new(0.0, 0.0); padding.points()];
    for (index, &value) in kernel.iter().enumerate() {
        let [x, y] = window.offset(index);
        let at = y.rem_euclid(height as i64) as usize * width + x.rem_euclid(width as i64) as usize;
        values[at].re += value.widened() * scale;
    }
    let mut planner = FftPlanner::<f64>::new();
    let (rows, columns) = (planner.plan_fft_forward(width), planner.plan_fft_forward(height));
    values.par_chunks_mut(width).for_each(|row| rows.process(row));
    let mut column_by_column: Vec<Complex<f64>> =
        (0..values.len()).map(|i| values[i % height * width + i / height]).collect();
    column_by_column.par_chunks_mut(height).for_each(|column| columns.process(column));
    (0..values.len())
        .map(|i| column_by_column[i % width * height + i / width])
        .map(|value| [value.re as f32, value.im as f32])
        .collect()
}
