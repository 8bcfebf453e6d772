//! Scenes as plain data: meshes, materials with spectra, lights, cameras.
//!
//! Units are metres, lux (directional lights), candela (point and spot lights) and nanometres;
//! the world is right-handed with +Y up, as in glTF.

mod scene;

pub use scene::*;
