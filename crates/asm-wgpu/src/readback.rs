//! Reading resources back to the host: at once, or a frame late and without waiting.

use frame_plan::{ExecuteError, Plan, Resource, ResourceId, ResourceKind};

use crate::device::{Gpu, device_error};
use crate::resources::Held;
use crate::ring::ReadBacks;

/// Wait for the device and read a buffer, or level 0 of layer 0 of a texture, without padding between rows.
pub(crate) fn read(gpu: &Gpu, resource: &Resource, held: &Held) -> Result<Vec<u8>, ExecuteError> {
    gpu.scoped(|| {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let rows = Rows::of(resource);
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let staging = gpu.buffer("read back", rows.padded_bytes(), usage);
        record_copy(&mut encoder, resource, held, (&staging, 0))?;
        let (sender, receiver) = std::sync::mpsc::sync_channel(1);
        encoder.map_buffer_on_submit(&staging, wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone only if waiting failed, which is reported.
            let _ = sender.send(result);
        });
        gpu.queue.submit([encoder.finish()]);
        gpu.wait()?;
        let failed = |what: String| device_error(format!("reading back: {what}"));
        receiver.try_recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
        let mut bytes = Vec::with_capacity(resource.read_bytes() as usize);
        rows.unpad(&staging.get_mapped_range(..).map_err(|e| failed(e.to_string()))?, &mut bytes);
        staging.unmap();
        Ok(bytes)
    })
}

/// How a resource's contents lie in a buffer that they are copied to; a buffer is one row.
struct Rows {
    count: u64,
    bytes: u64,
    padded: u64,
}

impl Rows {
    fn of(resource: &Resource) -> Self {
        match resource.kind {
            ResourceKind::Texture { format, size: [width, height], .. } => {
                let bytes = u64::from(width) * u64::from(format.bytes_per_texel());
                let padded = bytes.next_multiple_of(u64::from(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
                Self { count: u64::from(height), bytes, padded }
            }
            _ => Self { count: 1, bytes: resource.kind.bytes(), padded: resource.kind.bytes() },
        }
    }

    const fn padded_bytes(&self) -> u64 {
        self.count * self.padded
    }

    /// Add the rows without padding to `bytes`.
    fn unpad(&self, padded: &[u8], bytes: &mut Vec<u8>) {
        for row in padded[..self.padded_bytes() as usize].chunks_exact(self.padded as usize) {
            bytes.extend_from_slice(&row[..self.bytes as usize]);
        }
    }
}

fn record_copy(
    encoder: &mut wgpu::CommandEncoder,
    resource: &Resource,
    held: &Held,
    (target, offset): (&wgpu::Buffer, u64),
) -> Result<(), ExecuteError> {
    let rows = Rows::of(resource);
    match (held, &resource.kind) {
        (Held::Buffer(buffer), _) => {
            encoder.copy_buffer_to_buffer(buffer, 0, target, offset, buffer.size());
        }
        (Held::Texture(texture), ResourceKind::Texture { size: [width, height], .. }) => {
            let layout = wgpu::TexelCopyBufferLayout {
                offset,
                bytes_per_row: Some(rows.padded as u32),
                rows_per_image: None,
            };
            let size = wgpu::Extent3d { width: *width, height: *height, depth_or_array_layers: 1 };
            let target = wgpu::TexelCopyBufferInfo { buffer: target, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), target, size);
        }
        _ => return Err(ExecuteError::Usage(format!("{:?} cannot be read back", resource.name))),
    }
    Ok(())
}

/// Resources whose contents come to the host after every frame, without anybody waiting.
pub(crate) struct Watched {
    places: Vec<Place>,
    read_backs: ReadBacks,
    /// A frame has been taken over.
    has_arrived: bool,
}

/// Where a resource lies in the buffers, and what it held after the last frame that was taken over.
struct Place {
    resource: ResourceId,
    offset: u64,
    rows: Rows,
    latest: Vec<u8>,
}

impl Watched {
    /// For readable resources of a plan.
    pub(crate) fn new(gpu: &Gpu, plan: &Plan, resources: &[ResourceId]) -> Result<Self, ExecuteError> {
        let mut end = 0;
        let mut places = Vec::new();
        for &resource in resources {
            let info = plan.check_readable(resource)?;
            let rows = Rows::of(info);
            let offset = end;
            // Copies of textures begin at multiples of the row alignment, which is one of every texel's size.
            end = (end + rows.padded_bytes()).next_multiple_of(u64::from(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
            places.push(Place {
                resource,
                offset,
                rows,
                latest: Vec::with_capacity(info.read_bytes() as usize),
            });
        }
        let size = end.max(wgpu::COPY_BUFFER_ALIGNMENT);
        Ok(Self { places, read_backs: ReadBacks::new(gpu, "watched", size), has_arrived: false })
    }

    /// Record the copies into a frame, unless all buffers are still on their way.
    pub(crate) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        plan: &Plan,
        held: &[Held],
    ) -> Result<(), ExecuteError> {
        self.collect();
        let Some(read_back) = self.read_backs.next() else { return Ok(()) };
        for Place { resource, offset, .. } in &self.places {
            let index = resource.0 as usize;
            record_copy(encoder, &plan.resources[index], &held[index], (&read_back.buffer, *offset))?;
        }
        read_back.take_back(encoder);
        Ok(())
    }

    /// Take over what has arrived.
    pub(crate) fn collect(&mut self) {
        let Self { places, read_backs, has_arrived } = self;
        read_backs.collect(|bytes| {
            for Place { offset, rows, latest, .. } in &mut *places {
                latest.clear();
                rows.unpad(&bytes[*offset as usize..], latest);
            }
            *has_arrived = true;
        });
    }

    /// What a resource held after the last frame that was taken over.
    pub(crate) fn latest(&self, resource: ResourceId) -> Option<&[u8]> {
        let place = self.places.iter().find(|place| place.resource == resource)?;
        self.has_arrived.then_some(&place.latest)
    }
}
