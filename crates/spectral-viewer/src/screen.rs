//! The part of the window that shows the picture.

use asm_wgpu::{DisplayPass, wgpu};
use spectral_core::display::Display;

use crate::graphics::Graphics;

/// What egui takes pictures in: encoded sRGB.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A texture of the window's device as large as the picture, which egui shows.
pub(crate) struct Screen {
    /// What the picture is drawn into.
    view: wgpu::TextureView,
    /// How.
    pass: DisplayPass,
    /// How egui enlarges it.
    filter: wgpu::FilterMode,
    /// As egui knows it.
    pub(crate) id: egui::TextureId,
}

impl Screen {
    /// One pixel, for a start.
    pub(crate) fn new(
        graphics: &Graphics,
        painter: &mut egui_wgpu::Renderer,
        filter: wgpu::FilterMode,
    ) -> Self {
        let view = texture(&graphics.device, [1, 1]);
        let id = painter.register_native_texture(&graphics.device, &view, filter);
        Self { pass: DisplayPass::new(&graphics.device, FORMAT), view, filter, id }
    }

    /// Make it of this size, as it is most of the time. What it showed is gone if it was not.
    pub(crate) fn fit(&mut self, graphics: &Graphics, painter: &mut egui_wgpu::Renderer, size: [u32; 2]) {
        let most = graphics.device.limits().max_texture_dimension_2d;
        let size = size.map(|side| side.min(most));
        let texture_now = self.view.texture();
        if [texture_now.width(), texture_now.height()] != size {
            self.view = texture(&graphics.device, size);
            painter.update_egui_texture_from_wgpu_texture(&graphics.device, &self.view, self.filter, self.id);
        }
    }

    /// Record the drawing of a picture.
    pub(crate) fn draw(
        &mut self,
        graphics: &Graphics,
        encoder: &mut wgpu::CommandEncoder,
        picture: (&wgpu::Buffer, [u32; 2]),
        display: &Display,
    ) {
        self.pass.record(&graphics.device, &graphics.queue, encoder, picture, &self.view, display);
    }
}

fn texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture on screen"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
