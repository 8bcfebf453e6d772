//! Who makes pictures of what is relit.

use std::sync::Arc;

use asm_wgpu::{WgpuExecutor, wgpu};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use spectral_cli::RelitView;
use spectral_cli::backend::{self, RELIT};
use spectral_prt::PASSES;

use super::frames::Frames;
use super::job::RelitJob;
use crate::graphics::Graphics;
use crate::maker::{Finished, Inside, Maker, Recorded};
use crate::runner::Runner;
use crate::subject::Report;
use crate::worker::{Wake, Worker};

/// What makes pictures of `stage` by this runner.
pub(super) fn maker(
    runner: Runner,
    stage: Arc<RelitView>,
    graphics: &Graphics,
    wake: Wake,
) -> Maker<RelitJob> {
    match runner {
        Runner::Wgpu => {
            let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
            let executor = WgpuExecutor::from_host(device, queue, PASSES);
            Maker::inside(Window(Frames::new(stage, executor)))
        }
        Runner::Cpu => {
            beside(stage, wake, || CpuExecutor::new(PASSES, None).map_err(|error| error.to_string()))
        }
        Runner::Vulkan => beside(stage, wake, || backend::vulkan(&RELIT, None)),
    }
}

/// Pictures inside the window's frames.
struct Window(Frames<WgpuExecutor>);

impl Inside<RelitJob> for Window {
    fn record(&mut self, job: &RelitJob, encoder: &mut wgpu::CommandEncoder) -> Result<Recorded, String> {
        self.0.prepare(job)?;
        let picture = self.0.buffer();
        let executor = &mut self.0.executor;
        executor.record(encoder).map_err(|error| error.to_string())?;
        let picture = picture.and_then(|id| executor.buffer(id)).cloned();
        Ok(picture.map_or(Recorded::Nothing, |buffer| Recorded::Picture(buffer, job.size)))
    }

    fn report(&mut self) -> Report<()> {
        report(&mut self.0)
    }
}

/// Pictures on a thread, by the executor that `open` opens there.
fn beside<E: Executor + 'static>(
    stage: Arc<RelitView>,
    wake: Wake,
    open: impl FnOnce() -> Result<E, String> + Send + 'static,
) -> Maker<RelitJob> {
    Maker::beside(Worker::start(wake, move || {
        let mut frames = Frames::new(stage, open()?);
        Ok(move |job: RelitJob| {
            let picture = frames.picture(&job)?;
            Ok(Finished { picture, report: report(&mut frames), job })
        })
    }))
}

fn report<E: Executor>(frames: &mut Frames<E>) -> Report<()> {
    let decisions = frames.decisions();
    Report::of(&mut frames.executor, decisions, ())
}
