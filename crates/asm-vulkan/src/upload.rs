//! From the host to the device: contents of a new plan at once, and what changes between frames with the next frame.

use std::sync::Arc;

use ash::vk;
use frame_plan::device::Writes;
use frame_plan::{ExecuteError, Lifetime, Plan, Resource, ResourceKind, Subresource, TextureFormat};
use gpu_allocator::MemoryLocation;

use crate::barrier::{Access, Slot, Tracker, Use, range};
use crate::conv;
use crate::device::Gpu;
use crate::object::{Buffer, Commands};
use crate::resources::{Held, ParamsBuffer};

/// Contents of a new plan go over in pieces of this size, larger where a single level of a texture is.
const STAGING_BYTES: u64 = 16 << 20;

/// Fill what a plan starts with: contents where they are given, zeros elsewhere. Waits for it.
pub(crate) fn fill(
    gpu: &Arc<Gpu>,
    plan: &Plan,
    held: &[Held],
    params: &mut ParamsBuffer,
    tracker: &mut Tracker,
) -> Result<(), ExecuteError> {
    let commands = Commands::new(gpu)?;
    let done = commands.submit(gpu, |commands| {
        for (i, (resource, held)) in plan.resources.iter().zip(held).enumerate() {
            if resource.lifetime != Lifetime::Imported && resource.initial.is_none() {
                clear(gpu, commands, tracker, (i, resource), held);
            }
        }
        Ok(())
    })?;
    gpu.wait(done)?;
    let mut staging = Staging::new(gpu, &commands, plan)?;
    for (i, (resource, held)) in plan.resources.iter().zip(held).enumerate() {
        let Some(initial) = &resource.initial else { continue };
        match (&resource.kind, held) {
            (ResourceKind::Buffer { .. }, Held::Buffer(buffer)) => {
                staging.buffer(tracker, Slot::Resource(i), buffer, 0, initial)?;
            }
            (ResourceKind::Texture { format, size, layers, mips }, Held::Image(image)) => {
                let mut bytes = &initial[..];
                for (layer, mip) in (0..*layers).flat_map(|l| (0..*mips).map(move |m| (l, m))) {
                    let size = size.map(|s| (s >> mip).max(1));
                    let (level, rest) =
                        bytes.split_at((size[0] * size[1] * format.bytes_per_texel()) as usize);
                    bytes = rest;
                    let place = ImagePlace { image: image.raw(), format: *format, mip, layer, size };
                    staging.image(tracker, i, &place, level)?;
                }
            }
            _ => {}
        }
    }
    for (id, block) in (0..).map(frame_plan::ParamsId).zip(&plan.params) {
        let (offset, bytes) = params.layout.padded(id, &block.bytes);
        if let Some(buffer) = &params.buffer {
            staging.buffer(tracker, Slot::Params, buffer, offset, bytes)?;
        }
    }
    Ok(())
}

/// Record zeros for all of a resource.
fn clear(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    tracker: &mut Tracker,
    (index, resource): (usize, &Resource),
    held: &Held,
) {
    let access = Access::CLEAR;
    match (&resource.kind, held) {
        (ResourceKind::Buffer { .. }, Held::Buffer(buffer)) => {
            tracker.follow(&Use { slot: Slot::Resource(index), part: None, access });
            tracker.record(&gpu.device, commands);
            // SAFETY: the commands are being recorded; the buffer is a copy target and its size a multiple of 4.
            unsafe { gpu.device.cmd_fill_buffer(commands, buffer.raw(), 0, vk::WHOLE_SIZE, 0) }
        }
        (ResourceKind::Texture { format, layers, mips, .. }, Held::Image(image)) => {
            tracker.follow(&Use { slot: Slot::Resource(index), part: None, access });
            tracker.record(&gpu.device, commands);
            let part = Subresource { base_mip: 0, mips: *mips, base_layer: 0, layers: *layers };
            let ranges = [range(conv::aspect(*format), part)];
            let (image, layout) = (image.raw(), access.layout);
            // SAFETY: the commands are being recorded; the image is a copy target and in this layout.
            unsafe {
                if *format == TextureFormat::Depth32Float {
                    let value = vk::ClearDepthStencilValue::default();
                    gpu.device.cmd_clear_depth_stencil_image(commands, image, layout, &value, &ranges);
                } else {
                    let value = vk::ClearColorValue::default();
                    gpu.device.cmd_clear_color_image(commands, image, layout, &value, &ranges);
                }
            }
        }
        _ => {}
    }
}

/// One level of one layer of a texture.
struct ImagePlace {
    image: vk::Image,
    format: TextureFormat,
    mip: u32,
    layer: u32,
    size: [u32; 2],
}

/// A buffer through which contents go over, one piece after the other.
struct Staging<'a> {
    gpu: &'a Gpu,
    commands: &'a Commands,
    buffer: Option<Buffer>,
}

impl<'a> Staging<'a> {
    fn new(gpu: &'a Arc<Gpu>, commands: &'a Commands, plan: &Plan) -> Result<Self, ExecuteError> {
        let initial = plan.resources.iter().filter_map(|r| r.initial.as_ref().map(|bytes| (r, bytes)));
        let largest_level = |(resource, bytes): (&Resource, &Vec<u8>)| match resource.kind {
            ResourceKind::Texture { format, size: [width, height], .. } => {
                u64::from(width) * u64::from(height) * u64::from(format.bytes_per_texel())
            }
            _ => (bytes.len() as u64).min(STAGING_BYTES),
        };
        let params = plan.params.iter().map(|p| p.bytes.len() as u64).max();
        // Blocks are padded to an alignment; pieces of them go over like those of any buffer.
        let size = initial.map(largest_level).chain(params).max();
        let create = |size: u64| staging(gpu, size.next_multiple_of(4));
        Ok(Self { gpu, commands, buffer: size.filter(|&size| size > 0).map(create).transpose()? })
    }

    fn buffer(
        &mut self,
        tracker: &mut Tracker,
        slot: Slot,
        target: &Buffer,
        offset: u64,
        bytes: &[u8],
    ) -> Result<(), ExecuteError> {
        let Some(staging) = &mut self.buffer else { return Ok(()) };
        let mut at = offset;
        for piece in bytes.chunks(staging.size as usize) {
            staging.mapped_mut()?[..piece.len()].copy_from_slice(piece);
            let source = staging.raw();
            let region = vk::BufferCopy::default().dst_offset(at).size(piece.len() as u64);
            let done = self.commands.submit(self.gpu, |commands| {
                tracker.follow(&Use { slot, part: None, access: Access::COPY_TO });
                tracker.record(&self.gpu.device, commands);
                // SAFETY: the commands are being recorded; the range lies in both buffers.
                unsafe { self.gpu.device.cmd_copy_buffer(commands, source, target.raw(), &[region]) }
                Ok(())
            })?;
            self.gpu.wait(done)?;
            at += piece.len() as u64;
        }
        Ok(())
    }

    fn image(
        &mut self,
        tracker: &mut Tracker,
        resource: usize,
        place: &ImagePlace,
        bytes: &[u8],
    ) -> Result<(), ExecuteError> {
        let Some(staging) = &mut self.buffer else { return Ok(()) };
        staging.mapped_mut()?[..bytes.len()].copy_from_slice(bytes);
        let source = staging.raw();
        let part = Subresource { base_mip: place.mip, mips: 1, base_layer: place.layer, layers: 1 };
        let region = vk::BufferImageCopy::default()
            .image_subresource(layers(place.format, part))
            .image_extent(vk::Extent3D { width: place.size[0], height: place.size[1], depth: 1 });
        let done = self.commands.submit(self.gpu, |commands| {
            let access = Access::COPY_TO;
            tracker.follow(&Use { slot: Slot::Resource(resource), part: Some(part), access });
            tracker.record(&self.gpu.device, commands);
            let device = &self.gpu.device;
            // SAFETY: the commands are being recorded; the level fits into the staging buffer and is in this layout.
            unsafe {
                device.cmd_copy_buffer_to_image(commands, source, place.image, access.layout, &[region]);
            }
            Ok(())
        })?;
        self.gpu.wait(done)
    }
}

/// A buffer that the host writes and the device copies from.
fn staging(gpu: &Arc<Gpu>, bytes: u64) -> Result<Buffer, ExecuteError> {
    Buffer::new(gpu, "staging", bytes, vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu)
}

/// One level of one layer, as copies name it.
pub(crate) const fn layers(format: TextureFormat, part: Subresource) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: conv::aspect(format),
        mip_level: part.base_mip,
        base_array_layer: part.base_layer,
        layer_count: part.layers,
    }
}

/// Writes of the host since the last frame, and the buffers they go over in: one per frame that may be unfinished.
pub(crate) struct Uploads {
    writes: Writes<(Slot, vk::Buffer)>,
    ring: Vec<Option<Buffer>>,
}

impl Uploads {
    /// For `frames` frames at once, with room from the start for new values of everything that `plan` has given values.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        plan: &Plan,
        params: &ParamsBuffer,
        frames: usize,
    ) -> Result<Self, ExecuteError> {
        let bytes = plan.rewritable_bytes(&params.layout).min(STAGING_BYTES);
        let place = |_| (bytes > 0).then(|| staging(gpu, bytes)).transpose();
        Ok(Self {
            writes: Writes::with_capacity(bytes as usize),
            ring: (0..frames).map(place).collect::<Result<_, _>>()?,
        })
    }

    /// Bring bytes over with the next frame, over what earlier calls brought there.
    pub(crate) fn push(&mut self, slot: Slot, target: vk::Buffer, offset: u64, bytes: &[u8]) {
        self.writes.push((slot, target), offset, bytes);
    }

    /// Forget the writes to a buffer that is no longer the one.
    pub(crate) fn forget(&mut self, slot: Slot) {
        self.writes.forget(|(written, _)| *written == slot);
    }

    /// Record all writes into a frame whose place in the ring is free.
    pub(crate) fn record(
        &mut self,
        gpu: &Arc<Gpu>,
        commands: vk::CommandBuffer,
        frame: usize,
        tracker: &mut Tracker,
    ) -> Result<(), ExecuteError> {
        let (writes, bytes) = (self.writes.all(), self.writes.bytes());
        if writes.is_empty() {
            return Ok(());
        }
        let needed = bytes.len() as u64;
        let held = &mut self.ring[frame];
        let staging = match held {
            Some(buffer) if buffer.size >= needed => buffer,
            // Grows to the largest frame and stays so.
            _ => held.insert(staging(gpu, needed.next_power_of_two())?),
        };
        staging.mapped_mut()?[..bytes.len()].copy_from_slice(bytes);
        for (i, write) in writes.iter().enumerate() {
            let (slot, _) = write.target;
            // Writes to one buffer do not overlap, and need no barrier between them.
            if writes[..i].iter().all(|w| w.target != write.target) {
                tracker.follow(&Use { slot, part: None, access: Access::COPY_TO });
            }
        }
        tracker.record(&gpu.device, commands);
        for write in writes {
            let (_, target) = write.target;
            let region = vk::BufferCopy::default()
                .src_offset(write.start as u64)
                .dst_offset(write.offset)
                .size(write.len as u64);
            // SAFETY: the commands are being recorded; the range lies in both buffers, as was checked when it was written.
            unsafe { gpu.device.cmd_copy_buffer(commands, staging.raw(), target, &[region]) }
        }
        self.writes.clear();
        Ok(())
    }
}
