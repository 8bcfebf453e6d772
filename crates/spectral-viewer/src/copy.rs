//! A picture on its way from the window's device to the host, without anybody waiting for it.

use std::sync::Arc;
use std::sync::OnceLock;

use asm_core::Picture;
use asm_wgpu::wgpu;

use crate::maker::PIXEL_BYTES;

/// A copy of a picture that was recorded into a frame.
pub(crate) struct PictureCopy {
    buffer: wgpu::Buffer,
    size: [u32; 2],
    /// Asked for, and what became of that.
    mapped: Option<Arc<OnceLock<Result<(), wgpu::BufferAsyncError>>>>,
}

impl PictureCopy {
    /// Have `picture` copied as soon as it is there.
    pub(crate) fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        picture: &wgpu::Buffer,
        size: [u32; 2],
    ) -> Self {
        let bytes = PIXEL_BYTES * u64::from(size[0]) * u64::from(size[1]);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture for the host"),
            size: bytes,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_buffer_to_buffer(picture, 0, &buffer, 0, bytes);
        Self { buffer, size, mapped: None }
    }

    /// Its frame is submitted.
    pub(crate) fn submitted(&mut self) {
        if self.mapped.is_none() {
            let mapped = Arc::new(OnceLock::new());
            self.mapped = Some(Arc::clone(&mapped));
            self.buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                let _ = mapped.set(result);
            });
        }
    }

    /// The picture in `copy` with what it is of, if it has come; `copy` is empty then.
    ///
    /// # Errors
    /// What the device says, in a sentence.
    pub(crate) fn collect<J>(
        copy: &mut Option<(Self, J)>,
        device: &wgpu::Device,
    ) -> Result<Option<(J, Picture)>, String> {
        if copy.is_none() {
            return Ok(None);
        }
        // A failed poll is told by whatever uses the device next.
        let _ = device.poll(wgpu::PollType::Poll);
        let Some((there, job)) = copy.take_if(|(copy, _)| copy.has_come()) else { return Ok(None) };
        there.picture().map(|picture| Some((job, picture)))
    }

    fn has_come(&self) -> bool {
        self.mapped.as_ref().is_some_and(|mapped| mapped.get().is_some())
    }

    fn picture(&self) -> Result<Picture, String> {
        if let Some(Err(error)) = self.mapped.as_ref().and_then(|mapped| mapped.get()) {
            return Err(format!("a picture cannot be read back: {error}"));
        }
        let bytes = self.buffer.get_mapped_range(..).map_err(|error| error.to_string())?;
        let pixels = bytes.chunks_exact(PIXEL_BYTES as usize);
        let xyz = pixels.map(bytemuck::pod_read_unaligned::<[f32; 4]>).map(|[x, y, z, _]| [x, y, z]);
        let [width, height] = self.size;
        Ok(Picture { width, height, xyz: xyz.collect() })
    }
}
