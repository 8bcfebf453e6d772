//! `spectral view`: its options, and the start of the window, which is a program of its own so that this one stays small.

use std::env::{self, consts::EXE_SUFFIX};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use asm_core::Settings;
use clap::Args;

use crate::args::PlanOptions;
use crate::choices::{Backend, Method};
use crate::error::CliError;
use crate::output::atomic_file::AtomicFile;
use crate::targets;
use crate::values::{self, Exposure, Size};

/// The window's program, beside this one.
const PROGRAM: &str = "spectral-viewer";

/// The options of `spectral view`, which hands them on, and of `spectral-viewer`, which obeys them.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// glTF file or bundled scene.
    pub scene: String,
    /// Method to begin with: caustics-map, acm or asm.
    #[arg(long, value_name = "METHOD", default_value = "asm")]
    pub(crate) method: Method,
    /// Number of wavelengths [default: the method's].
    #[arg(long, value_name = "N", value_parser = values::traced_wavelengths, allow_negative_numbers = true)]
    pub(crate) wavelengths: Option<usize>,
    /// What runs the plan to begin with: auto, cpu, wgpu or vulkan.
    #[arg(long, value_name = "BACKEND", default_value = "auto")]
    pub backend: Backend,
    /// Texels of the light's view to begin with, along each side.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_384), allow_negative_numbers = true)]
    pub(crate) emission: Option<u32>,
    /// Texels of the caustic map to begin with, along each side.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_384), allow_negative_numbers = true)]
    pub(crate) map: Option<u32>,
    #[command(flatten)]
    pub(crate) plan: PlanOptions,
    /// Width and height of the window's contents.
    #[arg(long, value_name = "WxH", default_value = "1280x800", allow_hyphen_values = true)]
    pub size: Size,
    /// Factor on the picture; auto is 1 / the 99th percentile of the first picture's Y.
    #[arg(long, value_name = "E", default_value = "auto", allow_hyphen_values = true)]
    pub exposure: Exposure,
    /// Close the window after this many pictures of the scene.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    pub frames: Option<u32>,
    /// PNG file for what the window shows after its --frames.
    #[arg(long, value_name = "FILE.png", requires = "frames")]
    pub screenshot: Option<PathBuf>,
}

impl ViewArgs {
    /// The plan's settings to begin with.
    ///
    /// # Errors
    /// A usage error for the reference, which has no plan.
    pub fn settings(&self) -> Result<Settings, CliError> {
        let settings = self.plan.settings(self.method.of_plan()?, self.wavelengths, None);
        let emission_size = self.emission.unwrap_or(settings.emission_size);
        Ok(Settings { emission_size, map_size: self.map, ..settings })
    }

    /// The file of `--screenshot`, found writable.
    ///
    /// # Errors
    /// A usage error for another kind of file; what the file system says.
    pub fn screenshot_file(&self) -> Result<Option<AtomicFile>, CliError> {
        self.screenshot.as_deref().map(|path| targets::png("--screenshot", path)).transpose()
    }
}

/// Start the window with these arguments and pass on its exit status.
///
/// # Errors
/// If it is not there, or the system ended it.
pub(crate) fn start(arguments: &[OsString]) -> Result<ExitCode, CliError> {
    let program =
        env::current_exe().map_err(CliError::failed)?.with_file_name(format!("{PROGRAM}{EXE_SUFFIX}"));
    if !program.is_file() {
        let profile = if cfg!(debug_assertions) { "" } else { "--release " };
        return Err(CliError::Failed(format!(
            "{} is not there: build it with `cargo build {profile}-p {PROGRAM}`",
            program.display()
        )));
    }
    let status = Command::new(&program)
        .args(arguments)
        .status()
        .map_err(|error| CliError::failed(format!("cannot start {}: {error}", program.display())))?;
    let Some(code) = status.code() else {
        return Err(CliError::Failed(format!("{PROGRAM} did not end by itself: {status}")));
    };
    Ok(ExitCode::from(u8::try_from(code).unwrap_or(1)))
}
