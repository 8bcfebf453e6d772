//! Who makes the pictures: the window's own device inside its frames, or an executor beside it.

use asm_core::{PASSES, Picture};
use asm_wgpu::{AsmRenderer, WgpuExecutor, wgpu};
use spectral_core::display::Display;
use spectral_scene::Scene;

use crate::choices::Runner;
use crate::graphics::Graphics;
use crate::job::{Job, Report};
use crate::screen::Screen;
use crate::worker::{Outcome, Wake, Worker};

/// Bytes of a pixel on its way to the screen: XYZ and padding, f32.
const PIXEL_BYTES: u64 = 16;

/// What makes pictures of one scene.
pub(crate) enum Maker {
    /// On the window's device, recorded into its frames; nothing is read back but on request.
    Inside { renderer: Box<AsmRenderer>, scene: Scene },
    /// On a thread; its pictures are handed to the window's device.
    Beside { worker: Worker, uploaded: Option<Uploaded> },
}

/// A picture on the window's device that was made elsewhere.
pub(crate) struct Uploaded {
    buffer: wgpu::Buffer,
    size: [u32; 2],
}

/// What a frame brought.
#[derive(Default)]
pub(crate) struct Progress {
    /// A picture was made inside this frame: ask [`Maker::after_submit`] about it.
    pub(crate) recorded: bool,
    /// A picture has been begun elsewhere.
    pub(crate) begun: bool,
    /// A picture made elsewhere is there, or the reason why not.
    pub(crate) arrived: Option<Outcome>,
    /// Nothing is being made.
    pub(crate) idle: bool,
}

impl Maker {
    /// For this runner.
    pub(crate) fn new(runner: Runner, scene: Scene, graphics: &Graphics, wake: Wake) -> Self {
        let worker = match runner {
            Runner::Wgpu => {
                let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
                let renderer = AsmRenderer::new(WgpuExecutor::from_host(device, queue, PASSES));
                return Self::Inside { renderer: Box::new(renderer), scene };
            }
            Runner::Cpu => Worker::cpu(scene, wake),
            Runner::Vulkan => Worker::vulkan(scene, wake),
        };
        Self::Beside { worker, uploaded: None }
    }

    /// Record this frame's part: the picture of `job`, if it is `due`, or the newest one that is there.
    ///
    /// # Errors
    /// Why there is no picture, in a sentence.
    pub(crate) fn record(
        &mut self,
        job: &Job,
        due: bool,
        (graphics, encoder): (&Graphics, &mut wgpu::CommandEncoder),
        screen: &mut Screen,
        display: &Display,
    ) -> Result<Progress, String> {
        match self {
            Self::Inside { .. } if !due => Ok(Progress { idle: true, ..Progress::default() }),
            Self::Inside { renderer, scene } => {
                job.prepare(renderer, scene)
                    .and_then(|()| screen.pass.record_frame(renderer, encoder, &screen.view, display))
                    .map_err(|error| error.to_string())?;
                Ok(Progress { recorded: true, ..Progress::default() })
            }
            Self::Beside { worker, uploaded } => {
                let arrived = worker.finished();
                if let Some(Ok((picture, ..))) = &arrived {
                    upload(graphics, uploaded, picture);
                }
                let begun = due && !worker.is_busy();
                if begun {
                    worker.begin(job.clone());
                }
                if let Some(Uploaded { buffer, size }) = uploaded {
                    screen.draw(graphics, encoder, (buffer, *size), display);
                }
                Ok(Progress { recorded: false, begun, arrived, idle: !worker.is_busy() })
            }
        }
    }

    /// What is known of the picture recorded inside a frame, once that is submitted; with `read`, wait for it and read it back.
    ///
    /// # Errors
    /// What the device says, in a sentence.
    pub(crate) fn after_submit(&mut self, read: bool) -> Result<(Option<Picture>, Report), String> {
        let Self::Inside { renderer, .. } = self else { return Ok(Default::default()) };
        let picture = if read { Some(renderer.read().map_err(|error| error.to_string())?.0) } else { None };
        Ok((picture, Report::of(renderer)))
    }
}

/// Hand a picture to the window's device, in the buffer that is there if it fits.
fn upload(graphics: &Graphics, uploaded: &mut Option<Uploaded>, picture: &Picture) {
    let size = [picture.width, picture.height];
    if uploaded.as_ref().is_none_or(|there| there.size != size) {
        let buffer = graphics.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture from another executor"),
            size: PIXEL_BYTES * u64::from(size[0]) * u64::from(size[1]),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        *uploaded = Some(Uploaded { buffer, size });
    }
    if let Some(Uploaded { buffer, .. }) = uploaded {
        let pixels: Vec<[f32; 4]> = picture.xyz.iter().map(|&[x, y, z]| [x, y, z, 0.0]).collect();
        graphics.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&pixels));
    }
}
