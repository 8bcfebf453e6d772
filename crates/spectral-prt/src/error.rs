//! What can be wrong with surfaces and with requests.

use std::path::PathBuf;

/// Why a mesh cannot be lit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// An undefined or infinite position.
    #[error("vertex {vertex} is at ({0}, {1}, {2}); positions are finite", position[0], position[1], position[2])]
    Position {
        /// Which vertex, from 0.
        vertex: usize,
        /// Its position, metres.
        position: [f64; 3],
    },
    /// A normal without direction at a vertex that a triangle uses.
    #[error("the normal of vertex {vertex} is ({0}, {1}, {2}); it needs a direction", normal[0], normal[1], normal[2])]
    Normal {
        /// Which vertex, from 0.
        vertex: usize,
        /// Its normal.
        normal: [f64; 3],
    },
    /// Some normals, but not one per vertex.
    #[error("{normals} normals for {vertices} vertices; there is one for each, or none at all")]
    NormalCount {
        /// Normals there are.
        normals: usize,
        /// Vertices there are.
        vertices: usize,
    },
    /// A triangle whose corner does not exist.
    #[error("triangle {triangle} uses vertex {vertex}, the mesh has {vertices}")]
    Index {
        /// Which triangle, from 0.
        triangle: usize,
        /// The vertex it uses.
        vertex: u32,
        /// Vertices there are.
        vertices: usize,
    },
    /// Nothing to light.
    #[error("no triangle has an area: {triangles} triangles, all of them degenerate")]
    NoArea {
        /// Triangles there are.
        triangles: usize,
    },
}

/// Why there is no transfer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PrtError {
    /// A mesh cannot be lit.
    #[error("`{name}`: {error}")]
    Surface {
        /// The object's name.
        name: String,
        /// What is wrong with its mesh.
        error: SurfaceError,
    },
    /// Too few or too many rays.
    #[error("{got} rays per vertex; 1 to {max} are possible")]
    Rays {
        /// Rays asked for.
        got: u32,
        /// The most.
        max: u32,
    },
    /// Too many bounces.
    #[error("{got} bounces; 0 to {max} are possible")]
    Bounces {
        /// Bounces asked for.
        got: u32,
        /// The most.
        max: u32,
    },
    /// What surfaces reflect is not given for each of them.
    #[error("{got} reflectances for {surfaces} surfaces; there is one for each")]
    ReflectanceCount {
        /// Reflectances there are.
        got: usize,
        /// Surfaces there are.
        surfaces: usize,
    },
    /// A reflectance on another grid.
    #[error("the reflectance of surface {surface} has {got} values, the grid has {expected} wavelengths")]
    ReflectanceSamples {
        /// Which surface, from 0.
        surface: usize,
        /// Its values.
        got: usize,
        /// The grid's wavelengths.
        expected: usize,
    },
    /// A reflectance that is none.
    #[error("surface {surface} reflects {got} at {lambda_nm} nm; a reflectance is 0 to 1")]
    Reflectance {
        /// Which surface, from 0.
        surface: usize,
        /// Where, nm.
        lambda_nm: f64,
        /// The value.
        got: f64,
    },
    /// The direct transfer is of other surfaces.
    #[error("the direct transfer has {got} numbers, these surfaces and bands need {expected}")]
    OtherTransfer {
        /// Numbers there are.
        got: usize,
        /// Numbers there should be.
        expected: usize,
    },
    /// A lobe that is none.
    #[error("a lobe of exponent {got}; 0 to {max} are possible")]
    Exponent {
        /// The exponent asked for.
        got: f64,
        /// The most.
        max: f64,
    },
    /// Too few bands of transfer for a lobe.
    #[error("a lobe under {bands} bands of light needs transfer of {needed} bands, this has {got}")]
    GlossBands {
        /// Bands of light.
        bands: usize,
        /// Bands of the transfer.
        got: usize,
        /// As many as there must be.
        needed: usize,
    },
    /// Lobes are not given for each surface.
    #[error("{got} lobes for {surfaces} surfaces; there is one for each, or none for what does not shine")]
    Lobes {
        /// Entries there are.
        got: usize,
        /// Surfaces there are.
        surfaces: usize,
    },
    /// No lobe at all.
    #[error("no surface has a lobe; leave gloss out where nothing shines")]
    NothingShines,
    /// Gloss and interreflection of different scenes.
    #[error("the transfer with bounces is of other surfaces or bands than the gloss")]
    OtherBounces,
    /// The cache cannot be read or written.
    #[error("the cache {}: {error}", path.display())]
    Cache {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
}
