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
    let no_device = |reason| ExecuteError::NoDevice { executor: EXECUTOR, reason };
    let Some(wanted) = &options.adapter else {
        return block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        }))
        .map_err(|e| no_device(e.to_string()));
    };
    let mut adapters = enumerate(&instance);
    let infos: Vec<_> = adapters.iter().map(|a| device_info(&a.get_info())).collect();
    match infos.iter().position(|info| matches(info, wanted)) {
        Some(index) => Ok(adapters.swap_remove(index)),
        None => Err(no_device(not_found(wanted, &infos))),
    }
}

fn matches(info: &DeviceInfo, wanted: &str) -> bool {
    let wanted = wanted.to_lowercase();
    info.device.to_lowercase().contains(&wanted) || info.driver.to_lowercase().contains(&wanted)
}

fn not_found(wanted: &str, infos: &[DeviceInfo]) -> String {
    let names: Vec<_> = infos.iter().map(|i| format!("{}, {}", i.device, i.driver)).collect();
    if names.is_empty() {
        format!("no adapter at all, and so none named {wanted:?}")
    } else {
        format!("no adapter is named {wanted:?}; there are: {}", names.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::{matches, not_found};
    use frame_plan::DeviceInfo;

    fn info(device: &str, driver: &str) -> DeviceInfo {
        DeviceInfo { device: device.into(), driver: driver.into(), ..DeviceInfo::default() }
    }

    #[test]
    fn adapters_are_found_by_part_of_a_name() {
        let lavapipe = info("llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe Mesa 22.3.6 (vulkan)");
        assert!(matches(&lavapipe, "LLVMpipe"));
        assert!(matches(&lavapipe, "mesa"));
        assert!(!matches(&lavapipe, "swiftshader"));
    }

    #[test]
    fn the_error_lists_what_there_is() {
        let text = not_found("voodoo", &[info("A", "a 1"), info("B", "b 2")]);
        assert_eq!(text, "no adapter is named \"voodoo\"; there are: A, a 1; B, b 2");
        assert!(not_found("voodoo", &[]).starts_with("no adapter at all"));
    }
}
