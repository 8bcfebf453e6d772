//! A host application: it owns instance, device, queue and images, listens to the validation layer, and can spoil what the executor
//! asks of Vulkan, as a control.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]
#![allow(unsafe_code, reason = "a host calls Vulkan itself, and demands of the executor what it promises")]

// Its instance is validated as the executor's own, and its images are made as an application's.
#[path = "../../examples/vulkan_host/resources.rs"]
mod resources;
#[path = "../../src/validation.rs"]
mod validation;

use std::cell::Cell;
use std::ffi::{CStr, c_void};
use std::mem::transmute;
use std::sync::{Arc, Mutex};

use asm_vulkan::ash::{self, ext, vk};
use asm_vulkan::{HostBuffer, HostImage, VulkanExecutor, VulkanHost};
use frame_plan::spirv::SpirvPasses;
use validation::Messenger;

use crate::device;

/// Frames that a host lets be unfinished: it waits for each of its own.
const FRAMES_IN_FLIGHT: u32 = 1;

type Messages = Arc<Mutex<Vec<String>>>;

pub struct Host {
    _entry: ash::Entry,
    instance: ash::Instance,
    messenger: Option<Messenger>,
    messages: Messages,
    physical: vk::PhysicalDevice,
    memory: vk::PhysicalDeviceMemoryProperties,
    pub device: ash::Device,
    queue: vk::Queue,
    robust: bool,
    pool: vk::CommandPool,
    images: Mutex<Vec<(vk::Image, vk::ImageView, vk::DeviceMemory)>>,
    buffers: Mutex<Vec<(vk::Buffer, vk::DeviceMemory)>>,
}

impl Host {
    /// None if there is no device and skipping is allowed. `robust` lets the device keep accesses inside buffers, if it can.
    pub fn new(robust: bool) -> Option<Self> {
        // The same rule for skipping as everywhere, and the same device.
        let wanted = device::executor(frame_plan::PassSet(&[]))?;
        let name = frame_plan::Executor::info(&wanted).device.clone();
        drop(wanted);
        let validated = device::validation();
        let messages = Messages::default();
        // SAFETY, for all of this function: the calls follow Vulkan's rules, and the layer checks that they do.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let instance = validation::create_instance(&entry, c"host", validated).unwrap();
            let messenger = validated.then(|| {
                let messages = Arc::clone(&messages);
                let hear = Box::new(move |message| messages.lock().unwrap().push(message));
                Messenger::new(&entry, &instance, hear).unwrap()
            });
            let physical = instance
                .enumerate_physical_devices()
                .unwrap()
                .into_iter()
                .find(|&p| {
                    let properties = instance.get_physical_device_properties(p);
                    properties.device_name_as_c_str().is_ok_and(|n| n.to_string_lossy() == name)
                })
                .unwrap();
            let known = instance.enumerate_device_extension_properties(physical).unwrap();
            let robustness2 =
                |e: &vk::ExtensionProperties| e.extension_name_as_c_str() == Ok(ext::robustness2::NAME);
            let robust = robust && known.iter().any(robustness2);
            let queues =
                [vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0])];
            let core = vk::PhysicalDeviceFeatures {
                robust_buffer_access: vk::TRUE,
                fragment_stores_and_atomics: vk::TRUE,
                ..Default::default()
            };
            let (mut features12, mut features13) = VulkanHost::required_features();
            let mut robust2 = vk::PhysicalDeviceRobustness2FeaturesEXT::default().robust_buffer_access2(true);
            let device_extensions = [ext::robustness2::NAME.as_ptr()];
            let mut create = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_features(&core)
                .push_next(&mut features12)
                .push_next(&mut features13);
            if robust {
                create = create.enabled_extension_names(&device_extensions).push_next(&mut robust2);
            }
            let device = instance.create_device(physical, &create, None).unwrap();
            let queue = device.get_device_queue(0, 0);
            let create = vk::CommandPoolCreateInfo::default();
            let pool = device.create_command_pool(&create, None).unwrap();
            Some(Self {
                _entry: entry,
                memory: instance.get_physical_device_memory_properties(physical),
                instance,
                messenger,
                messages,
                physical,
                device,
                queue,
                robust,
                pool,
                images: Mutex::default(),
                buffers: Mutex::default(),
            })
        }
    }

    /// Whether the validation layer listens.
    pub fn is_validated(&self) -> bool {
        self.messenger.is_some()
    }

    /// What the validation layer has said since this was last asked.
    pub fn messages(&self) -> Vec<String> {
        std::mem::take(&mut self.messages.lock().unwrap())
    }

    /// What an executor needs to know; its calls of some functions can be spoiled.
    pub fn lend(&self) -> VulkanHost {
        let device_fn = |name: &CStr| {
            // SAFETY: the device is alive, the name ends with 0.
            let found = unsafe { self.instance.get_device_proc_addr(self.device.handle(), name.as_ptr()) };
            spoiled(name, found.map_or(std::ptr::null(), |f| f as *const c_void))
        };
        VulkanHost {
            instance: self.instance.clone(),
            physical_device: self.physical,
            // SAFETY: the functions are the device's own, or call them.
            device: unsafe { ash::Device::load_with(device_fn, self.device.handle()) },
            queue: self.queue,
            queue_family: 0,
            frames_in_flight: FRAMES_IN_FLIGHT,
            robust_buffer_access2: self.robust,
            fragment_stores_and_atomics: true,
        }
    }

    pub fn executor(&self, passes: SpirvPasses) -> VulkanExecutor {
        // SAFETY: the host outlives its executors, and uses its queue when no method of theirs runs.
        unsafe { VulkanExecutor::from_host(self.lend(), passes) }.unwrap()
    }

    /// Record a command buffer, submit it and wait for it.
    pub fn frame(&self, record: impl FnOnce(vk::CommandBuffer)) {
        // SAFETY: a pool of this device, whose command buffers are done when the function returns.
        unsafe {
            let allocate =
                vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
            let commands = self.device.allocate_command_buffers(&allocate).unwrap();
            self.device.begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default()).unwrap();
            record(commands[0]);
            self.device.end_command_buffer(commands[0]).unwrap();
            let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
            self.device.queue_submit(self.queue, &submit, vk::Fence::null()).unwrap();
            self.device.queue_wait_idle(self.queue).unwrap();
            self.device.free_command_buffers(self.pool, &commands);
        }
    }

    /// An image with a view, in a layout it stays in between frames; its contents are undefined.
    pub fn image(&self, format: vk::Format, size: [u32; 2], usage: vk::ImageUsageFlags) -> HostImage {
        // SAFETY: the memory is the device's, and every image can have the layout.
        let (image, view) = unsafe {
            let (image, memory) = resources::image(&self.device, &self.memory, format, size, usage).unwrap();
            let viewable = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED;
            let view = if usage.intersects(viewable) {
                resources::view(&self.device, image, format).unwrap()
            } else {
                vk::ImageView::null()
            };
            self.images.lock().unwrap().push((image, view, memory));
            let barrier = [vk::ImageMemoryBarrier::default()
                .old_layout(vk::ImageLayout::UNDEFINED)
                .new_layout(vk::ImageLayout::GENERAL)
                .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                .image(image)
                .subresource_range(resources::WHOLE_IMAGE)];
            self.frame(|commands| {
                let all = vk::PipelineStageFlags::ALL_COMMANDS;
                self.device.cmd_pipeline_barrier(
                    commands,
                    all,
                    all,
                    vk::DependencyFlags::empty(),
                    &[],
                    &[],
                    &barrier,
                );
            });
            (image, view)
        };
        HostImage {
            image,
            view: (view != vk::ImageView::null()).then_some(view),
            format,
            size,
            layers: 1,
            mips: 1,
            usage,
            layout_before: vk::ImageLayout::GENERAL,
            layout_after: vk::ImageLayout::GENERAL,
        }
    }

    /// A buffer that holds these words.
    pub fn buffer(&self, words: &[u32], usage: vk::BufferUsageFlags) -> HostBuffer {
        let bytes: &[u8] = bytemuck::cast_slice(words);
        let size_bytes = bytes.len() as u64;
        // SAFETY: the memory is the device's; where it is mapped there is room for the bytes.
        let buffer = unsafe {
            let (buffer, memory) =
                resources::mappable_buffer(&self.device, &self.memory, size_bytes, usage).unwrap();
            let mapped = self.device.map_memory(memory, 0, size_bytes, vk::MemoryMapFlags::empty()).unwrap();
            std::ptr::copy_nonoverlapping(bytes.as_ptr(), mapped.cast(), bytes.len());
            self.device.unmap_memory(memory);
            self.buffers.lock().unwrap().push((buffer, memory));
            buffer
        };
        HostBuffer { buffer, size_bytes, usage }
    }

    /// Copy an image to another of its size and bytes per texel.
    pub fn copy_image(&self, from: &HostImage, to: &HostImage) {
        let layer = vk::ImageSubresourceLayers {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            layer_count: 1,
            ..Default::default()
        };
        let region = vk::ImageCopy::default()
            .src_subresource(layer)
            .dst_subresource(layer)
            .extent(vk::Extent3D { width: from.size[0], height: from.size[1], depth: 1 });
        let general = vk::ImageLayout::GENERAL;
        self.frame(|commands| {
            // SAFETY: the commands are being recorded, both images are in this layout between frames.
            unsafe { self.device.cmd_copy_image(commands, from.image, general, to.image, general, &[region]) }
        });
    }
}

/// Destroying the device is a check, too: what an executor left behind is an error of validation.
impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: executors are gone, and nothing is pending.
        unsafe {
            self.device.device_wait_idle().unwrap();
            for (image, view, memory) in self.images.lock().unwrap().drain(..) {
                self.device.destroy_image_view(view, None);
                self.device.destroy_image(image, None);
                self.device.free_memory(memory, None);
            }
            for (buffer, memory) in self.buffers.lock().unwrap().drain(..) {
                self.device.destroy_buffer(buffer, None);
                self.device.free_memory(memory, None);
            }
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            let messages = self.messages();
            self.messenger = None;
            self.instance.destroy_instance(None);
            if !std::thread::panicking() {
                assert_eq!(messages, [""; 0], "validation");
            }
        }
    }
}

/// What is spoiled of the calls in this thread.
#[derive(Clone, Copy, Default)]
pub struct Spoil {
    /// Leave this barrier out, counted from when it was set.
    pub barrier: Option<usize>,
    /// Lose the device at the next submission.
    pub lose_device: bool,
    /// Have no memory.
    pub no_memory: bool,
}

thread_local! {
    static SPOIL: Cell<Spoil> = Cell::default();
    static BARRIERS: Cell<usize> = const { Cell::new(0) };
    static ORIGINALS: Cell<[*const c_void; 3]> = const { Cell::new([std::ptr::null(); 3]) };
}

/// Spoil from now on; the count of barriers starts anew.
pub fn spoil(spoil: Spoil) {
    SPOIL.set(spoil);
    BARRIERS.set(0);
}

/// Barriers recorded since [`spoil`].
pub fn barriers() -> usize {
    BARRIERS.get()
}

/// The function that executors get for one of the device's.
fn spoiled(name: &CStr, original: *const c_void) -> *const c_void {
    let (index, ours) = match name.to_bytes() {
        b"vkCmdPipelineBarrier2" => (0, barrier as *const c_void),
        b"vkQueueSubmit2" => (1, submit as *const c_void),
        b"vkAllocateMemory" => (2, allocate as *const c_void),
        _ => return original,
    };
    let mut originals = ORIGINALS.get();
    originals[index] = original;
    ORIGINALS.set(originals);
    ours
}

unsafe extern "system" fn barrier(commands: vk::CommandBuffer, dependency: *const vk::DependencyInfo<'_>) {
    let count = BARRIERS.replace(BARRIERS.get() + 1);
    if SPOIL.get().barrier != Some(count) {
        // SAFETY: the caller's call, passed on to the function it was meant for.
        unsafe {
            transmute::<*const c_void, vk::PFN_vkCmdPipelineBarrier2>(ORIGINALS.get()[0])(
                commands, dependency,
            )
        }
    }
}

unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    if SPOIL.get().lose_device {
        return vk::Result::ERROR_DEVICE_LOST;
    }
    // SAFETY: as in `barrier`.
    unsafe {
        transmute::<*const c_void, vk::PFN_vkQueueSubmit2>(ORIGINALS.get()[1])(queue, count, submits, fence)
    }
}

unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    callbacks: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    if SPOIL.get().no_memory {
        return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    }
    // SAFETY: as in `barrier`.
    unsafe {
        transmute::<*const c_void, vk::PFN_vkAllocateMemory>(ORIGINALS.get()[2])(
            device, info, callbacks, memory,
        )
    }
}
