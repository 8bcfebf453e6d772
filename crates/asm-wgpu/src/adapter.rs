//! Choosing an adapter.

use frame_plan::{DeviceInfo, ExecuteError};
use pollster::block_on;

use crate::conv::device_type;
use crate::device::EXECUTOR;

/// How a headless executor finds its device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WgpuOptions {
    /// Part of the adapter's or driver's name, upper or lower case; by default the most powerful adapter.
    pub adapter: Option<String>,
}

/// All adapters of this machine: Vulkan, Metal or Direct3D 12. Their subpixel bits are known once they are opened.
#[must_use]
pub fn adapters() -> Vec<DeviceInfo> {
    enumerate(&instance()).iter().map(|a| device_info(&a.get_info())).collect()
}

pub(crate) fn device_info(info: &wgpu::AdapterInfo) -> DeviceInfo {
    let driver = [&*info.driver, &*info.driver_info].join(" ");
    DeviceInfo {
        executor: EXECUTOR.into(),
        device: info.name.clone(),
        driver: format!("{} ({})", driver.trim(), info.backend),
        device_type: device_type(info.device_type),
        subpixel_bits: None,
    }
}

fn instance() -> wgpu::Instance {
    // Indirect arguments come from shaders: wgpu checks them on the device, whatever the build profile.
    let flags = wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL.with_env();
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        flags,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    })
}

fn enumerate(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    block_on(instance.enumerate_adapters(wgpu::Backends::all()))
}

pub(crate) fn choose(options: &WgpuOptions) -> Result<wgpu::Adapter, ExecuteError> {
    let instance = instance();
    let Some(wanted) = &options.adapter else {
        return block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        }))
        .map_err(|e| ExecuteError::NoDevice { executor: EXECUTOR, reason: e.to_string() });
    };
    let mut adapters = enumerate(&instance);
    let infos: Vec<_> = adapters.iter().map(|a| device_info(&a.get_info())).collect();
    match infos.iter().position(|info| info.is_named(wanted)) {
        Some(index) => Ok(adapters.swap_remove(index)),
        None => Err(ExecuteError::no_device_named(EXECUTOR, wanted, &infos)),
    }
}
