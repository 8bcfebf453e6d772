//! Why there is no plan.

use spectral_core::wavelengths::WavelengthError;
use spectral_scene::SceneError;

/// Why a scene, its settings and a device's limits make no plan. Nothing has been allocated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The scene itself is not usable.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// No such wavelengths.
    #[error(transparent)]
    Wavelengths(#[from] WavelengthError),
    /// A setting is outside what it can mean.
    #[error("{setting} is {got}, it must be {expected}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Its value.
        got: String,
        /// What would be right.
        expected: String,
    },
    /// An index that points past the end of the scene's list.
    #[error("there is no {what} {index}, the scene has {count}")]
    NoSuch {
        /// `object` or `camera`.
        what: &'static str,
        /// The index asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// The object cannot be baked onto.
    #[error("`{object}` cannot be baked onto: {reason}")]
    NotAReceiver {
        /// Its name.
        object: String,
        /// Why not.
        reason: &'static str,
    },
    /// More triangles than visibility buffers can name.
    #[error("the scene has {got} triangles, a visibility buffer names up to {max}")]
    TooManyTriangles {
        /// Triangles with an area.
        got: usize,
        /// Most that a plan takes.
        max: usize,
    },
    /// A light stands where its view of the refractors would be a panorama.
    #[error(
        "light `{light}` sees the refractors over {opening_deg:.0} degrees, the emission view takes up to {max_deg:.0}: \
         move it away from them"
    )]
    LightTooClose {
        /// Its name.
        light: String,
        /// Full opening of the cone round the refractors; 360 inside their bounds.
        opening_deg: f64,
        /// Most that a plan takes.
        max_deg: f64,
    },
    /// A light so far off that f32 cannot tell its rays apart.
    #[error(
        "light `{light}` is {radii:.1e} scene radii away, rays are told apart up to {max_radii:.0e}: \
         make it a directional light"
    )]
    LightTooFar {
        /// Its name.
        light: String,
        /// Its distance in radii of the scene.
        radii: f64,
        /// Most that a plan takes.
        max_radii: f64,
    },
    /// A resource that does not fit into the device.
    #[error("{what} needs {needed} {unit}, the device takes {max}: lower {remedy}")]
    Limit {
        /// The resource.
        what: String,
        /// What it needs.
        needed: u64,
        /// What of.
        unit: &'static str,
        /// What the device has.
        max: u64,
        /// The setting that helps.
        remedy: &'static str,
    },
    /// All photons together could overflow the map's 64 bits.
    #[error(
        "{texels} emission texels times {wavelengths} wavelengths are more than the {max} photons that the map can add up"
    )]
    TooManyPhotons {
        /// Texels of the emission view.
        texels: u64,
        /// Wavelengths per texel.
        wavelengths: u64,
        /// Most that a plan takes.
        max: u64,
    },
}
