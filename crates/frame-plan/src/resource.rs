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
    /// Contents written once when the plan is prepared, whole, little-endian and tightly packed (textures layer by layer, with
    /// all levels of each); `None` means zeros.
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

impl ResourceKind {
    /// Bytes of the whole resource, all levels and layers; saturates instead of overflowing, 0 for samplers.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        match *self {
            Self::Buffer { size_bytes } => size_bytes,
            Self::Texture { format, size, layers, mips } => (0..mips.min(32))
                .map(|mip| size.map(|s| u64::from((s >> mip).max(1))))
                .map(|[width, height]| {
                    width
                        .saturating_mul(height)
                        .saturating_mul(u64::from(layers))
                        .saturating_mul(u64::from(format.bytes_per_texel()))
                })
                .fold(0, u64::saturating_add),
            Self::Sampler { .. } => 0,
        }
    }
}

impl Resource {
    /// A transient buffer; see the fields for other lifetimes, contents and read-back.
    #[must_use]
    pub fn buffer(name: impl Into<String>, size_bytes: u64) -> Self {
        Self::transient(name, ResourceKind::Buffer { size_bytes })
    }

    /// A persistent buffer that starts with the bytes of `contents`: meshes, tables.
    #[must_use]
    pub fn buffer_with<T: bytemuck::NoUninit>(name: impl Into<String>, contents: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        Self {
            lifetime: Lifetime::Persistent,
            initial: Some(bytes.to_vec()),
            ..Self::buffer(name, bytes.len() as u64)
        }
    }

    /// A transient 2-D texture with one level and layer.
    #[must_use]
    pub fn texture(name: impl Into<String>, format: TextureFormat, size: [u32; 2]) -> Self {
        Self::transient(name, ResourceKind::Texture { format, size, layers: 1, mips: 1 })
    }

    fn transient(name: impl Into<String>, kind: ResourceKind) -> Self {
        Self { name: name.into(), kind, lifetime: Lifetime::Transient, initial: None, readable: false }
    }

    /// Bytes that reading it back gives: a buffer's, or a texture's level 0 of layer 0.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        match self.kind {
            ResourceKind::Texture { format, size: [width, height], .. } => {
                u64::from(width) * u64::from(height) * u64::from(format.bytes_per_texel())
            }
            _ => self.kind.bytes(),
        }
    }

    /// The same resource, read back by the host.
    #[must_use]
    pub fn readable(self) -> Self {
        Self { readable: true, ..self }
    }

    /// The same resource with another lifetime.
    #[must_use]
    pub fn with_lifetime(self, lifetime: Lifetime) -> Self {
        Self { lifetime, ..self }
    }
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
