//! Buffers, textures, samplers and parameters of a plan.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use frame_plan::{
    BindingKind, ExecuteError, Lifetime, Params, ParamsId, PassSet, Plan, Resource, ResourceId, ResourceKind,
    Step, Targets,
};
use gpu_allocator::MemoryLocation;

use crate::conv;
use crate::device::Gpu;
use crate::object::{Buffer, Image, Owned};

/// A buffer of a host's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostBuffer {
    /// The buffer.
    pub buffer: vk::Buffer,
    /// Its size.
    pub size_bytes: u64,
    /// What it was created for.
    pub usage: vk::BufferUsageFlags,
}

/// A 2-D image of a host's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HostImage {
    /// The image.
    pub image: vk::Image,
    /// A view of level 0 of layer 0, which draws then use as their target. A host that hands over another image every frame (a
    /// swap chain's) and gives its view costs the executor nothing; otherwise it makes new views.
    pub view: Option<vk::ImageView>,
    /// Texel format, of image and view.
    pub format: vk::Format,
    /// Width and height of level 0.
    pub size: [u32; 2],
    /// Array layers.
    pub layers: u32,
    /// Mip levels.
    pub mips: u32,
    /// What it was created for.
    pub usage: vk::ImageUsageFlags,
    /// The layout of all of it when a frame begins; undefined if its contents do not matter.
    pub layout_before: vk::ImageLayout,
    /// The layout that a frame leaves it in; not undefined.
    pub layout_after: vk::ImageLayout,
}

/// A resource on the device.
pub(crate) enum Held {
    Buffer(Buffer),
    Image(Image),
    Sampler(Owned<vk::Sampler>),
    HostBuffer(HostBuffer),
    HostImage(HostImage),
}

impl Held {
    /// The buffer, if it is one.
    pub(crate) const fn buffer(&self) -> Option<vk::Buffer> {
        match self {
            Self::Buffer(buffer) => Some(buffer.raw()),
            Self::HostBuffer(host) => Some(host.buffer),
            _ => None,
        }
    }

    /// The image, if it is one.
    pub(crate) const fn image(&self) -> Option<vk::Image> {
        match self {
            Self::Image(image) => Some(image.raw()),
            Self::HostImage(host) => Some(host.image),
            _ => None,
        }
    }
}

/// What a host has handed over under a name.
#[derive(Clone, Copy)]
pub(crate) enum Import {
    Buffer(HostBuffer),
    Image(HostImage),
}

impl From<Import> for Held {
    fn from(import: Import) -> Self {
        match import {
            Import::Buffer(host) => Self::HostBuffer(host),
            Import::Image(host) => Self::HostImage(host),
        }
    }
}

/// What the steps of a plan do with each resource.
pub(crate) struct Usages {
    buffers: Vec<vk::BufferUsageFlags>,
    textures: Vec<vk::ImageUsageFlags>,
}

impl Usages {
    pub(crate) fn of(plan: &Plan, passes: &PassSet) -> Self {
        let count = plan.resources.len();
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let mut usages =
            Self { buffers: vec![storage; count], textures: vec![vk::ImageUsageFlags::empty(); count] };
        for (i, resource) in plan.resources.iter().enumerate() {
            if resource.readable {
                usages.buffers[i] |= vk::BufferUsageFlags::TRANSFER_SRC;
                usages.textures[i] |= vk::ImageUsageFlags::TRANSFER_SRC;
            }
            // Our own textures are filled or cleared when the plan is prepared.
            if resource.lifetime != Lifetime::Imported {
                usages.textures[i] |= vk::ImageUsageFlags::TRANSFER_DST;
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
        usages.add(plan, &plan.steps);
        usages
    }

    fn add(&mut self, plan: &Plan, steps: &[Step]) {
        for step in steps {
            match step {
                Step::Dispatch { .. } | Step::ClearBuffer { .. } => {}
                Step::DispatchIndirect { arguments, .. } => self.add_indirect(*arguments),
                Step::Draw { targets, .. } => self.add_targets(plan, targets),
                Step::DrawIndirect { targets, arguments, .. } => {
                    self.add_targets(plan, targets);
                    self.add_indirect(*arguments);
                }
                Step::CopyBuffer { source, .. } => {
                    self.buffers[source.0 as usize] |= vk::BufferUsageFlags::TRANSFER_SRC;
                }
                Step::CopyTexture { source, target, .. } => {
                    self.textures[source.0 as usize] |= vk::ImageUsageFlags::TRANSFER_SRC;
                    self.textures[target.0 as usize] |= vk::ImageUsageFlags::TRANSFER_DST;
                }
                Step::Repeat { iterations, .. } => iterations.iter().for_each(|steps| self.add(plan, steps)),
            }
        }
    }

    fn add_indirect(&mut self, buffer: ResourceId) {
        self.buffers[buffer.0 as usize] |= vk::BufferUsageFlags::INDIRECT_BUFFER;
    }

    fn add_targets(&mut self, plan: &Plan, targets: &Targets) {
        for target in targets.color.iter().chain(&targets.depth) {
            let index = target.texture.0 as usize;
            if let ResourceKind::Texture { format, .. } = plan.resources[index].kind {
                self.textures[index] |= conv::target_usage(format);
            }
        }
    }

    /// Whether passes bind a texture, rather than only draw into it or copy it.
    pub(crate) fn binds_texture(&self, id: ResourceId) -> bool {
        let bound = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::STORAGE;
        self.textures[id.0 as usize].intersects(bound)
    }
}

/// Allocate what a validated plan needs, without contents; imported resources are taken from `imports`.
pub(crate) fn allocate(
    gpu: &Arc<Gpu>,
    plan: &Plan,
    usages: &Usages,
    imports: &HashMap<String, Import>,
) -> Result<Vec<Held>, ExecuteError> {
    (0..)
        .zip(&plan.resources)
        .map(|(i, resource)| {
            if resource.lifetime == Lifetime::Imported {
                let import = imports.get(&resource.name).ok_or_else(|| {
                    ExecuteError::Usage(format!("imported resource {:?} was not handed over", resource.name))
                })?;
                check_import(resource, import, usages, ResourceId(i))?;
                return Ok(Held::from(*import));
            }
            let name = &resource.name;
            match resource.kind {
                ResourceKind::Buffer { size_bytes } => {
                    let usage = usages.buffers[i as usize];
                    Buffer::new(gpu, name, size_bytes, usage, MemoryLocation::GpuOnly).map(Held::Buffer)
                }
                ResourceKind::Texture { .. } => {
                    let create = image_create_info(&resource.kind, usages.textures[i as usize]);
                    Image::new(gpu, name, &create).map(Held::Image)
                }
                ResourceKind::Sampler { linear, repeat } => {
                    // SAFETY: the description asks for nothing that needs a feature.
                    let raw = unsafe { gpu.device.create_sampler(&conv::sampler(linear, repeat), None) }
                        .map_err(|e| gpu.error(e, "creating a sampler"))?;
                    Ok(Held::Sampler(Owned::new(gpu, raw)))
                }
            }
        })
        .collect()
}

fn image_create_info(kind: &ResourceKind, usage: vk::ImageUsageFlags) -> vk::ImageCreateInfo<'static> {
    let ResourceKind::Texture { format, size: [width, height], layers, mips } = *kind else {
        unreachable!("called for textures only")
    };
    vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(conv::format(format))
        .extent(vk::Extent3D { width, height, depth: 1 })
        .mip_levels(mips)
        .array_layers(layers)
        .samples(vk::SampleCountFlags::TYPE_1)
        .tiling(vk::ImageTiling::OPTIMAL)
        .usage(usage)
        .initial_layout(vk::ImageLayout::UNDEFINED)
}

/// Check that what the host handed over is what the plan wants.
pub(crate) fn check_import(
    resource: &Resource,
    import: &Import,
    usages: &Usages,
    id: ResourceId,
) -> Result<(), ExecuteError> {
    let problem = match (&resource.kind, import) {
        (ResourceKind::Buffer { size_bytes }, Import::Buffer(host)) => {
            let missing = usages.buffers[id.0 as usize] & !host.usage;
            if host.size_bytes != *size_bytes {
                Some(format!("has {} bytes, the plan wants {size_bytes}", host.size_bytes))
            } else if missing.is_empty() {
                None
            } else {
                Some(format!("lacks the usages {missing:?}"))
            }
        }
        (ResourceKind::Texture { .. }, Import::Image(host)) => {
            image_problem(resource, host, usages.textures[id.0 as usize])
        }
        _ => Some("is of another kind than the plan's".into()),
    };
    match problem {
        None => Ok(()),
        Some(problem) => Err(ExecuteError::Usage(format!("imported resource {:?} {problem}", resource.name))),
    }
}

fn image_problem(resource: &Resource, host: &HostImage, usage: vk::ImageUsageFlags) -> Option<String> {
    let ResourceKind::Texture { format, size, layers, mips } = resource.kind else { return None };
    let format = conv::format(format);
    let missing = usage & !host.usage;
    if host.format != format {
        return Some(format!("is {:?}, the plan wants {format:?}", host.format));
    }
    if host.size != size {
        let [width, height] = host.size;
        return Some(format!("is {width} x {height}, the plan wants {} x {}", size[0], size[1]));
    }
    if host.layers < layers || host.mips < mips {
        return Some(format!(
            "has {} layers and {} levels, the plan wants {layers} and {mips}",
            host.layers, host.mips
        ));
    }
    if host.layout_after == vk::ImageLayout::UNDEFINED {
        return Some("is to be left in the undefined layout".into());
    }
    (!missing.is_empty()).then(|| format!("lacks the usages {missing:?}"))
}

/// All uniform blocks of a plan in one buffer, each block at an offset that a dynamic binding may have.
pub(crate) struct ParamsBuffer {
    /// None if the plan has no uniform blocks.
    pub(crate) buffer: Option<Buffer>,
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
    pub(crate) fn new(gpu: &Arc<Gpu>, params: &[Params]) -> Result<Self, ExecuteError> {
        let align = gpu.properties.min_uniform_buffer_offset_alignment.max(1) as u32;
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
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let create = || Buffer::new(gpu, "params", u64::from(size), usage, MemoryLocation::GpuOnly);
        let buffer = (size > 0).then(create).transpose()?;
        let largest = blocks.iter().map(|b| b.padded_stride * b.count).max().unwrap_or(0);
        Ok(Self { buffer, blocks, scratch: vec![0; largest as usize] })
    }

    /// Where all blocks of one [`Params`] go, and the bytes that go there; the length is checked.
    pub(crate) fn padded(&mut self, id: ParamsId, bytes: &[u8]) -> (u64, &[u8]) {
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
    pub(crate) fn offset(&self, id: ParamsId, iteration: u32) -> u32 {
        let blocks = &self.blocks[id.0 as usize];
        let block = if blocks.count == 1 { 0 } else { iteration };
        blocks.offset + block * blocks.padded_stride
    }
}
