//! Moving frames on wgpu.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../asm-core/tests/on_device/moving.rs"]
mod moving;
