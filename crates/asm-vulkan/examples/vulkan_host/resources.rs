//! Images and buffers, each with memory of its own; applications with more of them share memory out.

use std::error::Error;

use asm_vulkan::ash::{self, vk};

/// All of an image that has one level and one layer.
pub(crate) const WHOLE_IMAGE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

/// An image with one level and one layer, of undefined contents.
///
/// # Safety
/// The memory is the device's.
pub(crate) unsafe fn image(
    device: &ash::Device,
    memory: &vk::PhysicalDeviceMemoryProperties,
    format: vk::Format,
    size: [u32; 2],
    usage: vk::ImageUsageFlags,
) -> Result<(vk::Image, vk::DeviceMemory), Box<dyn Error>> {
    let create = vk::ImageCreateInfo::default()
        .image_type(vk::ImageType::TYPE_2D)
        .format(format)
        .extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 })
        .mip_levels(1)
        .array_layers(1)
        .samples(vk::SampleCountFlags::TYPE_1)
        .usage(usage);
    // SAFETY: a whole description, and memory that fits it.
    unsafe {
        let image = device.create_image(&create, None)?;
        let wanted = device.get_image_memory_requirements(image);
        let held = allocate(device, memory, wanted, vk::MemoryPropertyFlags::DEVICE_LOCAL)?;
        device.bind_image_memory(image, held, 0)?;
        Ok((image, held))
    }
}

/// # Safety
/// The device made the image, of this format.
pub(crate) unsafe fn view(
    device: &ash::Device,
    image: vk::Image,
    format: vk::Format,
) -> Result<vk::ImageView, vk::Result> {
    let create = vk::ImageViewCreateInfo::default()
        .image(image)
        .view_type(vk::ImageViewType::TYPE_2D)
        .format(format)
        .subresource_range(WHOLE_IMAGE);
    // SAFETY: as the function demands.
    unsafe { device.create_image_view(&create, None) }
}

/// A buffer in memory that the host can map.
///
/// # Safety
/// The memory is the device's.
pub(crate) unsafe fn mappable_buffer(
    device: &ash::Device,
    memory: &vk::PhysicalDeviceMemoryProperties,
    size_bytes: u64,
    usage: vk::BufferUsageFlags,
) -> Result<(vk::Buffer, vk::DeviceMemory), Box<dyn Error>> {
    let create = vk::BufferCreateInfo::default().size(size_bytes).usage(usage);
    let visible = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
    // SAFETY: a whole description, and memory that fits it.
    unsafe {
        let buffer = device.create_buffer(&create, None)?;
        let held = allocate(device, memory, device.get_buffer_memory_requirements(buffer), visible)?;
        device.bind_buffer_memory(buffer, held, 0)?;
        Ok((buffer, held))
    }
}

/// # Safety
/// The memory is the device's.
unsafe fn allocate(
    device: &ash::Device,
    memory: &vk::PhysicalDeviceMemoryProperties,
    wanted: vk::MemoryRequirements,
    flags: vk::MemoryPropertyFlags,
) -> Result<vk::DeviceMemory, Box<dyn Error>> {
    let fits = |i: &u32| {
        wanted.memory_type_bits & (1 << i) != 0
            && memory.memory_types[*i as usize].property_flags.contains(flags)
    };
    let index = (0..memory.memory_type_count).find(fits).ok_or("no memory of the kind that is needed")?;
    let allocate = vk::MemoryAllocateInfo::default().allocation_size(wanted.size).memory_type_index(index);
    // SAFETY: the type is one that the device has.
    Ok(unsafe { device.allocate_memory(&allocate, None) }?)
}
