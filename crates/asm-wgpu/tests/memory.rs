//! A device that has no memory left: wgpu on Vulkan, with the function that allocates replaced by one that can refuse.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(unsafe_code, reason = "a device that is made by hand, to be spoiled")]

mod device;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use std::cell::Cell;
use std::ffi::c_void;
use std::mem::transmute;

use ash::vk;
use asm_wgpu::WgpuExecutor;
use device::words;
use frame_plan::{ExecuteError, Executor, PassSet, Resource};
use passes::*;
use pollster::block_on;
use wgpu::hal::api::Vulkan;

thread_local! {
    static NO_MEMORY: Cell<bool> = const { Cell::new(false) };
    static ALLOCATE: Cell<*const c_void> = const { Cell::new(std::ptr::null()) };
}

unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    callbacks: *const vk::AllocationCallbacks<'_>,
    memory: *mut vk::DeviceMemory,
) -> vk::Result {
    if NO_MEMORY.get() {
        return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    }
    // SAFETY: the caller's call, passed on to the function it was meant for.
    unsafe {
        transmute::<*const c_void, vk::PFN_vkAllocateMemory>(ALLOCATE.get())(device, info, callbacks, memory)
    }
}

/// A device whose every allocation may fail; none if there is no device and skipping is allowed.
fn spoilable() -> Option<(wgpu::Instance, wgpu::Device, wgpu::Queue)> {
    // The same rule for skipping as everywhere.
    device::executor(PassSet(&[]))?;
    let instance = wgpu::Instance::default();
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).unwrap();
    let wanted = wgpu::DeviceDescriptor {
        // Blocks so small that what is large has an allocation of its own.
        memory_hints: wgpu::MemoryHints::MemoryUsage,
        ..asm_wgpu::device_descriptor(&adapter)
    };
    // SAFETY: a device of the adapter with the extensions and features that wgpu itself would ask for; its functions are the
    // device's own, or call them.
    let open = unsafe {
        let adapter = adapter.as_hal::<Vulkan>().expect("wgpu runs on Vulkan here");
        let extensions = adapter.required_device_extensions(wanted.required_features);
        let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(0).queue_priorities(&[1.0])];
        let create =
            vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
        let mut features = adapter.physical_device_features(&extensions, wanted.required_features);
        let create = features.add_to_device_create(create);
        let vulkan = adapter.shared_instance().raw_instance();
        let device = vulkan.create_device(adapter.raw_physical_device(), &create, None).unwrap();
        let spoiled = ash::Device::load_with(
            |name| {
                let found = vulkan.get_device_proc_addr(device.handle(), name.as_ptr());
                let found = found.map_or(std::ptr::null(), |f| f as *const c_void);
                if name.to_bytes() != b"vkAllocateMemory" {
                    return found;
                }
                ALLOCATE.set(found);
                allocate as *const c_void
            },
            device.handle(),
        );
        let (features, limits) = (wanted.required_features, &wanted.required_limits);
        adapter
            .device_from_raw(spoiled, None, &extensions, features, limits, &wanted.memory_hints, 0, 0)
            .unwrap()
    };
    // SAFETY: the device is the adapter's.
    let (device, queue) = unsafe { adapter.create_device_from_hal(open, &wanted) }.unwrap();
    Some((instance, device, queue))
}

#[test]
fn running_out_of_memory_is_an_error_that_leaves_nothing_behind() {
    let Some((instance, device, queue)) = spoilable() else { return };
    let mut gpu = WgpuExecutor::from_host(device.clone(), queue, PASSES);
    let live = || {
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let hub = instance.generate_report().unwrap().hub;
        [hub.buffers.num_allocated, hub.textures.num_allocated, hub.bind_groups.num_allocated]
    };
    assert_eq!(words(&device::run(&mut gpu, &scale_plan(), "output"))[9], 34);
    // The last plan goes before the next one comes.
    let mut none = scale_plan();
    none.resources.clear();
    none.steps.clear();
    none.params.clear();
    gpu.prepare(&none).unwrap();
    let before = live();
    let mut plan = scale_plan();
    plan.add_resource(Resource::buffer("large", 100 << 20));
    NO_MEMORY.set(true);
    match gpu.prepare(&plan).unwrap_err() {
        ExecuteError::OutOfMemory { executor, reason } => {
            assert_eq!(executor, "wgpu");
            assert!(reason.contains("large"), "{reason}");
        }
        other => panic!("{other}"),
    }
    NO_MEMORY.set(false);
    assert_eq!(live(), before, "what was made is gone again");
    // The same plan, now that there is memory.
    assert_eq!(words(&device::run(&mut gpu, &plan, "output"))[9], 34);
    assert_ne!(live(), before);
}
