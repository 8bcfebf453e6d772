//! Formats and states of plans in Vulkan's terms.

use ash::vk;
use frame_plan::device::Uses;
use frame_plan::{BindingKind, Cull, DepthTest, DeviceType, Load, PassInfo, PassKind, TextureFormat};

pub(crate) const fn format(format: TextureFormat) -> vk::Format {
    match format {
        TextureFormat::R32Uint => vk::Format::R32_UINT,
        TextureFormat::R32Float => vk::Format::R32_SFLOAT,
        TextureFormat::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
        TextureFormat::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
        TextureFormat::Rgba8Unorm => vk::Format::R8G8B8A8_UNORM,
        TextureFormat::Depth32Float => vk::Format::D32_SFLOAT,
    }
}

pub(crate) const fn aspect(format: TextureFormat) -> vk::ImageAspectFlags {
    match format {
        TextureFormat::Depth32Float => vk::ImageAspectFlags::DEPTH,
        _ => vk::ImageAspectFlags::COLOR,
    }
}

/// Descriptor of a binding.
pub(crate) const fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::Read | BindingKind::ReadAtomic | BindingKind::Write | BindingKind::Atomic => {
            vk::DescriptorType::STORAGE_BUFFER
        }
        BindingKind::Texture { .. } | BindingKind::DepthTexture => vk::DescriptorType::SAMPLED_IMAGE,
        BindingKind::StorageTexture { .. } => vk::DescriptorType::STORAGE_IMAGE,
        BindingKind::Sampler { .. } => vk::DescriptorType::SAMPLER,
    }
}

/// Shader stages that see a binding of a pass.
pub(crate) const fn stages(info: &PassInfo, kind: BindingKind) -> vk::ShaderStageFlags {
    match (&info.kind, kind) {
        (PassKind::Compute { .. }, _) => vk::ShaderStageFlags::COMPUTE,
        // Vertex shaders may only read.
        (PassKind::Draw { .. }, BindingKind::Write | BindingKind::Atomic) => vk::ShaderStageFlags::FRAGMENT,
        (PassKind::Draw { .. }, _) => all_stages(info),
    }
}

/// Shader stages of a pass.
pub(crate) const fn all_stages(info: &PassInfo) -> vk::ShaderStageFlags {
    match info.kind {
        PassKind::Compute { .. } => vk::ShaderStageFlags::COMPUTE,
        PassKind::Draw { .. } => vk::ShaderStageFlags::from_raw(
            vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
        ),
    }
}

pub(crate) const fn cull_mode(cull: Cull) -> vk::CullModeFlags {
    match cull {
        Cull::None => vk::CullModeFlags::NONE,
        Cull::Back => vk::CullModeFlags::BACK,
        Cull::Front => vk::CullModeFlags::FRONT,
    }
}

pub(crate) const fn depth_compare(test: DepthTest) -> vk::CompareOp {
    match test {
        DepthTest::Less => vk::CompareOp::LESS,
        DepthTest::Greater => vk::CompareOp::GREATER,
    }
}

pub(crate) fn blend(additive: bool) -> vk::PipelineColorBlendAttachmentState {
    vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(vk::ColorComponentFlags::RGBA)
        .blend_enable(additive)
        .src_color_blend_factor(vk::BlendFactor::ONE)
        .dst_color_blend_factor(vk::BlendFactor::ONE)
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(vk::BlendFactor::ONE)
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
        .alpha_blend_op(vk::BlendOp::ADD)
}

/// How a colour target starts, and with what.
pub(crate) fn color_load(format: TextureFormat, load: Load) -> (vk::AttachmentLoadOp, vk::ClearValue) {
    let Load::Clear(value) = load else { return (vk::AttachmentLoadOp::LOAD, vk::ClearValue::default()) };
    let color = match format {
        TextureFormat::R32Uint => vk::ClearColorValue { uint32: value.map(|v| v as u32) },
        _ => vk::ClearColorValue { float32: value },
    };
    (vk::AttachmentLoadOp::CLEAR, vk::ClearValue { color })
}

/// How a depth target starts, and with what.
pub(crate) fn depth_load(load: Load) -> (vk::AttachmentLoadOp, vk::ClearValue) {
    let Load::Clear([depth, ..]) = load else {
        return (vk::AttachmentLoadOp::LOAD, vk::ClearValue::default());
    };
    let depth_stencil = vk::ClearDepthStencilValue { depth, stencil: 0 };
    (vk::AttachmentLoadOp::CLEAR, vk::ClearValue { depth_stencil })
}

/// Usages of a buffer with which the steps do this.
pub(crate) fn buffer_usages(uses: Uses) -> vk::BufferUsageFlags {
    let mut usages = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST;
    if uses.indirect {
        usages |= vk::BufferUsageFlags::INDIRECT_BUFFER;
    }
    if uses.copy_source {
        usages |= vk::BufferUsageFlags::TRANSFER_SRC;
    }
    usages
}

/// Usages of a texture with which the steps do this.
pub(crate) fn image_usages(uses: Uses, format: TextureFormat) -> vk::ImageUsageFlags {
    let target = match format {
        TextureFormat::Depth32Float => vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
        _ => vk::ImageUsageFlags::COLOR_ATTACHMENT,
    };
    [
        (uses.sampled, vk::ImageUsageFlags::SAMPLED),
        (uses.stored, vk::ImageUsageFlags::STORAGE),
        (uses.target, target),
        (uses.copy_source, vk::ImageUsageFlags::TRANSFER_SRC),
        (uses.copy_target, vk::ImageUsageFlags::TRANSFER_DST),
    ]
    .into_iter()
    .filter(|(used, _)| *used)
    .fold(vk::ImageUsageFlags::empty(), |usages, (_, usage)| usages | usage)
}

pub(crate) fn sampler(linear: bool, repeat: bool) -> vk::SamplerCreateInfo<'static> {
    let address = if repeat { vk::SamplerAddressMode::REPEAT } else { vk::SamplerAddressMode::CLAMP_TO_EDGE };
    let filter = if linear { vk::Filter::LINEAR } else { vk::Filter::NEAREST };
    vk::SamplerCreateInfo::default()
        .address_mode_u(address)
        .address_mode_v(address)
        .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
        .mag_filter(filter)
        .min_filter(filter)
        .mipmap_mode(vk::SamplerMipmapMode::NEAREST)
        .max_lod(32.0)
}

pub(crate) const fn device_type(device_type: vk::PhysicalDeviceType) -> DeviceType {
    match device_type {
        vk::PhysicalDeviceType::CPU => DeviceType::Cpu,
        vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceType::Integrated,
        vk::PhysicalDeviceType::DISCRETE_GPU => DeviceType::Discrete,
        vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceType::Virtual,
        _ => DeviceType::Other,
    }
}

/// Smaller is more powerful, as a rule.
pub(crate) const fn power(device_type: vk::PhysicalDeviceType) -> u32 {
    match device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 4,
        _ => 3,
    }
}
