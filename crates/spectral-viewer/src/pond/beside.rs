//! Floors on a thread beside the window's, by an executor of their own or by none.

use std::time::Instant;

use asm_wgpu::WgpuExecutor;
use caustic_heightfield::{FloorGrid, Photon, PhotonSettings, PondError};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use spectral_cli::backend::{self, PONDS, SCENES};
use spectral_cli::{Floor, Floors};

use super::fit::{self, MadeFor, Method, Planned};
use super::job::{FloorFacts, FloorJob, picture, report_of_host};
use super::pebbles::Waves;
use crate::graphics::Graphics;
use crate::maker::Finished;
use crate::runner::Runner;
use crate::subject::Report;
use crate::worker::{Wake, Worker};

/// An executor, opened where it is used.
type Opener = Box<dyn Fn() -> Result<Box<dyn Executor>, String> + Send>;

/// How executors are opened: for the pond's passes, and for those of `asm-core`, which `photon` runs.
struct Openers {
    ponds: Opener,
    scenes: Opener,
}

/// Floors by this runner.
pub(super) fn worker(
    runner: Runner,
    graphics: &Graphics,
    wake: Wake,
) -> Worker<FloorJob, Finished<FloorJob>> {
    let openers = Openers::new(runner, graphics);
    Worker::start(wake, move || {
        let mut floors = Beside { openers, ready: None };
        Ok(move |job: FloorJob| floors.make(job))
    })
}

impl Openers {
    fn new(runner: Runner, graphics: &Graphics) -> Self {
        let cpu = |passes| -> Opener {
            Box::new(move || match CpuExecutor::new(passes, None) {
                Ok(cpu) => Ok(Box::new(cpu)),
                Err(error) => Err(error.to_string()),
            })
        };
        let window = |passes| -> Opener {
            let (device, queue) = (graphics.device.clone(), graphics.queue.clone());
            Box::new(move || Ok(Box::new(WgpuExecutor::from_host(device.clone(), queue.clone(), passes))))
        };
        match runner {
            Runner::Cpu => Self { ponds: cpu(caustic_heightfield::PASSES), scenes: cpu(asm_core::PASSES) },
            Runner::Wgpu => {
                Self { ponds: window(caustic_heightfield::PASSES), scenes: window(asm_core::PASSES) }
            }
            Runner::Vulkan => Self {
                ponds: Box::new(|| Ok(Box::new(backend::vulkan(&PONDS, None)?))),
                scenes: Box::new(|| Ok(Box::new(backend::vulkan(&SCENES, None)?))),
            },
        }
    }
}

/// A method that is ready.
enum Ready {
    Plan { planned: Box<Planned>, executor: Box<dyn Executor> },
    Host { floors: Floors, fit: String },
    Photon { photon: Box<Photon>, executor: Box<dyn Executor> },
}

struct Beside {
    openers: Openers,
    ready: Option<(MadeFor, Ready)>,
}

type Made = (Floor, Report<FloorFacts>);

impl Beside {
    fn make(&mut self, job: FloorJob) -> Result<Finished<FloorJob>, String> {
        let made_for = MadeFor::of(&job);
        let was_ready = self.ready.as_ref().is_some_and(|(made_before, _)| *made_before == made_for);
        if !was_ready {
            self.prepare(&job)?;
        }
        let (mut floor, mut report) = self.run(&job)?;
        // Waves or light have become unlike those that the method was fitted to.
        if was_ready && fit::is_unlike(report.facts.outside) {
            self.prepare(&job)?;
            (floor, report) = self.run(&job)?;
        }
        Ok(Finished { picture: picture(&floor, job.basin.white_xyz), job, report })
    }

    fn prepare(&mut self, job: &FloorJob) -> Result<(), String> {
        // An executor may be large: the old one goes first, unless it can go on.
        let ready = match (job.choices.is_spectral(), self.ready.take()) {
            (true, before) => {
                let executor = match before {
                    Some((_, Ready::Photon { executor, .. })) => executor,
                    _ => (self.openers.scenes)()?,
                };
                let settings = PhotonSettings {
                    dispersion: job.choices.dispersion,
                    spectrum: job.basin.spectrum.clone(),
                    ..PhotonSettings::default()
                };
                let photon = Photon::new(&job.pond, settings).map_err(|error| error.to_string())?;
                Ready::Photon { photon: Box::new(photon), executor }
            }
            (false, before) => match fit::method(job).map_err(|error| error.to_string())? {
                Method::Host(floors, fit) => Ready::Host { floors, fit },
                Method::Plan(planned) => {
                    let (running, mut executor) = match before {
                        Some((_, Ready::Plan { planned, executor })) => (Some(planned.plan), executor),
                        _ => (None, (self.openers.ponds)()?),
                    };
                    let started = planned.start(running, executor.as_mut());
                    let (planned, _) = started.map_err(|error| error.to_string())?;
                    Ready::Plan { planned: Box::new(planned), executor }
                }
            },
        };
        self.ready = Some((MadeFor::of(job), ready));
        Ok(())
    }

    fn run(&mut self, job: &FloorJob) -> Result<Made, String> {
        let Some((_, ready)) = &mut self.ready else { return Err("no method is ready".into()) };
        ready.floor(job).map_err(|error| error.to_string())
    }
}

impl Ready {
    fn floor(&mut self, job: &FloorJob) -> Result<Made, PondError> {
        match self {
            Self::Plan { planned, executor } => {
                let Planned { plan, fit, .. } = planned.as_mut();
                let executor = executor.as_mut();
                let Waves { impulses, time_s } = &job.waves;
                plan.write_light(executor, &job.pond)?;
                plan.write_impulses(executor, &job.basin.ripple, impulses, job.basin.walls, *time_s)?;
                executor.execute()?;
                let frame = plan.read(executor)?;
                let outside = frame.outside_states as f64 / frame.light.irradiance.len() as f64;
                let facts = FloorFacts { fit: fit.clone(), outside };
                Ok((frame.light.into(), Report::of(executor, plan.plan.decisions.clone(), facts)))
            }
            Self::Host { floors, fit } => {
                let surface = job.surface()?;
                let begun = Instant::now();
                let floor = floors.below(&surface)?;
                let milliseconds = 1e3 * begun.elapsed().as_secs_f64();
                let outside = floor.outside as f64 / floor.light.irradiance.len() as f64;
                let facts = FloorFacts { fit: fit.clone(), outside };
                Ok((floor, report_of_host(&job.choices, milliseconds, facts)))
            }
            Self::Photon { photon, executor } => {
                let executor = executor.as_mut();
                photon.set_pond(&job.pond)?;
                let surface = job.surface()?;
                let made = photon.floor(&surface, FloorGrid::below(&surface), executor)?;
                let decisions = photon.prepared().map(|plan| plan.bake.plan.decisions.clone());
                let xyz = job.choices.dispersion.then_some(made.xyz);
                let floor = Floor { xyz, ..made.light.into() };
                Ok((floor, Report::of(executor, decisions.unwrap_or_default(), FloorFacts::default())))
            }
        }
    }
}
