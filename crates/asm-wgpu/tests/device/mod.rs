//! The device that tests run on.
#![allow(dead_code, unreachable_pub, reason = "every test binary includes this module and uses some of it")]

#[path = "../../../frame-plan/tests/on_device/support.rs"]
mod support;

use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::{DeviceInfo, ExecuteError, PassSet};
pub use support::*;

/// What the executor is called.
pub const ID: &str = "wgpu";

/// An executor, or none if there is no device and `SPECTRAL_ALLOW_SKIP=1` allows to skip the test.
///
/// `SPECTRAL_ADAPTER` chooses an adapter by part of its name.
pub fn executor(passes: PassSet) -> Option<WgpuExecutor> {
    made_or_skipped(open(passes, std::env::var("SPECTRAL_ADAPTER").ok()))
}

/// An executor on the adapter of this name.
pub fn open(passes: PassSet, adapter: Option<String>) -> Result<WgpuExecutor, ExecuteError> {
    WgpuExecutor::new(passes, &WgpuOptions { adapter })
}

/// Devices to choose from.
pub fn adapters() -> Vec<DeviceInfo> {
    asm_wgpu::adapters()
}

pub fn timed(executor: &WgpuExecutor) -> Timed {
    let features = executor.device().features();
    if features.contains(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS) {
        Timed::Steps
    } else if features.contains(wgpu::Features::TIMESTAMP_QUERY) {
        Timed::Passes
    } else {
        Timed::Nothing
    }
}
