//! The device that tests run on.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]

#[path = "../../../frame-plan/tests/on_device/support.rs"]
mod support;

use asm_vulkan::{VulkanExecutor, VulkanOptions, validation_is_available};
use frame_plan::spirv::{SpirvPasses, compile};
use frame_plan::{DeviceInfo, ExecuteError, PassSet};
pub use support::*;

/// What the executor is called.
pub const ID: &str = "vulkan";

/// Passes with their SPIR-V, compiled now.
pub fn compiled(passes: PassSet) -> SpirvPasses {
    compile(passes).unwrap_or_else(|error| panic!("{error}"))
}

/// An executor, or none if there is no device and `SPECTRAL_ALLOW_SKIP=1` allows to skip the test.
///
/// `SPECTRAL_ADAPTER` chooses an adapter by part of its name.
pub fn executor(passes: PassSet) -> Option<VulkanExecutor> {
    executor_of(compiled(passes))
}

pub fn executor_of(passes: SpirvPasses) -> Option<VulkanExecutor> {
    made_or_skipped(VulkanExecutor::new(passes, &options()))
}

/// Every call is validated where the validation layer is installed.
pub fn options() -> VulkanOptions {
    let adapter = std::env::var("SPECTRAL_ADAPTER").ok();
    VulkanOptions { adapter, validation: validation(), ..VulkanOptions::default() }
}

/// Whether the validation layer is there; says so if it is not, and fails where `SPECTRAL_REQUIRE_VALIDATION=1`.
pub fn validation() -> bool {
    let available = validation_is_available();
    let required = std::env::var("SPECTRAL_REQUIRE_VALIDATION").is_ok_and(|v| v == "1");
    assert!(available || !required, "no validation layer: install vulkan-validationlayers (Debian)");
    if !available {
        eprintln!("NOT VALIDATED: install vulkan-validationlayers (Debian) to have every call checked");
    }
    available
}

/// An executor on the adapter of this name.
pub fn open(passes: PassSet, adapter: Option<String>) -> Result<VulkanExecutor, ExecuteError> {
    VulkanExecutor::new(compiled(passes), &VulkanOptions { adapter, ..options() })
}

/// Devices to choose from.
pub fn adapters() -> Vec<DeviceInfo> {
    asm_vulkan::adapters()
}

/// Every queue that draws has timestamps on the devices that we know.
pub fn timed(_: &VulkanExecutor) -> Timed {
    Timed::Steps
}
