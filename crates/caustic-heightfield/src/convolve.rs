//! Sums of convolutions: floor(x) = sum over terms r of (source_r * kernel_r)(x), in space or by FFT, whichever is cheaper.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftNum, FftPlanner};
use serde::{Deserialize, Serialize};
use spectral_core::optics::Real;

use crate::pond::Outside;

/// Numbers that floors are computed in: f32 or f64.
pub trait Sample: FftNum + Real + Default {
    /// Rounded from f64.
    fn rounded(x: f64) -> Self;
    /// As f64, without loss.
    fn widened(self) -> f64;
    /// Transforms of images of this size. Here, so that they are compiled with this crate and not with each that uses it.
    #[doc(hidden)]
    fn transforms(size: [usize; 2]) -> Transforms<Self>;
}

/// Real rows to spectra, columns of spectra, and both back.
#[doc(hidden)]
pub struct Transforms<T> {
    rows: Arc<dyn RealToComplex<T>>,
    columns: Arc<dyn Fft<T>>,
    columns_back: Arc<dyn Fft<T>>,
    rows_back: Arc<dyn ComplexToReal<T>>,
}

impl<T: FftNum> Transforms<T> {
    fn new([width, height]: [usize; 2]) -> Self {
        let mut real = RealFftPlanner::new();
        let mut complex = FftPlanner::new();
        Self {
            rows: real.plan_fft_forward(width),
            columns: complex.plan_fft_forward(height),
            columns_back: complex.plan_fft_inverse(height),
            rows_back: real.plan_fft_inverse(width),
        }
    }
}

impl Sample for f32 {
    fn rounded(x: f64) -> Self {
        x as Self
    }
    fn widened(self) -> f64 {
        f64::from(self)
    }
    fn transforms(size: [usize; 2]) -> Transforms<Self> {
        Transforms::new(size)
    }
}

impl Sample for f64 {
    fn rounded(x: f64) -> Self {
        x
    }
    fn widened(self) -> f64 {
        self
    }
    fn transforms(size: [usize; 2]) -> Transforms<Self> {
        Transforms::new(size)
    }
}

/// How convolutions are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convolve {
    /// By the way that costs less.
    #[default]
    Auto,
    /// As a sum over the kernel.
    Spatial,
    /// As a product of spectra.
    Fft,
}

/// Offsets, in samples, that kernels cover: `low` up to `low + size`, exclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Window {
    pub(crate) low: [i64; 2],
    pub(crate) size: [usize; 2],
}

impl Window {
    /// All offsets up to `radius` in x and y.
    pub(crate) fn centred(radius: [usize; 2]) -> Self {
        Self { low: radius.map(|r| -(r as i64)), size: radius.map(|r| 2 * r + 1) }
    }

    pub(crate) fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The offset at an index of a kernel's values.
    pub(crate) fn offset(&self, index: usize) -> [i64; 2] {
        [self.low[0] + (index % self.size[0]) as i64, self.low[1] + (index / self.size[0]) as i64]
    }

    /// The last offset.
    pub(crate) fn high(&self) -> [i64; 2] {
        [0, 1].map(|k| self.low[k] + self.size[k] as i64 - 1)
    }

    /// The index of an offset, if it is covered.
    pub(crate) fn index(&self, offset: [i64; 2]) -> Option<usize> {
        let [x, y] = [offset[0] - self.low[0], offset[1] - self.low[1]];
        let inside = (0..self.size[0] as i64).contains(&x) && (0..self.size[1] as i64).contains(&y);
        inside.then(|| y as usize * self.size[0] + x as usize)
    }
}

/// A rectangle of a window's offsets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Its first column and line, from the window's.
    pub(crate) first: [usize; 2],
    /// Its columns and lines.
    pub(crate) count: [usize; 2],
}

impl Window {
    /// All of it.
    pub(crate) fn whole(&self) -> Part {
        Part { first: [0; 2], count: self.size }
    }
}

/// A fixed set of kernels over one window, ready to be applied to images of one size.
pub(crate) struct TermSum<T: Sample> {
    pub(crate) size: [usize; 2],
    pub(crate) outside: Outside,
    /// Offsets that kernels cover.
    pub(crate) window: Window,
    /// One value per offset each.
    pub(crate) kernels: Vec<Vec<T>>,
    /// What was asked for.
    pub(crate) convolve: Convolve,
    /// Where sums go through them.
    spectra: Option<Spectra<T>>,
}

impl<T: Sample> TermSum<T> {
    /// `kernels` hold one value per offset of `window` each.
    pub(crate) fn new(
        size: [usize; 2],
        outside: Outside,
        window: Window,
        kernels: Vec<Vec<T>>,
        convolve: Convolve,
    ) -> Self {
        let padded = padded_size(size, outside, window);
        let spatial = match convolve {
            Convolve::Spatial => true,
            Convolve::Fft => false,
            Convolve::Auto => spatial_is_cheaper(size, padded, window),
        };
        let spectra = (!spatial).then(|| Spectra::new(size, padded, window, &kernels));
        Self { size, outside, window, kernels, convolve, spectra }
    }

    /// The same with kernels of nothing up to `count`, for plans; none where there are as many.
    pub(crate) fn with_room(&self, count: usize) -> Option<Self> {
        let more = count.checked_sub(self.kernels.len()).filter(|&more| more > 0)?;
        let nothing = std::iter::repeat_n(vec![T::zero(); self.window.len()], more);
        let kernels = self.kernels.iter().cloned().chain(nothing).collect();
        let terms = Self::new(self.size, self.outside, self.window, kernels, Convolve::Spatial);
        Some(terms.asked_for(self.convolve))
    }

    /// The same for plans, which may be asked for another way.
    pub(crate) fn asked_for(self, convolve: Convolve) -> Self {
        Self { convolve, ..self }
    }

    /// Whether spectra are multiplied.
    pub(crate) fn is_fft(&self) -> bool {
        self.spectra.is_some()
    }

    /// The floor of these sources, one image per term.
    pub(crate) fn sum(&self, sources: &[Vec<T>]) -> Vec<T> {
        debug_assert_eq!(sources.len(), self.kernels.len());
        if let Some(spectra) = &self.spectra {
            return spectra.sum(self.size, sources);
        }
        let mut floor = vec![T::zero(); self.size[0] * self.size[1]];
        let terms = self.kernels.iter().map(Vec::as_slice).zip(sources.iter().map(Vec::as_slice));
        let part = (self.window, self.window.whole());
        floor.par_chunks_mut(self.size[0]).enumerate().for_each_init(Vec::new, |edge, (j, row)| {
            sum_row(row, j, self.size, self.outside, part, terms.clone(), edge);
        });
        floor
    }
}

/// Samples whose sums are taken together: few enough to stay in registers from tap to tap.
const BLOCK: usize = 32;

/// Add what comes to row `j` of the floor through a part of the terms' kernels; `terms` are kernels with what they are applied to, `edge` is
/// room for what lies around a row. In the widest registers that this processor has, with the same bits on all.
pub(crate) fn sum_row<'a, T: Real + 'a>(
    row: &mut [T],
    j: usize,
    size: [usize; 2],
    outside: Outside,
    window: (Window, Part),
    terms: impl Iterator<Item = (&'a [T], &'a [T])> + Clone,
    edge: &mut Vec<T>,
) {
    pulp::Arch::new().dispatch(|| sum_blocks(row, j, size, outside, window, terms, edge));
}

// Inlined into each kind of registers.
#[inline(always)]
fn sum_blocks<'a, T: Real + 'a>(
    row: &mut [T],
    j: usize,
    size: [usize; 2],
    outside: Outside,
    (window, part): (Window, Part),
    terms: impl Iterator<Item = (&'a [T], &'a [T])> + Clone,
    edge: &mut Vec<T>,
) {
    let [width, height] = size.map(|side| side as i64);
    let columns = part.count[0];
    // From the last tap on sources lie one after the other.
    let last = window.low[0] + (part.first[0] + columns - 1) as i64;
    for (block, floor) in row.chunks_mut(BLOCK).enumerate() {
        let mut sums = [T::zero(); BLOCK];
        let first = (block * BLOCK) as i64 - last;
        let lit = first..first + (BLOCK + columns - 1) as i64;
        for (kernel, source) in terms.clone() {
            for line in part.first[1]..part.first[1] + part.count[1] {
                let from = j as i64 - (window.low[1] + line as i64);
                let from = match outside {
                    Outside::Periodic => from.rem_euclid(height),
                    Outside::Dark if (0..height).contains(&from) => from,
                    Outside::Dark => continue,
                };
                let weights = &kernel[line * window.size[0] + part.first[0]..][..columns];
                let source = &source[from as usize * size[0]..][..size[0]];
                if lit.start >= 0 && lit.end <= width {
                    add_taps(&mut sums, weights, &source[lit.start as usize..lit.end as usize]);
                    continue;
                }
                take_around(edge, source, lit.clone(), outside);
                add_taps(&mut sums, weights, edge);
            }
        }
        floor.iter_mut().zip(sums).for_each(|(floor, sum)| *floor = *floor + sum);
    }
}

/// Samples of a row from before it to behind it.
fn take_around<T: Real>(edge: &mut Vec<T>, row: &[T], lit: Range<i64>, outside: Outside) {
    let width = row.len() as i64;
    edge.clear();
    match outside {
        Outside::Dark => {
            let inside = lit.start.clamp(0, width)..lit.end.clamp(0, width);
            edge.resize((inside.start.min(lit.end) - lit.start).max(0) as usize, T::zero());
            edge.extend_from_slice(&row[inside.start as usize..inside.end as usize]);
            edge.resize((lit.end - lit.start) as usize, T::zero());
        }
        Outside::Periodic => {
            let mut at = lit.start;
            while at < lit.end {
                let from = at.rem_euclid(width);
                let run = (width - from).min(lit.end - at);
                edge.extend_from_slice(&row[from as usize..(from + run) as usize]);
                at += run;
            }
        }
    }
}

/// Add the taps of a line of a kernel; `lit` begins where its last one is.
#[inline(always)]
fn add_taps<T: Real>(sums: &mut [T; BLOCK], weights: &[T], lit: &[T]) {
    let mut own = *sums;
    for (&weight, lit) in weights.iter().rev().zip(lit.windows(BLOCK)) {
        for (sum, &light) in own.iter_mut().zip(lit) {
            *sum = *sum + weight * light;
        }
    }
    *sums = own;
}

/// Add what comes to row `j` of the floor through a part of one term's kernel, tap after tap: `add(floor, weight, light)`.
#[expect(clippy::too_many_arguments, reason = "an image, a kernel and where they are")]
pub(crate) fn add_row<C: Copy, T: Copy>(
    row: &mut [C],
    j: usize,
    size: [usize; 2],
    outside: Outside,
    (window, part): (Window, Part),
    kernel: &[T],
    source: &[T],
    add: impl Fn(C, T, T) -> C,
) {
    let [width, height] = size.map(|side| side as i64);
    for line in part.first[1]..part.first[1] + part.count[1] {
        let weights = &kernel[line * window.size[0] + part.first[0]..][..part.count[0]];
        let from = j as i64 - (window.low[1] + line as i64);
        let from = match outside {
            Outside::Periodic => from.rem_euclid(height),
            Outside::Dark if (0..height).contains(&from) => from,
            Outside::Dark => continue,
        };
        let line_of_source = &source[from as usize * size[0]..][..size[0]];
        for (column, &weight) in weights.iter().enumerate() {
            let offset = window.low[0] + (part.first[0] + column) as i64;
            if outside == Outside::Periodic {
                for (i, floor) in row.iter_mut().enumerate() {
                    let light = line_of_source[(i as i64 - offset).rem_euclid(width) as usize];
                    *floor = add(*floor, weight, light);
                }
                continue;
            }
            let (first, last) = (offset.max(0), (width + offset).min(width));
            if first < last {
                let lit = &line_of_source[(first - offset) as usize..(last - offset) as usize];
                for (floor, &light) in row[first as usize..last as usize].iter_mut().zip(lit) {
                    *floor = add(*floor, weight, light);
                }
            }
        }
    }
}

/// The size that images are transformed at: the pond itself where it is periodic, else with room for the kernel.
fn padded_size(size: [usize; 2], outside: Outside, window: Window) -> [usize; 2] {
    if outside == Outside::Periodic {
        return size;
    }
    [0, 1].map(|k| smooth_at_least(size[k] + window.low[k].abs().max(window.high()[k]).max(0) as usize))
}

/// The smallest number from `least` on that has no prime factor above 5.
fn smooth_at_least(least: usize) -> usize {
    (least.max(1)..)
        .find(|&n| {
            let mut rest = n;
            for prime in [2, 3, 5] {
                while rest % prime == 0 {
                    rest /= prime;
                }
            }
            rest == 1
        })
        .expect("powers of two have no end")
}

/// Multiplications of a term in space against those of its share of transforms, measured on x86-64: a point of a transform costs
/// some 4 log2(points) multiplications of a row.
pub(crate) fn spatial_is_cheaper(size: [usize; 2], padded: [usize; 2], window: Window) -> bool {
    let points = (padded[0] * padded[1]) as f64;
    let spatial = (size[0] * size[1]) as f64 * window.len() as f64;
    spatial < 4.0 * points * points.log2().max(1.0)
}

/// Spectra of kernels, and the transforms that make and undo them. Spectra are stored transposed: y fastest.
struct Spectra<T: Sample> {
    padded: [usize; 2],
    bins: usize,
    transforms: Transforms<T>,
    kernels: Vec<Vec<Complex<T>>>,
}

impl<T: Sample> Spectra<T> {
    fn new(size: [usize; 2], padded: [usize; 2], window: Window, kernels: &[Vec<T>]) -> Self {
        let transforms = T::transforms(padded);
        let mut spectra = Self { padded, bins: padded[0] / 2 + 1, transforms, kernels: Vec::new() };
        // The transforms back and forth multiply by the number of points.
        let scale = T::rounded(1.0 / (padded[0] * padded[1]) as f64);
        let reaches = |o: i64, side: usize| o.unsigned_abs() < side as u64;
        let transformed = |values: &Vec<T>| {
            let mut wrapped = vec![T::zero(); padded[0] * padded[1]];
            for (index, &value) in values.iter().enumerate() {
                let offset = window.offset(index);
                let wraps = padded == size;
                if wraps || (reaches(offset[0], padded[0]) && reaches(offset[1], padded[1])) {
                    let [x, y] = [0, 1].map(|k| offset[k].rem_euclid(padded[k] as i64) as usize);
                    wrapped[y * padded[0] + x] = wrapped[y * padded[0] + x] + value * scale;
                }
            }
            spectra.forward(&wrapped, padded)
        };
        spectra.kernels = kernels.iter().map(transformed).collect();
        spectra
    }

    /// The spectrum of an image of `size`, with nothing around it.
    fn forward(&self, image: &[T], size: [usize; 2]) -> Vec<Complex<T>> {
        let [width, height] = self.padded;
        let mut by_rows = vec![Complex::<T>::default(); self.bins * size[1]];
        by_rows.par_chunks_mut(self.bins).zip(image.par_chunks(size[0])).for_each_init(
            || (vec![T::zero(); width], self.transforms.rows.make_scratch_vec()),
            |(line, scratch), (bins, row)| {
                line[..size[0]].copy_from_slice(row);
                line[size[0]..].fill(T::zero());
                self.transforms
                    .rows
                    .process_with_scratch(line, bins, scratch)
                    .expect("the buffers have the lengths of the plan");
            },
        );
        let mut spectrum = vec![Complex::default(); self.bins * height];
        spectrum.par_chunks_mut(height).enumerate().for_each_init(
            || vec![Complex::default(); self.transforms.columns.get_inplace_scratch_len()],
            |scratch, (bin, column)| {
                for (j, value) in column[..size[1]].iter_mut().enumerate() {
                    *value = by_rows[j * self.bins + bin];
                }
                self.transforms.columns.process_with_scratch(column, scratch);
            },
        );
        spectrum
    }

    fn sum(&self, size: [usize; 2], sources: &[Vec<T>]) -> Vec<T> {
        let [width, height] = self.padded;
        let mut total = vec![Complex::<T>::default(); self.bins * height];
        for (source, kernel) in sources.iter().zip(&self.kernels) {
            let spectrum = self.forward(source, size);
            for ((t, s), k) in total.iter_mut().zip(&spectrum).zip(kernel) {
                *t = *t + *s * *k;
            }
        }
        total.par_chunks_mut(height).for_each_init(
            || vec![Complex::default(); self.transforms.columns_back.get_inplace_scratch_len()],
            |scratch, column| self.transforms.columns_back.process_with_scratch(column, scratch),
        );
        let mut floor = vec![T::zero(); size[0] * size[1]];
        floor.par_chunks_mut(size[0]).enumerate().for_each_init(
            || {
                let bins = vec![Complex::<T>::default(); self.bins];
                (bins, vec![T::zero(); width], self.transforms.rows_back.make_scratch_vec())
            },
            |(bins, line, scratch), (j, row)| {
                for (bin, value) in bins.iter_mut().enumerate() {
                    *value = total[bin * height + j];
                }
                // The sum of real images is real: what rounding left in these bins is no part of it.
                bins[0].im = T::zero();
                if width % 2 == 0 {
                    bins[self.bins - 1].im = T::zero();
                }
                self.transforms
                    .rows_back
                    .process_with_scratch(bins, line, scratch)
                    .expect("the buffers have the lengths of the plan");
                row.copy_from_slice(&line[..size[0]]);
            },
        );
        floor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both ways against the definition, for any outside and odd sizes; kernels larger than the image too.
    #[test]
    fn ways_agree_with_the_definition() {
        for (size, radius) in [([7, 5], [2, 3]), ([1, 1], [0, 0]), ([16, 9], [15, 8]), ([5, 4], [7, 6])] {
            for outside in [Outside::Dark, Outside::Periodic] {
                let window = Window::centred(radius);
                let value =
                    |seed: usize, i: usize| ((i * 7919 + seed * 104_729) % 1009) as f64 / 1009.0 - 0.3;
                let image = |seed, len| (0..len).map(|i| value(seed, i)).collect::<Vec<f64>>();
                let kernels = vec![image(1, window.len()), image(2, window.len())];
                let sources = vec![image(3, size[0] * size[1]), image(4, size[0] * size[1])];
                let mut expected = vec![0.0; size[0] * size[1]];
                for (kernel, source) in kernels.iter().zip(&sources) {
                    for (index, weight) in kernel.iter().enumerate() {
                        let [ox, oy] = window.offset(index);
                        for (s, light) in source.iter().enumerate() {
                            let mut at = [(s % size[0]) as i64 + ox, (s / size[0]) as i64 + oy];
                            if outside == Outside::Periodic {
                                at = [0, 1].map(|k| at[k].rem_euclid(size[k] as i64));
                            }
                            if (0..2).all(|k| (0..size[k] as i64).contains(&at[k])) {
                                expected[at[1] as usize * size[0] + at[0] as usize] += weight * light;
                            }
                        }
                    }
                }
                for convolve in [Convolve::Spatial, Convolve::Fft] {
                    let sum = TermSum::new(size, outside, window, kernels.clone(), convolve);
                    assert_eq!(sum.is_fft(), convolve == Convolve::Fft);
                    for (got, expected) in sum.sum(&sources).iter().zip(&expected) {
                        assert!(
                            (got - expected).abs() < 1e-11,
                            "{size:?} {outside:?} {convolve:?}: {got} {expected}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn transforms_have_small_factors() {
        assert_eq!([1, 7, 127, 255].map(smooth_at_least), [1, 8, 128, 256]);
    }
}
