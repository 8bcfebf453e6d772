//! Buffers, textures and samplers of a plan.

use serde::{Deserialize, Serialize};

/// Index of a [`Resource`] in [`crate::Plan::resources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ResourceId(pub u32);

/// How long a resource's contents mean something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lifetime {
    /// Written and read within one frame.
    Transient,
    /// Kept from frame to frame: meshes, wave state, history.
    Persistent,
    /// Owned by the host application and handed to the executor by name.
    Imported,
}

/// One resource of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Resource {
    /// Unique within the plan.
    pub name: String,
    /// What it is.
    pub kind: ResourceKind,
    /// How long it lives.
    pub lifetime: Lifetime,
    /// Contents written once when the plan is prepared (little-endian, tightly packed); `None` means zeros.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub initial: Option<Vec<u8>>,
    /// The host reads it back after the frame.
    pub readable: bool,
}

/// Kinds of resource.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ResourceKind {
    /// Linear memory; usable as storage, vertex, index, indirect-argument and copy source or target.
    Buffer {
        /// Size in bytes, a multiple of 4, above 0.
        size_bytes: u64,
    },
    /// 2-D texture, optionally with layers and mip levels.
    Texture {
        /// Texel format.
        format: TextureFormat,
        /// Width and height of level 0, texels.
        size: [u32; 2],
        /// Array layers, at least 1.
        layers: u32,
        /// Mip levels, at least 1.
        mips: u32,
    },
    /// Texture sampler.
    Sampler {
        /// Bilinear rather than nearest.
        linear: bool,
        /// Wrap around rather than clamp to the edge.
        repeat: bool,
    },
}

/// Texel formats that every executor supports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TextureFormat {
    /// One 32-bit unsigned integer: visibility buffers.
    R32Uint,
    /// One 32-bit float.
    R32Float,
    /// Four 16-bit floats.
    Rgba16Float,
    /// Four 32-bit floats.
    Rgba32Float,
    /// Four 8-bit values in 0..1.
    Rgba8Unorm,
    /// 32-bit float depth.
    Depth32Float,
}

impl TextureFormat {
    /// Bytes per texel.
    #[must_use]
    pub const fn bytes_per_texel(self) -> u32 {
        match self {
            Self::R32Uint | Self::R32Float | Self::Rgba8Unorm | Self::Depth32Float => 4,
            Self::Rgba16Float => 8,
            Self::Rgba32Float => 16,
        }
    }
}

/// Part of a texture: which mip levels and layers a pass sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Subresource {
    /// First mip level.
    pub base_mip: u32,
    /// Number of mip levels.
    pub mips: u32,
    /// First layer.
    pub base_layer: u32,
    /// Number of layers.
    pub layers: u32,
}

impl Subresource {
    /// Level 0 of layer 0.
    pub const FIRST: Self = Self { base_mip: 0, mips: 1, base_layer: 0, layers: 1 };
}
