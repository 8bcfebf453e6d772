//! What can be wrong with relighting.

use frame_plan::ExecuteError;

use crate::sh::NotARotation;

/// Why there is no plan, or no frame of it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RelightingError {
    /// Nothing to show.
    #[error("there are no surfaces: a picture needs one at least")]
    NoSurfaces,
    /// Not one of something for each surface.
    #[error("{got} {what} for {surfaces} surfaces; there is one for each")]
    SurfaceCount {
        /// What there is another number of.
        what: &'static str,
        /// How many there are.
        got: usize,
        /// Surfaces there are.
        surfaces: usize,
    },
    /// Not one of something for each vertex of a surface.
    #[error("surface {surface} has {vertices} vertices and {got} {what}; there is one for each")]
    VertexCount {
        /// Which surface, from 0.
        surface: usize,
        /// What there is another number of.
        what: &'static str,
        /// How many there are.
        got: usize,
        /// Its vertices.
        vertices: usize,
    },
    /// Coefficients of another spectral basis, transfer or number of bands.
    #[error("{what} has {got} {unit}, {with} has {expected}")]
    Mismatch {
        /// What does not fit.
        what: &'static str,
        /// How many it has.
        got: usize,
        /// Of what.
        unit: &'static str,
        /// What it should fit.
        with: &'static str,
        /// How many that has.
        expected: usize,
    },
    /// Gloss of other surfaces.
    #[error("gloss and transfer are of different surfaces: make gloss of this transfer, with more bands")]
    OtherGloss,
    /// An albedo that names what there is not.
    #[error("{by} names {what} {index}, there are {count}")]
    NoSuch {
        /// What names it.
        by: String,
        /// What it names.
        what: &'static str,
        /// Its index, from 0.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A map without texels, or with another number of them than its size says.
    #[error("a map of {} x {} texels has {texels}", size[0], size[1])]
    MapSize {
        /// Columns and rows.
        size: [u32; 2],
        /// Texels there are.
        texels: usize,
    },
    /// Spectral maps are layers of one texture.
    #[error(
        "spectral map {map} has {} x {} texels, map 0 has {} x {}: all have one size",
        got[0], got[1], expected[0], expected[1]
    )]
    MapSizes {
        /// Which map, from 0.
        map: usize,
        /// Its size.
        got: [u32; 2],
        /// That of the first.
        expected: [u32; 2],
    },
    /// A number that is none, or outside what it can mean.
    #[error("{what} is {got}; it must be {expected}")]
    Value {
        /// Which number.
        what: &'static str,
        /// The number.
        got: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A sky is turned by something else.
    #[error(transparent)]
    Rotation(#[from] NotARotation),
    /// Something that does not fit into the device.
    #[error("{what} needs {needed} {unit}, the device takes {max}: lower {remedy}")]
    Limit {
        /// The resource.
        what: String,
        /// What it needs.
        needed: u64,
        /// Of what.
        unit: &'static str,
        /// What the device takes.
        max: u64,
        /// What helps.
        remedy: &'static str,
    },
    /// The executor did not take it.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
}
