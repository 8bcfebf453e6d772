//! A frame as plain data: passes, resources, and the executors that run them.
//!
//! A [`Plan`] is built once when a scene's structure changes; a frame only updates parameters. It
//! names its passes; a [`PassSet`] says what each name means: a WGSL module for GPU executors and a
//! plain Rust function, the CPU mirror, for [`cpu::CpuExecutor`]. This crate knows no scene and no method.
//!
//! Features: `reflect` adds the module of that name, which compares passes with their WGSL through naga, for tests;
//! `spirv` adds the compiler to [`spirv`], for build scripts.

pub mod cpu;
pub mod device;
mod executor;
pub mod memory;
mod pass;
mod plan;
#[cfg(feature = "reflect")]
pub mod reflect;
mod resource;
pub mod spirv;
mod validate;

pub use executor::*;
pub use pass::*;
pub use plan::*;
pub use resource::*;
