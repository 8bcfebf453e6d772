//! glTF 2.0 in and out.
//!
//! | extension | in | simulated |
//! |---|---|---|
//! | `KHR_materials_ior` | n_d | yes |
//! | `KHR_materials_dispersion` | 20 / V_d, Cauchy form | yes |
//! | `KHR_materials_transmission` | factor | refracts if above 0; the texture is ignored |
//! | `KHR_materials_volume` | attenuation | yes; `thicknessFactor` is kept, real geometry is traced |
//! | `KHR_materials_iridescence` | kept | no |
//! | `KHR_materials_emissive_strength` | kept | no: emitters are not light sources here |
//! | `KHR_lights_punctual` | all three kinds | yes |
//!
//! `extras.spectral` overrides what these cannot say. On a material: `{"cauchy": [A, B_um2, C_um4]}` (2 or 3
//! numbers), `{"glass": "N-BK7"}` or `{"sellmeier": [[B, C_um2], ...]}`. On a light: `{"illuminant": "E"}`,
//! `{"line_nm": 546.1}`, `{"cct_k": 3200}` (a black body below 4000 K, CIE daylight above),
//! `{"black_body_k": 5000}` or `{"color": [r, g, b]}` (D65 times the smooth upsampling of this linear sRGB colour).
//!
//! Textures, vertex colours, skins, morph targets and animations are ignored with a [`Warning`]. A file that
//! requires any other extension is refused by that extension's name.
//!
//! The document is read by serde into our own types rather than through the `gltf` crate: its numbers are f32
//! where a [`Scene`](crate::Scene) holds f64, so nothing written would come back the same, and indices beyond
//! 32 bits, short `.glb` headers and sparse accessors can make version 1.4 wrap or panic.

mod accessor;
mod container;
mod document;
mod error;
mod light;
mod load;
mod material;
mod mesh;
mod save;

pub use error::{LoadError, Warning};
pub use load::{load, load_bytes};
pub use save::{SaveError, to_glb};

/// Extensions that a file may require.
const SUPPORTED_EXTENSIONS: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_transmission",
    "KHR_materials_volume",
];
