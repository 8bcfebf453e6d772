//! Buffers, textures, samplers and parameters of a plan.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;
use frame_plan::device::{ImportShape, ParamsLayout, Uses, import_problem};
use frame_plan::{ExecuteError, Lifetime, Params, Plan, Resource, ResourceKind};
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

/// Allocate what a validated plan needs, without contents; imported resources are taken from `imports`.
pub(crate) fn allocate(
    gpu: &Arc<Gpu>,
    plan: &Plan,
    uses: &[Uses],
    imports: &HashMap<String, Import>,
) -> Result<Vec<Held>, ExecuteError> {
    let held = |(resource, &uses): (&Resource, &Uses)| {
        if resource.lifetime == Lifetime::Imported {
            let import = imports.get(&resource.name).ok_or_else(|| {
                ExecuteError::Usage(format!("imported resource {:?} was not handed over", resource.name))
            })?;
            check_import(resource, import, uses)?;
            return Ok(Held::from(*import));
        }
        let name = &resource.name;
        match resource.kind {
            ResourceKind::Buffer { size_bytes } => {
                let usage = conv::buffer_usages(uses);
                Buffer::new(gpu, name, size_bytes, usage, MemoryLocation::GpuOnly).map(Held::Buffer)
            }
            ResourceKind::Texture { .. } => {
                Image::new(gpu, name, &image_create_info(&resource.kind, uses)).map(Held::Image)
            }
            ResourceKind::Sampler { linear, repeat } => {
                // SAFETY: the description asks for nothing that needs a feature.
                let raw = unsafe { gpu.device.create_sampler(&conv::sampler(linear, repeat), None) }
                    .map_err(|e| gpu.error(e, "creating a sampler"))?;
                Ok(Held::Sampler(Owned::new(gpu, raw)))
            }
        }
    };
    plan.resources.iter().zip(uses).map(held).collect()
}

fn image_create_info(kind: &ResourceKind, uses: Uses) -> vk::ImageCreateInfo<'static> {
    let ResourceKind::Texture { format, size: [width, height], layers, mips } = *kind else {
        unreachable!("called for textures only")
    };
    // Textures of plans are filled or cleared when these are prepared.
    let usage = conv::image_usages(Uses { copy_target: true, ..uses }, format);
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
pub(crate) fn check_import(resource: &Resource, import: &Import, uses: Uses) -> Result<(), ExecuteError> {
    let problem = match import {
        Import::Buffer(host) => {
            let shape = ImportShape::Buffer { size_bytes: host.size_bytes };
            let missing = conv::buffer_usages(uses) & !host.usage;
            import_problem(resource, &shape, conv::format)
                .or_else(|| (!missing.is_empty()).then(|| lacks(missing)))
        }
        Import::Image(host) => image_problem(resource, host, uses),
    };
    match problem {
        None => Ok(()),
        Some(problem) => Err(ExecuteError::Usage(format!("imported resource {:?} {problem}", resource.name))),
    }
}

fn image_problem(resource: &Resource, host: &HostImage, uses: Uses) -> Option<String> {
    let &HostImage { format, size, layers, mips, .. } = host;
    if let Some(problem) =
        import_problem(resource, &ImportShape::Texture { format, size, layers, mips }, conv::format)
    {
        return Some(problem);
    }
    if host.layout_after == vk::ImageLayout::UNDEFINED {
        return Some("is to be left in the undefined layout".into());
    }
    let ResourceKind::Texture { format, .. } = resource.kind else { return None };
    let missing = conv::image_usages(uses, format) & !host.usage;
    (!missing.is_empty()).then(|| lacks(missing))
}

fn lacks(missing: impl std::fmt::Debug) -> String {
    format!("lacks the usages {missing:?}")
}

/// All uniform blocks of a plan in one buffer.
pub(crate) struct ParamsBuffer {
    /// None if the plan has no uniform blocks.
    pub(crate) buffer: Option<Buffer>,
    pub(crate) layout: ParamsLayout,
}

impl ParamsBuffer {
    /// Without contents.
    pub(crate) fn new(gpu: &Arc<Gpu>, params: &[Params]) -> Result<Self, ExecuteError> {
        let layout = ParamsLayout::new(params, gpu.properties.min_uniform_buffer_offset_alignment as u32);
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
        let size = layout.size_bytes();
        let create = || Buffer::new(gpu, "params", size, usage, MemoryLocation::GpuOnly);
        Ok(Self { buffer: (size > 0).then(create).transpose()?, layout })
    }
}
