//! Sources of the passes, joined in order: shared files first. The build script compiles the same for Vulkan.

const VIEW: &str = include_str!("../../../../shaders/shared/view.wgsl");
const TRIANGLE: &str = include_str!("../../../../shaders/shared/triangle.wgsl");
const HARMONICS: &str = include_str!("../../../../shaders/shared/harmonics.wgsl");
const PRT_PICTURE: &str = include_str!("../../../../shaders/shared/prt_picture.wgsl");

pub(crate) const PRT_LIGHT: &[&str] = &[include_str!("../../../../shaders/prt_light.wgsl")];
pub(crate) const PRT_VERTEX: &[&str] = &[include_str!("../../../../shaders/prt_vertex.wgsl")];
pub(crate) const PRT_GLOSS: &[&str] = &[VIEW, HARMONICS, include_str!("../../../../shaders/prt_gloss.wgsl")];
pub(crate) const PRT_SHADE: &[&str] =
    &[VIEW, TRIANGLE, PRT_PICTURE, include_str!("../../../../shaders/prt_shade.wgsl")];
pub(crate) const PRT_SHADE_MAPS: &[&str] =
    &[VIEW, TRIANGLE, PRT_PICTURE, include_str!("../../../../shaders/prt_shade_maps.wgsl")];

/// Every pass of this crate by its name.
#[cfg(feature = "spirv")]
#[allow(dead_code, reason = "the build script reads it, the crate does not")]
pub(crate) const ALL: &[(&str, &[&str])] = &[
    ("prt_light", PRT_LIGHT),
    ("prt_vertex", PRT_VERTEX),
    ("prt_gloss", PRT_GLOSS),
    ("prt_shade", PRT_SHADE),
    ("prt_shade_maps", PRT_SHADE_MAPS),
];
