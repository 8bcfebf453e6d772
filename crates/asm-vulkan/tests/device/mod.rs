//! The device that tests run on.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]

use asm_vulkan::{VulkanExecutor, VulkanOptions, validation_is_available};
use frame_plan::spirv::{SpirvPasses, compile};
use frame_plan::{ExecuteError, Executor, PassSet, Plan};

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
    made(VulkanExecutor::new(passes, &options()))
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

/// What was made, or none if there is no device and skipping is allowed.
pub fn made<T>(result: Result<T, ExecuteError>) -> Option<T> {
    match result {
        Ok(made) => Some(made),
        Err(ExecuteError::NoDevice { reason, .. })
            if std::env::var("SPECTRAL_ALLOW_SKIP").is_ok_and(|v| v == "1") =>
        {
            eprintln!("skipped: {reason}");
            None
        }
        Err(error) => panic!(
            "{error}\nThese tests need a Vulkan 1.3 device: install a driver (Mesa's lavapipe will do), or set \
             SPECTRAL_ALLOW_SKIP=1 to skip them."
        ),
    }
}

/// Run one frame of a plan and read a resource.
pub fn run(executor: &mut dyn Executor, plan: &Plan, name: &str) -> Vec<u8> {
    executor.prepare(plan).unwrap();
    executor.execute().unwrap();
    read(executor, plan, name)
}

pub fn read(executor: &mut dyn Executor, plan: &Plan, name: &str) -> Vec<u8> {
    executor.read(plan.resource(name).unwrap()).unwrap()
}

pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(bytes)
}

pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(bytes)
}

pub fn halves(bytes: &[u8]) -> Vec<f32> {
    bytemuck::pod_collect_to_vec::<u8, u16>(bytes)
        .into_iter()
        .map(|h| half::f16::from_bits(h).to_f32())
        .collect()
}
