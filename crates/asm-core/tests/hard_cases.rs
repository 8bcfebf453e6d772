//! Cases that break assumptions, on the CPU.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "on_device/hard_cases.rs"]
mod hard_cases;
#[path = "on_device/many_photons.rs"]
mod many_photons;
#[path = "caustics/stage.rs"]
#[allow(dead_code, reason = "made for the tests of plans")]
mod stage;

/// What tests on devices choose from: here the CPU, which is always there.
mod device {
    use frame_plan::PassSet;
    use frame_plan::cpu::CpuExecutor;

    pub(crate) fn executor(passes: PassSet) -> Option<CpuExecutor> {
        Some(CpuExecutor::new(passes, None).unwrap())
    }

    pub(crate) fn words(bytes: &[u8]) -> Vec<u32> {
        bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned).collect()
    }
}
