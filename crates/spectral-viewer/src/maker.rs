//! Who makes the pictures: the window's own device inside its frames, or an executor beside it.

use asm_core::Picture;
use asm_wgpu::wgpu;
use spectral_core::display::Display;

use crate::copy::PictureCopy;
use crate::graphics::Graphics;
use crate::screen::Screen;
use crate::subject::{Job, Report};
use crate::worker::Worker;

/// Bytes of a pixel on its way to the screen: XYZ and padding, f32.
pub(crate) const PIXEL_BYTES: u64 = 16;

/// A picture that was made, of what, and what is known of it.
pub(crate) struct Finished<J: Job> {
    pub(crate) picture: Picture,
    pub(crate) job: J,
    pub(crate) report: Report<J::Facts>,
}

/// Makes pictures on the window's device, recorded into its frames.
pub(crate) trait Inside<J: Job> {
    /// Record the picture of `job`.
    ///
    /// # Errors
    /// Why there is no picture, in a sentence.
    fn record(&mut self, job: &J, encoder: &mut wgpu::CommandEncoder) -> Result<Recorded, String>;

    /// What is known of the picture recorded last, once that is submitted.
    fn report(&mut self) -> Report<J::Facts>;
}

/// A picture recorded into a frame.
pub(crate) enum Recorded {
    /// XYZ and padding per pixel, f32, rows from the top; and pixels.
    Picture(wgpu::Buffer, [u32; 2]),
    /// The same, by a plan of which it is known some frames later whether it is right: record it again.
    Provisional(wgpu::Buffer, [u32; 2]),
    /// The same by a plan for something else: the right one is being made.
    Late(wgpu::Buffer, [u32; 2]),
    /// None yet.
    Nothing,
}

/// What makes pictures of one subject.
pub(crate) enum Maker<J: Job> {
    /// On the window's device, recorded into its frames; pictures are copied to the host on request.
    Inside { frames: Box<dyn Inside<J>>, copy: Option<(PictureCopy, J)>, again: bool },
    /// On a thread; its pictures are handed to the window's device.
    Beside { worker: Worker<J, Finished<J>>, uploaded: Option<Uploaded> },
}

/// A picture on the window's device that was made elsewhere.
pub(crate) struct Uploaded {
    buffer: wgpu::Buffer,
    size: [u32; 2],
}

/// What a frame brought.
pub(crate) struct Progress<J: Job> {
    /// A picture of the job is part of this frame.
    pub(crate) current: bool,
    /// Something was recorded into this frame: ask [`Maker::after_submit`] about it.
    pub(crate) recorded: bool,
    /// A picture has been begun elsewhere.
    pub(crate) begun: bool,
    /// A picture made elsewhere is there, or the reason why not.
    pub(crate) arrived: Option<Result<Finished<J>, String>>,
    /// A picture made inside the window's frames has come to the host.
    pub(crate) copied: Option<(J, Picture)>,
    /// Nothing is being made.
    pub(crate) idle: bool,
}

impl<J: Job> Progress<J> {
    const NOTHING: Self =
        Self { current: false, recorded: false, begun: false, arrived: None, copied: None, idle: false };
}

impl<J: Job> Maker<J> {
    /// Inside the window's frames.
    pub(crate) fn inside(frames: impl Inside<J> + 'static) -> Self {
        Self::Inside { frames: Box::new(frames), copy: None, again: false }
    }

    /// On this thread.
    pub(crate) fn beside(worker: Worker<J, Finished<J>>) -> Self {
        Self::Beside { worker, uploaded: None }
    }

    /// Record this frame's part: the picture of `job`, if it is `due`, or the newest one that is there. `wanted` asks for the
    /// picture on the host, some frames later.
    ///
    /// # Errors
    /// Why there is no picture, in a sentence.
    pub(crate) fn record(
        &mut self,
        (job, due, wanted): (&J, bool, bool),
        (graphics, encoder): (&Graphics, &mut wgpu::CommandEncoder),
        screen: &mut Screen,
        display: &Display,
    ) -> Result<Progress<J>, String> {
        match self {
            Self::Inside { frames, copy, again } => {
                let copied = PictureCopy::collect(copy, &graphics.device)?;
                if !(due || *again || wanted && copy.is_none()) {
                    return Ok(Progress { copied, idle: copy.is_none(), ..Progress::NOTHING });
                }
                let recorded = frames.record(job, encoder)?;
                *again = matches!(recorded, Recorded::Provisional(..));
                let (Recorded::Picture(buffer, size)
                | Recorded::Provisional(buffer, size)
                | Recorded::Late(buffer, size)) = &recorded
                else {
                    return Ok(Progress { copied, ..Progress::NOTHING });
                };
                let current = !matches!(recorded, Recorded::Late(..));
                screen.draw(graphics, encoder, (buffer, *size), display);
                if current && wanted && copy.is_none() {
                    let begun = PictureCopy::record(&graphics.device, encoder, buffer, *size);
                    *copy = Some((begun, job.clone()));
                }
                Ok(Progress { current, recorded: true, copied, ..Progress::NOTHING })
            }
            Self::Beside { worker, uploaded } => {
                let arrived = worker.finished();
                if let Some(Ok(Finished { picture, .. })) = &arrived {
                    upload(graphics, uploaded, picture);
                }
                let begun = due && !worker.is_busy();
                if begun {
                    worker.begin(job.clone());
                }
                if let Some(Uploaded { buffer, size }) = uploaded {
                    screen.draw(graphics, encoder, (buffer, *size), display);
                }
                Ok(Progress { begun, arrived, idle: !worker.is_busy(), ..Progress::NOTHING })
            }
        }
    }

    /// What is known of the picture recorded inside a frame, once that is submitted.
    pub(crate) fn after_submit(&mut self) -> Option<Report<J::Facts>> {
        let Self::Inside { frames, copy, .. } = self else { return None };
        if let Some((copy, _)) = copy {
            copy.submitted();
        }
        Some(frames.report())
    }

    /// Whether the window's own frames are to go on.
    pub(crate) fn is_inside(&self) -> bool {
        matches!(self, Self::Inside { .. })
    }

    /// Whether frames must go on: a picture is on its way to the host, or to be recorded again.
    pub(crate) fn goes_on(&self) -> bool {
        matches!(self, Self::Inside { copy: Some(_), .. } | Self::Inside { again: true, .. })
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
