//! The same plans on the CPU and on Vulkan.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/on_device/parity.rs"]
mod parity;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;
