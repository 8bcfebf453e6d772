//! Executors with a device of their own, on a thread beside the window's: it stays responsive however long a picture takes.

use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};

use asm_core::{AsmError, AsmRenderer, PASSES, Picture};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use spectral_cli::backend;
use spectral_scene::Scene;

use crate::job::{Job, Report};

/// A picture with what it is of and what is known of it, or why there is none.
pub(crate) type Outcome = Result<(Picture, Job, Report), String>;

/// Told when a picture is there.
pub(crate) type Wake = Box<dyn Fn() + Send>;

/// Wakes once more when the thread ends: if it panicked, somebody waits for its picture.
struct WakeAtEnd(Wake);

impl Drop for WakeAtEnd {
    fn drop(&mut self) {
        (self.0)();
    }
}

/// A thread that makes one picture after the other.
pub(crate) struct Worker {
    /// Taken when the thread is to end.
    jobs: Option<Sender<Job>>,
    outcomes: Receiver<Outcome>,
    thread: Option<JoinHandle<()>>,
    busy: bool,
}

impl Worker {
    /// On the CPU executor, with all cores.
    pub(crate) fn cpu(scene: Scene, wake: Wake) -> Self {
        Self::start(scene, wake, || CpuExecutor::new(PASSES, None).map_err(|error| error.to_string()))
    }

    /// On the Vulkan executor's best device.
    pub(crate) fn vulkan(scene: Scene, wake: Wake) -> Self {
        Self::start(scene, wake, || backend::vulkan(None))
    }

    /// On the executor that `open` opens, on the thread that uses it.
    fn start<E: Executor>(
        mut scene: Scene,
        wake: Wake,
        open: impl FnOnce() -> Result<E, String> + Send + 'static,
    ) -> Self {
        let (jobs, to_do) = channel::<Job>();
        let (done, outcomes) = channel();
        let thread = thread::spawn(move || {
            let wake = WakeAtEnd(wake);
            // Gone before the last waking, which then finds the channel closed.
            let done = done;
            let mut renderer = open().map(AsmRenderer::new);
            for job in to_do {
                let outcome = match &mut renderer {
                    Ok(renderer) => make(renderer, &mut scene, job),
                    Err(reason) => Err(reason.clone()),
                };
                if done.send(outcome).is_err() {
                    return;
                }
                (wake.0)();
            }
        });
        Self { jobs: Some(jobs), outcomes, thread: Some(thread), busy: false }
    }

    /// Whether a picture is being made.
    pub(crate) fn is_busy(&self) -> bool {
        self.busy
    }

    /// Have a picture made. Call it when none is being made: they do not overtake each other.
    pub(crate) fn begin(&mut self, job: Job) {
        if let Some(jobs) = &self.jobs {
            // A thread that has ended shows in `finished`.
            let _ = jobs.send(job);
            self.busy = true;
        }
    }

    /// The picture that was begun, once it is there.
    pub(crate) fn finished(&mut self) -> Option<Outcome> {
        if !self.busy {
            return None;
        }
        let outcome = match self.outcomes.try_recv() {
            Ok(outcome) => outcome,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the executor's thread has ended".into()),
        };
        self.busy = false;
        Some(outcome)
    }
}

/// A device is not left while it works: drivers take their process down with them.
impl Drop for Worker {
    fn drop(&mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            // Its panic was told when it happened.
            let _ = thread.join();
        }
    }
}

fn make<E: Executor>(renderer: &mut AsmRenderer<E>, scene: &mut Scene, job: Job) -> Outcome {
    let mut made = || -> Result<(Picture, Report), AsmError> {
        job.prepare(renderer, scene)?;
        renderer.execute()?;
        let (picture, _) = renderer.read()?;
        Ok((picture, Report::of(renderer)))
    };
    let (picture, report) = made().map_err(|error| error.to_string())?;
    Ok((picture, job, report))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::tests::view;

    #[test]
    fn a_thread_that_panics_tells_who_waits_for_its_picture() {
        let (told, wakings) = channel();
        let wake: Wake = Box::new(move || told.send(()).expect("the test listens"));
        let open = || -> Result<CpuExecutor, String> { panic!("on purpose") };
        let mut worker = Worker::start(Scene::default(), wake, open);
        worker.begin(view("").job([1, 1]));
        wakings.recv().expect("a waking");
        let Some(Err(error)) = worker.finished() else { panic!("neither a picture nor nothing") };
        assert!(error.contains("ended") && !worker.is_busy(), "{error}");
    }
}
