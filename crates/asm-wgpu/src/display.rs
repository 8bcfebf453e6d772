//! From a picture in a buffer to a texture of the host's.

use asm_core::AsmError;
use asm_core::display::{DISPLAY_WGSL, DisplayParams};
use frame_plan::ExecuteError;
use spectral_core::display::Display;

use crate::AsmRenderer;

/// Draws a picture of XYZ radiance into a texture view of any renderable format, as [`spectral_core::display`] does on the CPU.
pub struct DisplayPass {
    pipeline: wgpu::RenderPipeline,
    params: wgpu::Buffer,
    format: wgpu::TextureFormat,
    /// The last picture's buffer and its bind group.
    bound: Option<(wgpu::Buffer, wgpu::BindGroup)>,
}

impl DisplayPass {
    /// A pass for targets of `format`. Formats that do not encode sRGB themselves get encoded values.
    #[must_use]
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("display"),
            source: wgpu::ShaderSource::Wgsl(DISPLAY_WGSL.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("display_vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("display_fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let params = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display"),
            size: size_of::<DisplayParams>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { pipeline, params, format, bound: None }
    }

    /// Record a frame of the renderer's prepared picture, and its display in `target` (level 0 of its texture), into a host's
    /// encoder.
    ///
    /// # Errors
    /// If nothing is prepared, `target` has another format, or the device failed.
    pub fn record_frame(
        &mut self,
        renderer: &mut AsmRenderer,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        display: &Display,
    ) -> Result<(), AsmError> {
        let format = target.texture().format();
        if format != self.format {
            let problem = format!("a display for {:?} cannot draw into {format:?}", self.format);
            return Err(ExecuteError::Usage(problem).into());
        }
        let render = renderer.prepared().ok_or_else(ExecuteError::nothing_prepared)?;
        let (picture, size) = (render.picture(), render.size);
        let executor = renderer.executor();
        executor.record(encoder)?;
        let picture = executor.buffer(picture).ok_or_else(ExecuteError::nothing_prepared)?;
        self.record(executor.device(), executor.queue(), encoder, (picture, size), target, display);
        Ok(())
    }

    /// Record the drawing of `picture` (XYZ and padding per pixel, f32, rows from the top, `size` pixels) over the whole of
    /// `target`, level 0 of its texture. Other sizes are scaled to the nearest pixel. `queue` gets the parameters, which apply
    /// to the next submission.
    pub fn record(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        (picture, size): (&wgpu::Buffer, [u32; 2]),
        target: &wgpu::TextureView,
        display: &Display,
    ) {
        let target_size = [target.texture().width(), target.texture().height()];
        let params = DisplayParams::new(display, size, target_size, !self.format.is_srgb());
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
        let group = self.bind(device, picture);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("display"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }

    fn bind(&mut self, device: &wgpu::Device, picture: &wgpu::Buffer) -> wgpu::BindGroup {
        if let Some((bound, group)) = &self.bound
            && bound == picture
        {
            return group.clone();
        }
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.params.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: picture.as_entire_binding() },
            ],
        });
        self.bound = Some((picture.clone(), group.clone()));
        group
    }
}
