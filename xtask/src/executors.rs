//! The executors of the project, in the order in which they are compared.

use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{ExecuteError, Executor};

/// An executor that a machine may or may not be able to start.
pub struct Candidate {
    /// Name in reports: `cpu`, `wgpu`.
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
];
