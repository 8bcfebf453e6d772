//! Runs [`frame_plan`] plans on Vulkan 1.3 through ash: headless, or inside a host application's device and command buffer.
//!
//! [`VulkanExecutor`] knows plans and passes, no method. Its parts are those of `asm-wgpu`: [`adapters`] and the choice of one
//! (`adapter`), a device with its errors (`device`), pipelines per pass (`pipeline`), buffers, textures and parameters of a plan
//! (`resources`), recording of its steps (`command`), reading back (`readback`), times per step (`timing`) and the
//! translation of formats and states (`conv`). What wgpu does by itself is here, too: objects that clean up (`object`), barriers
//! from what steps do with resources (`barrier`), descriptor sets (`descriptor`), writes between frames (`upload`), compiled
//! pipelines on disk (`cache`), Khronos' layer that checks all this (`validation`).
//!
//! Shaders come as SPIR-V that build scripts make of the passes' WGSL: see [`frame_plan::spirv`]. [`ASM_PASSES`] are those of
//! asm-core.
//!
//! [`AsmRenderer`] is for applications that want caustics and nothing else: it makes asm-core's plans and runs them, and
//! [`DisplayPass`] records them into a host's command buffer and brings the picture to an image of the host's.
//!
//! Examples: `vulkan_headless` bakes without a window, `vulkan_host` puts caustics into another application's frame. Tests need a device, and
//! fail without one unless `SPECTRAL_ALLOW_SKIP=1`; `SPECTRAL_ADAPTER` chooses one by part of its name. They run with Khronos'
//! validation and synchronization validation where that is installed; `SPECTRAL_REQUIRE_VALIDATION=1` fails them without.
#![allow(unsafe_code, reason = "ash leaves Vulkan's rules to its caller; each block says why they hold")]
#![warn(clippy::undocumented_unsafe_blocks)]

mod adapter;
mod barrier;
mod cache;
mod command;
mod conv;
mod descriptor;
mod device;
mod display;
mod executor;
mod object;
mod pipeline;
mod readback;
mod resources;
mod timing;
mod upload;
mod validation;

use std::borrow::Cow;

use frame_plan::spirv::SpirvPasses;

pub use adapter::{VulkanOptions, adapters, validation_is_available};
pub use ash;
pub use device::VulkanHost;
pub use display::DisplayPass;
pub use executor::VulkanExecutor;
pub use resources::{HostBuffer, HostImage};

/// asm-core's renderer on Vulkan: `AsmRenderer::new(VulkanExecutor::new(ASM_PASSES, &options)?)`.
pub type AsmRenderer = asm_core::AsmRenderer<VulkanExecutor>;

/// asm-core's passes with their SPIR-V, compiled when this crate was built.
pub const ASM_PASSES: SpirvPasses = SpirvPasses {
    passes: asm_core::PASSES,
    modules: Cow::Borrowed(include!(concat!(env!("OUT_DIR"), "/asm_passes.rs"))),
};
