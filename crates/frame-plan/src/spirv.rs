//! Passes with their shaders in SPIR-V, for executors that take no WGSL.
//!
//! Feature `spirv` adds the functions `compile`, `compile_wgsl` and `write_modules`, for build scripts and tests:
//!
//! ```text
//! // build.rs
//! write_modules(&compile(PASSES)?.modules, &out_dir, "passes")?;
//! // lib.rs
//! const SPIRV_PASSES: SpirvPasses =
//!     SpirvPasses { passes: PASSES, modules: Cow::Borrowed(include!(concat!(env!("OUT_DIR"), "/passes.rs"))) };
//! ```

use std::borrow::Cow;

#[cfg(feature = "spirv")]
mod compile;

#[cfg(feature = "spirv")]
pub use compile::{SpirvError, compile, compile_wgsl, write_modules};

use crate::{PassInfo, PassKind, PassSet};

/// A pass set and the SPIR-V of all its entry points.
#[derive(Clone)]
pub struct SpirvPasses {
    /// The passes.
    pub passes: PassSet,
    /// One module per entry point.
    pub modules: Cow<'static, [SpirvModule]>,
}

/// A SPIR-V 1.6 module with one entry point, as little-endian words. Indices into arrays of known length are always kept inside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpirvModule {
    /// Name of the entry point: see [`PassInfo`].
    pub entry_point: Cow<'static, str>,
    /// For devices that keep accesses inside buffers themselves (`robustBufferAccess2`).
    pub unchecked: Cow<'static, [u8]>,
    /// For other devices: the shader clamps indices into buffers.
    pub restricted: Cow<'static, [u8]>,
}

impl SpirvPasses {
    /// The module of an entry point.
    #[must_use]
    pub fn module(&self, entry_point: &str) -> Option<&SpirvModule> {
        self.modules.iter().find(|m| m.entry_point == entry_point)
    }
}

impl PassInfo {
    /// Names of the entry points: one, or vertex and fragment.
    #[must_use]
    pub fn entry_points(&self) -> Vec<String> {
        match self.kind {
            PassKind::Compute { .. } => vec![self.name.into()],
            PassKind::Draw { .. } => ["vertex", "fragment"].map(|s| format!("{}_{s}", self.name)).to_vec(),
        }
    }
}
