//! Choosing what runs a plan.

use asm_core::PASSES;
use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use wgpu::DeviceType;

use crate::args::RunArgs;
use crate::choices::Backend;
use crate::error::CliError;

/// An executor and why it was chosen.
pub(crate) struct Chosen {
    pub(crate) executor: Box<dyn Executor>,
    pub(crate) reason: String,
}

/// The executor that the options ask for.
///
/// `auto` takes wgpu only on a real GPU: a software driver runs the same arithmetic on the same cores as the CPU
/// executor, and slower: `bake sphere-fine` took 7.5 s on two cores and 12 s on llvmpipe over the same two.
///
/// # Errors
/// If a backend or adapter that was asked for by name is not there.
pub(crate) fn choose(run: &RunArgs) -> Result<Chosen, CliError> {
    match (run.backend, &run.adapter) {
        (Backend::Cpu, _) => cpu(run, "asked for".into()),
        (Backend::Wgpu, _) | (Backend::Auto, Some(_)) => {
            let executor = wgpu(run.adapter.clone()).map_err(|problem| {
                CliError::failed(format!(
                    "{problem}; `spectral devices` lists what there is, --backend cpu always works"
                ))
            })?;
            Ok(Chosen { executor: Box::new(executor), reason: "asked for".into() })
        }
        (Backend::Auto, None) => match wgpu(None) {
            Ok(gpu) if is_software(&gpu) => {
                let driver = &gpu.info().driver;
                cpu(
                    run,
                    format!(
                        "the best wgpu adapter is a software driver ({driver}), which the CPU executor outruns"
                    ),
                )
            }
            Ok(gpu) => Ok(Chosen { executor: Box::new(gpu), reason: "wgpu has a GPU".into() }),
            Err(problem) => cpu(run, problem),
        },
    }
}

/// Whether the adapter computes on the CPU.
pub(crate) fn is_software(executor: &WgpuExecutor) -> bool {
    executor.device().adapter_info().device_type == DeviceType::Cpu
}

/// The wgpu executor on the adapter of that name, or on the best one; or why there is none.
pub(crate) fn wgpu(adapter: Option<String>) -> Result<WgpuExecutor, String> {
    WgpuExecutor::new(PASSES, &WgpuOptions { adapter }).map_err(|error| error.to_string())
}

fn cpu(run: &RunArgs, reason: String) -> Result<Chosen, CliError> {
    let executor = CpuExecutor::new(PASSES, run.threads).map_err(CliError::failed)?;
    Ok(Chosen { executor: Box::new(executor), reason })
}
