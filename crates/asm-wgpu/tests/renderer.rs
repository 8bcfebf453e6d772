//! `AsmRenderer` on wgpu, and its pictures in a host's texture.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../asm-core/tests/on_device/renderer.rs"]
mod renderer;

use asm_core::{AsmError, PASSES};
use asm_wgpu::{AsmRenderer, DisplayPass, WgpuExecutor};
use frame_plan::{Lifetime, Plan, Resource, ResourceId, TextureFormat};
use spectral_core::display::Display;

/// A host application: its device, and a texture that it shows pictures in.
struct Screen {
    device: wgpu::Device,
    queue: wgpu::Queue,
    size: [u32; 2],
    target: wgpu::Texture,
    pass: DisplayPass,
}

impl Screen {
    /// None if there is no device and skipping is allowed.
    fn new(size: [u32; 2], encodes_srgb: bool) -> Option<Self> {
        let executor = device::executor(PASSES)?;
        let (device, queue) = (executor.device().clone(), executor.queue().clone());
        let format =
            if encodes_srgb { wgpu::TextureFormat::Rgba8UnormSrgb } else { wgpu::TextureFormat::Rgba8Unorm };
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let target = texture(&device, format, size, usage);
        let pass = DisplayPass::new(&device, format);
        Some(Self { device, queue, size, target, pass })
    }

    /// An executor on the host's device.
    fn executor(&self) -> WgpuExecutor {
        WgpuExecutor::from_host(self.device.clone(), self.queue.clone(), PASSES)
    }

    fn show_frame(&mut self, renderer: &mut AsmRenderer, display: &Display) -> Result<(), AsmError> {
        let target = self.target.clone();
        self.show_frame_in(&target, renderer, display)
    }

    /// Into a texture of a format that the display was not made for.
    fn show_frame_where_it_does_not_fit(
        &mut self,
        renderer: &mut AsmRenderer,
        display: &Display,
    ) -> Result<(), AsmError> {
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let other = texture(&self.device, wgpu::TextureFormat::Rgba16Float, self.size, usage);
        self.show_frame_in(&other, renderer, display)
    }

    fn show_frame_in(
        &mut self,
        target: &wgpu::Texture,
        renderer: &mut AsmRenderer,
        display: &Display,
    ) -> Result<(), AsmError> {
        let view = target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.pass.record_frame(renderer, &mut encoder, &view, display)?;
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Show a buffer of the executor's plan.
    fn show(&mut self, gpu: &mut WgpuExecutor, picture: ResourceId, display: &Display) {
        let view = self.target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let picture = (gpu.buffer(picture).unwrap(), self.size);
        self.pass.record(&self.device, &self.queue, &mut encoder, picture, &view, display);
        self.queue.submit([encoder.finish()]);
    }

    /// What the target holds, as it is encoded there.
    fn pixels(&self) -> Vec<[u8; 4]> {
        // A texture of the same bytes whose format plans know, imported by a plan that only reads it.
        let usage = wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
        let copy = texture(&self.device, wgpu::TextureFormat::Rgba8Unorm, self.size, usage);
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let (from, to) = (self.target.as_image_copy(), copy.as_image_copy());
        encoder.copy_texture_to_texture(from, to, self.target.size());
        self.queue.submit([encoder.finish()]);
        let mut plan = Plan { name: "read".into(), ..Plan::default() };
        let image = Resource::texture("image", TextureFormat::Rgba8Unorm, self.size).readable();
        plan.add_resource(image.with_lifetime(Lifetime::Imported));
        let mut reader = self.executor();
        reader.import_texture("image", copy).unwrap();
        bytemuck::pod_collect_to_vec(&device::run(&mut reader, &plan, "image"))
    }
}

fn texture(
    device: &wgpu::Device,
    format: wgpu::TextureFormat,
    size: [u32; 2],
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}
