//! Reading resources back to the host.

use std::sync::Arc;

use ash::vk;
use frame_plan::{ExecuteError, Resource, ResourceKind, Subresource};
use gpu_allocator::MemoryLocation;

use crate::barrier::{Access, Slot, Tracker, Use};
use crate::device::Gpu;
use crate::object::{Buffer, Commands};
use crate::resources::Held;
use crate::upload::layers;

/// Wait for the device and read a buffer, or level 0 of layer 0 of a texture. `staging` is used if it is large enough, and kept;
/// an image of a host's is left in the layout that is given.
pub(crate) fn read(
    gpu: &Arc<Gpu>,
    (index, resource): (usize, &Resource),
    held: &Held,
    tracker: &mut Tracker,
    staging: &mut Option<Buffer>,
    leave_in: Option<vk::ImageLayout>,
) -> Result<Vec<u8>, ExecuteError> {
    let bytes = bytes(resource);
    let unreadable = || ExecuteError::Usage(format!("{:?} cannot be read back", resource.name));
    let buffer = match staging.take() {
        Some(buffer) if buffer.size >= bytes => buffer,
        _ => {
            let usage = vk::BufferUsageFlags::TRANSFER_DST;
            let size = bytes.next_multiple_of(4).max(4);
            Buffer::new(gpu, "read back", size, usage, MemoryLocation::GpuToCpu)?
        }
    };
    let commands = Commands::new(gpu)?;
    let part = matches!(resource.kind, ResourceKind::Texture { .. }).then_some(Subresource::FIRST);
    let done = commands.submit(gpu, |commands| {
        tracker.follow(&Use { slot: Slot::Resource(index), part, access: Access::COPY_FROM });
        tracker.record(&gpu.device, commands);
        record_copy(gpu, commands, resource, held, buffer.raw()).ok_or_else(unreadable)?;
        // The host reads after it has waited for the submission, which makes everything available to it once it is told so.
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the commands are being recorded.
        unsafe { gpu.device.cmd_pipeline_barrier2(commands, &dependency) };
        if let Some(layout) = leave_in {
            tracker.hand_back(index, layout);
            tracker.record(&gpu.device, commands);
        }
        Ok(())
    })?;
    gpu.wait(done)?;
    let contents = buffer.mapped()?[..bytes as usize].to_vec();
    *staging = Some(buffer);
    Ok(contents)
}

/// Bytes that reading a resource gives.
fn bytes(resource: &Resource) -> u64 {
    match resource.kind {
        ResourceKind::Texture { format, size: [width, height], .. } => {
            u64::from(width) * u64::from(height) * u64::from(format.bytes_per_texel())
        }
        _ => resource.kind.bytes(),
    }
}

/// Record the copy of a resource to the start of a buffer; none if the resource has no contents.
fn record_copy(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    resource: &Resource,
    held: &Held,
    target: vk::Buffer,
) -> Option<()> {
    match resource.kind {
        ResourceKind::Buffer { size_bytes } => {
            let region = vk::BufferCopy::default().size(size_bytes);
            // SAFETY: the commands are being recorded; both buffers have this size at least.
            unsafe { gpu.device.cmd_copy_buffer(commands, held.buffer()?, target, &[region]) }
        }
        ResourceKind::Texture { format, size: [width, height], .. } => {
            let region = vk::BufferImageCopy::default()
                .image_subresource(layers(format, Subresource::FIRST))
                .image_extent(vk::Extent3D { width, height, depth: 1 });
            let layout = Access::COPY_FROM.layout;
            // SAFETY: the commands are being recorded; the level fits into the buffer and is in this layout.
            unsafe {
                gpu.device.cmd_copy_image_to_buffer(commands, held.image()?, layout, target, &[region]);
            }
        }
        ResourceKind::Sampler { .. } => return None,
    }
    Some(())
}
