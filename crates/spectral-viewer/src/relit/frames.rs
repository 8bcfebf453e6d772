//! Frames of a plan on one executor: numbers are written unless the structure is another.

use std::sync::Arc;

use asm_core::Picture;
use frame_plan::{Decision, Executor, ResourceId};
use glam::DMat3;
use spectral_cli::RelitView;
use spectral_core::basis::SpectralBasis;
use spectral_prt::figures::{GRID, OBSERVER};
use spectral_prt::{Exposure, Projection, Relighting, RelightingSettings, Shot};

use super::choices::Colors;
use super::job::RelitJob;

/// A plan, and what it is for.
struct Running {
    colors: Colors,
    settings: RelightingSettings,
    /// Of spectral colours.
    basis: Option<SpectralBasis>,
    relighting: Relighting,
}

/// Pictures of one stage by one executor.
pub(super) struct Frames<E> {
    stage: Arc<RelitView>,
    pub(super) executor: E,
    running: Option<Running>,
}

impl<E: Executor> Frames<E> {
    pub(super) fn new(stage: Arc<RelitView>, executor: E) -> Self {
        Self { stage, executor, running: None }
    }

    /// Bring the executor to this picture: by numbers alone, unless colours, size or samples have changed.
    ///
    /// # Errors
    /// Those of basis, plan and device, in a sentence.
    pub(super) fn prepare(&mut self, job: &RelitJob) -> Result<(), String> {
        let settings = RelightingSettings { size: job.size, samples: job.samples };
        let is_running = |running: &Running| (running.colors, running.settings) == (job.colors, settings);
        if self.running.as_ref().is_some_and(is_running) {
            return self.write(job);
        }
        // The old plan goes before the new one comes. Its basis is good for any size.
        let old = self.running.take().filter(|old| old.colors == job.colors);
        let basis = match (old, job.colors) {
            (Some(old), _) => old.basis,
            (None, Colors::Spectral(basis, coefficients)) => {
                Some(self.stage.trained(basis, coefficients).map_err(|error| error.to_string())?)
            }
            (None, Colors::Rgb | Colors::Sampled) => None,
        };
        let projection = projection(job.colors, basis.as_ref());
        let palette = self.stage.palette(&projection);
        let scene = self.stage.scene(&palette);
        let limits = self.executor.limits();
        let relighting = with_shot(&self.stage, &projection, job, |shot| {
            Relighting::new(&scene, shot, &settings, &limits).map_err(|error| error.to_string())
        })?;
        self.executor.prepare(&relighting.plan).map_err(|error| error.to_string())?;
        self.running = Some(Running { colors: job.colors, settings, basis, relighting });
        Ok(())
    }

    fn write(&mut self, job: &RelitJob) -> Result<(), String> {
        let Some(Running { basis, relighting, .. }) = &self.running else { return Ok(()) };
        let executor = &mut self.executor;
        with_shot(&self.stage, &projection(job.colors, basis.as_ref()), job, |shot| {
            relighting.write(executor, shot).map_err(|error| error.to_string())
        })
    }

    /// Run the frame and read its picture.
    ///
    /// # Errors
    /// Those of [`Frames::prepare`] and of the executor.
    pub(super) fn picture(&mut self, job: &RelitJob) -> Result<Picture, String> {
        self.prepare(job)?;
        self.executor.execute().map_err(|error| error.to_string())?;
        let Some(Running { relighting, .. }) = &self.running else {
            return Err("nothing is prepared".into());
        };
        relighting.read(&mut self.executor).map_err(|error| error.to_string())
    }

    /// The buffer with the picture.
    pub(super) fn buffer(&self) -> Option<ResourceId> {
        self.running.as_ref().map(|running| running.relighting.picture())
    }

    /// Which passes run, and why.
    pub(super) fn decisions(&self) -> Vec<Decision> {
        self.running.as_ref().map(|running| running.relighting.plan.decisions.clone()).unwrap_or_default()
    }
}

fn projection(colors: Colors, basis: Option<&SpectralBasis>) -> Projection<'_> {
    match (colors, basis) {
        (Colors::Spectral(..), Some(basis)) => Projection::Spectral(basis),
        (Colors::Rgb, _) => Projection::Rgb(GRID, OBSERVER),
        (Colors::Sampled | Colors::Spectral(..), _) => Projection::Sampled(GRID, OBSERVER),
    }
}

/// What a frame of this job writes.
fn with_shot<T>(
    stage: &RelitView,
    projection: &Projection<'_>,
    job: &RelitJob,
    then: impl FnOnce(&Shot<'_>) -> T,
) -> T {
    let relamped = job.lamp.map(|lamp| stage.environment.in_light(lamp));
    let environment = relamped.as_ref().unwrap_or(&stage.environment);
    then(&Shot {
        sky: &environment.sky.projected(projection),
        rotation: DMat3::from_quat(job.turn),
        camera: &job.camera,
        exposure: Exposure { factor: 1.0, balance: environment.balance() },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relit::view::tests::view;
    use crate::subject::Subject;
    use frame_plan::cpu::CpuExecutor;
    use glam::DQuat;
    use spectral_cli::Basis;
    use spectral_core::illuminant::Illuminant;
    use spectral_prt::PASSES;

    /// Sky, light and camera are numbers of a frame; whatever else changes makes another plan.
    #[test]
    fn a_frame_makes_nothing_and_shows_what_a_new_plan_shows() {
        let view = view("glass --environment FL4 --bands 2");
        let frames = || {
            let executor = CpuExecutor::new(PASSES, None).expect("threads");
            Frames::new(Arc::clone(&view.stage), executor)
        };
        let begun = view.job([48, 36]);
        let mut running = frames();
        let first = running.picture(&begun).expect("a picture");
        (0..2).for_each(|_| drop(running.picture(&begun)));
        let made = running.executor.made();
        let turn = DQuat::from_rotation_y(1.0) * DQuat::from_rotation_x(0.4);
        let lamp = Some(Illuminant::A);
        let mut camera = begun.camera.clone();
        camera.yfov_rad *= 0.9;
        for job in [
            RelitJob { turn, ..begun.clone() },
            RelitJob { lamp, ..begun.clone() },
            RelitJob { camera: camera.clone(), ..begun.clone() },
            RelitJob { turn, lamp, camera, ..begun.clone() },
        ] {
            let picture = running.picture(&job).expect("a picture");
            assert_eq!(running.executor.made(), made);
            assert_ne!(picture, first);
            assert_eq!(picture, frames().picture(&job).expect("a picture"));
        }
        assert_eq!(running.picture(&begun), Ok(first));
        let eight = RelitJob { colors: Colors::Spectral(Basis::Optimal, 8), ..begun };
        running.picture(&eight).expect("a picture");
        assert_ne!(running.executor.made(), made);
    }
}
