//! Buffers, textures, samplers and parameters of a plan.

use std::collections::HashMap;

use frame_plan::device::{ImportShape, ParamsLayout, Uses, import_problem};
use frame_plan::{ExecuteError, Lifetime, Params, ParamsId, Plan, Resource, ResourceKind, TextureFormat};

use crate::conv;
use crate::device::Gpu;

/// A resource on the device.
#[derive(Clone)]
pub(crate) enum Held {
    Buffer(wgpu::Buffer),
    Texture(wgpu::Texture),
    /// A host's view; it is used whole, and cannot be copied or read back.
    View(wgpu::TextureView),
    Sampler(wgpu::Sampler),
}

/// Allocate what a validated plan needs, with its contents; imported resources are taken from `imports`.
pub(crate) fn allocate(
    gpu: &Gpu,
    plan: &Plan,
    uses: &[Uses],
    imports: &HashMap<String, Held>,
) -> Result<Vec<Held>, ExecuteError> {
    let held = |(resource, &uses): (&Resource, &Uses)| {
        if resource.lifetime == Lifetime::Imported {
            let held = imports.get(&resource.name).ok_or_else(|| {
                ExecuteError::Usage(format!("imported resource {:?} was not handed over", resource.name))
            })?;
            check_import(resource, held, uses)?;
            return Ok(held.clone());
        }
        Ok(match resource.kind {
            ResourceKind::Buffer { size_bytes } => Held::Buffer(buffer(gpu, resource, size_bytes, uses)),
            ResourceKind::Texture { .. } => Held::Texture(texture(gpu, resource, uses)),
            ResourceKind::Sampler { linear, repeat } => {
                gpu.count(|made| made.bindings += 1);
                Held::Sampler(gpu.device.create_sampler(&conv::sampler(linear, repeat)))
            }
        })
    };
    plan.resources.iter().zip(uses).map(held).collect()
}

fn buffer(gpu: &Gpu, resource: &Resource, size: u64, uses: Uses) -> wgpu::Buffer {
    let buffer = gpu.buffer(&resource.name, size, conv::buffer_usages(uses));
    if let Some(initial) = &resource.initial {
        gpu.queue.write_buffer(&buffer, 0, initial);
    }
    buffer
}

fn texture(gpu: &Gpu, resource: &Resource, uses: Uses) -> wgpu::Texture {
    let ResourceKind::Texture { format, size: [width, height], layers, mips } = resource.kind else {
        unreachable!("called for textures only")
    };
    gpu.count(|made| {
        made.textures += 1;
        made.bytes += resource.kind.bytes();
    });
    let usage = conv::texture_usages(uses);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(&resource.name),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: mips,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: conv::texture_format(format),
        // A texture that no step uses still needs some usage.
        usage: if usage.is_empty() { wgpu::TextureUsages::COPY_DST } else { usage },
        view_formats: &[],
    });
    if let Some(initial) = &resource.initial {
        write_texture(gpu, &texture, format, initial);
    }
    texture
}

/// Fill all levels of all layers, layer by layer.
fn write_texture(gpu: &Gpu, texture: &wgpu::Texture, format: TextureFormat, mut bytes: &[u8]) {
    for layer in 0..texture.depth_or_array_layers() {
        for mip_level in 0..texture.mip_level_count() {
            let size = wgpu::Extent3d { depth_or_array_layers: 1, ..texture.size() }
                .mip_level_size(mip_level, texture.dimension());
            let row_bytes = size.width * format.bytes_per_texel();
            let (image, rest) = bytes.split_at(row_bytes as usize * size.height as usize);
            bytes = rest;
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level,
                    origin: wgpu::Origin3d { z: layer, ..wgpu::Origin3d::ZERO },
                    aspect: wgpu::TextureAspect::All,
                },
                image,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row_bytes),
                    rows_per_image: None,
                },
                size,
            );
        }
    }
}

/// Check that what the host handed over is what the plan wants.
pub(crate) fn check_import(resource: &Resource, held: &Held, uses: Uses) -> Result<(), ExecuteError> {
    let problem = match held {
        Held::Buffer(buffer) => {
            let shape = ImportShape::Buffer { size_bytes: buffer.size() };
            let missing = conv::buffer_usages(uses) - buffer.usage();
            import_problem(resource, &shape, conv::texture_format)
                .or_else(|| (!missing.is_empty()).then(|| lacks(missing)))
        }
        Held::Texture(texture) => texture_problem(resource, texture, uses),
        Held::View(view) => match resource.kind {
            ResourceKind::Texture { layers, mips, .. } if (layers, mips) != (1, 1) => {
                Some(format!("is a view, the plan wants {layers} layers and {mips} levels"))
            }
            _ if uses.copy_source || uses.copy_target => Some("is a view, but is copied or read back".into()),
            _ => texture_problem(resource, view.texture(), uses),
        },
        Held::Sampler(_) => unreachable!("hosts hand over no samplers"),
    };
    match problem {
        None => Ok(()),
        Some(problem) => Err(ExecuteError::Usage(format!("imported resource {:?} {problem}", resource.name))),
    }
}

fn texture_problem(resource: &Resource, texture: &wgpu::Texture, uses: Uses) -> Option<String> {
    let shape = ImportShape::Texture {
        format: texture.format(),
        size: [texture.width(), texture.height()],
        layers: texture.depth_or_array_layers(),
        mips: texture.mip_level_count(),
    };
    let missing = conv::texture_usages(uses) - texture.usage();
    import_problem(resource, &shape, conv::texture_format)
        .or_else(|| (!missing.is_empty()).then(|| lacks(missing)))
}

fn lacks(missing: impl std::fmt::Debug) -> String {
    format!("lacks the usages {missing:?}")
}

/// All uniform blocks of a plan in one buffer.
pub(crate) struct ParamsBuffer {
    /// None if the plan has no uniform blocks.
    pub(crate) buffer: Option<wgpu::Buffer>,
    pub(crate) layout: ParamsLayout,
}

impl ParamsBuffer {
    /// With its contents.
    pub(crate) fn new(gpu: &Gpu, params: &[Params]) -> Self {
        let mut layout = ParamsLayout::new(params, gpu.device.limits().min_uniform_buffer_offset_alignment);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = (layout.size_bytes() > 0).then(|| gpu.buffer("params", layout.size_bytes(), usage));
        if let Some(buffer) = &buffer {
            for (id, params) in (0..).map(ParamsId).zip(params) {
                let (offset, bytes) = layout.padded(id, &params.bytes);
                gpu.queue.write_buffer(buffer, offset, bytes);
            }
        }
        Self { buffer, layout }
    }
}
