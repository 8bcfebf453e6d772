//! The device that tests run on.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]

use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::{ExecuteError, Executor, PassSet, Plan};

/// An executor, or none if there is no device and `SPECTRAL_ALLOW_SKIP=1` allows to skip the test.
///
/// `SPECTRAL_ADAPTER` chooses an adapter by part of its name.
pub fn executor(passes: PassSet) -> Option<WgpuExecutor> {
    let options = WgpuOptions { adapter: std::env::var("SPECTRAL_ADAPTER").ok() };
    match WgpuExecutor::new(passes, &options) {
        Ok(executor) => Some(executor),
        Err(ExecuteError::NoDevice { reason, .. })
            if std::env::var("SPECTRAL_ALLOW_SKIP").is_ok_and(|v| v == "1") =>
        {
            eprintln!("skipped: {reason}");
            None
        }
        Err(error) => panic!(
            "{error}\nThese tests need a wgpu device: install a Vulkan driver (Mesa's lavapipe will do), or set \
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
