//! Negative controls: the same comparison with one input spoiled, which must fail.
//!
//! A comparer that accepts everything would pass for ever. So each check is repeated with results that have
//! the faults it exists to find, through the very same [`judge`]; a control that passes fails `compare`.

use xtask::checks::{Bound, Expected, judge};
use xtask::metrics::{BINS, Map, exposure};

/// A fault put into a finished map.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// Z is missing: seen in colour alone.
    NoZ,
    /// Every eighth row is dark: seen in energy.
    DarkRows,
    /// Moved sideways by one of 64 bins: energy and colours are right, places are not.
    Moved,
    /// A single NaN.
    NotANumber,
    /// No light.
    Black,
}

impl Fault {
    const fn words(self) -> &'static str {
        match self {
            Self::NoZ => "Z removed",
            Self::DarkRows => "every eighth row dark",
            Self::Moved => "moved by 1/64",
            Self::NotANumber => "one NaN",
            Self::Black => "black",
        }
    }

    fn spoil(self, map: &Map<'_>) -> Vec<[f32; 3]> {
        let [width, _] = map.size;
        let mut xyz = map.xyz.to_vec();
        match self {
            Self::NoZ => xyz.iter_mut().for_each(|v| v[2] = 0.0),
            Self::DarkRows => {
                xyz.chunks_exact_mut(width).step_by(8).for_each(|row| row.fill([0.0; 3]));
            }
            Self::Moved => {
                xyz.chunks_exact_mut(width).for_each(|row| row.rotate_right(width / width.min(BINS)));
            }
            Self::NotANumber => xyz[0][1] = f32::NAN,
            Self::Black => xyz.fill([0.0; 3]),
        }
        xyz
    }

    /// Faults that a check of `b` with `bound` must find.
    ///
    /// Colour is judged only where enough is lit, and a place only shows where light varies.
    fn for_check(b: &Map<'_>, expected: Expected, bound: Option<Bound>) -> Vec<Self> {
        let mut faults = vec![Self::NotANumber, Self::Black];
        let Some(bound) = bound else { return faults };
        if bound.total_y.is_some() {
            faults.push(Self::DarkRows);
        }
        if bound.delta_e_mean.is_some() && exposure(b).is_some() {
            faults.push(Self::NoZ);
        }
        if bound.rms_64.is_some() && expected.varies {
            faults.push(Self::Moved);
        }
        faults
    }
}

/// The check of `a` against `b`, repeated with every fault that it must find in `a`: the fault, and whether it was found.
pub(crate) fn with_spoiled_maps(
    a: &Map<'_>,
    b: &Map<'_>,
    expected: Expected,
    bound: Option<Bound>,
) -> Vec<(&'static str, bool)> {
    let control = |fault: Fault| {
        let spoiled = fault.spoil(a);
        let judgement = judge(&Map { xyz: &spoiled, ..*a }, b, expected, bound);
        (fault.words(), !judgement.problems.is_empty())
    };
    Fault::for_check(b, expected, bound).into_iter().map(control).collect()
}
