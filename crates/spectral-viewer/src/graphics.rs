//! The window's device, and the surface that shows what it draws.

use std::sync::{Arc, Mutex, PoisonError};

use asm_wgpu::{device_descriptor, wgpu};
use pollster::block_on;
use spectral_cli::CliError;
use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// A window with a device that draws into it.
pub(crate) struct Graphics {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// What failed outside of any call, such as the loss of the device.
    failure: Arc<Mutex<Option<String>>>,
}

impl Graphics {
    /// A device for this window; `readable` if what the window shows is to be read back.
    ///
    /// # Errors
    /// No adapter that can show anything in the window, no device, or a surface that cannot be read.
    pub(crate) fn new(
        event_loop: &ActiveEventLoop,
        window: Arc<Window>,
        readable: bool,
    ) -> Result<Self, CliError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            // Indirect arguments come from shaders: wgpu checks them on the device, whatever the build profile.
            flags: wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL.with_env(),
            ..wgpu::InstanceDescriptor::new_with_display_handle(Box::new(event_loop.owned_display_handle()))
        });
        let surface =
            instance.create_surface(Arc::clone(&window)).map_err(failed("the window has no surface"))?;
        let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..wgpu::RequestAdapterOptions::default()
        }))
        .map_err(failed("no device draws into this window"))?;
        let (device, queue) = block_on(adapter.request_device(&device_descriptor(&adapter)))
            .map_err(failed("the window's adapter gives no device"))?;
        let failure = Arc::default();
        watch(&device, &failure);

        let can = surface.get_capabilities(&adapter);
        let format = egui_wgpu::preferred_framebuffer_format(&can.formats)
            .map_err(failed("the window takes no picture"))?;
        let mut usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        if readable {
            usage |= wgpu::TextureUsages::COPY_SRC;
            let readable_format =
                matches!(format, wgpu::TextureFormat::Rgba8Unorm | wgpu::TextureFormat::Bgra8Unorm);
            if !can.usages.contains(usage) || !readable_format {
                let problem = "--screenshot: what this window shows cannot be read back from its device";
                return Err(CliError::Failed(problem.into()));
            }
        }
        let PhysicalSize { width, height } = window.inner_size();
        let Some(defaults) = surface.get_default_config(&adapter, width.max(1), height.max(1)) else {
            return Err(CliError::Failed("the window's device does not draw into it".into()));
        };
        let config = wgpu::SurfaceConfiguration {
            usage,
            format,
            present_mode: wgpu::PresentMode::AutoVsync,
            ..defaults
        };
        surface.configure(&device, &config);
        Ok(Self { device, queue, window, surface, config, failure })
    }

    /// Texels of the surface.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Their format.
    pub(crate) fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Follow the window's size. A minimised window has none.
    pub(crate) fn resize(&mut self, size: PhysicalSize<u32>) {
        if size.width > 0 && size.height > 0 {
            (self.config.width, self.config.height) = (size.width, size.height);
            self.surface.configure(&self.device, &self.config);
        }
    }

    /// The texture to draw the next frame into; none if there is nothing to see it now.
    ///
    /// # Errors
    /// If the device failed.
    pub(crate) fn next_frame(&mut self) -> Result<Option<wgpu::SurfaceTexture>, CliError> {
        use wgpu::CurrentSurfaceTexture::{
            Lost, Occluded, Outdated, Suboptimal, Success, Timeout, Validation,
        };
        let next = self.surface.get_current_texture();
        if let Some(reason) = &*self.failure.lock().unwrap_or_else(PoisonError::into_inner) {
            return Err(CliError::Failed(format!("the window's device failed: {reason}")));
        }
        Ok(match next {
            Success(texture) | Suboptimal(texture) => Some(texture),
            Outdated | Lost => {
                self.surface.configure(&self.device, &self.config);
                self.window.request_redraw();
                None
            }
            // Whatever asked for this frame asks only once.
            Timeout => {
                self.window.request_redraw();
                None
            }
            // Told when it can be seen again; noted as a failure.
            Occluded | Validation => None,
        })
    }

    /// Have a frame copied, before it is shown, into a buffer of its own.
    pub(crate) fn copy_frame(
        &self,
        frame: &wgpu::Texture,
        encoder: &mut wgpu::CommandEncoder,
    ) -> wgpu::Buffer {
        let [width, height] = self.size();
        let bytes_per_row = row_bytes(width);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("screenshot"),
            size: u64::from(bytes_per_row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(bytes_per_row),
            rows_per_image: None,
        };
        encoder.copy_texture_to_buffer(
            frame.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            frame.size(),
        );
        buffer
    }

    /// The sRGB pixels of a copied frame that has been submitted.
    ///
    /// # Errors
    /// If the device failed.
    pub(crate) fn read_frame(&self, copied: &wgpu::Buffer) -> Result<Vec<[u8; 3]>, CliError> {
        copied.map_async(wgpu::MapMode::Read, .., |_| ());
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(failed("the window's device failed"))?;
        let bytes = copied.get_mapped_range(..).map_err(failed("the screenshot cannot be read"))?;
        let blue_first = self.config.format == wgpu::TextureFormat::Bgra8Unorm;
        let [width, _] = self.size();
        let rows = bytes.chunks_exact(row_bytes(width) as usize);
        let pixels = rows.flat_map(|row| row[..4 * width as usize].as_chunks::<4>().0);
        Ok(pixels.map(|&[a, b, c, _]| if blue_first { [c, b, a] } else { [a, b, c] }).collect())
    }
}

/// Bytes of a row of a copied frame, padded as copies need it.
fn row_bytes(width: u32) -> u32 {
    (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

/// Keep what the device reports: wgpu's own way is to panic.
fn watch(device: &wgpu::Device, failure: &Arc<Mutex<Option<String>>>) {
    let note = |failure: &Mutex<Option<String>>, reason: String| {
        // Later failures follow from the first.
        failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
    };
    let noted = Arc::clone(failure);
    device.on_uncaptured_error(Arc::new(move |error| note(&noted, error.to_string())));
    let noted = Arc::clone(failure);
    device.set_device_lost_callback(move |reason, message| note(&noted, format!("{message} ({reason:?})")));
}

/// A failure that says what could not be had.
fn failed<E: std::fmt::Display>(what: &'static str) -> impl FnOnce(E) -> CliError {
    move |error| CliError::Failed(format!("{what}: {error}"))
}
