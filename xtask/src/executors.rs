//! The executors of the project, in the order in which they are compared.

use asm_core::{BakePlan, RenderPlan, Statistics};
use asm_vulkan::{ASM_PASSES, VulkanExecutor, VulkanOptions};
use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::cpu::CpuExecutor;
use frame_plan::spirv::SpirvPasses;
use frame_plan::{ExecuteError, Executor, PassSet};
use spectral_scene::IrradianceMaps;

/// A started executor, or why it cannot be started.
pub type Opened = Result<Box<dyn Executor>, ExecuteError>;

/// An executor that a machine may or may not be able to start.
pub struct Candidate {
    /// `cpu`, `wgpu`, `vulkan`.
    pub id: &'static str,
    /// Name in checks.
    pub name: &'static str,
    /// Starts it on the adapter of this name, or on the most powerful one.
    pub open: fn(adapter: Option<&str>) -> Opened,
}

const WGPU: Candidate =
    Candidate { id: "wgpu", name: "wgpu", open: |adapter| wgpu(asm_core::PASSES, adapter) };

const VULKAN: Candidate =
    Candidate { id: "vulkan", name: "vulkan", open: |adapter| vulkan(ASM_PASSES, adapter) };

fn cpu(passes: PassSet) -> Opened {
    Ok(Box::new(CpuExecutor::new(passes, None)?))
}

fn wgpu(passes: PassSet, adapter: Option<&str>) -> Opened {
    let options = WgpuOptions { adapter: adapter.map(str::to_owned) };
    Ok(Box::new(WgpuExecutor::new(passes, &options)?))
}

fn vulkan(passes: SpirvPasses, adapter: Option<&str>) -> Opened {
    let options = VulkanOptions { adapter: adapter.map(str::to_owned), ..VulkanOptions::default() };
    Ok(Box::new(VulkanExecutor::new(passes, &options)?))
}

/// All of them. The first needs no device, so every machine has it.
pub const EXECUTORS: &[Candidate] =
    &[Candidate { id: "cpu", name: "cpu", open: |_| cpu(asm_core::PASSES) }, WGPU, VULKAN];

/// The same for the pond's passes.
pub const POND_EXECUTORS: &[Candidate] = &[
    Candidate { id: "cpu", name: "cpu", open: |_| cpu(caustic_heightfield::PASSES) },
    Candidate { id: "wgpu", name: "wgpu", open: |adapter| wgpu(caustic_heightfield::PASSES, adapter) },
    Candidate {
        id: "vulkan",
        name: "vulkan",
        open: |adapter| vulkan(caustic_heightfield::SPIRV_PASSES, adapter),
    },
];

/// The same for relighting.
pub const PRT_EXECUTORS: &[Candidate] = &[
    Candidate { id: "cpu", name: "cpu", open: |_| cpu(spectral_prt::PASSES) },
    Candidate { id: "wgpu", name: "wgpu", open: |adapter| wgpu(spectral_prt::PASSES, adapter) },
    Candidate { id: "vulkan", name: "vulkan", open: |adapter| vulkan(spectral_prt::SPIRV_PASSES, adapter) },
];

/// Those that have a device, for a second driver beside the first.
pub const ON_SECOND_DRIVER: &[Candidate] = &[
    Candidate { name: "wgpu, second driver", ..WGPU },
    Candidate { name: "vulkan, second driver", ..VULKAN },
];

/// A name that no executor has.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("--executor {id}: no such executor; there are {}", EXECUTORS.iter().map(|c| c.id).collect::<Vec<_>>().join(", "))]
pub struct UnknownExecutor {
    /// What was asked for.
    pub id: String,
}

/// Those of these names, or all of them if none is given.
///
/// # Errors
/// Names the first that there is not.
pub fn named(ids: &[String]) -> Result<Vec<&'static Candidate>, UnknownExecutor> {
    named_of(EXECUTORS, ids)
}

/// As [`named`], of some of them.
///
/// # Errors
/// As [`named`].
pub fn named_of(
    all: &'static [Candidate],
    ids: &[String],
) -> Result<Vec<&'static Candidate>, UnknownExecutor> {
    if ids.is_empty() {
        return Ok(all.iter().collect());
    }
    let find =
        |id: &String| all.iter().find(|c| c.id == id).ok_or_else(|| UnknownExecutor { id: id.clone() });
    ids.iter().map(find).collect()
}

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
