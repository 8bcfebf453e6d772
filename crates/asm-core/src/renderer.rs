//! [`AsmRenderer`]: caustics for applications that want nothing else.

use frame_plan::{ExecuteError, Executor};
use spectral_scene::{IrradianceMaps, Scene};

use crate::{Picture, PlanError, Planner, RenderPlan, Settings, Statistics, UpdateError};

/// Makes this crate's plans and runs them on an executor that was made with this crate's passes.
///
/// [`AsmRenderer::bake`] and [`AsmRenderer::render`] answer at once. In real time, [`AsmRenderer::update`] the picture with what
/// has moved and run it, every frame: by [`AsmRenderer::execute`], or inside a host's own frame by the executor's crate, whose
/// `DisplayPass` records it and brings it to a texture of the host's.
pub struct AsmRenderer<E> {
    executor: E,
    planner: Planner,
    prepared: Option<RenderPlan>,
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AsmError {
    /// The scene and the settings make no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The plan did not run.
    #[error(transparent)]
    Execute(#[from] ExecuteError),
    /// The prepared plan could not be moved on.
    #[error(transparent)]
    Update(#[from] UpdateError),
}

/// How [`AsmRenderer::update`] brought the device to the next frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Updated {
    /// By writing numbers: nothing was allocated or compiled on the device.
    Moved,
    /// By preparing a plan of another structure.
    Prepared,
}

impl<E: Executor> AsmRenderer<E> {
    /// A renderer on an executor of [`crate::PASSES`].
    #[must_use]
    pub fn new(executor: E) -> Self {
        Self { executor, planner: Planner::default(), prepared: None }
    }

    /// The executor, for its device, limits and step times. A plan that is prepared on it directly takes the picture's place
    /// only for the device: call [`AsmRenderer::prepare`] afterwards.
    pub const fn executor(&mut self) -> &mut E {
        &mut self.executor
    }

    /// The plan of the prepared picture.
    pub const fn prepared(&self) -> Option<&RenderPlan> {
        self.prepared.as_ref()
    }

    /// Irradiance on the UV square of `receiver`, an index into [`Scene::objects`]. Replaces a prepared picture.
    ///
    /// # Errors
    /// Those of the plan and of its run.
    pub fn bake(
        &mut self,
        scene: &Scene,
        receiver: usize,
        size: [u32; 2],
        settings: &Settings,
    ) -> Result<(IrradianceMaps, Statistics), AsmError> {
        let bake = self.planner.bake(scene, receiver, size, settings, &self.executor.limits())?;
        self.prepared = None;
        self.executor.prepare(&bake.plan)?;
        self.executor.execute()?;
        Ok(bake.read(&mut self.executor)?)
    }

    /// What `camera`, an index into [`Scene::cameras`], sees: XYZ radiance. Leaves the picture prepared.
    ///
    /// # Errors
    /// Those of the plan and of its run.
    pub fn render(
        &mut self,
        scene: &Scene,
        camera: usize,
        size: [u32; 2],
        settings: &Settings,
    ) -> Result<(Picture, Statistics), AsmError> {
        self.update(scene, camera, size, settings)?;
        self.execute()?;
        self.read()
    }

    /// Make everything for frames of what `camera` sees: plan, pipelines, memory.
    ///
    /// # Errors
    /// Those of the plan, and of the device that takes it.
    pub fn prepare(
        &mut self,
        scene: &Scene,
        camera: usize,
        size: [u32; 2],
        settings: &Settings,
    ) -> Result<(), AsmError> {
        let render = self.planner.render(scene, camera, size, settings, &self.executor.limits())?;
        self.take(render)
    }

    fn take(&mut self, render: RenderPlan) -> Result<(), AsmError> {
        self.prepared = None;
        self.executor.prepare(&render.plan)?;
        render.watch_statistics(&mut self.executor)?;
        self.prepared = Some(render);
        Ok(())
    }

    /// Bring the prepared picture to a scene whose lights, cameras or objects have moved, or whose materials' numbers have
    /// changed, from the next frame on. Whatever else has changed, or if nothing is prepared, the picture is prepared anew.
    ///
    /// # Errors
    /// Those of the plan, which leave the picture as it is; those of the device.
    pub fn update(
        &mut self,
        scene: &Scene,
        camera: usize,
        size: [u32; 2],
        settings: &Settings,
    ) -> Result<Updated, AsmError> {
        let next = self.planner.render(scene, camera, size, settings, &self.executor.limits())?;
        match &mut self.prepared {
            Some(current) if current.has_structure_of(&next) => {
                current.write_changes(&mut self.executor, next)?;
                Ok(Updated::Moved)
            }
            _ => {
                self.take(next)?;
                Ok(Updated::Prepared)
            }
        }
    }

    /// Run a frame of the prepared picture.
    ///
    /// # Errors
    /// If nothing is prepared, or the device failed.
    pub fn execute(&mut self) -> Result<(), AsmError> {
        if self.prepared.is_none() {
            return Err(ExecuteError::nothing_prepared().into());
        }
        Ok(self.executor.execute()?)
    }

    /// Statistics of the last frame of the prepared picture that is known to have finished: a frame late or more, without waiting.
    /// None if there is none yet.
    pub fn latest_statistics(&mut self) -> Option<Statistics> {
        self.prepared.as_ref()?.latest_statistics(&mut self.executor)
    }

    /// Wait for the last frame of the prepared picture and read it.
    ///
    /// # Errors
    /// If nothing is prepared, or the device failed.
    pub fn read(&mut self) -> Result<(Picture, Statistics), AsmError> {
        let render = self.prepared.as_ref().ok_or_else(ExecuteError::nothing_prepared)?;
        Ok(render.read(&mut self.executor)?)
    }
}
