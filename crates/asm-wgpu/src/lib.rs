//! Runs [`frame_plan`] plans on wgpu: headless, or inside a host application's device and encoder.
//!
//! [`WgpuExecutor`] knows plans and passes, no method. Its parts: [`adapters`] and the choice of one (`adapter`), errors and
//! allocation of a device (`device`), pipelines per pass (`pipeline`), buffers, textures and parameters of a plan
//! (`resources`), recording of its steps (`command`), reading back (`readback`), times per step (`timing`), writes between
//! frames (`upload`), buffers that come back with frames (`ring`) and the translation of formats and states (`conv`).
//!
//! [`AsmRenderer`] is for applications that want caustics and nothing else: it makes asm-core's plans and runs them, and
//! [`DisplayPass`] records them into a host's encoder and brings the picture to a texture of the host's.
//!
//! Examples: `headless` bakes without a window, `pond` drops pebbles into `caustic-heightfield`'s, `host` puts caustics into another application's frame. Tests need a device, and
//! fail without one unless `SPECTRAL_ALLOW_SKIP=1`; `SPECTRAL_ADAPTER` chooses one by part of its name.

mod adapter;
mod command;
mod conv;
mod device;
mod display;
mod executor;
mod pipeline;
mod readback;
mod resources;
mod ring;
mod timing;
mod upload;

pub use adapter::{WgpuOptions, adapters};
pub use device::device_descriptor;
pub use display::DisplayPass;
pub use executor::WgpuExecutor;
pub use wgpu;

/// asm-core's renderer on wgpu: `AsmRenderer::new(WgpuExecutor::new(asm_core::PASSES, &options)?)`.
pub type AsmRenderer = asm_core::AsmRenderer<WgpuExecutor>;
