//! What can be wrong with a pond.

use std::path::PathBuf;

/// Why there is no pond, or no light on its floor.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PondError {
    /// A grid without samples, or with too many.
    #[error("the grid is {width} x {height} samples; each side must be 1 to {max}")]
    Size {
        /// Samples in x asked for.
        width: usize,
        /// Samples in y asked for.
        height: usize,
        /// The most of either.
        max: usize,
    },
    /// Values that do not fill the grid.
    #[error("{name} has {got} values, a grid of {width} x {height} needs {}", .width * .height)]
    Ragged {
        /// What the values are.
        name: &'static str,
        /// How many there are.
        got: usize,
        /// Samples in x.
        width: usize,
        /// Samples in y.
        height: usize,
    },
    /// Rows of different lengths.
    #[error("row {row} has {got} values, row 0 has {expected}: all rows must be equally long")]
    RaggedRow {
        /// The row's index.
        row: usize,
        /// How many values it has.
        got: usize,
        /// How many the first row has.
        expected: usize,
    },
    /// NaN, an infinity, or a value outside what is possible, at a sample.
    #[error("{name} at sample ({column}, {row}) is {got}; it must be {expected}")]
    Sample {
        /// What the values are.
        name: &'static str,
        /// Index in x.
        column: usize,
        /// Index in y.
        row: usize,
        /// The value.
        got: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A number outside its range.
    #[error("{name} is {got}; it must be {expected}")]
    Setting {
        /// Which number.
        name: &'static str,
        /// Its value.
        got: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A time step that the scheme would answer with growing noise.
    #[error(
        "a time step of {got_s} s is unstable at this speed and grid; it must be above 0 and at most {max_s} s"
    )]
    TimeStep {
        /// The step asked for, seconds.
        got_s: f64,
        /// The longest stable step, seconds.
        max_s: f64,
    },
    /// A surface on another grid than the one that kernels were computed for.
    #[error("the surface has {got:?} samples on {got_m:?} m, the kernels are for {size:?} on {extent_m:?} m")]
    OtherGrid {
        /// Its samples.
        got: [usize; 2],
        /// Its extent, metres.
        got_m: [f64; 2],
        /// The kernels' samples.
        size: [usize; 2],
        /// The kernels' extent, metres.
        extent_m: [f64; 2],
    },
    /// Beams that no floor below is lit by, or none that a kernel could be made for.
    #[error(
        "{upwards} of {samples} beams below the surface do not travel downwards; `exact` takes such a surface"
    )]
    UpwardBeams {
        /// How many.
        upwards: usize,
        /// Of how many.
        samples: usize,
    },
    /// A lobe that falls between the samples.
    #[error(
        "the lobe is {lobe_samples:.2e} samples wide on the floor, which no kernel resolves; it must be at least {min}: more \
        samples, less clear or deeper water"
    )]
    Unresolved {
        /// Its standard deviation in samples.
        lobe_samples: f64,
        /// The least that is taken.
        min: f64,
    },
    /// Waves made by a plan that reach down to the floor.
    #[error(
        "{got} of {samples} heights are on the floor or below it; lower waves or deeper water: here only `exact` in the physical form has \
        a limit"
    )]
    Grounded {
        /// How many.
        got: usize,
        /// Of how many.
        samples: usize,
    },
    /// More impulses and images than a plan has room for.
    #[error("{got} impulses and images make waves in the pond; the plan has room for {max}")]
    Impulses {
        /// How many there are.
        got: usize,
        /// The most.
        max: usize,
    },
    /// Terms of other light that a plan has no room for.
    #[error(
        "the {what} of this light are {got}; the plan has room for {max}: make it anew, or with more room"
    )]
    Room {
        /// What there is too much of.
        what: &'static str,
        /// How much there is.
        got: usize,
        /// The most.
        max: usize,
    },
    /// A change that kernels do not follow.
    #[error("{what} of the pond is another than the one that the plan's kernels were made for; make it anew")]
    OtherKernels {
        /// What differs.
        what: &'static str,
    },
    /// What light through a mesh of water cannot be.
    #[error("`photon` does not do {what}")]
    Photon {
        /// What it is, and what would be right.
        what: &'static str,
    },
    /// A scene of water that makes no plan.
    #[error(transparent)]
    PhotonPlan(#[from] asm_core::PlanError),
    /// A plan that did not run.
    #[error(transparent)]
    Execute(#[from] frame_plan::ExecuteError),
    /// An error that more terms than allowed would be needed for.
    #[error(
        "{terms} terms leave an error of {reached:.2e}, {asked:.2e} was asked for; allow more, ask for less, or use `exact`"
    )]
    Terms {
        /// Terms tried.
        terms: usize,
        /// Relative RMS error that they leave.
        reached: f64,
        /// The error asked for.
        asked: f64,
    },
    /// Values that a number format does not hold, or that have no bounds.
    #[error(
        "the values of `{name}` reach from {low:.3e} to {high:.3e}, which {format} does not hold; take f32 or f64"
    )]
    Range {
        /// What they are.
        name: String,
        /// The smallest.
        low: f64,
        /// The largest.
        high: f64,
        /// The format.
        format: String,
    },
    /// A file that holds no height field.
    #[error("{}: {problem}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what would be right.
        problem: String,
    },
}

/// A number that must be finite and at least `min`.
pub(crate) fn check_at_least(
    name: &'static str,
    got: f64,
    min: f64,
    expected: &'static str,
) -> Result<(), PondError> {
    if got.is_finite() && got >= min { Ok(()) } else { Err(PondError::Setting { name, got, expected }) }
}

/// A number that must be finite and above 0.
pub(crate) fn check_positive(name: &'static str, got: f64) -> Result<(), PondError> {
    if got.is_finite() && got > 0.0 {
        Ok(())
    } else {
        Err(PondError::Setting { name, got, expected: "finite and above 0" })
    }
}

/// A number that must not be NaN or infinite.
pub(crate) fn check_finite(name: &'static str, got: f64) -> Result<(), PondError> {
    if got.is_finite() { Ok(()) } else { Err(PondError::Setting { name, got, expected: "finite" }) }
}
