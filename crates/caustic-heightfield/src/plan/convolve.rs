//! Steps from terms to the light on the floor.

use frame_plan::{ParamsId, Resource, ResourceId, Step};

use super::spectra::{Padding, SPECTRAL_PASSES, pair_spectra};
use super::{Builder, pass};
use crate::convolve::{Convolve, Part, Sample, TermSum, Window, spatial_is_cheaper};
use crate::error::PondError;
use crate::passes::pond_convolve::PondConvolve;
use crate::passes::{PondGrid, groups_of_grid, periodic};
use crate::pond::Outside;

/// Rounds of an invocation's loops: drivers end those with 65,536 in silence.
const MOST_ROUNDS: usize = 1 << 14;

impl Builder {
    /// The sum of all terms' convolutions; in space with room for kernels of so many `offsets`.
    pub(super) fn convolve<T: Sample>(
        &mut self,
        terms: &TermSum<T>,
        offsets: usize,
        images: ResourceId,
        irradiance: ResourceId,
    ) -> Kernels {
        let folded = terms.folded();
        let terms = folded.as_ref().unwrap_or(terms);
        let padding = Padding::new(terms.size, terms.outside, terms.window);
        let spatial = match terms.convolve {
            Convolve::Spatial => true,
            Convolve::Fft => false,
            Convolve::Auto => spatial_is_cheaper(terms.size, padding.size, terms.window),
        };
        if spatial {
            for pass in SPECTRAL_PASSES {
                self.decide(pass, false, "kernels are small enough for sums in space");
            }
            self.convolve_in_space(terms, offsets, images, irradiance)
        } else {
            self.decide("pond_convolve", false, "kernels are too large for sums in space");
            self.convolve_spectra(terms, padding, images, irradiance)
        }
    }

    fn convolve_in_space<T: Sample>(
        &mut self,
        terms: &TermSum<T>,
        offsets: usize,
        images: ResourceId,
        irradiance: ResourceId,
    ) -> Kernels {
        let count = terms.kernels.len();
        let offsets = offsets.max(terms.window.len());
        let mut kernels = kernel_values(terms);
        kernels.resize(offsets * count, 0.0);
        let kernels = self.plan.add_resource(Resource::buffer_with("kernels", &kernels));
        let blocks = blocks(self.grid, terms, count);
        let params = self.plan.add_params_per_iteration("pond_convolve", &blocks);
        let step = Step::Dispatch {
            pass: pass("pond_convolve", Some(params), &[images, kernels, irradiance]),
            groups: groups_of_grid(self.grid.size()),
        };
        let iterations = blocks.iter().map(|_| vec![step.clone()]).collect();
        self.plan.steps.push(Step::Repeat { label: "pond_convolve".into(), iterations });
        let [width, height] = terms.window.size;
        self.decide(
            "pond_convolve",
            true,
            format!("{count} kernels of {width} x {height} offsets, in space"),
        );
        Kernels::InSpace { buffer: kernels, params, grid: self.grid, offsets, parts: blocks.len() }
    }
}

/// The parameters of all parts of a sum in space, for `count` terms with those that are only room.
fn blocks<T: Sample>(grid: PondGrid, terms: &TermSum<T>, count: usize) -> Vec<PondConvolve> {
    let window = terms.window;
    let block = |part: Part| PondConvolve {
        grid,
        low: window.low.map(|low| low as i32),
        window: window.size.map(|side| side as u32),
        first: part.first.map(|at| at as u32),
        count: part.count.map(|count| count as u32),
        terms: count as u32,
        periodic: periodic(terms.outside),
        reserved0: 0,
        reserved1: 0,
    };
    parts(window, count).into_iter().map(block).collect()
}

/// Where a plan has its kernels.
#[derive(Clone, Debug)]
pub(super) enum Kernels {
    /// Values at all offsets of a window, kernel after kernel.
    InSpace {
        /// Where they are, and the parameters that say which offsets they cover.
        buffer: ResourceId,
        params: ParamsId,
        grid: PondGrid,
        /// Room: offsets of a kernel, and parts that they are summed in.
        offsets: usize,
        parts: usize,
    },
    /// Spectra of pairs.
    Spectra {
        /// Where they are, the first pair of each buffer, and how many it has.
        buffers: Vec<(ResourceId, usize, usize)>,
        /// How they are laid out.
        padding: Padding,
    },
}

/// What buffers and parameters hold for other terms.
pub(super) struct Filled {
    pub(super) buffers: Vec<(ResourceId, Vec<u8>)>,
    pub(super) params: Option<(ParamsId, Vec<u8>)>,
}

impl Kernels {
    /// What there is to be written for other terms, with nothing in what is only room up to `count` terms.
    ///
    /// # Errors
    /// Offsets, or parts that they are summed in, that there is no room for.
    pub(super) fn filled<T: Sample>(&self, terms: &TermSum<T>, count: usize) -> Result<Filled, PondError> {
        let room = |what, got, max| if got > max { Err(PondError::Room { what, got, max }) } else { Ok(()) };
        match self {
            Self::InSpace { buffer, params, grid, offsets, parts } => {
                let folded = terms.folded();
                let terms = folded.as_ref().unwrap_or(terms);
                room("offsets of their kernels", terms.window.len(), *offsets)?;
                let mut blocks = blocks(*grid, terms, count);
                room("parts of their kernels", blocks.len(), *parts)?;
                // Those that are left over are parts behind the first, and have no lines.
                blocks.resize(*parts, PondConvolve { first: [1, 0], count: [1, 0], ..blocks[0] });
                let mut values = kernel_values(terms);
                values.resize(terms.window.len() * count, 0.0);
                let buffers = vec![(*buffer, bytemuck::cast_slice(&values).to_vec())];
                Ok(Filled { buffers, params: Some((*params, bytemuck::cast_slice(&blocks).to_vec())) })
            }
            Self::Spectra { buffers, padding } => {
                let needed = Padding::new(terms.size, terms.outside, terms.window);
                for k in 0..2 {
                    room("points of their spectra along a side", needed.size[k], padding.size[k])?;
                }
                let bytes = |&(buffer, first, pairs): &(ResourceId, usize, usize)| {
                    let spectra = pair_spectra(terms, *padding, first, pairs);
                    (buffer, bytemuck::cast_slice(&spectra).to_vec())
                };
                Ok(Filled { buffers: buffers.iter().map(bytes).collect(), params: None })
            }
        }
    }
}

/// The values of all kernels, one after the other.
fn kernel_values<T: Sample>(terms: &TermSum<T>) -> Vec<f32> {
    terms.kernels.iter().flatten().map(|value| value.widened() as f32).collect()
}

impl<T: Sample> TermSum<T> {
    /// Kernels of a periodic pond that are larger than it, with all copies on one tile; none where they are not.
    fn folded(&self) -> Option<Self> {
        let larger = (0..2).any(|k| self.window.size[k] > self.size[k]);
        let tile = Window { low: [0, 0], size: self.size };
        if self.outside == Outside::Dark || !larger {
            return None;
        }
        let fold = |kernel: &Vec<T>| {
            let mut sums = vec![0.0; tile.len()];
            for (index, value) in kernel.iter().enumerate() {
                let offset = self.window.offset(index);
                let [x, y] = [0, 1].map(|k| offset[k].rem_euclid(self.size[k] as i64) as usize);
                sums[y * self.size[0] + x] += value.widened();
            }
            sums.into_iter().map(T::rounded).collect()
        };
        let kernels = self.kernels.iter().map(fold).collect();
        Some(Self::new(self.size, self.outside, tile, kernels, Convolve::Spatial).asked_for(self.convolve))
    }
}

/// A window in parts that an invocation can sum over, from the first offset on.
fn parts(window: Window, terms: usize) -> Vec<Part> {
    // A column takes a round and one per term, a line one more.
    let columns = (MOST_ROUNDS / (terms + 1)).clamp(1, window.size[0]);
    let lines = (MOST_ROUNDS / (columns * (terms + 1) + 1)).clamp(1, window.size[1]);
    let starts = |k: usize, step: usize| (0..window.size[k]).step_by(step);
    starts(1, lines)
        .flat_map(|y| starts(0, columns).map(move |x| [x, y]))
        .map(|first| Part {
            first,
            count: [columns.min(window.size[0] - first[0]), lines.min(window.size[1] - first[1])],
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_a_window_once_in_few_rounds() {
        for (size, terms) in
            [([7, 7], 3), ([255, 255], 12), ([1, 9], 1), ([32_767, 3], 40), ([300, 1], 20_000)]
        {
            let window = Window { low: [0, 0], size };
            let mut covered = vec![0; window.len()];
            for part in parts(window, terms) {
                for y in part.first[1]..part.first[1] + part.count[1] {
                    for x in part.first[0]..part.first[0] + part.count[0] {
                        covered[y * size[0] + x] += 1;
                    }
                }
                let rounds = part.count[1] * (1 + part.count[0] * (1 + terms));
                assert!(rounds <= MOST_ROUNDS + 1 || part.count == [1, 1], "{part:?}: {rounds}");
            }
            assert!(covered.iter().all(|&times| times == 1), "{size:?}");
            assert_eq!(parts(window, terms)[0].first, [0, 0]);
        }
    }
}
