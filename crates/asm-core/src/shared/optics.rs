//! Host side of `shaders/shared/optics.wgsl`: what a material does to light of one wavelength.

use bytemuck::{Pod, Zeroable};

/// A material at one wavelength; mirrors `Optics`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Optics {
    /// Refractive index.
    pub index: f32,
    /// Absorption per working unit.
    pub absorption: f32,
    /// Share of refracted light that the surface lets pass; a mirror's reflectance at normal incidence.
    pub surface: f32,
    /// Padding.
    pub reserved: f32,
}
