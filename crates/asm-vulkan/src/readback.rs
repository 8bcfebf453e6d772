//! Reading resources back to the host: at once, or a frame late and without waiting.

use std::sync::Arc;

use ash::vk;
use frame_plan::{ExecuteError, Plan, Resource, ResourceId, ResourceKind, Subresource};
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
    let bytes = resource.read_bytes();
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
        record_copy(gpu, commands, resource, held, (buffer.raw(), 0)).ok_or_else(unreadable)?;
        record_host_barrier(gpu, commands);
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

/// Record that the host may read what was copied, after it has waited.
fn record_host_barrier(gpu: &Gpu, commands: vk::CommandBuffer) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::COPY)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
    // SAFETY: the commands are being recorded outside of any rendering.
    unsafe { gpu.device.cmd_pipeline_barrier2(commands, &dependency) }
}

/// Record the copy of a resource to a place in a buffer; none if the resource has no contents.
fn record_copy(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    resource: &Resource,
    held: &Held,
    (target, offset): (vk::Buffer, u64),
) -> Option<()> {
    match resource.kind {
        ResourceKind::Buffer { size_bytes } => {
            let region = vk::BufferCopy::default().dst_offset(offset).size(size_bytes);
            // SAFETY: the commands are being recorded; both buffers have room for the size.
            unsafe { gpu.device.cmd_copy_buffer(commands, held.buffer()?, target, &[region]) }
        }
        ResourceKind::Texture { format, size: [width, height], .. } => {
            let region = vk::BufferImageCopy::default()
                .buffer_offset(offset)
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

/// Where the contents of a resource begin in a buffer: a multiple of every texel.
const ALIGNMENT: u64 = 16;

/// Resources whose contents come to the host after every frame, without anybody waiting.
pub(crate) struct Watched {
    places: Vec<Place>,
    /// A buffer per frame that may be unfinished.
    ring: Vec<Buffer>,
    /// The frame in each place of the ring has not been taken over yet.
    pending: Vec<bool>,
    latest: Option<Vec<u8>>,
}

/// Where a resource lies in a buffer of the ring.
struct Place {
    resource: ResourceId,
    offset: u64,
    bytes: u64,
}

impl Watched {
    /// For readable resources of a plan, and `frames` frames at once.
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        plan: &Plan,
        resources: &[ResourceId],
        frames: usize,
    ) -> Result<Self, ExecuteError> {
        let mut end = 0;
        let mut places = Vec::new();
        for &resource in resources {
            let bytes = plan.check_readable(resource)?.read_bytes();
            places.push(Place { resource, offset: end, bytes });
            end = (end + bytes).next_multiple_of(ALIGNMENT);
        }
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = |_| Buffer::new(gpu, "watched", end.max(ALIGNMENT), usage, MemoryLocation::GpuToCpu);
        let ring = (0..frames).map(buffer).collect::<Result<_, _>>()?;
        Ok(Self { places, ring, pending: vec![false; frames], latest: None })
    }

    /// Record the copies into a frame whose place in the ring is free.
    pub(crate) fn record(
        &mut self,
        gpu: &Gpu,
        commands: vk::CommandBuffer,
        frame: usize,
        (plan, held): (&Plan, &[Held]),
        tracker: &mut Tracker,
    ) {
        self.pending[frame] = true;
        for Place { resource, offset, .. } in &self.places {
            let index = resource.0 as usize;
            let info = &plan.resources[index];
            let part = matches!(info.kind, ResourceKind::Texture { .. }).then_some(Subresource::FIRST);
            tracker.follow(&Use { slot: Slot::Resource(index), part, access: Access::COPY_FROM });
            tracker.record(&gpu.device, commands);
            // A readable resource has contents.
            let _ = record_copy(gpu, commands, info, &held[index], (self.ring[frame].raw(), *offset));
        }
        record_host_barrier(gpu, commands);
    }

    /// Take over what the finished frame at this place of the ring left.
    pub(crate) fn collect(&mut self, frame: usize) {
        if std::mem::take(&mut self.pending[frame])
            && let Ok(bytes) = self.ring[frame].mapped()
        {
            let latest = self.latest.get_or_insert_with(|| vec![0; bytes.len()]);
            latest.copy_from_slice(bytes);
        }
    }

    /// What a resource held after the last frame that was taken over.
    pub(crate) fn latest(&self, resource: ResourceId) -> Option<&[u8]> {
        let place = self.places.iter().find(|place| place.resource == resource)?;
        let begin = place.offset as usize;
        Some(&self.latest.as_ref()?[begin..begin + place.bytes as usize])
    }
}
