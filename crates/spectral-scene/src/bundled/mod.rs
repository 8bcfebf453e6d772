//! Scenes made in code, the same bits every time, addressed by name wherever a scene file could stand.
//!
//! `sphere`, `sphere-fine` and `gem` are the scenes of the outside references, to the last number; face counts
//! of the others follow Table 2 of Blanchette & Agu (ASM, 2013).

mod diamond;
mod facets;
mod gem;
mod glass;
mod lamps;
mod metal_ring;
mod organic;
mod prism;
mod ring;
mod sphere;
mod stage;
mod surfaces;
mod underwater;
mod water;

use spectral_core::dispersion::Dispersion;

use crate::Scene;

/// Names of the bundled scenes. Each has a main receiver named `receiver`, a light or more, and a camera.
pub const BUNDLED: &[&str] = &[
    "prism",
    "sphere",
    "sphere-fine",
    "ring",
    "gem",
    "diamond",
    "glass",
    "organic",
    "water",
    "metal-ring",
    "underwater",
    "lamps",
];

/// The bundled scene of this name; `None` if [`BUNDLED`] does not list it.
pub fn bundled(name: &str) -> Option<Scene> {
    Some(match name {
        "prism" => prism::scene(),
        "sphere" => sphere::scene(name, 4),
        "sphere-fine" => sphere::scene(name, 7),
        "ring" => ring::scene(),
        "gem" => gem::scene(),
        "diamond" => diamond::scene(),
        "glass" => glass::scene(),
        "organic" => organic::scene(),
        "water" => water::scene(),
        "metal-ring" => metal_ring::scene(),
        "underwater" => underwater::scene(),
        "lamps" => lamps::scene(),
        _ => return None,
    })
}

/// A glass that the catalogue is known to hold.
fn catalogue(name: &str) -> Dispersion {
    spectral_core::glass::by_name(name).expect("the glasses of the bundled scenes are in the catalogue")
}
