//! Passes: what a name in a plan means to an executor.

use crate::TextureFormat;
use crate::cpu::{Fragment, MirrorArgs, VertexOutput};

/// A compute or draw pass: the WGSL module of its name, its bindings and its CPU mirror.
///
/// Everything is in bind group 0. If `params_bytes` is not 0, binding 0 is the uniform struct and the
/// entries of `bindings` follow at 1, 2, ...; otherwise they start at 0. A compute entry point has the
/// pass's name, a draw's are `<name>_vertex` and `<name>_fragment`.
pub struct PassInfo {
    /// Name of the pass, its WGSL file, its parameter struct's file and its mirror.
    pub name: &'static str,
    /// WGSL sources, joined in order: shared files first, the pass's own file last.
    pub wgsl: &'static [&'static str],
    /// Name of the uniform struct in the WGSL, empty if there is none.
    pub params_struct: &'static str,
    /// Size of the uniform struct, 0 if there is none.
    pub params_bytes: u32,
    /// Resources, in binding order.
    pub bindings: &'static [Binding],
    /// What the pass runs.
    pub kind: PassKind,
}

/// A binding of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Name of the WGSL variable.
    pub name: &'static str,
    /// How the pass uses it.
    pub kind: BindingKind,
}

/// How a pass uses a resource.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>` without atomics.
    Write,
    /// `var<storage, read_write>` of `atomic<u32>`, for adding. A buffer bound so in any pass of a plan is held as atomics by
    /// the CPU executor; passes that only read it bind it as [`BindingKind::ReadAtomic`].
    Atomic,
    /// `var<storage, read>` of plain u32, of a buffer that other passes bind as [`BindingKind::Atomic`].
    ReadAtomic,
    /// Sampled or loaded texture; float textures are unfilterable unless `filter`.
    Texture {
        /// Integer rather than float texels.
        uint: bool,
        /// May be used with a linear sampler.
        filter: bool,
        /// 2-D array rather than 2-D.
        array: bool,
    },
    /// Depth texture, loaded.
    DepthTexture,
    /// Write-only storage texture.
    StorageTexture {
        /// Its format.
        format: TextureFormat,
    },
    /// Sampler.
    Sampler {
        /// Filtering sampler.
        filter: bool,
    },
}

/// What a pass runs.
pub enum PassKind {
    /// A compute shader.
    Compute {
        /// Workgroup size, as in the WGSL.
        workgroup: [u32; 3],
        /// CPU mirror: does the work of the whole dispatch.
        mirror: fn(&MirrorArgs<'_>),
    },
    /// A draw of triangles.
    Draw {
        /// Formats of the colour targets, at most 4.
        targets: &'static [TextureFormat],
        /// Depth test, if there is a depth target; a passing fragment's depth is written.
        depth: Option<DepthTest>,
        /// Which triangles are dropped, by winding after projection (counter-clockwise is front).
        cull: Cull,
        /// Add to float targets instead of replacing.
        additive: bool,
        /// CPU mirror of the vertex entry point: vertex index, instance index.
        vertex: fn(&MirrorArgs<'_>, u32, u32) -> VertexOutput,
        /// CPU mirror of the fragment entry point, run at each covered texel centre; `None` discards. A target of an
        /// unsigned format takes the integer value of the first component, exact up to 2^24.
        fragment: fn(&MirrorArgs<'_>, &Fragment) -> Option<[[f32; 4]; 4]>,
    },
}

/// Which depth wins. Cleared depth is the loser's: 1 for `Less`, 0 for `Greater`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthTest {
    /// Nearest.
    Less,
    /// Farthest.
    Greater,
}

/// Which triangles a draw drops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cull {
    /// None.
    None,
    /// Those that face away.
    Back,
    /// Those that face the viewer.
    Front,
}

/// The passes a plan may name.
#[derive(Clone, Copy)]
pub struct PassSet(pub &'static [&'static PassInfo]);

impl PassSet {
    /// Look a pass up by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&'static PassInfo> {
        self.0.iter().find(|p| p.name == name).copied()
    }
}

impl PassInfo {
    /// The whole WGSL module.
    #[must_use]
    pub fn source(&self) -> String {
        self.wgsl.concat()
    }

    /// Binding index of entry `i` of `bindings`.
    #[must_use]
    pub const fn binding_index(&self, i: u32) -> u32 {
        if self.params_bytes == 0 { i } else { i + 1 }
    }
}
