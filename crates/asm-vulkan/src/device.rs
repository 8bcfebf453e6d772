//! A device with its errors and its memory: nothing that Vulkan reports goes unseen, and nothing panics.

use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, vk};
use frame_plan::{DeviceInfo, DeviceType, ExecuteError, Limits, memory};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use gpu_allocator::{AllocationError, AllocationSizes, AllocatorDebugSettings};

use crate::adapter::{Adapter, Instance, device_info, has_extension, no_device};
use crate::object::ObjectCounts;

/// Executor id.
pub(crate) const EXECUTOR: &str = "vulkan";

/// Memory is taken from the device in blocks that grow from the first to the second of these sizes.
const DEVICE_BLOCK_BYTES: (u64, u64) = (16 << 20, 256 << 20);
/// The same for memory that the host maps.
const HOST_BLOCK_BYTES: (u64, u64) = (4 << 20, 64 << 20);

/// What failed outside of any call, such as the loss of the device.
#[derive(Default)]
pub(crate) struct Failure(Mutex<Option<String>>);

impl Failure {
    /// Keep the first: later ones follow from it.
    pub(crate) fn note(&self, reason: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
    }

    fn check(&self) -> Result<(), ExecuteError> {
        match &*self.0.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(reason) => Err(device_error(reason.clone())),
            None => Ok(()),
        }
    }
}

/// What a host application hands over: its device, and what it enabled there.
///
/// The device has Vulkan 1.3 with the features of [`VulkanHost::required_features`].
#[derive(Clone)]
pub struct VulkanHost {
    /// The instance that `physical_device` comes from.
    pub instance: ash::Instance,
    /// What `device` was made of.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// A queue that draws and computes.
    pub queue: vk::Queue,
    /// Its family.
    pub queue_family: u32,
    /// How many frames the host lets be unfinished at once; at least 1.
    pub frames_in_flight: u32,
    /// The feature `robustBufferAccess2` of `VK_EXT_robustness2` is enabled; without it shaders clamp their indices.
    pub robust_buffer_access2: bool,
    /// The feature `fragmentStoresAndAtomics` is enabled, which plans need whose draws write buffers.
    pub fragment_stores_and_atomics: bool,
}

impl VulkanHost {
    /// What a host enables when it creates its device, along with features of its own: `timelineSemaphore`, `synchronization2`,
    /// `dynamicRendering`, `robustImageAccess` and `shaderZeroInitializeWorkgroupMemory`, which every device of Vulkan 1.3 has.
    pub fn required_features()
    -> (vk::PhysicalDeviceVulkan12Features<'static>, vk::PhysicalDeviceVulkan13Features<'static>) {
        let features12 = vk::PhysicalDeviceVulkan12Features::default().timeline_semaphore(true);
        let features13 = vk::PhysicalDeviceVulkan13Features::default()
            .synchronization2(true)
            .dynamic_rendering(true)
            .robust_image_access(true)
            .shader_zero_initialize_workgroup_memory(true);
        (features12, features13)
    }
}

/// Device and queue, ours or a host's.
pub(crate) struct Gpu {
    pub(crate) device: ash::Device,
    pub(crate) instance: ash::Instance,
    pub(crate) physical: vk::PhysicalDevice,
    pub(crate) queue: vk::Queue,
    pub(crate) queue_family: u32,
    pub(crate) info: DeviceInfo,
    pub(crate) limits: Limits,
    pub(crate) properties: vk::PhysicalDeviceLimits,
    /// Identifies driver and device to compiled pipelines.
    pub(crate) pipeline_cache_uuid: [u8; vk::UUID_SIZE],
    /// Bits of a timestamp that count; 0 if the queue has none.
    pub(crate) timestamp_bits: u32,
    pub(crate) robust_buffers: bool,
    pub(crate) fragment_writes: bool,
    /// Objects by kind.
    pub(crate) objects: Arc<ObjectCounts>,
    pub(crate) allocator: ManuallyDrop<Mutex<Allocator>>,
    /// Counts submissions.
    timeline: vk::Semaphore,
    submitted: AtomicU64,
    failure: Arc<Failure>,
    /// Ours; none if the device is a host's.
    owned: Option<Instance>,
}

impl Gpu {
    /// Open a device of our own.
    pub(crate) fn open(instance: Instance, adapter: &Adapter) -> Result<Arc<Self>, ExecuteError> {
        let robustness2 = has_extension(&instance.raw, adapter.physical, ext::robustness2::NAME);
        let mut robust = vk::PhysicalDeviceRobustness2FeaturesEXT::default();
        let mut can12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut can13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut can = vk::PhysicalDeviceFeatures2::default().push_next(&mut can12).push_next(&mut can13);
        if robustness2 {
            can = can.push_next(&mut robust);
        }
        // SAFETY: the device comes from this instance; the structures in the chain are ones it knows.
        unsafe { instance.raw.get_physical_device_features2(adapter.physical, &mut can) };
        let can = can.features;
        for (name, has) in [
            ("timelineSemaphore", can12.timeline_semaphore),
            ("synchronization2", can13.synchronization2),
            ("dynamicRendering", can13.dynamic_rendering),
            ("robustImageAccess", can13.robust_image_access),
            ("shaderZeroInitializeWorkgroupMemory", can13.shader_zero_initialize_workgroup_memory),
        ] {
            if has == vk::FALSE {
                return Err(no_device(format!("{} lacks the feature {name}", adapter.info.device)));
            }
        }
        let robust_buffers = robust.robust_buffer_access2 == vk::TRUE;
        let fragment_writes = can.fragment_stores_and_atomics == vk::TRUE;

        let features = vk::PhysicalDeviceFeatures {
            robust_buffer_access: vk::TRUE,
            fragment_stores_and_atomics: can.fragment_stores_and_atomics,
            draw_indirect_first_instance: can.draw_indirect_first_instance,
            ..vk::PhysicalDeviceFeatures::default()
        };
        let (mut features12, mut features13) = VulkanHost::required_features();
        let mut robust2 = vk::PhysicalDeviceRobustness2FeaturesEXT::default()
            .robust_buffer_access2(robust_buffers)
            .robust_image_access2(robust.robust_image_access2 == vk::TRUE);
        let queue = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(adapter.queue_family)
            .queue_priorities(&[1.0])];
        let extensions = [ext::robustness2::NAME.as_ptr()];
        let mut create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queue)
            .enabled_features(&features)
            .push_next(&mut features12)
            .push_next(&mut features13);
        if robustness2 {
            create = create.enabled_extension_names(&extensions).push_next(&mut robust2);
        }
        // SAFETY: only features and extensions that the device has are asked for, and one queue of a family it has.
        let device = unsafe { instance.raw.create_device(adapter.physical, &create, None) }
            .map_err(|e| no_device(format!("{} gives no device: {e}", adapter.info.device)))?;
        // SAFETY: the queue was just created with the device.
        let queue = unsafe { device.get_device_queue(adapter.queue_family, 0) };
        let host = VulkanHost {
            instance: instance.raw.clone(),
            physical_device: adapter.physical,
            device,
            queue,
            queue_family: adapter.queue_family,
            frames_in_flight: 1,
            robust_buffer_access2: robust_buffers,
            fragment_stores_and_atomics: fragment_writes,
        };
        Self::new(host, Some(instance))
    }

    /// Use a host's device.
    pub(crate) fn of_host(host: VulkanHost) -> Result<Arc<Self>, ExecuteError> {
        Self::new(host, None)
    }

    fn new(host: VulkanHost, owned: Option<Instance>) -> Result<Arc<Self>, ExecuteError> {
        let VulkanHost { instance, physical_device: physical, device, queue, queue_family, .. } = host;
        let (info, _) = device_info(&instance, physical);
        let mut maintenance3 = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut maintenance4 = vk::PhysicalDeviceMaintenance4Properties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut maintenance3)
            .push_next(&mut maintenance4);
        // SAFETY: the device comes from this instance and has Vulkan 1.3, which knows both structures.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
        let properties = properties.properties;
        // SAFETY: as above.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let limits = Limits {
            max_texture_size: properties
                .limits
                .max_image_dimension2_d
                .min(properties.limits.max_framebuffer_width),
            max_storage_binding_bytes: u64::from(properties.limits.max_storage_buffer_range),
            max_buffer_bytes: maintenance3.max_memory_allocation_size.min(maintenance4.max_buffer_size),
            max_groups_per_dimension: properties
                .limits
                .max_compute_work_group_count
                .into_iter()
                .min()
                .unwrap_or_default(),
            max_total_bytes: match info.device_type {
                // These take the machine's memory, and software drivers hand out more than there is.
                DeviceType::Cpu | DeviceType::Integrated => memory::usable_bytes(),
                _ => device_memory(&instance, physical),
            },
        };
        let mut timeline = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let create = vk::SemaphoreCreateInfo::default().push_next(&mut timeline);
        let allocator = allocator(&instance, physical, &device).inspect_err(|_| {
            if owned.is_some() {
                // SAFETY: nothing was made from our own device, and it is not used again.
                unsafe { device.destroy_device(None) }
            }
        })?;
        // From here on `drop` cleans up.
        let mut gpu = Self {
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            info,
            limits,
            properties: properties.limits,
            pipeline_cache_uuid: properties.pipeline_cache_uuid,
            timestamp_bits: families.get(queue_family as usize).map_or(0, |f| f.timestamp_valid_bits),
            robust_buffers: host.robust_buffer_access2,
            fragment_writes: host.fragment_stores_and_atomics,
            objects: Arc::default(),
            timeline: vk::Semaphore::null(),
            submitted: AtomicU64::new(0),
            failure: owned.as_ref().map_or_else(Arc::default, |instance| Arc::clone(&instance.failure)),
            owned,
            instance,
            physical,
            device,
            queue,
            queue_family,
        };
        // SAFETY: the device has the feature.
        gpu.timeline = unsafe { gpu.device.create_semaphore(&create, None) }
            .map_err(|e| gpu.error(e, "creating a timeline semaphore"))?;
        Ok(Arc::new(gpu))
    }

    /// An error of ours for one of Vulkan's; the loss of the device is remembered.
    pub(crate) fn error(&self, result: vk::Result, doing: &str) -> ExecuteError {
        match result {
            vk::Result::ERROR_OUT_OF_HOST_MEMORY | vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                ExecuteError::OutOfMemory { executor: EXECUTOR, reason: doing.into() }
            }
            vk::Result::ERROR_DEVICE_LOST => {
                self.failure.note(format!("device lost while {doing}"));
                device_error(format!("device lost while {doing}"))
            }
            other => device_error(format!("{other} while {doing}")),
        }
    }

    /// An error of ours for one of the allocator's.
    pub(crate) fn allocation_error(&self, error: &AllocationError, doing: &str) -> ExecuteError {
        match error {
            AllocationError::OutOfMemory => {
                ExecuteError::OutOfMemory { executor: EXECUTOR, reason: doing.into() }
            }
            other => device_error(format!("{other} while {doing}")),
        }
    }

    /// Fail if something failed outside of any call.
    pub(crate) fn check(&self) -> Result<(), ExecuteError> {
        self.failure.check()
    }

    /// Submit a recorded command buffer and return the value that the timeline has when it is done.
    pub(crate) fn submit(&self, commands: vk::CommandBuffer) -> Result<u64, ExecuteError> {
        let value = self.submitted.load(Ordering::Relaxed) + 1;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.timeline)
            .value(value)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit =
            vk::SubmitInfo2::default().command_buffer_infos(&buffers).signal_semaphore_infos(&signals);
        // SAFETY: the commands are recorded and not pending: their owner waits for the value of their last submission. Queues
        // of hosts are not used by others meanwhile, as `VulkanExecutor::from_host` demands.
        unsafe { self.device.queue_submit2(self.queue, &[submit], vk::Fence::null()) }
            .map_err(|e| self.error(e, "submitting a frame"))?;
        self.submitted.store(value, Ordering::Relaxed);
        Ok(value)
    }

    /// Wait until the timeline has this value.
    pub(crate) fn wait(&self, value: u64) -> Result<(), ExecuteError> {
        let (semaphores, values) = ([self.timeline], [value]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is alive, and a submission that signals the value was made.
        unsafe { self.device.wait_semaphores(&wait, u64::MAX) }
            .map_err(|e| self.error(e, "waiting for a frame"))
    }

    /// Whether the timeline has this value.
    pub(crate) fn is_done(&self, value: u64) -> bool {
        // SAFETY: the semaphore is alive.
        unsafe { self.device.get_semaphore_counter_value(self.timeline) }.is_ok_and(|done| done >= value)
    }

    /// Wait for everything submitted, a host's own work included, before something is destroyed.
    pub(crate) fn idle(&self) {
        // SAFETY: the queue is alive and not used by others meanwhile, see `submit`.
        let result = unsafe { self.device.queue_wait_idle(self.queue) };
        if let Err(error) = result {
            // A lost device runs nothing, which is all that the callers need.
            let _ = self.error(error, "waiting for the queue");
        }
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: every object made from the device holds it, so they are all gone; our own device is not used again.
        // The allocator is taken once, here, and its memory goes before the device.
        unsafe {
            self.device.destroy_semaphore(self.timeline, None);
            ManuallyDrop::drop(&mut self.allocator);
            if self.owned.is_some() {
                self.device.destroy_device(None);
            }
        }
    }
}

fn allocator(
    instance: &ash::Instance,
    physical: vk::PhysicalDevice,
    device: &ash::Device,
) -> Result<Allocator, ExecuteError> {
    let sizes = AllocationSizes::new(DEVICE_BLOCK_BYTES.0, HOST_BLOCK_BYTES.0)
        .with_max_device_memblock_size(DEVICE_BLOCK_BYTES.1)
        .with_max_host_memblock_size(HOST_BLOCK_BYTES.1);
    Allocator::new(&AllocatorCreateDesc {
        instance: instance.clone(),
        device: device.clone(),
        physical_device: physical,
        debug_settings: AllocatorDebugSettings::default(),
        buffer_device_address: false,
        allocation_sizes: sizes,
    })
    .map_err(|e| device_error(format!("no memory allocator: {e}")))
}

/// Bytes of the largest heap that is the device's own.
fn device_memory(instance: &ash::Instance, physical: vk::PhysicalDevice) -> u64 {
    // SAFETY: the device comes from this instance.
    let memory = unsafe { instance.get_physical_device_memory_properties(physical) };
    let heaps = memory.memory_heaps_as_slice().iter();
    let local = heaps.filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
    local.map(|heap| heap.size).max().unwrap_or(u64::MAX)
}

pub(crate) fn device_error(reason: String) -> ExecuteError {
    ExecuteError::Device { executor: EXECUTOR, reason }
}
