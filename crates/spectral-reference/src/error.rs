//! What can be wrong with a request.

use spectral_scene::SceneError;

/// Why nothing was baked or rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The scene breaks a rule that every consumer relies on.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There is no such object.
    #[error("receiver {object} does not exist, the scene has {count} objects")]
    UnknownObject {
        /// The index asked for.
        object: usize,
        /// How many there are.
        count: usize,
    },
    /// The receiver lets light through.
    #[error("`{name}` refracts, a receiver is opaque")]
    ReceiverRefracts {
        /// The object's name.
        name: String,
    },
    /// Nothing lands on the receiver.
    #[error("`{name}` is a mirror, a receiver is matt")]
    ReceiverMirrors {
        /// The object's name.
        name: String,
    },
    /// The receiver has no texture coordinates.
    #[error("`{name}` has no texture coordinates to bake onto")]
    ReceiverHasNoUvs {
        /// The object's name.
        name: String,
    },
    /// There is nothing to look through.
    #[error("the scene has no camera, and none was given")]
    NoCamera,
    /// A map or picture without texels, or with too many.
    #[error("size is {width} x {height}; both must be 1 to {max}")]
    Size {
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
        /// The most of either.
        max: u32,
    },
    /// A setting outside its range.
    #[error("{name} is {got}; it must be {expected}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        got: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// Threads could not be started.
    #[error("could not start {threads} threads: {source}")]
    Threads {
        /// How many were asked for; 0 means one per core.
        threads: usize,
        /// What the system said.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Most reflections that can be asked for.
const MAX_BOUNCES: u32 = 1000;

/// The most texels or pixels along one side.
const MAX_SIDE: u32 = 8192;

pub(crate) fn check_size([width, height]: [u32; 2]) -> Result<(), ReferenceError> {
    let fits = |side| (1..=MAX_SIDE).contains(&side);
    if fits(width) && fits(height) {
        Ok(())
    } else {
        Err(ReferenceError::Size { width, height, max: MAX_SIDE })
    }
}

pub(crate) fn check_bounces(bounces: u32) -> Result<(), ReferenceError> {
    check_setting(bounces <= MAX_BOUNCES, "bounces", f64::from(bounces), "at most 1000")
}

pub(crate) fn check_step(step_nm: f64) -> Result<(), ReferenceError> {
    check_setting((1.0..=5.0).contains(&step_nm), "step_nm", step_nm, "1 to 5")
}

pub(crate) fn check_setting(
    ok: bool,
    name: &'static str,
    got: f64,
    expected: &'static str,
) -> Result<(), ReferenceError> {
    if ok { Ok(()) } else { Err(ReferenceError::Setting { name, got, expected }) }
}
