//! What the checks that need more than one crate share: executors that run, and one small bake.

pub mod agreement;

use std::path::{Path, PathBuf};

use asm_core::{BakePlan, Method, Reflections, Settings};
use frame_plan::{Executor, Limits};
use xtask::executors::{Candidate, EXECUTORS, POND_EXECUTORS, PRT_EXECUTORS};
use xtask::subject::Subject;

/// Set to 1, a missing executor is reported and skipped instead of failing the test.
pub const ALLOW_SKIP: &str = "SPECTRAL_ALLOW_SKIP";

/// Photons across and down at each wavelength.
pub const EMISSION_SIZE: u32 = 128;

/// Texels across and down: small, so that every scene runs on every executor in seconds.
pub const SIZE: [u32; 2] = [64, 64];

/// Start every executor of the project.
///
/// # Panics
/// If one cannot start and [`ALLOW_SKIP`] is not 1: no test passes because nothing ran.
#[must_use]
pub fn executors() -> Vec<(&'static str, Box<dyn Executor>)> {
    opened(EXECUTORS)
}

/// Start every executor of the project for the pond's passes.
///
/// # Panics
/// As [`executors`].
#[must_use]
pub fn pond_executors() -> Vec<(&'static str, Box<dyn Executor>)> {
    opened(POND_EXECUTORS)
}

/// Start every executor of the project for relighting.
///
/// # Panics
/// As [`executors`].
#[must_use]
pub fn prt_executors() -> Vec<(&'static str, Box<dyn Executor>)> {
    opened(PRT_EXECUTORS)
}

fn opened(candidates: &[Candidate]) -> Vec<(&'static str, Box<dyn Executor>)> {
    let open = |candidate: &Candidate| match (candidate.open)(None) {
        Ok(executor) => Some((candidate.id, executor)),
        Err(error) if std::env::var_os(ALLOW_SKIP).is_some_and(|v| v == "1") => {
            eprintln!("skipped {}: {error}", candidate.id);
            None
        }
        Err(error) => panic!("{}: {error} ({ALLOW_SKIP}=1 would skip it)", candidate.id),
    };
    candidates.iter().filter_map(open).collect()
}

/// One of [`Subject::names`].
///
/// # Panics
/// If it cannot be opened.
#[must_use]
pub fn subject(name: &str) -> Subject {
    Subject::open(name, &workspace_root()).unwrap_or_else(|error| panic!("{error}"))
}

/// The small bake of a scene, with the emission grid in proportion.
///
/// # Panics
/// If the scene has no plan.
#[must_use]
pub fn small_bake(subject: &Subject) -> BakePlan {
    bake_of(subject, Reflections::default())
}

/// The small bake of a scene with these reflections.
///
/// # Panics
/// If the scene has no plan.
#[must_use]
pub fn bake_of(subject: &Subject, reflections: Reflections) -> BakePlan {
    let settings = Settings {
        emission_size: EMISSION_SIZE,
        map_size: Some(128),
        reflections,
        ..Settings::of(Method::CausticsMap)
    };
    asm_core::bake_plan(&subject.scene, subject.receiver, SIZE, &settings, &Limits::default())
        .unwrap_or_else(|error| panic!("{}: {error}", subject.name))
}

fn workspace_root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().map_or_else(|| package.to_owned(), Path::to_path_buf)
}
