//! Sources of the passes, joined in order: shared files first. The build script compiles the same for Vulkan.

const POND: &str = include_str!("../../../../shaders/shared/pond.wgsl");
const REPORT: &str = include_str!("../../../../shaders/shared/pond_report.wgsl");
const REFRACT: &str = include_str!("../../../../shaders/shared/refract.wgsl");

pub(crate) const POND_HEIGHTS: &[&str] = &[POND, include_str!("../../../../shaders/pond_heights.wgsl")];
pub(crate) const POND_RELIEF: &[&str] = &[POND, include_str!("../../../../shaders/pond_relief.wgsl")];
pub(crate) const POND_SURFACE: &[&str] =
    &[POND, REPORT, REFRACT, include_str!("../../../../shaders/pond_surface.wgsl")];
pub(crate) const POND_PRODUCT: &[&str] = &[include_str!("../../../../shaders/pond_product.wgsl")];
pub(crate) const POND_COEFFICIENTS: &[&str] =
    &[REPORT, include_str!("../../../../shaders/pond_coefficients.wgsl")];
pub(crate) const POND_CONVOLVE: &[&str] = &[POND, include_str!("../../../../shaders/pond_convolve.wgsl")];
pub(crate) const POND_FFT: &[&str] = &[include_str!("../../../../shaders/pond_fft.wgsl")];
pub(crate) const POND_SPECTRUM: &[&str] = &[include_str!("../../../../shaders/pond_spectrum.wgsl")];
pub(crate) const POND_CROP: &[&str] = &[POND, include_str!("../../../../shaders/pond_crop.wgsl")];
pub(crate) const POND_PICTURE: &[&str] = &[POND, include_str!("../../../../shaders/pond_picture.wgsl")];

/// Every pass by its name.
#[cfg(feature = "spirv")]
#[allow(dead_code, reason = "the build script reads it, and the crate's tests")]
pub(crate) const ALL: &[(&str, &[&str])] = &[
    ("pond_heights", POND_HEIGHTS),
    ("pond_relief", POND_RELIEF),
    ("pond_surface", POND_SURFACE),
    ("pond_product", POND_PRODUCT),
    ("pond_coefficients", POND_COEFFICIENTS),
    ("pond_convolve", POND_CONVOLVE),
    ("pond_fft", POND_FFT),
    ("pond_spectrum", POND_SPECTRUM),
    ("pond_crop", POND_CROP),
    ("pond_picture", POND_PICTURE),
];
