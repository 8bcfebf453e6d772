//! Who makes pictures of a scene.

use asm_core::{AsmRenderer, PASSES, Picture};
use asm_wgpu::{WgpuExecutor, wgpu};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use spectral_cli::backend::{self, SCENES};
use spectral_scene::Scene;

use super::job::{PictureJob, SceneFacts, report};
use crate::graphics::Graphics;
use crate::maker::{Finished, Inside, Maker, Recorded};
use crate::runner::Runner;
use crate::subject::Report;
use crate::worker::{Wake, Worker};

/// What makes pictures of `scene` by this runner.
pub(super) fn maker(runner: Runner, scene: Scene, graphics: &Graphics, wake: Wake) -> Maker<PictureJob> {
    match runner {
        Runner::Wgpu => {
            let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
            let renderer = AsmRenderer::new(WgpuExecutor::from_host(device, queue, PASSES));
            Maker::inside(Frames { renderer, scene })
        }
        Runner::Cpu => {
            beside(scene, wake, || CpuExecutor::new(PASSES, None).map_err(|error| error.to_string()))
        }
        Runner::Vulkan => beside(scene, wake, || backend::vulkan(&SCENES, None)),
    }
}

/// Pictures inside the window's frames.
struct Frames {
    renderer: asm_wgpu::AsmRenderer,
    scene: Scene,
}

impl Inside<PictureJob> for Frames {
    fn record(&mut self, job: &PictureJob, encoder: &mut wgpu::CommandEncoder) -> Result<Recorded, String> {
        job.prepare(&mut self.renderer, &mut self.scene).map_err(|error| error.to_string())?;
        let prepared = self.renderer.prepared().map(|render| (render.picture(), render.size));
        let executor = self.renderer.executor();
        executor.record(encoder).map_err(|error| error.to_string())?;
        let drawn = prepared.and_then(|(id, size)| Some((executor.buffer(id)?.clone(), size)));
        Ok(drawn.map_or(Recorded::Nothing, |(buffer, size)| Recorded::Picture(buffer, size)))
    }

    fn report(&mut self) -> Report<SceneFacts> {
        report(&mut self.renderer)
    }
}

/// Pictures on a thread, by the executor that `open` opens there.
fn beside<E: Executor + 'static>(
    mut scene: Scene,
    wake: Wake,
    open: impl FnOnce() -> Result<E, String> + Send + 'static,
) -> Maker<PictureJob> {
    Maker::beside(Worker::start(wake, move || {
        let mut renderer = AsmRenderer::new(open()?);
        Ok(move |job: PictureJob| make(&mut renderer, &mut scene, job))
    }))
}

fn make<E: Executor>(
    renderer: &mut AsmRenderer<E>,
    scene: &mut Scene,
    job: PictureJob,
) -> Result<Finished<PictureJob>, String> {
    let mut made = || -> Result<Picture, asm_core::AsmError> {
        job.prepare(renderer, scene)?;
        renderer.execute()?;
        Ok(renderer.read()?.0)
    };
    let picture = made().map_err(|error| error.to_string())?;
    Ok(Finished { picture, report: report(renderer), job })
}
