//! Vulkan objects that know their device, destroy themselves and are counted.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError};

use ash::vk;
use frame_plan::{ExecuteError, Made};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use crate::device::Gpu;

/// Kinds of object, as they are counted.
const KINDS: [&str; 11] = [
    "buffers",
    "images",
    "image views",
    "samplers",
    "descriptor pools",
    "descriptor set layouts",
    "pipeline layouts",
    "pipelines",
    "pipeline caches",
    "command pools",
    "query pools",
];

/// How many objects of each kind were made and live, and what memory was taken.
#[derive(Default)]
pub(crate) struct ObjectCounts {
    live: [AtomicUsize; KINDS.len()],
    made: [AtomicU64; KINDS.len()],
    bytes: AtomicU64,
}

impl ObjectCounts {
    fn index(kind: &str) -> usize {
        KINDS.iter().position(|k| *k == kind).expect("one of the kinds")
    }

    fn add(&self, kind: &str) {
        self.live[Self::index(kind)].fetch_add(1, Ordering::Relaxed);
        self.made[Self::index(kind)].fetch_add(1, Ordering::Relaxed);
    }

    fn remove(&self, kind: &str) {
        self.live[Self::index(kind)].fetch_sub(1, Ordering::Relaxed);
    }

    /// Live objects.
    pub(crate) fn live(&self) -> Vec<(&'static str, usize)> {
        KINDS.iter().zip(&self.live).map(|(kind, count)| (*kind, count.load(Ordering::Relaxed))).collect()
    }

    /// What was made so far.
    pub(crate) fn made(&self) -> Made {
        let of = |kind: &str| self.made[Self::index(kind)].load(Ordering::Relaxed);
        Made {
            pipelines: of("pipelines"),
            buffers: of("buffers"),
            textures: of("images"),
            bindings: of("image views") + of("samplers") + of("descriptor pools") + of("query pools"),
            bytes: self.bytes.load(Ordering::Relaxed),
        }
    }
}

/// What [`Owned`] can hold.
pub(crate) trait Object: Copy {
    const KIND: &'static str;

    /// # Safety
    /// The object is the device's, nothing pending uses it, and it is not used again.
    unsafe fn destroy(self, device: &ash::Device);
}

macro_rules! object {
    ($($type:ty, $kind:literal, $destroy:ident;)*) => {
        $(impl Object for $type {
            const KIND: &'static str = $kind;

            unsafe fn destroy(self, device: &ash::Device) {
                // SAFETY: as the trait demands.
                unsafe { device.$destroy(self, None) }
            }
        })*
    };
}

object! {
    vk::Buffer, "buffers", destroy_buffer;
    vk::Image, "images", destroy_image;
    vk::ImageView, "image views", destroy_image_view;
    vk::Sampler, "samplers", destroy_sampler;
    vk::DescriptorPool, "descriptor pools", destroy_descriptor_pool;
    vk::DescriptorSetLayout, "descriptor set layouts", destroy_descriptor_set_layout;
    vk::PipelineLayout, "pipeline layouts", destroy_pipeline_layout;
    vk::Pipeline, "pipelines", destroy_pipeline;
    vk::PipelineCache, "pipeline caches", destroy_pipeline_cache;
    vk::CommandPool, "command pools", destroy_command_pool;
    vk::QueryPool, "query pools", destroy_query_pool;
}

/// An object that is destroyed with its owner, who has waited for the device before.
pub(crate) struct Owned<T: Object> {
    gpu: Arc<Gpu>,
    raw: T,
}

impl<T: Object> Owned<T> {
    /// Take over an object just created from the device.
    pub(crate) fn new(gpu: &Arc<Gpu>, raw: T) -> Self {
        gpu.objects.add(T::KIND);
        Self { gpu: Arc::clone(gpu), raw }
    }

    pub(crate) const fn raw(&self) -> T {
        self.raw
    }
}

impl<T: Object> Drop for Owned<T> {
    fn drop(&mut self) {
        self.gpu.objects.remove(T::KIND);
        // SAFETY: `new` was given an object of this device, `self` was its only owner, and owners wait for the device before
        // they let go of what it may use.
        unsafe { self.raw.destroy(&self.gpu.device) }
    }
}

/// Memory of a buffer or an image; goes after the object that lies in it.
struct Memory {
    gpu: Arc<Gpu>,
    allocation: Option<Allocation>,
}

impl Memory {
    fn new(gpu: &Arc<Gpu>, request: &AllocationCreateDesc<'_>) -> Result<Self, ExecuteError> {
        let mut allocator = gpu.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        let allocation = allocator.allocate(request).map_err(|e| {
            let bytes = request.requirements.size;
            gpu.allocation_error(&e, &format!("allocating {bytes} bytes for {:?}", request.name))
        })?;
        gpu.objects.bytes.fetch_add(allocation.size(), Ordering::Relaxed);
        Ok(Self { gpu: Arc::clone(gpu), allocation: Some(allocation) })
    }

    fn get(&self) -> &Allocation {
        self.allocation.as_ref().expect("taken on drop only")
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        let mut allocator = self.gpu.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(allocation) = self.allocation.take() {
            // It fails only for memory of another allocator.
            let _ = allocator.free(allocation);
        }
    }
}

/// A buffer and its memory.
pub(crate) struct Buffer {
    // Fields drop in this order.
    raw: Owned<vk::Buffer>,
    memory: Memory,
    pub(crate) size: u64,
}

impl Buffer {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        name: &str,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self, ExecuteError> {
        let create = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the size is above 0 and within the device's limits, which plans were checked against.
        let raw = unsafe { gpu.device.create_buffer(&create, None) }
            .map_err(|e| gpu.error(e, &format!("creating the buffer {name:?} of {size} bytes")))?;
        let raw = Owned::new(gpu, raw);
        // SAFETY: the buffer is the device's, here and below.
        let requirements = unsafe { gpu.device.get_buffer_memory_requirements(raw.raw()) };
        let memory = Memory::new(
            gpu,
            &AllocationCreateDesc {
                name,
                requirements,
                location,
                linear: true,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            },
        )?;
        // SAFETY: the memory was allocated for this buffer's requirements, and nothing is bound to either.
        unsafe { gpu.device.bind_buffer_memory(raw.raw(), memory.get().memory(), memory.get().offset()) }
            .map_err(|e| gpu.error(e, &format!("binding memory to {name:?}")))?;
        Ok(Self { raw, memory, size })
    }

    pub(crate) const fn raw(&self) -> vk::Buffer {
        self.raw.raw()
    }

    /// What the host sees of a buffer in mapped memory. The device must be done with it.
    pub(crate) fn mapped(&self) -> Result<&[u8], ExecuteError> {
        let bytes = self.memory.get().mapped_slice();
        bytes.map(|b| &b[..self.size as usize]).ok_or_else(not_mapped)
    }

    /// As [`Buffer::mapped`], for writing.
    pub(crate) fn mapped_mut(&mut self) -> Result<&mut [u8], ExecuteError> {
        let size = self.size as usize;
        let bytes = self.memory.allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        bytes.map(|b| &mut b[..size]).ok_or_else(not_mapped)
    }
}

fn not_mapped() -> ExecuteError {
    crate::device::device_error("memory that should be mapped is not".into())
}

/// An image and its memory.
pub(crate) struct Image {
    // Fields drop in this order.
    raw: Owned<vk::Image>,
    _memory: Memory,
}

impl Image {
    pub(crate) fn new(
        gpu: &Arc<Gpu>,
        name: &str,
        create: &vk::ImageCreateInfo<'_>,
    ) -> Result<Self, ExecuteError> {
        // SAFETY: size, layers and levels are within the device's limits, which plans were checked against.
        let raw = unsafe { gpu.device.create_image(create, None) }
            .map_err(|e| gpu.error(e, &format!("creating the image {name:?}")))?;
        let raw = Owned::new(gpu, raw);
        // SAFETY: the image is the device's, here and below.
        let requirements = unsafe { gpu.device.get_image_memory_requirements(raw.raw()) };
        let memory = Memory::new(
            gpu,
            &AllocationCreateDesc {
                name,
                requirements,
                location: MemoryLocation::GpuOnly,
                linear: false,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            },
        )?;
        // SAFETY: the memory was allocated for this image's requirements, and nothing is bound to either.
        unsafe { gpu.device.bind_image_memory(raw.raw(), memory.get().memory(), memory.get().offset()) }
            .map_err(|e| gpu.error(e, &format!("binding memory to {name:?}")))?;
        Ok(Self { raw, _memory: memory })
    }

    pub(crate) const fn raw(&self) -> vk::Image {
        self.raw.raw()
    }
}

/// A command pool with one command buffer, which is recorded anew each time.
pub(crate) struct Commands {
    pool: Owned<vk::CommandPool>,
    buffer: vk::CommandBuffer,
}

impl Commands {
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Result<Self, ExecuteError> {
        let create = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.queue_family);
        // SAFETY: the device has queues of this family.
        let pool = unsafe { gpu.device.create_command_pool(&create, None) }
            .map_err(|e| gpu.error(e, "creating a command pool"))?;
        let pool = Owned::new(gpu, pool);
        let allocate =
            vk::CommandBufferAllocateInfo::default().command_pool(pool.raw()).command_buffer_count(1);
        // SAFETY: the pool is the device's.
        let buffers = unsafe { gpu.device.allocate_command_buffers(&allocate) }
            .map_err(|e| gpu.error(e, "allocating a command buffer"))?;
        Ok(Self { pool, buffer: buffers[0] })
    }

    /// Begin the command buffer, which is not pending, anew.
    pub(crate) fn begin(&self, gpu: &Gpu) -> Result<vk::CommandBuffer, ExecuteError> {
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the pool's only command buffer is not pending, as the callers see to; it is reset before it begins.
        unsafe {
            gpu.device
                .reset_command_pool(self.pool.raw(), vk::CommandPoolResetFlags::empty())
                .and_then(|()| gpu.device.begin_command_buffer(self.buffer, &begin))
        }
        .map_err(|e| gpu.error(e, "beginning a command buffer"))?;
        Ok(self.buffer)
    }

    /// Submit the command buffer begun before; returns the timeline's value at its end.
    pub(crate) fn end(&self, gpu: &Gpu) -> Result<u64, ExecuteError> {
        // SAFETY: the command buffer is being recorded, outside of any rendering.
        unsafe { gpu.device.end_command_buffer(self.buffer) }
            .map_err(|e| gpu.error(e, "recording a frame"))?;
        gpu.submit(self.buffer)
    }

    /// Record into the command buffer, which is not pending, and submit it; returns the timeline's value at its end.
    pub(crate) fn submit(
        &self,
        gpu: &Gpu,
        record: impl FnOnce(vk::CommandBuffer) -> Result<(), ExecuteError>,
    ) -> Result<u64, ExecuteError> {
        record(self.begin(gpu)?)?;
        self.end(gpu)
    }
}
