//! Descriptor sets and views: made once per plan, never changed.

use std::sync::Arc;

use ash::vk;
use frame_plan::{ExecuteError, PassInfo, Subresource, TextureFormat};

use crate::barrier::{Access, range};
use crate::conv;
use crate::device::Gpu;
use crate::object::Owned;

/// What a binding refers to.
pub(crate) enum Entry {
    /// The buffer of uniform blocks, and the size of one.
    Params(vk::Buffer, u64),
    Buffer(vk::Buffer),
    Sampled(vk::ImageView),
    Storage(vk::ImageView),
    Sampler(vk::Sampler),
}

impl Entry {
    const fn descriptor_type(&self) -> vk::DescriptorType {
        match self {
            Self::Params(..) => vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC,
            Self::Buffer(_) => vk::DescriptorType::STORAGE_BUFFER,
            Self::Sampled(_) => vk::DescriptorType::SAMPLED_IMAGE,
            Self::Storage(_) => vk::DescriptorType::STORAGE_IMAGE,
            Self::Sampler(_) => vk::DescriptorType::SAMPLER,
        }
    }
}

/// A pool with room for one set of each of the passes; none for no pass.
pub(crate) fn pool(
    gpu: &Arc<Gpu>,
    sets: &[&PassInfo],
) -> Result<Option<Owned<vk::DescriptorPool>>, ExecuteError> {
    if sets.is_empty() {
        return Ok(None);
    }
    let params =
        sets.iter().filter(|i| i.params_bytes > 0).map(|_| vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC);
    let bindings = sets.iter().flat_map(|i| i.bindings).map(|b| conv::descriptor_type(b.kind));
    let mut sizes: Vec<vk::DescriptorPoolSize> = Vec::new();
    for ty in params.chain(bindings) {
        match sizes.iter_mut().find(|size| size.ty == ty) {
            Some(size) => size.descriptor_count += 1,
            None => sizes.push(vk::DescriptorPoolSize { ty, descriptor_count: 1 }),
        }
    }
    create_pool(gpu, sets.len() as u32, &sizes).map(Some)
}

/// A pool with room for `sets` sets, each with one descriptor of each of the types.
pub(crate) fn pool_of(
    gpu: &Arc<Gpu>,
    sets: u32,
    types: &[vk::DescriptorType],
) -> Result<Owned<vk::DescriptorPool>, ExecuteError> {
    let size = |ty: &vk::DescriptorType| vk::DescriptorPoolSize { ty: *ty, descriptor_count: sets };
    create_pool(gpu, sets, &types.iter().map(size).collect::<Vec<_>>())
}

fn create_pool(
    gpu: &Arc<Gpu>,
    sets: u32,
    sizes: &[vk::DescriptorPoolSize],
) -> Result<Owned<vk::DescriptorPool>, ExecuteError> {
    let create = vk::DescriptorPoolCreateInfo::default().max_sets(sets).pool_sizes(sizes);
    // SAFETY: there is at least one set, and `sizes` lives until the call returns.
    let raw = unsafe { gpu.device.create_descriptor_pool(&create, None) }
        .map_err(|e| gpu.error(e, "creating a descriptor pool"))?;
    Ok(Owned::new(gpu, raw))
}

/// A set of a layout that the pool has room for; its bindings point nowhere yet.
pub(crate) fn set(
    gpu: &Gpu,
    pool: &Owned<vk::DescriptorPool>,
    layout: &Owned<vk::DescriptorSetLayout>,
) -> Result<vk::DescriptorSet, ExecuteError> {
    let layouts = [layout.raw()];
    let allocate = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool.raw()).set_layouts(&layouts);
    // SAFETY: pool and layout are alive; the pool was made with room for the set.
    let sets = unsafe { gpu.device.allocate_descriptor_sets(&allocate) }
        .map_err(|e| gpu.error(e, "allocating a descriptor set"))?;
    Ok(sets[0])
}

/// Point the bindings of a set that nothing pending uses at `entries`.
pub(crate) fn write(gpu: &Gpu, set: vk::DescriptorSet, entries: &[Entry]) {
    let infos: Vec<_> = entries.iter().map(Infos::of).collect();
    let writes: Vec<_> = (0..)
        .zip(entries.iter().zip(&infos))
        .map(|(binding, (entry, infos))| {
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(binding)
                .descriptor_type(entry.descriptor_type());
            match infos {
                Infos::Buffer(info) => write.buffer_info(info),
                Infos::Image(info) => write.image_info(info),
            }
        })
        .collect();
    // SAFETY: the set is alive and not used; its layout has these types at these bindings, and what they refer to is alive.
    unsafe { gpu.device.update_descriptor_sets(&writes, &[]) }
}

enum Infos {
    Buffer([vk::DescriptorBufferInfo; 1]),
    Image([vk::DescriptorImageInfo; 1]),
}

impl Infos {
    fn of(entry: &Entry) -> Self {
        let buffer = |buffer, range| Self::Buffer([vk::DescriptorBufferInfo { buffer, offset: 0, range }]);
        let image = |image_view, sampler, image_layout| {
            Self::Image([vk::DescriptorImageInfo { sampler, image_view, image_layout }])
        };
        let no_stages = vk::PipelineStageFlags2::NONE;
        match *entry {
            Entry::Params(raw, block) => buffer(raw, block),
            Entry::Buffer(raw) => buffer(raw, vk::WHOLE_SIZE),
            Entry::Sampled(view) => image(view, vk::Sampler::null(), Access::sampled(no_stages).layout),
            Entry::Storage(view) => image(view, vk::Sampler::null(), Access::storage_image(no_stages).layout),
            Entry::Sampler(sampler) => image(vk::ImageView::null(), sampler, vk::ImageLayout::UNDEFINED),
        }
    }
}

/// A view of part of a texture.
pub(crate) fn view(
    gpu: &Arc<Gpu>,
    image: vk::Image,
    format: TextureFormat,
    part: Subresource,
    array: bool,
) -> Result<Owned<vk::ImageView>, ExecuteError> {
    let create = vk::ImageViewCreateInfo::default()
        .image(image)
        .view_type(if array { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D })
        .format(conv::format(format))
        .subresource_range(range(conv::aspect(format), part));
    // SAFETY: the image is alive and of this format, and the part lies in it, as the plan's validation says.
    let raw = unsafe { gpu.device.create_image_view(&create, None) }
        .map_err(|e| gpu.error(e, "creating an image view"))?;
    Ok(Owned::new(gpu, raw))
}
