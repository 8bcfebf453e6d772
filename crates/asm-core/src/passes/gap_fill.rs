//! Fills gaps in a map of 64-bit fixed point. Twin of `shaders/gap_fill.wgsl`.
//!
//! All in integers: the same bits on every device. Sums stay below 2^64 since a plan with gap filling has fewer than
//! 2^34 / samples photons of 2^30 units.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use frame_plan::{BindingKind, PassInfo, PassKind};
use glam::{IVec2, UVec2};
use rayon::prelude::*;

use super::{GAP_WGSL, binding};
use crate::shared::gap::{GAP_DISC, GAP_PAPER_LITERAL, MASK_BESIDE, MASK_GAP, MASK_LIT, texel_at};

/// Uniform of the pass; mirrors `GapFill` in `shaders/gap_fill.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct GapFill {
    /// Of one face of the map.
    pub size: UVec2,
    /// Of all faces together.
    pub rows: u32,
    /// `GAP_*`.
    pub rule: u32,
    /// Of the paper's rules.
    pub samples: u32,
    /// Hits among them.
    pub threshold: u32,
    /// Number of offsets.
    pub offsets: u32,
    /// Of [`GAP_DISC`]: what a texel gives to each other, in 2^-16 of what it has; below 2^14.
    pub share: u32,
    /// Of this light's, in `energy`.
    pub first_row: u32,
    /// Padding.
    pub reserved0: u32,
    /// Padding.
    pub reserved1: u32,
    /// Padding.
    pub reserved2: u32,
}

/// Rows of `energy` per light: X, Y, Z before, X, Y, Z after, lit texels before and after.
pub const ENERGY_ROWS: usize = 8;
/// Words of a row: a 96-bit number, low word first.
pub const ENERGY_WORDS: usize = 3;

/// All that an executor needs to build and run `gap_fill`.
pub const GAP_FILL: PassInfo = PassInfo {
    name: "gap_fill",
    wgsl: &[GAP_WGSL, include_str!("../../../../shaders/gap_fill.wgsl")],
    params_struct: "GapFill",
    params_bytes: size_of::<GapFill>() as u32,
    bindings: &[
        binding("map", BindingKind::ReadAtomic),
        binding("offsets", BindingKind::Read),
        binding("mask", BindingKind::Read),
        binding("filled", BindingKind::Atomic),
        binding("energy", BindingKind::Atomic),
    ],
    kind: PassKind::Compute {
        workgroup: [8, 8, 1],
        mirror: |args| {
            let inputs = Inputs {
                params: args.params(),
                map: args.atomics("map"),
                offsets: args.read("offsets"),
                mask: args.read("mask"),
            };
            gap_fill(&inputs, args.atomics("filled"), args.atomics("energy"));
        },
    },
};

/// What `gap_fill` reads.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The uniform.
    pub params: GapFill,
    /// The map.
    pub map: &'a [AtomicU32],
    /// Of the texels within the radius, without the middle.
    pub offsets: &'a [IVec2],
    /// `MASK_*` of each texel.
    pub mask: &'a [u32],
}

/// CPU mirror.
pub fn gap_fill(inputs: &Inputs<'_>, filled: &[AtomicU32], energy: &[AtomicU32]) {
    let params = &inputs.params;
    let width = params.size.x as usize;
    (0..params.rows).into_par_iter().for_each(|y| {
        let mut sums = [0_u128; ENERGY_ROWS];
        for x in 0..params.size.x {
            let texel = UVec2::new(x, y);
            let index = y as usize * width + x as usize;
            let before = inputs.flux_at(index);
            let after = if params.rule == GAP_DISC {
                inputs.exchanged_in_disc(texel, index, before)
            } else {
                inputs.filled_by_samples(texel, index, before)
            };
            for c in 0..3 {
                filled[6 * index + 2 * c].store(after[c] as u32, Ordering::Relaxed);
                filled[6 * index + 2 * c + 1].store((after[c] >> 32) as u32, Ordering::Relaxed);
                sums[c] += u128::from(before[c]);
                sums[3 + c] += u128::from(after[c]);
            }
            sums[6] += u128::from(before != [0; 3]);
            sums[7] += u128::from(after != [0; 3]);
        }
        for (row, sum) in sums.into_iter().enumerate() {
            let word = ENERGY_WORDS * (params.first_row as usize + row);
            add_96(&energy[word..word + ENERGY_WORDS], sum);
        }
    });
}

/// Adds to a 96-bit number held as three words, low first, with the carries that the shader takes.
fn add_96(words: &[AtomicU32], value: u128) {
    let add = |word: usize, value: u32| {
        value != 0 && words[word].fetch_add(value, Ordering::Relaxed).checked_add(value).is_none()
    };
    let mut high = (value >> 64) as u32;
    if add(0, value as u32) && add(1, 1) {
        high += 1;
    }
    if add(1, (value >> 32) as u32) {
        high += 1;
    }
    add(2, high);
}

/// Integer hash (Wellons' lowbias32): the pattern is the map's, frame after frame.
fn scrambled(seed: u32) -> u32 {
    let mut x = seed;
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

impl Inputs<'_> {
    fn flux_at(&self, index: usize) -> [u64; 3] {
        std::array::from_fn(|c| {
            let word = |i: usize| u64::from(self.map[6 * index + 2 * c + i].load(Ordering::Relaxed));
            word(0) | word(1) << 32
        })
    }

    fn filled_by_samples(&self, texel: UVec2, index: usize, own: [u64; 3]) -> [u64; 3] {
        let params = &self.params;
        let mut sum = [0_u64; 3];
        let mut hits = 0;
        for i in 0..params.samples {
            let pick =
                scrambled((index as u32).wrapping_mul(params.samples).wrapping_add(i)) % params.offsets;
            if let Some(at) = texel_at(params.size, texel, self.offsets[pick as usize])
                && self.mask[at] == MASK_LIT
            {
                let there = self.flux_at(at);
                sum = std::array::from_fn(|c| sum[c] + there[c]);
                hits += 1;
            }
        }
        if params.rule == GAP_PAPER_LITERAL {
            return if hits > params.threshold { sum } else { own };
        }
        if hits < params.threshold {
            return own;
        }
        let lit = u64::from(self.mask[index] == MASK_LIT);
        std::array::from_fn(|c| (sum[c] + own[c]) / (u64::from(hits) + lit))
    }

    /// What one texel gives the other gets, and every texel within the radius of another gives to it as much as that one
    /// would in its place: light is kept, and where all hold the same nothing changes. Gaps and what is beside them take part.
    fn exchanged_in_disc(&self, texel: UVec2, index: usize, own: [u64; 3]) -> [u64; 3] {
        if self.mask[index] < MASK_GAP {
            return own;
        }
        let share = |flux: u64| ((u128::from(flux) * u128::from(self.params.share)) >> 16) as u64;
        let given = own.map(share);
        let mut sum = own;
        for &offset in self.offsets {
            let Some(at) = texel_at(self.params.size, texel, offset) else { continue };
            if self.mask[at] < MASK_GAP {
                continue;
            }
            let got = if self.mask[at] == MASK_BESIDE { self.flux_at(at).map(share) } else { [0; 3] };
            sum = std::array::from_fn(|c| sum[c] + got[c] - given[c]);
        }
        sum
    }
}
