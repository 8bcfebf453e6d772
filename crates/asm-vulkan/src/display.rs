//! From a picture in a buffer to an image of the host's.

use std::sync::Arc;

use ash::vk;
use asm_core::AsmError;
use asm_core::display::DisplayParams;
use frame_plan::spirv::SpirvModule;
use frame_plan::{ExecuteError, ResourceId};
use gpu_allocator::MemoryLocation;
use spectral_core::display::Display;

use crate::AsmRenderer;
use crate::barrier::{Access, color_image};
use crate::command::set_viewport;
use crate::descriptor::{self, Entry};
use crate::device::Gpu;
use crate::executor::VulkanExecutor;
use crate::object::{Buffer, Owned};
use crate::pipeline::{DrawState, Shader, draw_pipeline, pipeline_layout, set_layout_of};
use crate::resources::HostImage;

/// `display_vertex` and `display_fragment`, compiled when this crate was built.
const MODULES: &[SpirvModule] = include!(concat!(env!("OUT_DIR"), "/display.rs"));

/// Draws a picture of XYZ radiance into an image view of any renderable format, as [`spectral_core::display`] does on the CPU.
pub struct DisplayPass {
    // Fields drop in this order.
    pipeline: Owned<vk::Pipeline>,
    layout: Owned<vk::PipelineLayout>,
    _set_layout: Owned<vk::DescriptorSetLayout>,
    _pool: Owned<vk::DescriptorPool>,
    /// A set per frame that may be unfinished.
    sets: Vec<vk::DescriptorSet>,
    /// A block per frame that may be unfinished.
    params: Buffer,
    stride: u64,
    format: vk::Format,
    gpu: Arc<Gpu>,
}

impl DisplayPass {
    /// A pass for targets of `format` on an executor's device. Formats that do not encode sRGB themselves get encoded values.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(executor: &VulkanExecutor, format: vk::Format) -> Result<Self, ExecuteError> {
        let gpu = Arc::clone(executor.gpu());
        let frames = executor.frames_in_flight();
        let params = vk::DescriptorType::UNIFORM_BUFFER_DYNAMIC;
        let picture = vk::DescriptorType::STORAGE_BUFFER;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let set_layout = set_layout_of(&gpu, &[(params, stages), (picture, stages)])?;
        let layout = pipeline_layout(&gpu, &set_layout)?;
        let [vertex, fragment] = MODULES else { unreachable!("the build script compiles two") };
        let state =
            DrawState { formats: vec![format], depth: None, cull: vk::CullModeFlags::NONE, additive: false };
        let no_cache = vk::PipelineCache::null();
        let pipeline = {
            let shaders = [&Shader::of(&gpu, vertex)?, &Shader::of(&gpu, fragment)?];
            draw_pipeline(&gpu, "display", shaders, layout.raw(), no_cache, &state)?
        };
        let pool = descriptor::pool_of(&gpu, frames as u32, &[params, picture])?;
        let alignment = gpu.properties.min_uniform_buffer_offset_alignment.max(1);
        let stride = (size_of::<DisplayParams>() as u64).next_multiple_of(alignment);
        let usage = vk::BufferUsageFlags::UNIFORM_BUFFER;
        let buffer = Buffer::new(&gpu, "display", stride * frames as u64, usage, MemoryLocation::CpuToGpu)?;
        let set = |_| descriptor::set(&gpu, &pool, &set_layout);
        Ok(Self {
            sets: (0..frames).map(set).collect::<Result<_, ExecuteError>>()?,
            pipeline,
            layout,
            _set_layout: set_layout,
            _pool: pool,
            params: buffer,
            stride,
            format,
            gpu,
        })
    }

    /// Record a frame of the renderer's prepared picture, and its display in `target` (level 0 of layer 0, through its view),
    /// into a host's command buffer.
    ///
    /// # Errors
    /// If nothing is prepared, `target` has no view or another format, or the device failed.
    ///
    /// # Safety
    /// As [`DisplayPass::record`].
    pub unsafe fn record_frame(
        &mut self,
        renderer: &mut AsmRenderer,
        commands: vk::CommandBuffer,
        target: &HostImage,
        display: &Display,
    ) -> Result<(), AsmError> {
        // The target first: if it does not fit, nothing is recorded.
        self.view_of(target)?;
        let render = renderer.prepared().ok_or_else(ExecuteError::nothing_prepared)?;
        let picture = (render.picture(), render.size);
        let executor = renderer.executor();
        // SAFETY: as the function demands; the display is recorded once, after the frame.
        unsafe {
            executor.record(commands)?;
            Ok(self.record(executor, commands, picture, target, display)?)
        }
    }

    fn view_of(&self, target: &HostImage) -> Result<vk::ImageView, ExecuteError> {
        target.view.filter(|_| target.format == self.format).ok_or_else(|| {
            ExecuteError::Usage(format!(
                "a display needs a view of {:?}, got {:?} of {:?}",
                self.format, target.view, target.format
            ))
        })
    }

    /// Record the drawing of `picture` (a buffer of the prepared plan: XYZ and padding per pixel, f32, rows from the top, `size`
    /// pixels) over the whole of `target`, level 0 of layer 0, into the command buffer that the executor's last frame went
    /// into. Other sizes are scaled to the nearest pixel.
    ///
    /// # Errors
    /// [`ExecuteError::Usage`] if there is no such buffer, or `target` has no view or another format.
    ///
    /// # Safety
    /// As [`VulkanExecutor::record`] and [`VulkanExecutor::import_image`]; at most one recording of this pass per frame.
    pub unsafe fn record(
        &mut self,
        executor: &mut VulkanExecutor,
        commands: vk::CommandBuffer,
        (picture, size): (ResourceId, [u32; 2]),
        target: &HostImage,
        display: &Display,
    ) -> Result<(), ExecuteError> {
        let view = self.view_of(target)?;
        let buffer = executor.use_buffer(commands, picture, vk::PipelineStageFlags2::FRAGMENT_SHADER)?;
        let place = executor.last_place();
        let params = DisplayParams::new(display, size, target.size, !is_srgb(self.format));
        let offset = place * self.stride as usize;
        let bytes = bytemuck::bytes_of(&params);
        self.params.mapped_mut()?[offset..offset + bytes.len()].copy_from_slice(bytes);
        let set = self.sets[place];
        // In every frame: another plan's buffer may have the handle of one that is gone.
        let block = Entry::Params(self.params.raw(), bytes.len() as u64);
        descriptor::write(&self.gpu, set, &[block, Entry::Buffer(buffer)]);
        let access = Access::color_target(false);
        color_image(&self.gpu, commands, target.image, (target.layout_before, access.layout));
        let attachment = [vk::RenderingAttachmentInfo::default()
            .image_view(view)
            .image_layout(access.layout)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let [width, height] = target.size;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let rendering =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachment);
        let device = &self.gpu.device;
        let point = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the commands are being recorded outside of any rendering, as the caller says; pipeline, set and offset belong
        // together, the view is the host's and in this layout, the picture was made visible above.
        unsafe {
            device.cmd_begin_rendering(commands, &rendering);
            set_viewport(device, commands, target.size);
            device.cmd_bind_pipeline(commands, point, self.pipeline.raw());
            let offsets = [offset as u32];
            device.cmd_bind_descriptor_sets(commands, point, self.layout.raw(), 0, &[set], &offsets);
            device.cmd_draw(commands, 3, 1, 0, 0);
            device.cmd_end_rendering(commands);
        }
        color_image(&self.gpu, commands, target.image, (access.layout, target.layout_after));
        Ok(())
    }
}

impl Drop for DisplayPass {
    fn drop(&mut self) {
        self.gpu.idle();
    }
}

/// Whether a format encodes what it is given.
const fn is_srgb(format: vk::Format) -> bool {
    matches!(format, vk::Format::R8G8B8A8_SRGB | vk::Format::B8G8R8A8_SRGB | vk::Format::A8B8G8R8_SRGB_PACK32)
}
