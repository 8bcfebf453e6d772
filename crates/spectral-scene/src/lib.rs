//! Scenes as plain data: meshes, materials with spectra, lights, cameras.
//!
//! Units are metres, lux (directional lights), candela (point and spot lights) and nanometres;
//! the world is right-handed with +Y up, as in glTF. A [`Scene`] comes from [`open`]: one of the [`bundled`]
//! scenes or a [glTF file](gltf); [`Effects`] says which light transport it calls for.

mod bundled;
mod camera;
mod effects;
pub mod gltf;
mod immersion;
mod material;
mod open;
mod scene;
mod select;
mod topology;
mod validate;

pub use bundled::{BUNDLED, bundled};
pub use effects::{Effect, Effects};
pub use gltf::{LoadError, SaveError, Warning, load, load_bytes, to_glb};
pub use material::MIRROR_ROUGHNESS;
pub use open::{OpenError, open};
pub use scene::*;
pub use select::{ReceiverError, WorldMesh};
pub use topology::Topology;
pub use validate::{SceneCounts, SceneError};
