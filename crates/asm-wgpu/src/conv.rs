//! Formats and states of plans in wgpu's terms.

use frame_plan::device::Uses;
use frame_plan::{
    Binding, BindingKind, Cull, DepthTest, DeviceType, Load, PassInfo, PassKind, Subresource, TextureFormat,
};

pub(crate) const fn device_type(device_type: wgpu::DeviceType) -> DeviceType {
    match device_type {
        wgpu::DeviceType::Cpu => DeviceType::Cpu,
        wgpu::DeviceType::IntegratedGpu => DeviceType::Integrated,
        wgpu::DeviceType::DiscreteGpu => DeviceType::Discrete,
        wgpu::DeviceType::VirtualGpu => DeviceType::Virtual,
        wgpu::DeviceType::Other => DeviceType::Other,
    }
}

pub(crate) const fn texture_format(format: TextureFormat) -> wgpu::TextureFormat {
    match format {
        TextureFormat::R32Uint => wgpu::TextureFormat::R32Uint,
        TextureFormat::R32Float => wgpu::TextureFormat::R32Float,
        TextureFormat::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        TextureFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
        TextureFormat::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        TextureFormat::Depth32Float => wgpu::TextureFormat::Depth32Float,
    }
}

/// Layout entry of binding `index` of a pass.
pub(crate) fn layout_entry(info: &PassInfo, index: u32, binding: &Binding) -> wgpu::BindGroupLayoutEntry {
    let storage = |read_only| wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only },
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let sampled = |sample_type, array| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: view_dimension(array),
        multisampled: false,
    };
    let ty = match binding.kind {
        BindingKind::Read | BindingKind::ReadAtomic => storage(true),
        BindingKind::Write | BindingKind::Atomic => storage(false),
        BindingKind::Texture { uint: true, array, .. } => sampled(wgpu::TextureSampleType::Uint, array),
        BindingKind::Texture { filter, array, .. } => {
            sampled(wgpu::TextureSampleType::Float { filterable: filter }, array)
        }
        BindingKind::DepthTexture => sampled(wgpu::TextureSampleType::Depth, false),
        BindingKind::StorageTexture { format } => wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: texture_format(format),
            view_dimension: wgpu::TextureViewDimension::D2,
        },
        BindingKind::Sampler { filter } => wgpu::BindingType::Sampler(if filter {
            wgpu::SamplerBindingType::Filtering
        } else {
            wgpu::SamplerBindingType::NonFiltering
        }),
    };
    let visibility = match (&info.kind, binding.kind) {
        // Vertex shaders may only read.
        (
            PassKind::Draw { .. },
            BindingKind::Write | BindingKind::Atomic | BindingKind::StorageTexture { .. },
        ) => wgpu::ShaderStages::FRAGMENT,
        _ => stages(info),
    };
    wgpu::BindGroupLayoutEntry { binding: info.binding_index(index), visibility, ty, count: None }
}

/// Layout entry of a pass's uniform block.
pub(crate) fn params_entry(info: &PassInfo) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility: stages(info),
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: wgpu::BufferSize::new(u64::from(info.params_bytes)),
        },
        count: None,
    }
}

const fn stages(info: &PassInfo) -> wgpu::ShaderStages {
    match info.kind {
        PassKind::Compute { .. } => wgpu::ShaderStages::COMPUTE,
        PassKind::Draw { .. } => wgpu::ShaderStages::VERTEX_FRAGMENT,
    }
}

pub(crate) const fn view_dimension(array: bool) -> wgpu::TextureViewDimension {
    if array { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 }
}

pub(crate) const fn cull_mode(cull: Cull) -> Option<wgpu::Face> {
    match cull {
        Cull::None => None,
        Cull::Back => Some(wgpu::Face::Back),
        Cull::Front => Some(wgpu::Face::Front),
    }
}

pub(crate) fn depth_state(test: DepthTest) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: wgpu::TextureFormat::Depth32Float,
        depth_write_enabled: Some(true),
        depth_compare: Some(match test {
            DepthTest::Less => wgpu::CompareFunction::Less,
            DepthTest::Greater => wgpu::CompareFunction::Greater,
        }),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

pub(crate) const ADDITIVE: wgpu::BlendState = {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: add, alpha: add }
};

pub(crate) fn color_load(load: Load) -> wgpu::LoadOp<wgpu::Color> {
    match load {
        Load::Clear(value) => {
            let [r, g, b, a] = value.map(f64::from);
            wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
        }
        Load::Keep => wgpu::LoadOp::Load,
    }
}

pub(crate) const fn depth_load(load: Load) -> wgpu::LoadOp<f32> {
    match load {
        Load::Clear([depth, ..]) => wgpu::LoadOp::Clear(depth),
        Load::Keep => wgpu::LoadOp::Load,
    }
}

/// Usages of a buffer with which the steps do this.
pub(crate) fn buffer_usages(uses: Uses) -> wgpu::BufferUsages {
    let mut usages = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
    usages.set(wgpu::BufferUsages::INDIRECT, uses.indirect);
    usages.set(wgpu::BufferUsages::COPY_SRC, uses.copy_source);
    usages
}

/// Usages of a texture with which the steps do this.
pub(crate) fn texture_usages(uses: Uses) -> wgpu::TextureUsages {
    let mut usages = wgpu::TextureUsages::empty();
    usages.set(wgpu::TextureUsages::TEXTURE_BINDING, uses.sampled);
    usages.set(wgpu::TextureUsages::STORAGE_BINDING, uses.stored);
    usages.set(wgpu::TextureUsages::RENDER_ATTACHMENT, uses.target);
    usages.set(wgpu::TextureUsages::COPY_SRC, uses.copy_source);
    usages.set(wgpu::TextureUsages::COPY_DST, uses.copy_target);
    usages
}

pub(crate) fn view_descriptor(part: Subresource, array: bool) -> wgpu::TextureViewDescriptor<'static> {
    wgpu::TextureViewDescriptor {
        dimension: Some(view_dimension(array)),
        base_mip_level: part.base_mip,
        mip_level_count: Some(part.mips),
        base_array_layer: part.base_layer,
        array_layer_count: Some(part.layers),
        ..wgpu::TextureViewDescriptor::default()
    }
}

pub(crate) fn sampler(linear: bool, repeat: bool) -> wgpu::SamplerDescriptor<'static> {
    let address = if repeat { wgpu::AddressMode::Repeat } else { wgpu::AddressMode::ClampToEdge };
    let filter = if linear { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
    wgpu::SamplerDescriptor {
        address_mode_u: address,
        address_mode_v: address,
        mag_filter: filter,
        min_filter: filter,
        ..wgpu::SamplerDescriptor::default()
    }
}
