//! [`AsmRenderer`]: caustics for applications that want nothing else.

use ash::vk;
use asm_core::{BakePlan, Picture, PlanError, RenderPlan, Settings, Statistics, bake_plan, render_plan};
use frame_plan::{ExecuteError, Executor};
use spectral_core::display::Display;
use spectral_scene::{IrradianceMaps, Scene};

use crate::{ASM_PASSES, DisplayPass, HostImage, VulkanExecutor, VulkanHost, VulkanOptions};

/// Makes asm-core's plans and runs them on Vulkan.
///
/// [`AsmRenderer::bake`] and [`AsmRenderer::render`] answer at once. In real time, [`AsmRenderer::prepare`] a picture when the
/// scene's structure changes, and [`AsmRenderer::record`] it every frame into a command buffer and an image of the host's.
pub struct AsmRenderer {
    // Fields drop in this order.
    display: Option<DisplayPass>,
    executor: VulkanExecutor,
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
}

impl AsmRenderer {
    /// A renderer with a device of its own.
    ///
    /// # Errors
    /// [`ExecuteError::NoDevice`].
    pub fn new(options: &VulkanOptions) -> Result<Self, AsmError> {
        Ok(Self::with_executor(VulkanExecutor::new(ASM_PASSES, options)?))
    }

    /// A renderer on a host's device.
    ///
    /// # Errors
    /// If the device is out of memory.
    ///
    /// # Safety
    /// As [`VulkanExecutor::from_host`].
    pub unsafe fn from_host(host: VulkanHost) -> Result<Self, AsmError> {
        // SAFETY: as the function demands.
        let executor = unsafe { VulkanExecutor::from_host(host, ASM_PASSES) }?;
        Ok(Self::with_executor(executor))
    }

    const fn with_executor(executor: VulkanExecutor) -> Self {
        Self { display: None, executor, prepared: None }
    }

    /// The executor, for its device, limits and step times.
    pub const fn executor(&mut self) -> &mut VulkanExecutor {
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

    /// Record a frame of the prepared picture, and its display in `target` (level 0 of layer 0, through its view), into a
    /// host's command buffer.
    ///
    /// # Errors
    /// If nothing is prepared, the target has no view, or the device failed.
    ///
    /// # Safety
    /// As [`VulkanExecutor::record`] for the command buffer, and [`VulkanExecutor::import_image`] for the target.
    pub unsafe fn record(
        &mut self,
        commands: vk::CommandBuffer,
        target: &HostImage,
        display: &Display,
    ) -> Result<(), AsmError> {
        let render = self.prepared.as_ref().ok_or_else(ExecuteError::nothing_prepared)?;
        let picture = render.plan.resource("picture").ok_or_else(ExecuteError::nothing_prepared)?;
        // The display first: if it cannot be made, nothing is recorded.
        if self.display.as_ref().is_none_or(|pass| pass.format() != target.format) {
            self.display = Some(DisplayPass::new(&self.executor, target.format)?);
        }
        // SAFETY: as the function demands; the display is recorded once, after the frame.
        unsafe {
            self.executor.record(commands)?;
            if let Some(pass) = &mut self.display {
                pass.record(&mut self.executor, commands, (picture, render.size), target, display)?;
            }
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
