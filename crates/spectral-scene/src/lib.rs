//! Scenes as plain data: meshes, materials with spectra, lights, cameras.
//!
//! Units are metres, lux (directional lights), candela (point and spot lights) and nanometres;
//! the world is right-handed with +Y up, as in glTF.

mod bundled;
mod camera;
mod scene;
mod select;
mod validate;

pub use bundled::{BUNDLED, bundled};
pub use scene::*;
pub use select::{ReceiverError, WorldMesh};
pub use validate::{SceneCounts, SceneError};
