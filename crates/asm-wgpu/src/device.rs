//! A device with its errors: nothing that wgpu reports goes unseen, and nothing panics.

use std::sync::{Arc, Mutex, PoisonError};

use frame_plan::{DeviceInfo, ExecuteError, Limits, Made, memory};
use pollster::block_on;

use crate::adapter::device_info;

/// Executor id.
pub(crate) const EXECUTOR: &str = "wgpu";

/// Features that are used where a device has them.
const OPTIONAL_FEATURES: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY
    .union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS)
    .union(wgpu::Features::FLOAT32_FILTERABLE)
    .union(wgpu::Features::FLOAT32_BLENDABLE)
    .union(wgpu::Features::INDIRECT_FIRST_INSTANCE);

/// What a device is asked for so that plans run on it as well as `adapter` can: its sizes, and the features that are used where
/// there are any. For hosts that make their device themselves.
#[must_use]
pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
    let can = adapter.limits();
    wgpu::DeviceDescriptor {
        label: Some("frame plan"),
        required_features: adapter.features() & OPTIONAL_FEATURES,
        required_limits: wgpu::Limits {
            max_texture_dimension_2d: can.max_texture_dimension_2d,
            max_buffer_size: can.max_buffer_size,
            max_storage_buffer_binding_size: can.max_storage_buffer_binding_size,
            max_compute_workgroups_per_dimension: can.max_compute_workgroups_per_dimension,
            ..wgpu::Limits::default()
        },
        ..wgpu::DeviceDescriptor::default()
    }
}

/// Device and queue, ours or a host's.
pub(crate) struct Gpu {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) info: DeviceInfo,
    pub(crate) limits: Limits,
    made: Mutex<Made>,
    /// What failed outside of any call, such as the loss of the device.
    failure: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Open a device of our own.
    pub(crate) fn open(adapter: &wgpu::Adapter) -> Result<Self, ExecuteError> {
        let (device, queue) = block_on(adapter.request_device(&device_descriptor(adapter)))
            .map_err(|e| ExecuteError::NoDevice { executor: EXECUTOR, reason: one_line(&e.to_string()) })?;
        let gpu = Self::of_host(device, queue);
        let failure = Arc::clone(&gpu.failure);
        gpu.device.on_uncaptured_error(Arc::new(move |error| note(&failure, one_line(&error.to_string()))));
        let failure = Arc::clone(&gpu.failure);
        gpu.device.set_device_lost_callback(move |reason, message| {
            // Dropping the device also ends here, and is no failure.
            if !matches!(reason, wgpu::DeviceLostReason::Destroyed) || !message.is_empty() {
                note(&failure, format!("device lost ({reason:?}): {}", one_line(&message)));
            }
        });
        Ok(gpu)
    }

    /// Use a host's device; its error and loss callbacks stay as they are.
    pub(crate) fn of_host(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let limits = device.limits();
        let adapter = device.adapter_info();
        let limits = Limits {
            max_texture_size: limits.max_texture_dimension_2d,
            max_storage_binding_bytes: limits.max_storage_buffer_binding_size,
            max_buffer_bytes: limits.max_buffer_size,
            max_groups_per_dimension: limits.max_compute_workgroups_per_dimension,
            max_total_bytes: match adapter.device_type {
                // These take the machine's memory, and software drivers hand out more than there is.
                wgpu::DeviceType::Cpu | wgpu::DeviceType::IntegratedGpu => memory::usable_bytes(),
                // wgpu does not say how much memory the device has; it reports when that runs out.
                _ => u64::MAX,
            },
        };
        let info =
            DeviceInfo { subpixel_bits: subpixel_bits(&device, adapter.backend), ..device_info(&adapter) };
        Self { device, queue, info, limits, made: Mutex::default(), failure: Arc::default() }
    }

    /// A buffer that is counted, and the device's.
    pub(crate) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.create_buffer(label, size, usage, false)
    }

    /// A buffer that is counted, and the host's to begin with.
    pub(crate) fn mapped_buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.create_buffer(label, size, usage, true)
    }

    fn create_buffer(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
        mapped_at_creation: bool,
    ) -> wgpu::Buffer {
        self.count(|made| {
            made.buffers += 1;
            made.bytes += size;
        });
        let label = Some(label);
        self.device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation })
    }

    /// Note what is made.
    pub(crate) fn count(&self, count: impl FnOnce(&mut Made)) {
        count(&mut self.made.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// What was made so far.
    pub(crate) fn made(&self) -> Made {
        *self.made.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Run `work` and turn what wgpu reports meanwhile into an error, which comes before the error of `work` itself.
    pub(crate) fn scoped<T>(
        &self,
        work: impl FnOnce() -> Result<T, ExecuteError>,
    ) -> Result<T, ExecuteError> {
        let [internal, memory, validation] =
            [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation]
                .map(|filter| self.device.push_error_scope(filter));
        let result = work();
        let errors = [validation, memory, internal].map(|scope| block_on(scope.pop()));
        match errors.into_iter().flatten().next() {
            Some(error) => Err(from_wgpu(&error)),
            None => result,
        }
    }

    /// Fail if something failed outside of any call.
    pub(crate) fn check(&self) -> Result<(), ExecuteError> {
        match &*self.failure.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(reason) => Err(device_error(reason.clone())),
            None => Ok(()),
        }
    }

    /// Wait until a submission is done.
    pub(crate) fn wait_for(&self, submission: wgpu::SubmissionIndex) -> Result<(), ExecuteError> {
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
        self.device.poll(wait).map_err(|e| device_error(e.to_string()))?;
        self.check()
    }

    /// Wait until all submitted work is done.
    pub(crate) fn wait(&self) -> Result<(), ExecuteError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| device_error(e.to_string()))?;
        self.check()
    }
}

/// Bits of a texel's fraction that the rasteriser keeps of a vertex's place.
fn subpixel_bits(device: &wgpu::Device, backend: wgpu::Backend) -> Option<u32> {
    match backend {
        wgpu::Backend::Vulkan => vulkan_subpixel_bits(device),
        // Fixed: D3D12_SUBPIXEL_FRACTIONAL_BIT_COUNT.
        wgpu::Backend::Dx12 => Some(8),
        _ => None,
    }
}

/// Vulkan's limit `subPixelPrecisionBits`, which wgpu itself does not pass on.
#[cfg(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd"))]
#[allow(unsafe_code, reason = "wgpu hands the Vulkan device out through an unsafe function only")]
fn vulkan_subpixel_bits(device: &wgpu::Device) -> Option<u32> {
    // SAFETY: nothing is destroyed or changed; the instance outlives `device`, whose guard is held while it is asked.
    unsafe {
        let device = device.as_hal::<wgpu::hal::api::Vulkan>()?;
        let instance = device.shared_instance().raw_instance();
        let properties = instance.get_physical_device_properties(device.raw_physical_device());
        Some(properties.limits.sub_pixel_precision_bits)
    }
}

/// wgpu has Vulkan elsewhere only on request.
#[cfg(not(any(windows, target_os = "linux", target_os = "android", target_os = "freebsd")))]
fn vulkan_subpixel_bits(_: &wgpu::Device) -> Option<u32> {
    None
}

/// Keep the first failure: later ones follow from it.
fn note(failure: &Mutex<Option<String>>, reason: String) {
    failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
}

pub(crate) fn device_error(reason: String) -> ExecuteError {
    ExecuteError::Device { executor: EXECUTOR, reason }
}

fn from_wgpu(error: &wgpu::Error) -> ExecuteError {
    match error {
        wgpu::Error::OutOfMemory { source } => {
            ExecuteError::OutOfMemory { executor: EXECUTOR, reason: one_line(&source.to_string()) }
        }
        _ => device_error(one_line(&error.to_string())),
    }
}

/// wgpu's messages are trees over many lines; errors of ours are one line.
pub(crate) fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && *line != "Caused by:");
    lines.collect::<Vec<_>>().join(": ")
}

#[cfg(test)]
mod tests {
    use super::one_line;

    #[test]
    fn messages_become_one_line() {
        let text =
            "Validation Error\n\nCaused by:\n  In Device::create_buffer\n    Buffer size 9 is too large\n";
        assert_eq!(one_line(text), "Validation Error: In Device::create_buffer: Buffer size 9 is too large");
    }
}
