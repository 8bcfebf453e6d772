//! Choosing a physical device.

use std::ffi::CStr;
use std::path::PathBuf;
use std::sync::Arc;

use ash::vk;
use frame_plan::{DeviceInfo, ExecuteError};

use crate::conv;
use crate::device::{EXECUTOR, Failure};
use crate::validation::{self, Messenger};

/// How a headless executor finds and uses its device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct VulkanOptions {
    /// Part of the device's or driver's name, upper or lower case; by default the most powerful device.
    pub adapter: Option<String>,
    /// Let Khronos' validation layer check every call and the synchronization of every frame. What it finds fails the next
    /// call of the executor. Slow; for tests.
    pub validation: bool,
    /// Folder in which compiled pipelines are kept from run to run, a file per device and driver. Best effort: a folder that
    /// cannot be written or a file that is damaged costs the time to compile, and nothing else.
    pub pipeline_cache: Option<PathBuf>,
}

/// All devices of this machine that have Vulkan 1.3, the most powerful first.
#[must_use]
pub fn adapters() -> Vec<DeviceInfo> {
    Instance::new(false).map_or_else(
        |_| Vec::new(),
        |instance| instance.adapters().into_iter().map(|adapter| adapter.info).collect(),
    )
}

/// Whether [`VulkanOptions::validation`] can be had here.
#[must_use]
pub fn validation_is_available() -> bool {
    load().is_ok_and(|entry| validation::is_installed(&entry))
}

fn load() -> Result<ash::Entry, String> {
    // SAFETY: loading the system's Vulkan loader runs its initialisers, which only set it up.
    unsafe { ash::Entry::load() }.map_err(|e| format!("no Vulkan loader: {e}"))
}

pub(crate) fn no_device(reason: String) -> ExecuteError {
    ExecuteError::NoDevice { executor: EXECUTOR, reason }
}

/// An instance of our own.
pub(crate) struct Instance {
    pub(crate) raw: ash::Instance,
    messenger: Option<Messenger>,
    /// Where the messenger notes what it hears.
    pub(crate) failure: Arc<Failure>,
    /// The loader's library stays loaded as long as its functions are used.
    _entry: ash::Entry,
}

impl Instance {
    /// # Errors
    /// [`ExecuteError::NoDevice`] without a loader, a driver, or a validation layer where one is asked for.
    pub(crate) fn new(validated: bool) -> Result<Self, ExecuteError> {
        let entry = load().map_err(no_device)?;
        if validated && !validation::is_installed(&entry) {
            return Err(no_device(
                "the validation layer is not installed (Debian: vulkan-validationlayers)".into(),
            ));
        }
        let failure = Arc::new(Failure::default());
        let raw = validation::create_instance(&entry, c"frame plan", validated)
            .map_err(|e| no_device(format!("no Vulkan instance: {e}")))?;
        let mut instance = Self { raw, messenger: None, failure, _entry: entry };
        if validated {
            let failure = Arc::clone(&instance.failure);
            let hear = Box::new(move |message| failure.note(format!("validation: {message}")));
            // SAFETY: the instance is validated, and `drop` lets the messenger go before it.
            let messenger = unsafe { Messenger::new(&instance._entry, &instance.raw, hear) };
            instance.messenger = Some(messenger.map_err(|e| no_device(format!("no debug messenger: {e}")))?);
        }
        Ok(instance)
    }

    /// Devices that can run plans, the most powerful first.
    pub(crate) fn adapters(&self) -> Vec<Adapter> {
        // SAFETY: the instance is alive; the call has no further conditions.
        let found = unsafe { self.raw.enumerate_physical_devices() }.unwrap_or_default();
        let mut adapters: Vec<_> =
            found.into_iter().filter_map(|physical| Adapter::new(&self.raw, physical)).collect();
        adapters.sort_by_key(|adapter| conv::power(adapter.device_type));
        adapters
    }

    /// # Errors
    /// [`ExecuteError::NoDevice`] if there is none, or none of that name.
    pub(crate) fn choose(&self, wanted: Option<&str>) -> Result<Adapter, ExecuteError> {
        let mut adapters = self.adapters();
        let Some(wanted) = wanted else {
            return adapters.into_iter().next().ok_or_else(|| no_device("no device has Vulkan 1.3".into()));
        };
        let infos: Vec<_> = adapters.iter().map(|a| a.info.clone()).collect();
        match infos.iter().position(|info| info.is_named(wanted)) {
            Some(index) => Ok(adapters.swap_remove(index)),
            None => Err(ExecuteError::no_device_named(EXECUTOR, wanted, &infos)),
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        self.messenger = None;
        // SAFETY: everything made from the instance is gone: it belongs to the device that drops it last. It is not used again.
        unsafe { self.raw.destroy_instance(None) }
    }
}

/// A physical device that can run plans.
pub(crate) struct Adapter {
    pub(crate) physical: vk::PhysicalDevice,
    pub(crate) device_type: vk::PhysicalDeviceType,
    pub(crate) info: DeviceInfo,
    /// A family whose queues draw and compute.
    pub(crate) queue_family: u32,
}

impl Adapter {
    /// None if it lacks Vulkan 1.3 or a queue that draws and computes.
    fn new(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Option<Self> {
        // SAFETY: the device comes from this instance, here and below.
        let api_version = unsafe { instance.get_physical_device_properties(physical) }.api_version;
        if api_version < vk::API_VERSION_1_3 {
            return None;
        }
        // SAFETY: as above.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue_family = families.iter().position(|f| f.queue_flags.contains(wanted))? as u32;
        let (info, device_type) = device_info(instance, physical);
        Some(Self { physical, device_type, info, queue_family })
    }
}

/// Names of a device that has Vulkan 1.3, and what it is.
pub(crate) fn device_info(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
) -> (DeviceInfo, vk::PhysicalDeviceType) {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the device comes from this instance and has Vulkan 1.2, which has the driver properties.
    unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
    let device = properties.properties;
    let text = |name: Result<&CStr, _>| name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let name = [text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())].join(" ");
    let info = DeviceInfo {
        executor: EXECUTOR.into(),
        device: text(device.device_name_as_c_str()),
        // As wgpu has it, so that what runs on one driver can be told.
        driver: format!("{} (vulkan)", name.trim()),
        device_type: conv::device_type(device.device_type),
        subpixel_bits: Some(device.limits.sub_pixel_precision_bits),
    };
    (info, device.device_type)
}

/// Whether the device has an extension.
pub(crate) fn has_extension(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    extension: &CStr,
) -> bool {
    // SAFETY: the device comes from this instance.
    let found = unsafe { instance.enumerate_device_extension_properties(physical) }.unwrap_or_default();
    found.iter().any(|e| e.extension_name_as_c_str() == Ok(extension))
}
