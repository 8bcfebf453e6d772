//! What can be wrong with a glTF file, and what is merely not simulated.

use std::path::PathBuf;

use crate::SceneError;

/// Why a file could not be loaded: what is wrong, where, and what would be right.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file, or one that it refers to, could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A folder, a device or a pipe.
    #[error("{} is not a regular file; a scene is a .gltf or .glb file", path.display())]
    NotAFile {
        /// Its path.
        path: PathBuf,
    },
    /// The bytes end too early or are not glTF at all.
    #[error("not a glTF file: {0}")]
    Container(String),
    /// The JSON does not parse, or a field has the wrong type.
    #[error("the glTF JSON is wrong: {0}")]
    Json(#[source] serde_json::Error),
    /// The file cannot be read without an extension that we lack.
    #[error("{at} needs the glTF extension {name}, which is not supported; export without it (supported: {})",
        super::SUPPORTED_EXTENSIONS.join(", "))]
    UnsupportedExtension {
        /// The extension's name.
        name: String,
        /// Who asks for it.
        at: String,
    },
    /// A value that glTF does not allow.
    #[error("{at} {problem}; {expected}")]
    Invalid {
        /// The JSON path, such as `accessors[3]`.
        at: String,
        /// What is wrong with it.
        problem: String,
        /// What would be right.
        expected: String,
    },
    /// The scene that the file describes is not usable.
    #[error("the file's scene is not usable: {0}")]
    Scene(#[from] SceneError),
}

pub(super) fn invalid<T>(
    at: impl Into<String>,
    problem: impl Into<String>,
    expected: impl Into<String>,
) -> Result<T, LoadError> {
    Err(LoadError::Invalid { at: at.into(), problem: problem.into(), expected: expected.into() })
}

/// Something in a file that is read differently from what it says, or not at all.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// Rough glass is simulated as smooth.
    #[error("material `{material}` is glass of roughness {roughness}: it is simulated as smooth")]
    RoughGlass {
        /// The material's name.
        material: String,
        /// Its glTF roughness.
        roughness: f64,
    },
    /// Nearly smooth metal is simulated as smooth.
    #[error("material `{material}` is metal of roughness {roughness}: it is simulated as a smooth mirror")]
    NearlySmoothMetal {
        /// The material's name.
        material: String,
        /// Its glTF roughness, below [`crate::MIRROR_ROUGHNESS`].
        roughness: f64,
    },
    /// Rough metal is simulated as matt.
    #[error(
        "material `{material}` is metal of roughness {roughness}: it is simulated as matt, a mirror's is below {}",
        crate::MIRROR_ROUGHNESS
    )]
    RoughMetal {
        /// The material's name.
        material: String,
        /// Its glTF roughness.
        roughness: f64,
    },
    /// Thin-walled in glTF's terms (transmission without volume), solid here.
    #[error("material `{material}` transmits but has no volume: its real geometry is traced as solid glass")]
    ThinWalled {
        /// The material's name.
        material: String,
    },
    /// Thin films are kept, not simulated.
    #[error("material `{material}` is iridescent: this is kept, not simulated")]
    Iridescence {
        /// The material's name.
        material: String,
    },
    /// KHR_materials_ior's special value 0 has no physical meaning.
    #[error("material `{material}` has ior 0 (full reflection for old workflows): 1.5 is used")]
    IorZero {
        /// The material's name.
        material: String,
    },
    /// Textures are not read; the factors alone count.
    #[error("material `{material}`: {texture} is ignored, its factor counts alone")]
    TextureIgnored {
        /// The material's name.
        material: String,
        /// Which texture.
        texture: &'static str,
    },
    /// Alpha is not transmission.
    #[error(
        "material `{material}` has alphaMode {alpha_mode}: it is treated as opaque; glass needs KHR_materials_transmission"
    )]
    AlphaIgnored {
        /// The material's name.
        material: String,
        /// Its mode.
        alpha_mode: String,
    },
    /// An optional extension that we do not read.
    #[error("the optional extension {name} is ignored")]
    ExtensionIgnored {
        /// The extension's name.
        name: String,
    },
    /// Part of a mesh or node that we do not read.
    #[error("{at}: {what} ignored")]
    Ignored {
        /// The JSON path.
        at: String,
        /// What is not read.
        what: &'static str,
    },
    /// Normals that were not unit vectors.
    #[error("{at}: {count} normals were not of unit length and were normalised or, at length 0, recomputed")]
    NormalsRepaired {
        /// The JSON path.
        at: String,
        /// How many.
        count: usize,
    },
    /// Triangles without area are legal and do nothing.
    #[error("{zero_area} of {triangles} triangles have no area")]
    ZeroAreaTriangles {
        /// How many have none.
        zero_area: usize,
        /// Out of how many.
        triangles: usize,
    },
    /// A closed glass body whose surface faces inwards.
    #[error("`{object}` is closed glass that faces inwards: it was turned outwards")]
    InsideOut {
        /// The object's name.
        object: String,
    },
    /// No camera in the file.
    #[error("the file has no perspective camera: one that frames the scene was added")]
    DefaultCamera,
    /// No light in the file.
    #[error("the file has no KHR_lights_punctual light: nothing will be lit")]
    NoLight,
}
