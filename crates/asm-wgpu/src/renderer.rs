//! [`AsmRenderer`]: caustics for applications that want nothing else.

use asm_core::{
    BakePlan, PASSES, Picture, PlanError, RenderPlan, Settings, Statistics, bake_plan, render_plan,
};
use frame_plan::{ExecuteError, Executor};
use spectral_core::display::Display;
use spectral_scene::{IrradianceMaps, Scene};

use crate::{DisplayPass, WgpuExecutor, WgpuOptions};

/// Makes asm-core's plans and runs them on wgpu.
///
/// [`AsmRenderer::bake`] and [`AsmRenderer::render`] answer at once. In real time, [`AsmRenderer::prepare`] a picture when the
/// scene's structure changes, and [`AsmRenderer::record`] it every frame into an encoder and a texture of the host's.
pub struct AsmRenderer {
    executor: WgpuExecutor,
    prepared: Option<RenderPlan>,
    display: Option<(wgpu::TextureFormat, DisplayPass)>,
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
}

impl AsmRenderer {
    /// A renderer with a device of its own.
    ///
    /// # Errors
    /// [`ExecuteError::NoDevice`].
    pub fn new(options: &WgpuOptions) -> Result<Self, AsmError> {
        Ok(Self::with_executor(WgpuExecutor::new(PASSES, options)?))
    }

    /// A renderer on a host's device; see [`WgpuExecutor::from_host`].
    #[must_use]
    pub fn from_host(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        Self::with_executor(WgpuExecutor::from_host(device, queue, PASSES))
    }

    const fn with_executor(executor: WgpuExecutor) -> Self {
        Self { executor, prepared: None, display: None }
    }

    /// The executor, for its device, limits and step times.
    pub const fn executor(&mut self) -> &mut WgpuExecutor {
        &mut self.executor
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
        let bake: BakePlan = bake_plan(scene, receiver, size, settings, &self.executor.limits())?;
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
        self.prepare(scene, camera, size, settings)?;
        self.executor.execute()?;
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
        let render = render_plan(scene, camera, size, settings, &self.executor.limits())?;
        self.prepared = None;
        self.executor.prepare(&render.plan)?;
        self.prepared = Some(render);
        Ok(())
    }

    /// Record a frame of the prepared picture, and its display in `target` (level 0 of its texture), into a host's encoder.
    ///
    /// # Errors
    /// If nothing is prepared, or the device failed.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        display: &Display,
    ) -> Result<(), AsmError> {
        let render = self.prepared.as_ref().ok_or_else(ExecuteError::nothing_prepared)?;
        self.executor.record(encoder)?;
        let picture = render.plan.resource("picture").and_then(|id| self.executor.buffer(id));
        let picture = picture.ok_or_else(ExecuteError::nothing_prepared)?;
        let (device, queue) = (self.executor.device(), self.executor.queue());
        let format = target.texture().format();
        if self.display.as_ref().is_none_or(|(made_for, _)| *made_for != format) {
            self.display = Some((format, DisplayPass::new(device, format)));
        }
        if let Some((_, pass)) = &mut self.display {
            pass.record(device, queue, encoder, (picture, render.size), target, display);
        }
        Ok(())
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
