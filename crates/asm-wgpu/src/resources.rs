//! Buffers, textures, samplers and parameters of a plan.

use std::collections::HashMap;

use frame_plan::{
    BindingKind, ExecuteError, Lifetime, Params, ParamsId, PassSet, Plan, Resource, ResourceId, ResourceKind,
    Step, Targets, TextureFormat,
};

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

/// What the steps of a plan do with each resource.
pub(crate) struct Usages {
    buffers: Vec<wgpu::BufferUsages>,
    textures: Vec<wgpu::TextureUsages>,
}

impl Usages {
    pub(crate) fn of(plan: &Plan, passes: &PassSet) -> Self {
        let count = plan.resources.len();
        let mut usages = Self {
            buffers: vec![wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST; count],
            textures: vec![wgpu::TextureUsages::empty(); count],
        };
        for (i, resource) in plan.resources.iter().enumerate() {
            if resource.readable {
                usages.buffers[i] |= wgpu::BufferUsages::COPY_SRC;
                usages.textures[i] |= wgpu::TextureUsages::COPY_SRC;
            }
            if resource.initial.is_some() {
                usages.textures[i] |= wgpu::TextureUsages::COPY_DST;
            }
        }
        plan.for_each_pass(&mut |step| {
            let bindings = passes.get(&step.pass).map_or(&[][..], |p| p.bindings);
            for (binding, bound) in bindings.iter().zip(&step.bindings) {
                if !matches!(binding.kind, BindingKind::Sampler { .. }) {
                    usages.textures[bound.resource.0 as usize] |= conv::texture_usage(binding.kind);
                }
            }
        });
        usages.add(&plan.steps);
        usages
    }

    fn add(&mut self, steps: &[Step]) {
        for step in steps {
            match step {
                Step::Dispatch { .. } | Step::ClearBuffer { .. } => {}
                Step::DispatchIndirect { arguments, .. } => self.add_indirect(*arguments),
                Step::Draw { targets, .. } => self.add_targets(targets),
                Step::DrawIndirect { targets, arguments, .. } => {
                    self.add_targets(targets);
                    self.add_indirect(*arguments);
                }
                Step::CopyBuffer { source, .. } => {
                    self.buffers[source.0 as usize] |= wgpu::BufferUsages::COPY_SRC;
                }
                Step::CopyTexture { source, target, .. } => {
                    self.textures[source.0 as usize] |= wgpu::TextureUsages::COPY_SRC;
                    self.textures[target.0 as usize] |= wgpu::TextureUsages::COPY_DST;
                }
                Step::Repeat { iterations, .. } => iterations.iter().for_each(|steps| self.add(steps)),
            }
        }
    }

    fn add_indirect(&mut self, buffer: ResourceId) {
        self.buffers[buffer.0 as usize] |= wgpu::BufferUsages::INDIRECT;
    }

    fn add_targets(&mut self, targets: &Targets) {
        for target in targets.color.iter().chain(&targets.depth) {
            self.textures[target.texture.0 as usize] |= wgpu::TextureUsages::RENDER_ATTACHMENT;
        }
    }
}

/// Allocate what a validated plan needs, with its contents; imported resources are taken from `imports`.
pub(crate) fn allocate(
    gpu: &Gpu,
    plan: &Plan,
    usages: &Usages,
    imports: &HashMap<String, Held>,
) -> Result<Vec<Held>, ExecuteError> {
    (0..)
        .zip(&plan.resources)
        .map(|(i, resource)| {
            if resource.lifetime == Lifetime::Imported {
                let held = imports.get(&resource.name).ok_or_else(|| {
                    ExecuteError::Usage(format!("imported resource {:?} was not handed over", resource.name))
                })?;
                check_import(resource, held, usages, ResourceId(i))?;
                return Ok(held.clone());
            }
            Ok(match resource.kind {
                ResourceKind::Buffer { size_bytes } => {
                    Held::Buffer(buffer(gpu, resource, size_bytes, usages.buffers[i as usize]))
                }
                ResourceKind::Texture { .. } => {
                    Held::Texture(texture(gpu, resource, usages.textures[i as usize]))
                }
                ResourceKind::Sampler { linear, repeat } => {
                    Held::Sampler(gpu.device.create_sampler(&conv::sampler(linear, repeat)))
                }
            })
        })
        .collect()
}

fn buffer(gpu: &Gpu, resource: &Resource, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let label = Some(resource.name.as_str());
    let buffer =
        gpu.device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false });
    if let Some(initial) = &resource.initial {
        gpu.queue.write_buffer(&buffer, 0, initial);
    }
    buffer
}

fn texture(gpu: &Gpu, resource: &Resource, usage: wgpu::TextureUsages) -> wgpu::Texture {
    let ResourceKind::Texture { format, size: [width, height], layers, mips } = resource.kind else {
        unreachable!("called for textures only")
    };
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
pub(crate) fn check_import(
    resource: &Resource,
    held: &Held,
    usages: &Usages,
    id: ResourceId,
) -> Result<(), ExecuteError> {
    let problem = match (&resource.kind, held) {
        (ResourceKind::Buffer { size_bytes }, Held::Buffer(buffer)) => {
            let missing = usages.buffers[id.0 as usize] - buffer.usage();
            if buffer.size() != *size_bytes {
                Some(format!("has {} bytes, the plan wants {size_bytes}", buffer.size()))
            } else if missing.is_empty() {
                None
            } else {
                Some(format!("lacks the usages {missing:?}"))
            }
        }
        (ResourceKind::Texture { .. }, Held::Texture(texture)) => {
            texture_problem(resource, texture, usages.textures[id.0 as usize])
        }
        (ResourceKind::Texture { layers, mips, .. }, Held::View(view)) => {
            let copies = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST;
            if (*layers, *mips) != (1, 1) {
                Some(format!("is a view, the plan wants {layers} layers and {mips} levels"))
            } else if usages.textures[id.0 as usize].intersects(copies) {
                Some("is a view, but is copied or read back".into())
            } else {
                texture_problem(resource, view.texture(), usages.textures[id.0 as usize])
            }
        }
        _ => Some("is of another kind than the plan's".into()),
    };
    match problem {
        None => Ok(()),
        Some(problem) => Err(ExecuteError::Usage(format!("imported resource {:?} {problem}", resource.name))),
    }
}

fn texture_problem(
    resource: &Resource,
    texture: &wgpu::Texture,
    usage: wgpu::TextureUsages,
) -> Option<String> {
    let ResourceKind::Texture { format, size, layers, mips } = resource.kind else { return None };
    let format = conv::texture_format(format);
    let missing = usage - texture.usage();
    if texture.format() != format {
        return Some(format!("is {:?}, the plan wants {format:?}", texture.format()));
    }
    if [texture.width(), texture.height()] != size {
        return Some(format!(
            "is {} x {}, the plan wants {} x {}",
            texture.width(),
            texture.height(),
            size[0],
            size[1]
        ));
    }
    if texture.depth_or_array_layers() < layers || texture.mip_level_count() < mips {
        return Some(format!(
            "has {} layers and {} levels, the plan wants {layers} and {mips}",
            texture.depth_or_array_layers(),
            texture.mip_level_count()
        ));
    }
    (!missing.is_empty()).then(|| format!("lacks the usages {missing:?}"))
}

/// All uniform blocks of a plan in one buffer, each block at an offset that a dynamic binding may have.
pub(crate) struct ParamsBuffer {
    /// None if the plan has no uniform blocks.
    pub(crate) buffer: Option<wgpu::Buffer>,
    blocks: Vec<Blocks>,
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

impl ParamsBuffer {
    pub(crate) fn new(gpu: &Gpu, params: &[Params]) -> Self {
        let align = gpu.device.limits().min_uniform_buffer_offset_alignment;
        let mut size = 0;
        let blocks: Vec<_> = params
            .iter()
            .map(|p| {
                let stride = p.stride_bytes;
                let count = p.bytes.len() as u32 / stride;
                let padded_stride = stride.next_multiple_of(align);
                let offset = size;
                size += padded_stride * count;
                Blocks { offset, stride, padded_stride, count }
            })
            .collect();
        let buffer = (size > 0).then(|| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("params"),
                size: u64::from(size),
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        let largest = blocks.iter().map(|b| b.padded_stride * b.count).max().unwrap_or(0);
        let mut this = Self { buffer, blocks, scratch: vec![0; largest as usize] };
        for (id, p) in (0..).map(ParamsId).zip(params) {
            this.write(gpu, id, &p.bytes);
        }
        this
    }

    /// Replace all blocks of one [`Params`]; the length is checked.
    pub(crate) fn write(&mut self, gpu: &Gpu, id: ParamsId, bytes: &[u8]) {
        let (blocks, Some(buffer)) = (&self.blocks[id.0 as usize], &self.buffer) else { return };
        let padded = self.scratch.chunks_exact_mut(blocks.padded_stride as usize);
        for (target, block) in padded.zip(bytes.chunks_exact(blocks.stride as usize)) {
            target[..block.len()].copy_from_slice(block);
        }
        let used = (blocks.padded_stride * blocks.count) as usize;
        gpu.queue.write_buffer(buffer, u64::from(blocks.offset), &self.scratch[..used]);
    }

    /// Offset of the block of an iteration.
    pub(crate) fn offset(&self, id: ParamsId, iteration: u32) -> u32 {
        let blocks = &self.blocks[id.0 as usize];
        let block = if blocks.count == 1 { 0 } else { iteration };
        blocks.offset + block * blocks.padded_stride
    }
}
