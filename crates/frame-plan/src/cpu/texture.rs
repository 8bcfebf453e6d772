//! Textures as mirrors see them: decoded loads, encoded stores.

use half::f16;
use rayon::prelude::*;

use super::storage::{Image, Texture};
use crate::{Subresource, TextureFormat};

/// A texture or a part of it, read by a mirror. Coordinates are texels; layer and level 0 are the part's first.
/// Loads outside the texture give 0, as WGSL's robust access does.
#[derive(Clone, Copy)]
pub struct TextureView<'a> {
    texture: &'a Texture,
    part: Subresource,
}

impl<'a> TextureView<'a> {
    pub(super) const fn new(texture: &'a Texture, part: Subresource) -> Self {
        Self { texture, part }
    }

    fn image(&self, layer: u32, level: u32) -> Option<&'a Image> {
        (layer < self.part.layers && level < self.part.mips).then(|| {
            &self.texture.images
                [self.texture.image_index(self.part.base_mip + level, self.part.base_layer + layer)]
        })
    }

    /// The texel's bytes in the format's encoding.
    fn texel(&self, x: u32, y: u32, layer: u32, level: u32) -> Option<&'a [u8]> {
        let image = self.image(layer, level)?;
        let [width, height] = image.size;
        (x < width && y < height).then(|| {
            let bytes = self.texture.format.bytes_per_texel() as usize;
            let at = (y as usize * width as usize + x as usize) * bytes;
            &image.texels.bytes()[at..at + bytes]
        })
    }

    /// Width and height of the first level.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.image(0, 0).map_or([0; 2], |i| i.size)
    }

    /// Number of levels in the part.
    #[must_use]
    pub const fn levels(&self) -> u32 {
        self.part.mips
    }

    /// Number of layers in the part.
    #[must_use]
    pub const fn layers(&self) -> u32 {
        self.part.layers
    }

    /// Texel of the first level and layer; missing channels are 0, missing alpha 1.
    #[must_use]
    pub fn load(&self, x: u32, y: u32) -> [f32; 4] {
        self.load_at(x, y, 0, 0)
    }

    /// Texel of a level of the first layer.
    #[must_use]
    pub fn load_level(&self, x: u32, y: u32, level: u32) -> [f32; 4] {
        self.load_at(x, y, 0, level)
    }

    /// Texel of the first level of a layer.
    #[must_use]
    pub fn load_layer(&self, x: u32, y: u32, layer: u32) -> [f32; 4] {
        self.load_at(x, y, layer, 0)
    }

    /// Texel of a level of a layer.
    #[must_use]
    pub fn load_at(&self, x: u32, y: u32, layer: u32, level: u32) -> [f32; 4] {
        self.texel(x, y, layer, level).map_or([0.0; 4], |t| decode(self.texture.format, t))
    }

    /// Texel of an unsigned texture, first level and layer.
    #[must_use]
    pub fn load_uint(&self, x: u32, y: u32) -> u32 {
        self.texel(x, y, 0, 0).map_or(0, |t| bytemuck::pod_read_unaligned(&t[..4]))
    }

    /// Bilinear sample of the first level and layer at normalised coordinates, clamped to the edge.
    #[must_use]
    pub fn sample_linear(&self, u: f32, v: f32) -> [f32; 4] {
        let size = self.size();
        let split = |t: f32, n: u32| {
            let t = (t * n as f32 - 0.5).clamp(0.0, (n.max(1) - 1) as f32);
            let low = t.floor();
            (low as u32, (low as u32 + 1).min(n.max(1) - 1), t - low)
        };
        let (x0, x1, fx) = split(u, size[0]);
        let (y0, y1, fy) = split(v, size[1]);
        let mix = |a: [f32; 4], b: [f32; 4], t: f32| -> [f32; 4] {
            std::array::from_fn(|i| a[i] * (1.0 - t) + b[i] * t)
        };
        mix(mix(self.load(x0, y0), self.load(x1, y0), fx), mix(self.load(x0, y1), self.load(x1, y1), fx), fy)
    }
}

/// A storage texture, one level of one layer, written by a mirror. Stores outside it are dropped.
pub struct StorageTextureMut<'a> {
    format: TextureFormat,
    size: [u32; 2],
    texels: &'a mut [u8],
}

/// One row of a [`StorageTextureMut`].
pub struct StorageRow<'a> {
    format: TextureFormat,
    texels: &'a mut [u8],
}

impl StorageRow<'_> {
    /// Write a texel; unsigned formats take the integer value of the first component.
    pub fn store(&mut self, x: u32, value: [f32; 4]) {
        let bytes = self.format.bytes_per_texel() as usize;
        if let Some(texel) = self.texels.chunks_exact_mut(bytes).nth(x as usize) {
            encode(self.format, value, texel);
        }
    }

    /// Write a texel of an unsigned format.
    pub fn store_uint(&mut self, x: u32, value: u32) {
        if let Some(texel) = self.texels.chunks_exact_mut(4).nth(x as usize) {
            texel.copy_from_slice(&value.to_le_bytes());
        }
    }
}

impl<'a> StorageTextureMut<'a> {
    pub(super) fn new(format: TextureFormat, image: &'a mut Image) -> Self {
        Self { format, size: image.size, texels: image.texels.bytes_mut() }
    }

    /// Width and height.
    #[must_use]
    pub const fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Write a texel; unsigned formats take the integer value of the first component.
    pub fn store(&mut self, x: u32, y: u32, value: [f32; 4]) {
        if let Some(mut row) = self.row(y) {
            row.store(x, value);
        }
    }

    /// Write a texel of an unsigned format.
    pub fn store_uint(&mut self, x: u32, y: u32, value: u32) {
        if let Some(mut row) = self.row(y) {
            row.store_uint(x, value);
        }
    }

    fn row(&mut self, y: u32) -> Option<StorageRow<'_>> {
        let format = self.format;
        let bytes = self.size[0] as usize * format.bytes_per_texel() as usize;
        self.texels.chunks_exact_mut(bytes).nth(y as usize).map(|texels| StorageRow { format, texels })
    }

    /// All rows, top first, for parallel writing.
    pub fn par_rows(self) -> impl IndexedParallelIterator<Item = StorageRow<'a>> {
        let format = self.format;
        let bytes = self.size[0] as usize * format.bytes_per_texel() as usize;
        self.texels.par_chunks_exact_mut(bytes).map(move |texels| StorageRow { format, texels })
    }

    /// Write every texel with `value(x, y)`, rows in parallel.
    pub fn par_store(self, value: impl Fn(u32, u32) -> [f32; 4] + Sync) {
        let width = self.size[0];
        self.par_rows().enumerate().for_each(|(y, mut row)| {
            for x in 0..width {
                row.store(x, value(x, y as u32));
            }
        });
    }
}

/// Value of an encoded texel.
pub(super) fn decode(format: TextureFormat, texel: &[u8]) -> [f32; 4] {
    match format {
        TextureFormat::R32Uint => [bytemuck::pod_read_unaligned::<u32>(texel) as f32, 0.0, 0.0, 1.0],
        TextureFormat::R32Float | TextureFormat::Depth32Float => {
            [bytemuck::pod_read_unaligned(texel), 0.0, 0.0, 1.0]
        }
        TextureFormat::Rgba16Float => {
            bytemuck::pod_read_unaligned::<[u16; 4]>(texel).map(|h| f16::from_bits(h).to_f32())
        }
        TextureFormat::Rgba32Float => bytemuck::pod_read_unaligned(texel),
        TextureFormat::Rgba8Unorm => {
            bytemuck::pod_read_unaligned::<[u8; 4]>(texel).map(|b| f32::from(b) / 255.0)
        }
    }
}

/// Write a texel in the format's encoding.
pub(super) fn encode(format: TextureFormat, value: [f32; 4], texel: &mut [u8]) {
    match format {
        TextureFormat::R32Uint => texel.copy_from_slice(&(value[0] as u32).to_le_bytes()),
        TextureFormat::R32Float | TextureFormat::Depth32Float => {
            texel.copy_from_slice(&value[0].to_le_bytes());
        }
        TextureFormat::Rgba16Float => {
            texel.copy_from_slice(bytemuck::bytes_of(&value.map(|v| f16::from_f32(v).to_bits())));
        }
        TextureFormat::Rgba32Float => texel.copy_from_slice(bytemuck::bytes_of(&value)),
        TextureFormat::Rgba8Unorm => {
            texel.copy_from_slice(&value.map(|v| (v.clamp(0.0, 1.0) * 255.0).round_ties_even() as u8));
        }
    }
}
