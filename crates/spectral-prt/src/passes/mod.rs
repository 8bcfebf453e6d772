//! The passes: per stem a WGSL file in `shaders/` and here its parameters, bindings and CPU mirror. Which triangle is seen is
//! found by asm-core's `visibility`.

use asm_core::passes::visibility::VISIBILITY;
use frame_plan::{Binding, BindingKind, PassSet};

pub mod prt_gloss;
pub mod prt_light;
pub mod prt_shade;
pub mod prt_shade_maps;
pub mod prt_vertex;
mod wgsl;

/// Every pass that plans of this crate name.
pub const PASSES: PassSet = PassSet(&[
    &prt_light::PRT_LIGHT,
    &prt_vertex::PRT_VERTEX,
    &prt_gloss::PRT_GLOSS,
    &VISIBILITY,
    &prt_shade::PRT_SHADE,
    &prt_shade_maps::PRT_SHADE_MAPS,
]);

/// The passes with their SPIR-V, compiled when this crate was built.
#[cfg(feature = "spirv")]
pub const SPIRV_PASSES: frame_plan::spirv::SpirvPasses = frame_plan::spirv::SpirvPasses {
    passes: PASSES,
    modules: std::borrow::Cow::Borrowed(include!(concat!(env!("OUT_DIR"), "/prt_passes.rs"))),
};

/// Terms in a block: passes take four at a time.
pub(crate) const BLOCK: usize = 4;

const fn binding(name: &'static str, kind: BindingKind) -> Binding {
    Binding { name, kind }
}
