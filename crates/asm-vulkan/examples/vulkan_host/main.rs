//! A host application that owns instance, device, queue and a target image, and puts caustics into its own frame.
//!
//! It has no window: at the end it writes what its image holds to a PNG file.
//! `cargo run -p asm-vulkan --example vulkan_host [SCENE] [FILE.png]`
#![allow(unsafe_code, reason = "a host calls Vulkan itself")]

mod resources;

use std::error::Error;

use asm_core::Settings;
use asm_vulkan::ash::{self, vk};
use asm_vulkan::{ASM_PASSES, AsmRenderer, DisplayPass, HostImage, VulkanExecutor, VulkanHost};
use spectral_core::display::{Display, ToneMap};

const SIZE: [u32; 2] = [640, 360];
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
const PICTURE_BYTES: u64 = SIZE[0] as u64 * SIZE[1] as u64 * 4;
const FRAMES: u64 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (mut scene, _) = spectral_scene::open(&arguments.next().unwrap_or_else(|| "sphere".into()))?;
    let file = arguments.next().unwrap_or_else(|| "host.png".into());

    // SAFETY, for all of this block: handles are the application's own and destroyed in the end, after the device is idle, those
    // that others are made from last; what the renderer demands is said at its calls.
    let pixels = unsafe {
        let host = Application::new()?;
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let (image, memory) = resources::image(&host.device, &host.memory, FORMAT, SIZE, usage)?;
        let view = resources::view(&host.device, image, FORMAT)?;
        let (staging, staging_memory) = resources::mappable_buffer(
            &host.device,
            &host.memory,
            PICTURE_BYTES,
            vk::BufferUsageFlags::TRANSFER_DST,
        )?;

        // Once: the executor gets the host's device and two frames that may be unfinished at once, the display draws into
        // targets of this format.
        let lent = VulkanHost {
            instance: host.instance.clone(),
            physical_device: host.physical,
            device: host.device.clone(),
            queue: host.queue,
            queue_family: host.queue_family,
            frames_in_flight: 2,
            robust_buffer_access2: false,
            fragment_stores_and_atomics: false,
        };
        let mut caustics = AsmRenderer::new(VulkanExecutor::from_host(lent, ASM_PASSES)?);
        let mut pass = DisplayPass::new(caustics.executor(), FORMAT)?;
        let display = Display { exposure: 2.0, tone_map: ToneMap::Reinhard { white: 8.0 } };
        let target = HostImage {
            image,
            view: Some(view),
            format: FORMAT,
            size: SIZE,
            layers: 1,
            mips: 1,
            usage,
            layout_before: vk::ImageLayout::UNDEFINED,
            layout_after: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        };
        // Every frame: something moves, the host's command buffer takes the caustics, and whatever the host draws before and
        // after them.
        for frame in 1..=FRAMES {
            // Two frames back must be finished, for its command buffer and for the renderer.
            host.wait(frame.saturating_sub(2))?;
            scene.cameras[0].world_from_camera.w_axis.x += 0.002;
            caustics.update(&scene, 0, SIZE, &Settings::default())?;
            let commands = host.commands[frame as usize % 2];
            host.device.begin_command_buffer(commands, &vk::CommandBufferBeginInfo::default())?;
            pass.record_frame(&mut caustics, commands, &target, &display)?;
            if frame == FRAMES {
                host.copy(commands, image, staging);
            }
            host.device.end_command_buffer(commands)?;
            host.submit(commands, frame)?;
        }
        host.wait(FRAMES)?;
        drop((pass, caustics));

        let mapped = host.device.map_memory(staging_memory, 0, PICTURE_BYTES, vk::MemoryMapFlags::empty())?;
        let pixels = std::slice::from_raw_parts(mapped.cast::<u8>(), PICTURE_BYTES as usize).to_vec();
        host.device.destroy_image_view(view, None);
        host.device.destroy_image(image, None);
        host.device.destroy_buffer(staging, None);
        host.device.free_memory(memory, None);
        host.device.free_memory(staging_memory, None);
        pixels
    };

    let writer = std::io::BufWriter::new(std::fs::File::create(&file)?);
    let mut png = png::Encoder::new(writer, SIZE[0], SIZE[1]);
    png.set_color(png::ColorType::Rgba);
    png.write_header()?.write_image_data(&pixels)?;
    let lit = pixels.chunks_exact(4).filter(|p| p[..3] != [0; 3]).count();
    println!("{file}: {} x {}, {lit} pixels are not black", SIZE[0], SIZE[1]);
    Ok(())
}

/// What any Vulkan application has.
struct Application {
    _entry: ash::Entry,
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    memory: vk::PhysicalDeviceMemoryProperties,
    queue_family: u32,
    device: ash::Device,
    queue: vk::Queue,
    pool: vk::CommandPool,
    commands: Vec<vk::CommandBuffer>,
    timeline: vk::Semaphore,
}

impl Application {
    /// # Safety
    /// As Vulkan's calls.
    unsafe fn new() -> Result<Self, Box<dyn Error>> {
        // SAFETY: whole descriptions, of what was just found.
        unsafe {
            let entry = ash::Entry::load()?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let create = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&create, None)?;
            let physical = *instance.enumerate_physical_devices()?.first().ok_or("no Vulkan device")?;
            let families = instance.get_physical_device_queue_family_properties(physical);
            let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
            let queue_family =
                families.iter().position(|f| f.queue_flags.contains(wanted)).ok_or("no queue that draws")?
                    as u32;
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(queue_family)
                .queue_priorities(&[1.0])];
            let (mut features12, mut features13) = VulkanHost::required_features();
            let create = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .push_next(&mut features12)
                .push_next(&mut features13);
            let device = instance.create_device(physical, &create, None)?;
            let queue = device.get_device_queue(queue_family, 0);
            let create = vk::CommandPoolCreateInfo::default()
                .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER)
                .queue_family_index(queue_family);
            let pool = device.create_command_pool(&create, None)?;
            let allocate =
                vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(2);
            let commands = device.allocate_command_buffers(&allocate)?;
            let mut timeline =
                vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
            let create = vk::SemaphoreCreateInfo::default().push_next(&mut timeline);
            let timeline = device.create_semaphore(&create, None)?;
            Ok(Self {
                _entry: entry,
                memory: instance.get_physical_device_memory_properties(physical),
                instance,
                physical,
                queue_family,
                device,
                queue,
                pool,
                commands,
                timeline,
            })
        }
    }

    /// # Safety
    /// The commands are being recorded, and the image is a copy source.
    unsafe fn copy(&self, commands: vk::CommandBuffer, image: vk::Image, staging: vk::Buffer) {
        let region = vk::BufferImageCopy::default()
            .image_subresource(vk::ImageSubresourceLayers {
                aspect_mask: vk::ImageAspectFlags::COLOR,
                mip_level: 0,
                base_array_layer: 0,
                layer_count: 1,
            })
            .image_extent(vk::Extent3D { width: SIZE[0], height: SIZE[1], depth: 1 });
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: as the function demands; the buffer has room for the image.
        unsafe {
            self.device.cmd_copy_image_to_buffer(commands, image, layout, staging, &[region]);
            self.device.cmd_pipeline_barrier2(commands, &dependency);
        }
    }

    /// # Safety
    /// The commands are recorded and not pending.
    unsafe fn submit(&self, commands: vk::CommandBuffer, frame: u64) -> Result<(), vk::Result> {
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let signals = [vk::SemaphoreSubmitInfo::default()
            .semaphore(self.timeline)
            .value(frame)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
        let submit =
            vk::SubmitInfo2::default().command_buffer_infos(&buffers).signal_semaphore_infos(&signals);
        // SAFETY: as the function demands.
        unsafe { self.device.queue_submit2(self.queue, &[submit], vk::Fence::null()) }
    }

    /// Wait until a frame is finished.
    fn wait(&self, frame: u64) -> Result<(), vk::Result> {
        let (semaphores, values) = ([self.timeline], [frame]);
        let wait = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is alive, and the frame was submitted or is 0.
        unsafe { self.device.wait_semaphores(&wait, u64::MAX) }
    }
}

impl Drop for Application {
    fn drop(&mut self) {
        // SAFETY: nothing is used again. A device that is lost is idle.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.device.destroy_semaphore(self.timeline, None);
            self.device.destroy_command_pool(self.pool, None);
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}
