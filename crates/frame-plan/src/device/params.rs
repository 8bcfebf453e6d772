//! Uniform blocks on a device.

use crate::{Params, ParamsId};

/// Where the uniform blocks of a plan lie in one buffer: each at an offset that a dynamic binding may have.
pub struct ParamsLayout {
    blocks: Vec<Blocks>,
    size: u32,
    /// One padded set of blocks, to be written at once.
    scratch: Vec<u8>,
}

/// Where the blocks of one [`Params`] lie.
struct Blocks {
    offset: u32,
    stride: u32,
    padded_stride: u32,
    count: u32,
}

impl ParamsLayout {
    /// With blocks at multiples of `alignment`.
    #[must_use]
    pub fn new(params: &[Params], alignment: u32) -> Self {
        let mut size = 0;
        let blocks: Vec<_> = params
            .iter()
            .map(|p| {
                let stride = p.stride_bytes;
                let count = p.bytes.len() as u32 / stride;
                let padded_stride = stride.next_multiple_of(alignment.max(1));
                let offset = size;
                size += padded_stride * count;
                Blocks { offset, stride, padded_stride, count }
            })
            .collect();
        let largest = blocks.iter().map(|b| b.padded_stride * b.count).max().unwrap_or(0);
        Self { blocks, size, scratch: vec![0; largest as usize] }
    }

    /// Bytes of all blocks; 0 if the plan has none.
    #[must_use]
    pub const fn size_bytes(&self) -> u64 {
        self.size as u64
    }

    /// Where all blocks of one [`Params`] go, and the bytes that go there; the length is checked.
    pub fn padded(&mut self, id: ParamsId, bytes: &[u8]) -> (u64, &[u8]) {
        let blocks = &self.blocks[id.0 as usize];
        let padded = self.scratch.chunks_exact_mut(blocks.padded_stride as usize);
        for (target, block) in padded.zip(bytes.chunks_exact(blocks.stride as usize)) {
            let (block_bytes, padding) = target.split_at_mut(block.len());
            block_bytes.copy_from_slice(block);
            padding.fill(0);
        }
        let used = (blocks.padded_stride * blocks.count) as usize;
        (u64::from(blocks.offset), &self.scratch[..used])
    }

    /// Offset of the block of an iteration.
    #[must_use]
    pub fn offset(&self, id: ParamsId, iteration: u32) -> u32 {
        let blocks = &self.blocks[id.0 as usize];
        let block = if blocks.count == 1 { 0 } else { iteration };
        blocks.offset + block * blocks.padded_stride
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_lie_at_aligned_offsets() {
        let params = |stride_bytes, count: u32| Params {
            name: String::new(),
            stride_bytes,
            bytes: (1..=(stride_bytes * count) as u8).collect(),
        };
        let plan = [params(16, 1), params(32, 2), params(16, 3)];
        let mut layout = ParamsLayout::new(&plan, 64);
        assert_eq!(layout.size_bytes(), 6 * 64);
        assert_eq!([0, 5].map(|i| layout.offset(ParamsId(0), i)), [0, 0], "one block for all iterations");
        assert_eq!([0, 1].map(|i| layout.offset(ParamsId(1), i)), [64, 128]);
        assert_eq!([0, 2].map(|i| layout.offset(ParamsId(2), i)), [192, 320]);
        let (offset, bytes) = layout.padded(ParamsId(1), &plan[1].bytes);
        assert_eq!((offset, bytes.len()), (64, 128));
        assert_eq!((&bytes[..32], &bytes[32..64]), (&plan[1].bytes[..32], &[0; 32][..]));
        assert_eq!(bytes[64..96], plan[1].bytes[32..]);
        // What a longer set left behind does not go over with a shorter one.
        let (offset, bytes) = layout.padded(ParamsId(0), &plan[0].bytes);
        assert_eq!((offset, &bytes[..16], &bytes[16..]), (0, &plan[0].bytes[..], &[0; 48][..]));
    }
}
