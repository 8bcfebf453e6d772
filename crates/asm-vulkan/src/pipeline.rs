//! One pipeline per pass, made when a plan first names it and kept for later plans.

use std::collections::HashMap;
use std::ffi::{CStr, CString};
use std::path::Path;
use std::sync::Arc;

use ash::vk;
use frame_plan::spirv::{SpirvModule, SpirvPasses};
use frame_plan::{Binding, ExecuteError, PassInfo, PassKind, Plan, TextureFormat};

use crate::cache::PipelineCache;
use crate::conv;
use crate::device::{EXECUTOR, Gpu, device_error};
use crate::object::Owned;

/// First word of every SPIR-V module.
const SPIRV_MAGIC: u32 = 0x0723_0203;
/// Words before the first instruction.
const SPIRV_HEADER_WORDS: usize = 5;

/// A pass's pipeline and the layouts of its descriptors.
pub(crate) struct PassPipeline {
    pub(crate) set_layout: Owned<vk::DescriptorSetLayout>,
    pub(crate) layout: Owned<vk::PipelineLayout>,
    pub(crate) pipeline: Owned<vk::Pipeline>,
}

/// Pipelines by pass name.
pub(crate) struct Pipelines {
    by_pass: HashMap<&'static str, PassPipeline>,
    cache: PipelineCache,
}

impl Pipelines {
    pub(crate) fn new(gpu: &Arc<Gpu>, cache_folder: Option<&Path>) -> Result<Self, ExecuteError> {
        Ok(Self { by_pass: HashMap::new(), cache: PipelineCache::new(gpu, cache_folder)? })
    }

    /// Make the pipelines that a validated plan needs and that are not there yet.
    pub(crate) fn prepare(
        &mut self,
        gpu: &Arc<Gpu>,
        spirv: &SpirvPasses,
        plan: &Plan,
    ) -> Result<(), ExecuteError> {
        let mut wanted = Vec::new();
        plan.for_each_pass(&mut |step| wanted.extend(spirv.passes.get(&step.pass)));
        let before = self.by_pass.len();
        for info in wanted {
            if !self.by_pass.contains_key(info.name) {
                let pipeline = create(gpu, spirv, info, self.cache.raw())?;
                self.by_pass.insert(info.name, pipeline);
            }
        }
        if self.by_pass.len() > before {
            self.cache.save(gpu);
        }
        Ok(())
    }

    /// The pipeline of a prepared pass.
    pub(crate) fn get(&self, pass: &str) -> &PassPipeline {
        self.by_pass.get(pass).expect("prepared with the plan")
    }

    /// Bytes of compiled pipelines that are on disk.
    pub(crate) const fn cached_bytes(&self) -> usize {
        self.cache.saved_bytes()
    }
}

fn create(
    gpu: &Arc<Gpu>,
    spirv: &SpirvPasses,
    info: &'static PassInfo,
    cache: vk::PipelineCache,
) -> Result<PassPipeline, ExecuteError> {
    let set_layout = set_layout(gpu, info)?;
    let layout = pipeline_layout(gpu, &set_layout)?;
    let shaders = info
        .entry_points()
        .into_iter()
        .map(|entry_point| Shader::new(gpu, spirv, info, &entry_point))
        .collect::<Result<Vec<_>, _>>()?;
    let pipeline = match (&info.kind, &*shaders) {
        (PassKind::Draw { targets, depth, cull, additive, .. }, [vertex, fragment]) => {
            let state = DrawState {
                formats: targets.iter().map(|&format| conv::format(format)).collect(),
                depth: depth.map(conv::depth_compare),
                cull: conv::cull_mode(*cull),
                additive: *additive,
            };
            draw_pipeline(gpu, info.name, [vertex, fragment], layout.raw(), cache, &state)?
        }
        (_, [compute, ..]) => {
            let create = vk::ComputePipelineCreateInfo::default()
                .stage(compute.stage(vk::ShaderStageFlags::COMPUTE))
                .layout(layout.raw());
            // SAFETY: module, entry point, layout and cache are alive; the SPIR-V comes from a validating compiler.
            let made = unsafe { gpu.device.create_compute_pipelines(cache, &[create], None) };
            one_pipeline(gpu, info.name, made)?
        }
        _ => unreachable!("every pass has an entry point"),
    };
    Ok(PassPipeline { set_layout, layout, pipeline })
}

fn set_layout(gpu: &Arc<Gpu>, info: &PassInfo) -> Result<Owned<vk::DescriptorSetLayout>, ExecuteError> {
    let params = (vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC, conv::all_stages(info));
    let binding = |b: &Binding| (conv::descriptor_type(b.kind), conv::stages(info, b.kind));
    let bindings = (info.params_bytes > 0).then_some(params).into_iter();
    set_layout_of(gpu, &bindings.chain(info.bindings.iter().map(binding)).collect::<Vec<_>>())
}

/// A layout whose bindings 0, 1, ... are of these types and seen by these stages.
pub(crate) fn set_layout_of(
    gpu: &Arc<Gpu>,
    bindings: &[(vk::DescriptorType, vk::ShaderStageFlags)],
) -> Result<Owned<vk::DescriptorSetLayout>, ExecuteError> {
    let binding = |(index, (descriptor_type, stages)): (u32, &(_, _))| {
        vk::DescriptorSetLayoutBinding::default()
            .binding(index)
            .descriptor_type(*descriptor_type)
            .descriptor_count(1)
            .stage_flags(*stages)
    };
    let bindings: Vec<_> = (0..).zip(bindings).map(binding).collect();
    let create = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: `bindings` lives until the call returns.
    let raw = unsafe { gpu.device.create_descriptor_set_layout(&create, None) }
        .map_err(|e| gpu.error(e, "creating a descriptor set layout"))?;
    Ok(Owned::new(gpu, raw))
}

pub(crate) fn pipeline_layout(
    gpu: &Arc<Gpu>,
    set_layout: &Owned<vk::DescriptorSetLayout>,
) -> Result<Owned<vk::PipelineLayout>, ExecuteError> {
    let set_layouts = [set_layout.raw()];
    let create = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
    // SAFETY: the set layout is alive.
    let raw = unsafe { gpu.device.create_pipeline_layout(&create, None) }
        .map_err(|e| gpu.error(e, "creating a pipeline layout"))?;
    Ok(Owned::new(gpu, raw))
}

/// A shader module, as long as a pipeline is made of it.
pub(crate) struct Shader<'a> {
    gpu: &'a Gpu,
    module: vk::ShaderModule,
    entry_point: CString,
}

impl<'a> Shader<'a> {
    /// The module of a pass's entry point.
    fn new(
        gpu: &'a Gpu,
        spirv: &SpirvPasses,
        info: &PassInfo,
        entry_point: &str,
    ) -> Result<Self, ExecuteError> {
        let failed = |reason| shader_error(info.name, reason);
        let module = spirv
            .module(entry_point)
            .ok_or_else(|| failed(format!("there is no SPIR-V for the entry point {entry_point}")))?;
        Self::of(gpu, module).map_err(|error| match error {
            ExecuteError::Device { reason, .. } => failed(reason),
            other => other,
        })
    }

    /// The variant of a module that fits the device.
    pub(crate) fn of(gpu: &'a Gpu, module: &SpirvModule) -> Result<Self, ExecuteError> {
        let bytes = if gpu.robust_buffers { &module.unchecked } else { &module.restricted };
        let words: Vec<u32> =
            bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).map(u32::from_le).collect();
        let entry_point = CString::new(&*module.entry_point).ok();
        let whole =
            bytes.len().is_multiple_of(4) && words.len() > SPIRV_HEADER_WORDS && words[0] == SPIRV_MAGIC;
        let Some(entry_point) = entry_point.filter(|_| whole) else {
            let problem = format!("{} bytes for {} that are no SPIR-V", bytes.len(), module.entry_point);
            return Err(device_error(problem));
        };
        let create = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words are a SPIR-V module of a validating compiler, for Vulkan 1.3.
        let module = unsafe { gpu.device.create_shader_module(&create, None) }
            .map_err(|e| gpu.error(e, "creating a shader module"))?;
        Ok(Self { gpu, module, entry_point })
    }

    fn stage(&self, stage: vk::ShaderStageFlags) -> vk::PipelineShaderStageCreateInfo<'_> {
        let entry_point: &CStr = &self.entry_point;
        vk::PipelineShaderStageCreateInfo::default().stage(stage).module(self.module).name(entry_point)
    }
}

impl Drop for Shader<'_> {
    fn drop(&mut self) {
        // SAFETY: the module is the device's, and pipelines made of it do not need it any more.
        unsafe { self.gpu.device.destroy_shader_module(self.module, None) }
    }
}

/// Fixed state of a draw.
pub(crate) struct DrawState {
    /// Of the colour targets.
    pub(crate) formats: Vec<vk::Format>,
    /// Which depth wins, if there is a depth target.
    pub(crate) depth: Option<vk::CompareOp>,
    pub(crate) cull: vk::CullModeFlags,
    pub(crate) additive: bool,
}

pub(crate) fn draw_pipeline(
    gpu: &Arc<Gpu>,
    name: &str,
    [vertex, fragment]: [&Shader<'_>; 2],
    layout: vk::PipelineLayout,
    cache: vk::PipelineCache,
    state: &DrawState,
) -> Result<Owned<vk::Pipeline>, ExecuteError> {
    let stages = [vertex.stage(vk::ShaderStageFlags::VERTEX), fragment.stage(vk::ShaderStageFlags::FRAGMENT)];
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly =
        vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let rasterization = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(state.cull)
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .line_width(1.0);
    let multisample =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let mut depth = vk::PipelineDepthStencilStateCreateInfo::default();
    let mut rendering = vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&state.formats);
    if let Some(compare) = state.depth {
        depth = depth.depth_test_enable(true).depth_write_enable(true).depth_compare_op(compare);
        rendering = rendering.depth_attachment_format(conv::format(TextureFormat::Depth32Float));
    }
    let blends = vec![conv::blend(state.additive); state.formats.len()];
    let blending = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let create = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&rasterization)
        .multisample_state(&multisample)
        .depth_stencil_state(&depth)
        .color_blend_state(&blending)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: modules, entry points, layout and cache are alive; the SPIR-V comes from a validating compiler.
    let made = unsafe { gpu.device.create_graphics_pipelines(cache, &[create], None) };
    one_pipeline(gpu, name, made)
}

/// What creating one pipeline gave.
fn one_pipeline(
    gpu: &Arc<Gpu>,
    pass: &str,
    made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
) -> Result<Owned<vk::Pipeline>, ExecuteError> {
    match made {
        Ok(pipelines) => Ok(Owned::new(gpu, pipelines[0])),
        // A pipeline that failed is null: there is nothing to destroy.
        Err((_, error)) => Err(match gpu.error(error, "creating a pipeline") {
            ExecuteError::Device { reason, .. } if error != vk::Result::ERROR_DEVICE_LOST => {
                shader_error(pass, reason)
            }
            other => other,
        }),
    }
}

fn shader_error(pass: &str, reason: String) -> ExecuteError {
    ExecuteError::Shader { executor: EXECUTOR, pass: pass.into(), reason }
}
