//! A scene by the one argument a user gives: a bundled name or a file.

use std::path::Path;

use crate::{BUNDLED, LoadError, Scene, Warning, bundled, load};

/// Why an argument names no scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// Neither a bundled name nor a file.
    #[error("`{argument}` is neither a bundled scene nor a file{}; bundled scenes: {}",
        suggestion(.argument), BUNDLED.join(", "))]
    NoSuchScene {
        /// What was asked for.
        argument: String,
    },
    /// A file that could not be loaded.
    #[error("{path}: {source}")]
    Load {
        /// The file, as it was asked for.
        path: String,
        /// What is wrong with it.
        source: LoadError,
    },
}

/// The bundled scene of this name or, failing that, the glTF file at this path.
///
/// Bundled names win; a file of the same name is reached as `./name`.
///
/// # Errors
/// If there is neither, or the file cannot be loaded.
pub fn open(argument: &str) -> Result<(Scene, Vec<Warning>), OpenError> {
    if let Some(scene) = bundled(argument) {
        return Ok((scene, Vec::new()));
    }
    if !Path::new(argument).exists() {
        return Err(OpenError::NoSuchScene { argument: argument.into() });
    }
    load(argument).map_err(|source| OpenError::Load { path: argument.into(), source })
}

/// The bundled names that a slip of the pen could have meant.
fn suggestion(argument: &str) -> String {
    let lower = argument.to_lowercase();
    let near = |name: &&&str| strsim::jaro_winkler(name, &lower) > 0.8;
    let names: Vec<String> = BUNDLED.iter().filter(near).map(|name| format!("`{name}`")).collect();
    match names.as_slice() {
        [] => String::new(),
        names => format!(" (did you mean {}?)", names.join(" or ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bundled_names_open_and_slips_get_a_suggestion() {
        assert_eq!(open("gem").expect("bundled").0.name, "gem");
        let message = |argument: &str| open(argument).expect_err(argument).to_string();
        assert!(message("dimond").contains("did you mean `diamond`?"), "{}", message("dimond"));
        assert!(message("Sphere-Fine").contains("`sphere-fine`"));
        let stray = message("xyzzy.glb");
        assert!(
            stray.contains("neither a bundled scene nor a file; bundled scenes: prism, sphere"),
            "{stray}"
        );
    }
}
