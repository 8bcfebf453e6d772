//! The executors of the project, in the order in which they are compared.

use asm_core::{BakePlan, RenderPlan, Statistics};
use asm_vulkan::{ASM_PASSES, VulkanExecutor, VulkanOptions};
use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{ExecuteError, Executor};
use spectral_scene::IrradianceMaps;

/// An executor that a machine may or may not be able to start.
pub struct Candidate {
    /// Name in reports: `cpu`, `wgpu`, `vulkan`.
    pub id: &'static str,
    /// Starts it.
    pub open: fn() -> Result<Box<dyn Executor>, ExecuteError>,
}

/// All of them. The first needs no device, so every machine has it.
pub const EXECUTORS: &[Candidate] = &[
    Candidate { id: "cpu", open: || Ok(Box::new(CpuExecutor::new(asm_core::PASSES, None)?)) },
    Candidate {
        id: "wgpu",
        open: || Ok(Box::new(WgpuExecutor::new(asm_core::PASSES, &WgpuOptions::default())?)),
    },
    Candidate {
        id: "vulkan",
        open: || Ok(Box::new(VulkanExecutor::new(ASM_PASSES, &VulkanOptions::default())?)),
    },
];

/// One frame of a bake that is prepared anew.
///
/// # Errors
/// Those of the executor.
pub fn bake(
    plan: &BakePlan,
    executor: &mut dyn Executor,
) -> Result<(IrradianceMaps, Statistics), ExecuteError> {
    executor.prepare(&plan.plan)?;
    executor.execute()?;
    plan.read(executor)
}

/// One frame of a picture that is prepared anew: XYZ per pixel.
///
/// # Errors
/// Those of the executor.
pub fn render(plan: &RenderPlan, executor: &mut dyn Executor) -> Result<Vec<[f32; 3]>, ExecuteError> {
    executor.prepare(&plan.plan)?;
    executor.execute()?;
    Ok(plan.read(executor)?.0.xyz)
}
