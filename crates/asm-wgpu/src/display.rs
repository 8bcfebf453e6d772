//! From a picture in a buffer to a texture of the host's.

use bytemuck::{Pod, Zeroable};
use spectral_core::display::{Display, ToneMap};
use spectral_core::rgb::{D65_WHITE_XYZ, RgbSpace};

/// Draws a picture of XYZ radiance into a texture view of any renderable format, as [`spectral_core::display`] does on the CPU.
pub struct DisplayPass {
    pipeline: wgpu::RenderPipeline,
    params: wgpu::Buffer,
    encode: bool,
    /// The last picture's buffer and its bind group.
    bound: Option<(wgpu::Buffer, wgpu::BindGroup)>,
}

/// Uniform of `display.wgsl`, mirrors `DisplayParams` there.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct DisplayParams {
    picture_size: [u32; 2],
    target_size: [u32; 2],
    exposure: f32,
    reinhard_white: f32,
    encode: u32,
    padding: u32,
    linear_srgb_from_x: [f32; 4],
    linear_srgb_from_y: [f32; 4],
    linear_srgb_from_z: [f32; 4],
    white_xyz: [f32; 4],
}

impl DisplayPass {
    /// A pass for targets of `format`. Formats that do not encode sRGB themselves get encoded values.
    #[must_use]
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("display.wgsl"));
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
        Self { pipeline, params, encode: !format.is_srgb(), bound: None }
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
        queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&self.params_of(size, target, display)));
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

    fn params_of(
        &self,
        picture_size: [u32; 2],
        target: &wgpu::TextureView,
        display: &Display,
    ) -> DisplayParams {
        let rows = RgbSpace::SRGB.rgb_from_xyz();
        let column = |c: usize| [rows[0][c] as f32, rows[1][c] as f32, rows[2][c] as f32, 0.0];
        let [x, y, z] = D65_WHITE_XYZ.map(|v| v as f32);
        DisplayParams {
            picture_size,
            target_size: [target.texture().width(), target.texture().height()],
            exposure: display.exposure as f32,
            reinhard_white: match display.tone_map {
                ToneMap::Clip => 0.0,
                ToneMap::Reinhard { white } => white as f32,
            },
            encode: self.encode.into(),
            padding: 0,
            linear_srgb_from_x: column(0),
            linear_srgb_from_y: column(1),
            linear_srgb_from_z: column(2),
            white_xyz: [x, y, z, 0.0],
        }
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

#[cfg(test)]
mod tests {
    use super::DisplayParams;
    use std::mem::offset_of;

    #[test]
    fn params_match_the_shader() {
        let module = naga::front::wgsl::parse_str(include_str!("display.wgsl")).unwrap();
        let (_, ty) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("DisplayParams")).unwrap();
        let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{ty:?}") };
        assert_eq!(*span as usize, size_of::<DisplayParams>());
        let offsets: Vec<_> =
            members.iter().map(|m| (m.name.as_deref().unwrap(), m.offset as usize)).collect();
        assert_eq!(
            offsets,
            [
                ("picture_size", offset_of!(DisplayParams, picture_size)),
                ("target_size", offset_of!(DisplayParams, target_size)),
                ("exposure", offset_of!(DisplayParams, exposure)),
                ("reinhard_white", offset_of!(DisplayParams, reinhard_white)),
                ("encode", offset_of!(DisplayParams, encode)),
                ("linear_srgb_from_x", offset_of!(DisplayParams, linear_srgb_from_x)),
                ("linear_srgb_from_y", offset_of!(DisplayParams, linear_srgb_from_y)),
                ("linear_srgb_from_z", offset_of!(DisplayParams, linear_srgb_from_z)),
                ("white_xyz", offset_of!(DisplayParams, white_xyz)),
            ]
        );
    }
}
