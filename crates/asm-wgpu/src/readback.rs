//! Reading resources back to the host.

use frame_plan::{ExecuteError, Resource, ResourceKind};

use crate::device::{Gpu, device_error};
use crate::resources::Held;

/// Wait for the device and read a buffer, or level 0 of layer 0 of a texture, without padding between rows.
pub(crate) fn read(gpu: &Gpu, resource: &Resource, held: &Held) -> Result<Vec<u8>, ExecuteError> {
    gpu.scoped(|| {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        match (held, &resource.kind) {
            (Held::Buffer(buffer), _) => {
                let staging = staging(gpu, buffer.size());
                encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, None);
                map(gpu, encoder, &staging)
            }
            (Held::Texture(texture), ResourceKind::Texture { format, size: [width, height], .. }) => {
                let row = width * format.bytes_per_texel();
                let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
                let staging = staging(gpu, u64::from(padded_row) * u64::from(*height));
                encoder.copy_texture_to_buffer(
                    texture.as_image_copy(),
                    wgpu::TexelCopyBufferInfo {
                        buffer: &staging,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 0,
                            bytes_per_row: Some(padded_row),
                            rows_per_image: None,
                        },
                    },
                    wgpu::Extent3d { width: *width, height: *height, depth_or_array_layers: 1 },
                );
                let padded = map(gpu, encoder, &staging)?;
                Ok(padded
                    .chunks_exact(padded_row as usize)
                    .flat_map(|r| &r[..row as usize])
                    .copied()
                    .collect())
            }
            _ => Err(ExecuteError::Usage(format!("{:?} cannot be read back", resource.name))),
        }
    })
}

fn staging(gpu: &Gpu, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn map(gpu: &Gpu, encoder: wgpu::CommandEncoder, staging: &wgpu::Buffer) -> Result<Vec<u8>, ExecuteError> {
    let (sender, receiver) = std::sync::mpsc::sync_channel(1);
    encoder.map_buffer_on_submit(staging, wgpu::MapMode::Read, .., move |result| {
        // The receiver is gone only if waiting failed, which is reported.
        let _ = sender.send(result);
    });
    gpu.queue.submit([encoder.finish()]);
    gpu.wait()?;
    let failed = |what: String| device_error(format!("reading back: {what}"));
    receiver.try_recv().map_err(|e| failed(e.to_string()))?.map_err(|e| failed(e.to_string()))?;
    let bytes = staging.get_mapped_range(..).map_err(|e| failed(e.to_string()))?.to_vec();
    staging.unmap();
    Ok(bytes)
}
