//! Choosing what runs a plan.

use std::path::PathBuf;

use asm_core::PASSES;
use asm_vulkan::{ASM_PASSES, VulkanExecutor, VulkanOptions};
use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::cpu::CpuExecutor;
use frame_plan::spirv::SpirvPasses;
use frame_plan::{DeviceInfo, DeviceType, Executor, PassSet};

use crate::args::DeviceArgs;
use crate::choices::Backend;
use crate::error::CliError;

/// An executor and why it was chosen.
pub(crate) struct Chosen {
    pub(crate) executor: Box<dyn Executor>,
    pub(crate) reason: String,
}

/// What executors are made for.
pub struct Programs {
    passes: PassSet,
    spirv: SpirvPasses,
}

/// Pictures and bakes of scenes.
pub const SCENES: Programs = Programs { passes: PASSES, spirv: ASM_PASSES };

/// Floors of ponds.
pub const PONDS: Programs =
    Programs { passes: caustic_heightfield::PASSES, spirv: caustic_heightfield::SPIRV_PASSES };

/// Surfaces under skies, by their transfer.
pub const RELIT: Programs = Programs { passes: spectral_prt::PASSES, spirv: spectral_prt::SPIRV_PASSES };

/// The executor that the options ask for.
///
/// `auto` takes wgpu only on a real GPU: a software driver runs the same arithmetic on the same cores as the CPU
/// executor, and slower: `bake sphere-fine` took 7.5 s on two cores and 12 s on llvmpipe over the same two.
///
/// # Errors
/// If a backend or adapter that was asked for by name is not there.
pub(crate) fn choose(device: &DeviceArgs, programs: &Programs) -> Result<Chosen, CliError> {
    match (device.backend, &device.adapter) {
        (Backend::Cpu, _) => cpu(device, programs, "asked for".into()),
        (Backend::Wgpu, _) | (Backend::Auto, Some(_)) => {
            let executor = wgpu_for(programs, device.adapter.clone()).map_err(no_device)?;
            Ok(Chosen { executor: Box::new(executor), reason: "asked for".into() })
        }
        (Backend::Vulkan, _) => {
            let executor = vulkan(programs, device.adapter.clone()).map_err(no_device)?;
            Ok(Chosen { executor: Box::new(executor), reason: "asked for".into() })
        }
        (Backend::Auto, None) => match auto(&asm_wgpu::adapters()) {
            Err(reason) => cpu(device, programs, reason),
            Ok(reason) => match wgpu_for(programs, None) {
                Ok(gpu) => Ok(Chosen { executor: Box::new(gpu), reason }),
                Err(problem) => cpu(device, programs, problem),
            },
        },
    }
}

/// Why `auto` takes wgpu on a machine with these adapters, or why it does not.
///
/// # Errors
/// The reason to take the CPU.
pub fn auto(adapters: &[DeviceInfo]) -> Result<String, String> {
    let software = |adapter: &&DeviceInfo| adapter.device_type == DeviceType::Cpu;
    match (adapters.iter().find(|a| !software(a)), adapters.first()) {
        (Some(gpu), _) => Ok(format!("wgpu has a GPU, {}", gpu.device)),
        (None, Some(DeviceInfo { driver, .. })) => {
            Err(format!("wgpu has a software driver only ({driver}), which the CPU executor outruns"))
        }
        (None, None) => Err("wgpu finds no adapter".into()),
    }
}

/// The wgpu executor on the adapter of that name, or on the best one; or why there is none.
pub(crate) fn wgpu(adapter: Option<String>) -> Result<WgpuExecutor, String> {
    wgpu_for(&SCENES, adapter)
}

fn wgpu_for(programs: &Programs, adapter: Option<String>) -> Result<WgpuExecutor, String> {
    WgpuExecutor::new(programs.passes, &WgpuOptions { adapter }).map_err(|error| error.to_string())
}

/// The Vulkan executor for these programs on the adapter of that name, or on the best one. Compiled pipelines are kept in the user's
/// cache folder.
///
/// # Errors
/// Why there is none.
pub fn vulkan(programs: &Programs, adapter: Option<String>) -> Result<VulkanExecutor, String> {
    let options = VulkanOptions { adapter, pipeline_cache: cache_folder(), ..VulkanOptions::default() };
    VulkanExecutor::new(programs.spirv.clone(), &options).map_err(|error| error.to_string())
}

/// Where users' programs keep what they can make again.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let folder = variable(if cfg!(windows) { "LOCALAPPDATA" } else { "XDG_CACHE_HOME" });
    Some(folder.or_else(|| variable("HOME").map(|home| home.join(".cache")))?.join("spectral"))
}

fn no_device(problem: String) -> CliError {
    CliError::failed(format!("{problem}; `spectral devices` lists what there is, --backend cpu always works"))
}

fn cpu(device: &DeviceArgs, programs: &Programs, reason: String) -> Result<Chosen, CliError> {
    let executor = CpuExecutor::new(programs.passes, device.threads).map_err(CliError::failed)?;
    Ok(Chosen { executor: Box::new(executor), reason })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(device: &str, device_type: DeviceType) -> DeviceInfo {
        DeviceInfo { device: device.into(), device_type, ..DeviceInfo::default() }
    }

    #[test]
    fn auto_takes_wgpu_where_any_adapter_is_no_software_driver() {
        let software = adapter("llvmpipe", DeviceType::Cpu);
        for gpu in [DeviceType::Integrated, DeviceType::Discrete, DeviceType::Virtual, DeviceType::Other] {
            let reason = auto(&[software.clone(), adapter("a card", gpu)]).expect("a GPU");
            assert!(reason.contains("a card"), "{reason}");
        }
        assert!(auto(&[software]).expect_err("no GPU").contains("software"));
        assert!(auto(&[]).expect_err("no GPU").contains("no adapter"));
    }
}
