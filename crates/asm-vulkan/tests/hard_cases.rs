//! Cases that break assumptions, on Vulkan.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../asm-core/tests/on_device/hard_cases.rs"]
mod hard_cases;
#[path = "../../asm-core/tests/on_device/many_photons.rs"]
mod many_photons;
#[path = "../../asm-core/tests/caustics/stage.rs"]
#[allow(dead_code, reason = "made for asm-core's own tests")]
mod stage;
