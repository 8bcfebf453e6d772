//! Floors inside the window's frames: impulses, light and time are written, and nothing else.

use asm_wgpu::{WgpuExecutor, wgpu};
use caustic_heightfield::{PASSES, PondError};

use super::fit::{self, MadeFor, Planned};
use super::job::{FloorFacts, FloorJob};
use super::pebbles::Waves;
use crate::graphics::Graphics;
use crate::maker::{Inside, Recorded};
use crate::subject::Report;
use crate::worker::{Wake, Worker};

/// Frames after which the states of a surface are known to have been counted: more than a window has unfinished.
const COUNTED_AFTER: u32 = 4;

/// A plan, and what it is for.
struct Running {
    planned: Planned,
    made_for: MadeFor,
    /// Share of states unlike those that it was fitted to, a frame late.
    outside: f64,
    /// Frames recorded since it was fitted: the first ones bring counts of those before.
    frames: u32,
}

/// Why there is no plan for a job; it is not tried again for the like.
struct Refused {
    made_for: MadeFor,
    light_direction: [f64; 3],
    pebbles: usize,
    reason: String,
}

/// The pond on the window's device. Plans are made on a thread beside it: fitting low-rank terms takes longer than a frame.
pub(super) struct Frames {
    executor: WgpuExecutor,
    running: Option<Running>,
    fitter: Worker<FloorJob, Planned>,
    /// What the fitter was last asked for.
    asked: Option<FloorJob>,
    refused: Option<Refused>,
    /// What was recorded last, and in how many frames.
    last: Option<FloorJob>,
    times: u32,
}

impl Frames {
    /// On the window's device; `wake` is told when there is another plan.
    pub(super) fn new(graphics: &Graphics, wake: Wake) -> Self {
        let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
        Self {
            executor: WgpuExecutor::from_host(device, queue, PASSES),
            running: None,
            fitter: Worker::start(wake, || {
                Ok(|job: FloorJob| fit::plan(&job).map_err(|error| error.to_string()))
            }),
            asked: None,
            refused: None,
            last: None,
            times: 0,
        }
    }

    /// Take a plan that is there, and have another one made where it is needed.
    fn refit(&mut self, job: &FloorJob) -> Result<(), String> {
        match (self.fitter.finished(), self.asked.take()) {
            (Some(Ok(planned)), Some(asked)) => {
                let made_for = MadeFor::of(&asked);
                self.run(planned, made_for).map_err(|error| error.to_string())?;
                self.refused = None;
            }
            (Some(Err(reason)), Some(asked)) => self.refused = Some(Refused::new(&asked, reason)),
            (_, asked) => self.asked = asked,
        }
        if let Some(Running { planned: Planned { plan, .. }, outside, frames, .. }) = &mut self.running
            && *frames >= COUNTED_AFTER
        {
            let states: f64 = job.samples().iter().product::<usize>() as f64;
            *outside = plan.latest_outside_states(&mut self.executor).map_or(*outside, |n| n as f64 / states);
        }
        if self.is_right_for(job) {
            return Ok(());
        }
        if let Some(refused) = self.refused.as_ref().filter(|refused| refused.is_of(job)) {
            return Err(refused.reason.clone());
        }
        if !self.fitter.is_busy() {
            self.fitter.begin(job.clone());
            self.asked = Some(job.clone());
        }
        Ok(())
    }

    /// Go on with what was fitted: by numbers alone where the plan that runs has room for it, by a plan of its own where not.
    fn run(&mut self, planned: Planned, made_for: MadeFor) -> Result<(), PondError> {
        let running = self.running.take().map(|running| running.planned.plan);
        let (planned, is_watched) = planned.start(running, &mut self.executor)?;
        if !is_watched {
            planned.plan.watch_states(&mut self.executor)?;
        }
        self.running = Some(Running { planned, made_for, outside: 0.0, frames: 0 });
        // What is shown is to be recorded and counted anew.
        self.last = None;
        Ok(())
    }

    fn is_right_for(&self, job: &FloorJob) -> bool {
        let right =
            |running: &Running| running.made_for == MadeFor::of(job) && !fit::is_unlike(running.outside);
        self.running.as_ref().is_some_and(right)
    }
}

impl Refused {
    fn new(job: &FloorJob, reason: String) -> Self {
        Self {
            made_for: MadeFor::of(job),
            light_direction: job.pond.light_direction,
            pebbles: job.waves.impulses.len(),
            reason,
        }
    }

    fn is_of(&self, job: &FloorJob) -> bool {
        self.made_for == MadeFor::of(job)
            && self.light_direction == job.pond.light_direction
            && self.pebbles == job.waves.impulses.len()
    }
}

impl Inside<FloorJob> for Frames {
    fn record(&mut self, job: &FloorJob, encoder: &mut wgpu::CommandEncoder) -> Result<Recorded, String> {
        self.refit(job)?;
        let is_right = self.is_right_for(job);
        let Some(Running { planned: Planned { plan, .. }, frames, .. }) = &mut self.running else {
            return Ok(Recorded::Nothing);
        };
        *frames = frames.saturating_add(1);
        let Waves { impulses, time_s } = &job.waves;
        let basin = &job.basin;
        let executor = &mut self.executor;
        plan.write_light(executor, &job.pond)
            .and_then(|()| plan.write_impulses(executor, &basin.ripple, impulses, basin.walls, *time_s))
            .map_err(|error| error.to_string())?;
        executor.record(encoder).map_err(|error| error.to_string())?;
        let picture = plan.picture().and_then(|picture| executor.buffer(picture)).cloned();
        let size = plan.size().map(|side| side as u32);
        self.times = if self.last.as_ref() == Some(job) { self.times + 1 } else { 1 };
        self.last = Some(job.clone());
        Ok(match picture {
            Some(picture) if is_right && self.times > COUNTED_AFTER => Recorded::Picture(picture, size),
            Some(picture) if is_right => Recorded::Provisional(picture, size),
            Some(picture) => Recorded::Late(picture, size),
            None => Recorded::Nothing,
        })
    }

    fn report(&mut self) -> Report<FloorFacts> {
        let Some(Running { planned: Planned { plan, fit, .. }, outside, .. }) = &self.running else {
            return Report::default();
        };
        let facts = FloorFacts { fit: fit.clone(), outside: *outside };
        Report::of(&mut self.executor, plan.plan.decisions.clone(), facts)
    }
}
