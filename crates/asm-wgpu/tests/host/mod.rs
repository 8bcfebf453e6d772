//! A host application: it owns instance, device, queue and textures.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]

use asm_wgpu::WgpuExecutor;
use frame_plan::PassSet;

use crate::device;

pub struct Host {
    instance: wgpu::Instance,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

impl Host {
    /// None if there is no device and skipping is allowed. The device has those of the features that the adapter has.
    pub fn new(features: wgpu::Features) -> Option<Self> {
        // The same rule for skipping as everywhere.
        device::executor(PassSet(&[]))?;
        let instance = wgpu::Instance::default();
        let adapter =
            pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: features & adapter.features(),
            ..wgpu::DeviceDescriptor::default()
        }))
        .unwrap();
        Some(Self { instance, device, queue })
    }

    /// An executor on the host's device.
    pub fn executor(&self, passes: PassSet) -> WgpuExecutor {
        WgpuExecutor::from_host(self.device.clone(), self.queue.clone(), passes)
    }

    /// Record commands, and submit them.
    pub fn frame(&self, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        record(&mut encoder);
        self.queue.submit([encoder.finish()]);
    }

    /// A texture with one level.
    pub fn texture(
        &self,
        format: wgpu::TextureFormat,
        size: [u32; 2],
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("host's"),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// Objects that wgpu holds, by kind, when nothing is on its way any more.
    pub fn live_objects(&self) -> Vec<(&'static str, usize)> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let hub = self.instance.generate_report().unwrap().hub;
        vec![
            ("buffers", hub.buffers.num_allocated),
            ("textures", hub.textures.num_allocated),
            ("texture views", hub.texture_views.num_allocated),
            ("bind groups", hub.bind_groups.num_allocated),
            ("bind group layouts", hub.bind_group_layouts.num_allocated),
            ("pipeline layouts", hub.pipeline_layouts.num_allocated),
            ("shader modules", hub.shader_modules.num_allocated),
            ("compute pipelines", hub.compute_pipelines.num_allocated),
            ("render pipelines", hub.render_pipelines.num_allocated),
            ("query sets", hub.query_sets.num_allocated),
            ("samplers", hub.samplers.num_allocated),
            ("command buffers", hub.command_buffers.num_allocated),
        ]
    }
}
