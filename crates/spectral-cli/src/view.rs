//! `spectral view`: its options, and the start of the window, which is a program of its own so that this one stays small.

use std::env::{self, consts::EXE_SUFFIX};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use std::str::FromStr;

use asm_core::Settings;
use caustic_heightfield::{Impulse, Pond, PondScene, Ripple, Surface, WallImages, impulse_heights};
use clap::Args;
use spectral_core::light::LightSpectrum;
use spectral_prt::Bands;

use crate::args::PlanOptions;
use crate::choices::{Backend, Basis, Method, PondMethod, Precision};
use crate::error::CliError;
use crate::output::atomic_file::AtomicFile;
use crate::pond::DEFAULT_SIDE;
use crate::pond::floors::FloorChoice;
use crate::prt::relit_view::{COLOR_CHECKER, METACOW, RelitRequest};
use crate::targets;
use crate::values::{self, Exposure, Gloss, Size};

/// The window's program, beside this one.
const PROGRAM: &str = "spectral-viewer";
/// The scene that is none.
const POND: &str = "pond";

/// The options of `spectral view`, which hands them on, and of `spectral-viewer`, which obeys them.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// glTF file or bundled scene, or pond; to be relit: with --environment, or metacow or color-checker.
    pub scene: String,
    /// Method to begin with: caustics-map, acm, asm or footprint [default: asm]; of the pond: convolution, low-rank, exact or photon
    /// [default: low-rank].
    #[arg(long, value_name = "METHOD")]
    pub(crate) method: Option<String>,
    /// What the pond is computed in to begin with, as for `spectral pond`.
    #[arg(long, value_name = "PRECISION")]
    pub(crate) precision: Option<Precision>,
    /// JSON file of the pond, with a surface of impulses [default: water at rest].
    #[arg(long, value_name = "POND.json")]
    pub(crate) pond: Option<PathBuf>,
    /// Relight the scene's matt objects by precomputed transfer: the sky to begin with, as for `spectral prt`; an illuminant is
    /// bright on one side.
    #[arg(long, value_name = "FILE|ILLUMINANT")]
    pub(crate) environment: Option<String>,
    /// Spectral basis of what is relit to begin with: peercy or optimal [default: optimal].
    #[arg(long, value_name = "BASIS")]
    pub(crate) basis: Option<Basis>,
    /// Its coefficients to begin with [default: 5, 8 for metacow].
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=61), allow_negative_numbers = true)]
    pub(crate) coefficients: Option<u32>,
    /// Bands of spherical harmonics of what is relit [default: 5].
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u8).range(1..=10), allow_negative_numbers = true)]
    pub(crate) bands: Option<u8>,
    /// Let what is relit shine, as for `spectral prt`.
    #[arg(long, value_name = "ROUGHNESS|material", num_args = 0..=1, require_equals = true, default_missing_value = "material", allow_negative_numbers = true)]
    pub(crate) gloss: Option<Gloss>,
    /// Number of wavelengths [default: the method's].
    #[arg(long, value_name = "N", value_parser = values::traced_wavelengths, allow_negative_numbers = true)]
    pub(crate) wavelengths: Option<usize>,
    /// What runs the plan to begin with: auto, cpu, wgpu or vulkan.
    #[arg(long, value_name = "BACKEND", default_value = "auto")]
    pub backend: Backend,
    /// Texels of the light's view to begin with, along each side.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16_384), allow_negative_numbers = true)]
    pub(crate) emission: Option<u32>,
    /// Texels of the caustic map to begin with, along each side; of the pond: samples of its surface and floor [default: 128].
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

/// What a window shows, and how it begins.
#[derive(Clone, Debug)]
pub enum Subject {
    /// A scene, with the settings of its plan.
    Scene(Box<Settings>),
    /// The pond.
    Pond(Box<PondView>),
    /// Surfaces under a sky, by their transfer.
    Relit(RelitRequest),
}

/// A pond to be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct PondView {
    /// Length of the pond in x and y, metres.
    pub extent_m: [f64; 2],
    /// Water and light.
    pub pond: Pond,
    /// The light's spectrum.
    pub spectrum: LightSpectrum,
    /// What moves the surface.
    pub pebbles: PondPebbles,
    /// By what its floor is computed.
    pub choice: FloorChoice,
    /// Samples of surface and floor on a side.
    pub samples: usize,
}

/// The surface of a pond that pebbles are dropped into.
#[derive(Clone, Debug, PartialEq)]
pub struct PondPebbles {
    /// What their waves are like.
    pub ripple: Ripple,
    /// Those that have fallen, or are to fall.
    pub impulses: Vec<Impulse>,
    /// How walls reflect.
    pub walls: WallImages,
    /// Seconds.
    pub time_s: f64,
}

impl ViewArgs {
    /// What is to be shown. Scenes are not opened yet.
    ///
    /// # Errors
    /// A usage error for the reference, which has no plan, and for options of the one with the other; a pond's file that holds none.
    pub fn subject(&self) -> Result<Subject, CliError> {
        let is_relit = self.environment.is_some() || [METACOW, COLOR_CHECKER].contains(&&*self.scene);
        let is_pond = self.scene == POND && !is_relit;
        let foreign = [
            (!is_pond, self.option_of_the_pond(), "`spectral view pond`"),
            (is_pond, self.option_of_scenes(), "scenes; leave it out for the pond"),
            (!is_relit, self.option_of_relighting(), "what is relit: add --environment"),
            (is_relit, self.option_of_plans(), "light through glass and water, not for what is relit"),
        ];
        for (is_foreign, option, what) in foreign {
            if let (true, Some(option)) = (is_foreign, option) {
                return Err(CliError::Usage(format!("{option} is for {what}")));
            }
        }
        if is_pond {
            Ok(Subject::Pond(Box::new(self.pond()?)))
        } else if is_relit {
            Ok(Subject::Relit(self.relit()?))
        } else {
            Ok(Subject::Scene(Box::new(self.settings()?)))
        }
    }

    fn relit(&self) -> Result<RelitRequest, CliError> {
        Ok(RelitRequest {
            scene: self.scene.clone(),
            environment: self.environment.clone(),
            basis: self.basis.unwrap_or(Basis::Optimal),
            coefficients: self.coefficients,
            bands: self.bands.map_or(Ok(Bands::default()), Bands::new).map_err(CliError::usage)?,
            gloss: self.gloss,
        })
    }

    /// A plan's settings to begin with.
    fn settings(&self) -> Result<Settings, CliError> {
        let method = self.method_or(Method::Asm)?;
        let settings = self.plan.settings(method.of_plan()?, self.wavelengths, None);
        let emission_size = self.emission.unwrap_or(settings.emission_size);
        Ok(Settings { emission_size, map_size: self.map, ..settings })
    }

    fn pond(&self) -> Result<PondView, CliError> {
        let method = self.method_or(PondMethod::LowRank)?;
        let precision = method.precision(self.precision).map_err(CliError::usage)?;
        let samples = self.map.unwrap_or(DEFAULT_SIDE as u32) as usize;
        let scene = match &self.pond {
            Some(path) => crate::pond::open(Some(path))?.0,
            None => still_water(),
        };
        let Surface::Impulses { ripple, impulses, walls, time_s } = scene.surface else {
            return Err(CliError::failed(
                "--pond: this surface is not of impulses, which are what the window drops; give it `impulses`, if none",
            ));
        };
        // Before a window appears.
        let (extent_m, pond) = (scene.extent_m, scene.pond);
        let surface = impulse_heights([samples; 2], extent_m, &ripple, &impulses, walls, time_s);
        surface.and_then(|surface| pond.check(&surface)).map_err(CliError::failed)?;
        let pebbles = PondPebbles { ripple, impulses, walls, time_s };
        let choice = FloorChoice::new(method, precision);
        Ok(PondView { extent_m, pond, spectrum: scene.spectrum, pebbles, choice, samples })
    }

    fn method_or<M: FromStr<Err = String>>(&self, default: M) -> Result<M, CliError> {
        let Some(name) = &self.method else { return Ok(default) };
        name.parse().map_err(|problem| CliError::Usage(format!("--method {name}: {problem}")))
    }

    fn option_of_scenes(&self) -> Option<&'static str> {
        let given = [
            ("--wavelengths", self.wavelengths.is_some()),
            ("--emission", self.emission.is_some()),
            ("--refraction", self.plan.refraction.is_some()),
        ];
        let given = given.into_iter().find(|(_, given)| *given);
        given.map(|(option, _)| option).or_else(|| self.plan.given())
    }

    fn option_of_relighting(&self) -> Option<&'static str> {
        let given = [
            ("--basis", self.basis.is_some()),
            ("--coefficients", self.coefficients.is_some()),
            ("--bands", self.bands.is_some()),
            ("--gloss", self.gloss.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(option, _)| option)
    }

    /// Of scenes and the pond: how light goes through them.
    fn option_of_plans(&self) -> Option<&'static str> {
        let given = [("--method", self.method.is_some()), ("--map", self.map.is_some())];
        let given = given.into_iter().find(|(_, given)| *given).map(|(option, _)| option);
        given.or_else(|| self.option_of_scenes())
    }

    fn option_of_the_pond(&self) -> Option<&'static str> {
        let given = [("--precision", self.precision.is_some()), ("--pond", self.pond.is_some())];
        given.into_iter().find(|(_, given)| *given).map(|(option, _)| option)
    }

    /// The file of `--screenshot`, found writable.
    ///
    /// # Errors
    /// A usage error for another kind of file; what the file system says.
    pub fn screenshot_file(&self) -> Result<Option<AtomicFile>, CliError> {
        self.screenshot.as_deref().map(|path| targets::png("--screenshot", path)).transpose()
    }
}

/// Water at rest under light from 20 degrees, for waves that focus on its floor.
fn still_water() -> PondScene {
    let ripple = Ripple::PEBBLE;
    let at_rest = Surface::Impulses { ripple, impulses: Vec::new(), walls: WallImages::Four, time_s: 0.0 };
    let scene = PondScene::default();
    PondScene { pond: Pond { scattering: 500.0, ..scene.pond }, surface: at_rest, ..scene }
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
