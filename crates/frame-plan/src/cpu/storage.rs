//! Memory of a prepared plan: buffers, atomic buffers and textures, and taking parts of them out to write.

use std::sync::atomic::{AtomicU32, Ordering};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use crate::{Resource, ResourceKind, Subresource, TextureFormat};

/// Unit of allocation, so that every element type up to `[f32; 4]` is aligned in it.
#[repr(C, align(16))]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Block([u32; 4]);

/// Bytes aligned to 16.
#[derive(Default)]
pub(super) struct Memory {
    blocks: Vec<Block>,
    len: usize,
}

impl Memory {
    pub(super) fn zeroed(len: usize) -> Self {
        Self { blocks: vec![Block::zeroed(); len.div_ceil(16)], len }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.blocks)[..self.len]
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.blocks)[..self.len]
    }
}

/// One mip level of one layer, texels tightly packed in the format's own encoding.
#[derive(Default)]
pub(super) struct Image {
    pub(super) size: [u32; 2],
    pub(super) texels: Memory,
}

/// All mip levels and layers of a texture, layer by layer.
pub(super) struct Texture {
    pub(super) format: TextureFormat,
    pub(super) mips: u32,
    pub(super) layers: u32,
    pub(super) images: Vec<Image>,
}

impl Texture {
    /// Index in `images`.
    pub(super) const fn image_index(&self, mip: u32, layer: u32) -> usize {
        (layer * self.mips + mip) as usize
    }

    /// The part that covers everything.
    pub(super) const fn whole(&self) -> Subresource {
        Subresource { base_mip: 0, mips: self.mips, base_layer: 0, layers: self.layers }
    }
}

/// A resource's memory.
pub(super) enum Storage {
    Buffer(Memory),
    Atomic(Vec<AtomicU32>),
    Texture(Texture),
    Sampler,
}

impl Storage {
    /// Allocate a validated resource; `atomic` holds a buffer as atomics.
    pub(super) fn new(resource: &Resource, atomic: bool) -> Self {
        let mut storage = match resource.kind {
            ResourceKind::Buffer { size_bytes } if atomic => {
                Self::Atomic((0..size_bytes / 4).map(|_| AtomicU32::new(0)).collect())
            }
            ResourceKind::Buffer { size_bytes } => Self::Buffer(Memory::zeroed(size_bytes as usize)),
            ResourceKind::Texture { format, size, layers, mips } => {
                let images = (0..layers)
                    .flat_map(|_| 0..mips)
                    .map(|mip| {
                        let size = size.map(|s| (s >> mip).max(1));
                        let len = size[0] as usize * size[1] as usize * format.bytes_per_texel() as usize;
                        Image { size, texels: Memory::zeroed(len) }
                    })
                    .collect();
                Self::Texture(Texture { format, mips, layers, images })
            }
            ResourceKind::Sampler { .. } => Self::Sampler,
        };
        if let Some(initial) = &resource.initial {
            storage.write(0, initial);
        }
        storage
    }

    /// Replace bytes; a texture's are its images in order, layer by layer.
    pub(super) fn write(&mut self, offset: usize, mut bytes: &[u8]) {
        match self {
            Self::Buffer(memory) => memory.bytes_mut()[offset..offset + bytes.len()].copy_from_slice(bytes),
            Self::Atomic(words) => {
                for (word, value) in words[offset / 4..].iter().zip(bytes.chunks_exact(4)) {
                    word.store(bytemuck::pod_read_unaligned(value), Ordering::Relaxed);
                }
            }
            Self::Texture(texture) => {
                for image in &mut texture.images {
                    let target = image.texels.bytes_mut();
                    let (now, rest) = bytes.split_at(target.len().min(bytes.len()));
                    target[..now.len()].copy_from_slice(now);
                    bytes = rest;
                }
            }
            Self::Sampler => {}
        }
    }

    /// Bytes that it takes.
    pub(super) fn size_bytes(&self) -> u64 {
        match self {
            Self::Buffer(memory) => memory.len as u64,
            Self::Atomic(words) => 4 * words.len() as u64,
            Self::Texture(texture) => texture.images.iter().map(|i| i.texels.len as u64).sum(),
            Self::Sampler => 0,
        }
    }

    /// Put a buffer's bytes, or a texture's level 0 layer 0, in place of what `bytes` holds.
    pub(super) fn copy_to(&self, bytes: &mut Vec<u8>) {
        bytes.clear();
        match self {
            Self::Buffer(memory) => bytes.extend_from_slice(memory.bytes()),
            Self::Atomic(words) => {
                bytes.extend(words.iter().flat_map(|w| w.load(Ordering::Relaxed).to_le_bytes()));
            }
            Self::Texture(texture) => bytes.extend_from_slice(texture.images[0].texels.bytes()),
            Self::Sampler => {}
        }
    }

    /// One word of a buffer.
    pub(super) fn word(&self, offset: usize) -> u32 {
        match self {
            Self::Buffer(memory) => bytemuck::pod_read_unaligned(&memory.bytes()[offset..offset + 4]),
            Self::Atomic(words) => words[offset / 4].load(Ordering::Relaxed),
            Self::Texture(_) | Self::Sampler => 0,
        }
    }

    pub(super) fn clear(&mut self) {
        match self {
            Self::Buffer(memory) => memory.blocks.par_iter_mut().for_each(|b| *b = Block::zeroed()),
            Self::Atomic(words) => words.par_iter().for_each(|w| w.store(0, Ordering::Relaxed)),
            Self::Texture(_) | Self::Sampler => {}
        }
    }

    /// Copy bytes from another buffer; offsets and size are multiples of 4 and in range.
    pub(super) fn copy_from(&mut self, offset: usize, source: &Self, source_offset: usize, size: usize) {
        match (self, source) {
            (Self::Buffer(target), Self::Buffer(source)) => target.bytes_mut()[offset..offset + size]
                .copy_from_slice(&source.bytes()[source_offset..source_offset + size]),
            (target, source) => {
                for at in (0..size).step_by(4) {
                    target.set_word(offset + at, source.word(source_offset + at));
                }
            }
        }
    }

    fn set_word(&mut self, offset: usize, value: u32) {
        match self {
            Self::Buffer(memory) => {
                memory.bytes_mut()[offset..offset + 4].copy_from_slice(bytemuck::bytes_of(&value));
            }
            Self::Atomic(words) => words[offset / 4].store(value, Ordering::Relaxed),
            Self::Texture(_) | Self::Sampler => {}
        }
    }
}
