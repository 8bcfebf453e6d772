//! Whether the surface may shade itself: its highest sample and its steepest slope. Twin of `shaders/pond_relief.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use rayon::prelude::*;

use super::{PondGrid, binding, wgsl};
use crate::pond::Outside;
use crate::shadow::Relief;

/// Words of a relief: the highest sample as [`ordered`], and the bits of the steepest slope.
pub(crate) const RELIEF_WORDS: usize = 2;

/// Uniform of the pass; mirrors `PondRelief` in `shaders/pond_relief.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct PondRelief {
    /// The samples.
    pub grid: PondGrid,
}

/// All that an executor needs to build and run `pond_relief`.
pub const POND_RELIEF: PassInfo = PassInfo {
    name: "pond_relief",
    wgsl: wgsl::POND_RELIEF,
    params_struct: "PondRelief",
    params_bytes: size_of::<PondRelief>() as u32,
    bindings: &[binding("heights", BindingKind::Read), binding("relief", BindingKind::Atomic)],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| pond_relief(&args.params(), args.read("heights"), args.atomics("relief")),
    },
};

/// CPU mirror.
pub fn pond_relief(params: &PondRelief, heights: &[f32], relief: &[AtomicU32]) {
    let [width, height] = params.grid.size();
    let surface = params.grid.heights(heights, Outside::Periodic);
    (0..height).into_par_iter().for_each(|j| {
        let row = (0..width).map(|i| Relief::of(&surface, i, j)).reduce(Relief::or);
        if let Some(row) = row {
            relief[0].fetch_max(ordered(row.highest_m), Ordering::Relaxed);
            relief[1].fetch_max(row.steepest.to_bits(), Ordering::Relaxed);
        }
    });
}

/// What the words of a relief say.
pub(crate) fn relief_of(words: &[AtomicU32]) -> Relief<f32> {
    let [highest, steepest] = [0, 1].map(|word: usize| words[word].load(Ordering::Relaxed));
    let bits = if highest >= SIGN { highest & !SIGN } else { !highest };
    Relief { highest_m: f32::from_bits(bits), steepest: f32::from_bits(steepest) }
}

const SIGN: u32 = 0x8000_0000;

/// A number that is larger where `x` is.
fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >= SIGN { !bits } else { bits | SIGN }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_come_back_in_their_order() {
        let heights = [-1e30, -2.0, -1e-40, 0.0, 1e-40, 0.003, 7.0, 1e30_f32];
        for pair in heights.windows(2) {
            assert!(ordered(pair[0]) < ordered(pair[1]), "{pair:?}");
        }
        for height in heights {
            let words = [AtomicU32::new(ordered(height)), AtomicU32::new(0)];
            assert_eq!(relief_of(&words).highest_m, height);
        }
        assert!(ordered(-1e30) > 0, "a cleared word is lower than all");
    }
}
