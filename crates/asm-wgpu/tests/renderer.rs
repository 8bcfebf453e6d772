//! `AsmRenderer` on wgpu, and its pictures in a host's texture.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
mod host;
#[path = "../../asm-core/tests/on_device/renderer.rs"]
mod renderer;

use asm_core::{AsmError, PASSES};
use asm_wgpu::{AsmRenderer, DisplayPass, WgpuExecutor};
use frame_plan::{ResourceId, TextureFormat};
use host::Host;
use spectral_core::display::Display;

/// A host application with a texture that it shows pictures in.
struct Screen {
    host: Host,
    size: [u32; 2],
    target: wgpu::Texture,
    pass: DisplayPass,
}

impl Screen {
    /// None if there is no device and skipping is allowed.
    fn new(size: [u32; 2], encodes_srgb: bool) -> Option<Self> {
        let host = Host::new(wgpu::Features::FLOAT32_FILTERABLE)?;
        let format =
            if encodes_srgb { wgpu::TextureFormat::Rgba8UnormSrgb } else { wgpu::TextureFormat::Rgba8Unorm };
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let target = host.texture(format, size, usage);
        let pass = DisplayPass::new(&host.device, format);
        Some(Self { host, size, target, pass })
    }

    /// An executor on the host's device.
    fn executor(&self) -> WgpuExecutor {
        self.host.executor(PASSES)
    }

    fn live_objects(&self, _: &mut AsmRenderer) -> Vec<(&'static str, usize)> {
        self.host.live_objects()
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
        let other = self.host.texture(wgpu::TextureFormat::Rgba16Float, self.size, usage);
        self.show_frame_in(&other, renderer, display)
    }

    fn show_frame_in(
        &mut self,
        target: &wgpu::Texture,
        renderer: &mut AsmRenderer,
        display: &Display,
    ) -> Result<(), AsmError> {
        let view = target.create_view(&wgpu::TextureViewDescriptor::default());
        let mut result = Ok(());
        self.host.frame(|encoder| result = self.pass.record_frame(renderer, encoder, &view, display));
        result
    }

    /// Show a buffer of the executor's plan.
    fn show(&mut self, gpu: &mut WgpuExecutor, picture: ResourceId, display: &Display) {
        let view = self.target.create_view(&wgpu::TextureViewDescriptor::default());
        let picture = (gpu.buffer(picture).unwrap(), self.size);
        let Host { device, queue, .. } = &self.host;
        self.host.frame(|encoder| self.pass.record(device, queue, encoder, picture, &view, display));
    }

    /// What the target holds, as it is encoded there.
    fn pixels(&self) -> Vec<[u8; 4]> {
        // A texture of the same bytes whose format plans know, imported by a plan that only reads it.
        let usage = wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
        let copy = self.host.texture(wgpu::TextureFormat::Rgba8Unorm, self.size, usage);
        let (from, to) = (self.target.as_image_copy(), copy.as_image_copy());
        self.host.frame(|encoder| encoder.copy_texture_to_texture(from, to, self.target.size()));
        let plan = device::image_plan(TextureFormat::Rgba8Unorm, self.size);
        let mut reader = self.executor();
        reader.import_texture("image", copy).unwrap();
        bytemuck::pod_collect_to_vec(&device::run(&mut reader, &plan, "image"))
    }
}
