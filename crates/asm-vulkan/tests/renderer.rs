//! `AsmRenderer` on Vulkan, and its pictures in a host's image.

#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(unsafe_code, reason = "a host hands its own commands and images over")]

mod device;
mod host;
#[path = "../../asm-core/tests/on_device/renderer.rs"]
mod renderer;

use asm_core::AsmError;
use asm_vulkan::ash::vk;
use asm_vulkan::{ASM_PASSES, AsmRenderer, DisplayPass, HostImage, VulkanExecutor};
use frame_plan::{ResourceId, TextureFormat};
use host::Host;
use spectral_core::display::Display;

/// A host application: its device, and an image that it shows pictures in.
struct Screen {
    // Fields drop in this order.
    pass: DisplayPass,
    target: HostImage,
    host: Host,
}

impl Screen {
    /// None if there is no device and skipping is allowed.
    fn new(size: [u32; 2], encodes_srgb: bool) -> Option<Self> {
        let host = Host::new(true)?;
        let format = if encodes_srgb { vk::Format::R8G8B8A8_SRGB } else { vk::Format::R8G8B8A8_UNORM };
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let target = host.image(format, size, usage);
        let pass = DisplayPass::new(&host.executor(ASM_PASSES), format).unwrap();
        Some(Self { pass, target, host })
    }

    /// An executor on the host's device.
    fn executor(&self) -> VulkanExecutor {
        self.host.executor(ASM_PASSES)
    }

    fn live_objects(&self, renderer: &mut AsmRenderer) -> Vec<(&'static str, usize)> {
        renderer.executor().live_objects()
    }

    fn show_frame(&mut self, renderer: &mut AsmRenderer, display: &Display) -> Result<(), AsmError> {
        self.show_frame_in(self.target, renderer, display)
    }

    /// Into an image without a view.
    fn show_frame_where_it_does_not_fit(
        &mut self,
        renderer: &mut AsmRenderer,
        display: &Display,
    ) -> Result<(), AsmError> {
        self.show_frame_in(HostImage { view: None, ..self.target }, renderer, display)
    }

    fn show_frame_in(
        &mut self,
        target: HostImage,
        renderer: &mut AsmRenderer,
        display: &Display,
    ) -> Result<(), AsmError> {
        let mut result = Ok(());
        // SAFETY: the host submits the commands at once and waits for them; its images live as long as it does.
        self.host.frame(|commands| unsafe {
            result = self.pass.record_frame(renderer, commands, &target, display);
        });
        result
    }

    /// Show a buffer of the executor's plan.
    fn show(&mut self, gpu: &mut VulkanExecutor, picture: ResourceId, display: &Display) {
        let picture = (picture, self.target.size);
        // SAFETY: as above.
        self.host.frame(|commands| unsafe {
            gpu.record(commands).unwrap();
            self.pass.record(gpu, commands, picture, &self.target, display).unwrap();
        });
    }

    /// What the target holds, as it is encoded there.
    fn pixels(&self) -> Vec<[u8; 4]> {
        // An image of the same bytes whose format plans know, imported by a plan that only reads it.
        let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC;
        let copy = self.host.image(vk::Format::R8G8B8A8_UNORM, self.target.size, usage);
        self.host.copy_image(&self.target, &copy);
        let plan = device::image_plan(TextureFormat::Rgba8Unorm, self.target.size);
        let mut reader = self.executor();
        // SAFETY: the host's images live as long as the host.
        unsafe { reader.import_image("image", copy) }.unwrap();
        bytemuck::pod_collect_to_vec(&device::run(&mut reader, &plan, "image"))
    }
}
