//! The SCENE argument: opened, checked, its warnings printed.

use spectral_scene::{OpenError, Scene};

use crate::error::CliError;
use crate::messages;

/// A scene and what its file says that we do not do.
pub struct Opened {
    /// The scene.
    pub scene: Scene,
    /// What was ignored, a sentence each.
    pub warnings: Vec<String>,
}

/// Open a bundled scene or a file, with warnings on standard error.
///
/// # Errors
/// A usage error if there is no such scene; a failure if its file is wrong.
pub fn open(argument: &str) -> Result<Opened, CliError> {
    let (scene, warnings) = spectral_scene::open(argument).map_err(|error| match error {
        OpenError::NoSuchScene { .. } => CliError::usage(error),
        _ => CliError::failed(error),
    })?;
    let warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    for warning in &warnings {
        messages::warn(warning);
    }
    Ok(Opened { scene, warnings })
}
