//! `spectral prt`: matt surfaces under spectral skies, by precomputed transfer (Schwenk et al. 2010).

mod background;
pub(crate) mod differences;
pub(crate) mod environment;
mod figure;
mod gloss;
mod panels;
pub(crate) mod relit_view;
mod scene;
mod sky_file;
mod stage;

use std::path::PathBuf;

use clap::Args;
use spectral_core::basis::{BasisError, Optimal, SpectralBasis, Training};
use spectral_core::display::{Display, ToneMap};
use spectral_prt::Bands;
use spectral_prt::figures::{GRID, OBSERVER};

use crate::args::{DEFAULT_RENDER_SIZE, DeviceArgs};
use crate::choices::{Basis, tone_map};
use crate::error::CliError;
use crate::values::{Exposure, Gloss, Size};

#[derive(Debug, Args)]
pub(crate) struct PrtArgs {
    /// glTF file or bundled scene: its matt objects, and with --gloss metals; glass is left out.
    #[arg(required_unless_present = "figure", conflicts_with = "figure")]
    scene: Option<String>,
    /// A figure of the paper, as a PNG of panels: 1 is METACOW under D65, A and FL2 (left in spectra, right in RGB); 2 is the ColorChecker under
    /// FL4 (sampled every 5 nm, in spectra, in RGB, and their CIE94 differences from the first, bright is 10).
    #[arg(long, value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2), allow_negative_numbers = true)]
    figure: Option<u8>,
    /// The sky: an equirectangular EXR file with R, G and B or with spectra, a JSON file of harmonics and spectra, or the name of an
    /// illuminant, the same from everywhere [default: D65].
    #[arg(long, value_name = "FILE|ILLUMINANT", conflicts_with = "figure")]
    environment: Option<String>,
    /// Spectral basis: peercy or optimal.
    #[arg(long, value_name = "BASIS", default_value = "optimal")]
    basis: Basis,
    /// Spectral coefficients [default: 5, 8 for the metamers of figure 1].
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..=61), allow_negative_numbers = true)]
    coefficients: Option<u32>,
    /// Bands of spherical harmonics.
    #[arg(long, value_name = "L", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=10), allow_negative_numbers = true)]
    bands: u8,
    /// Reflections between surfaces.
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=256), allow_negative_numbers = true, conflicts_with = "figure")]
    bounces: u32,
    /// Let objects shine: a lobe about the mirrored view, over what the sky and with --bounces other objects send there, as rough as glTF materials say, or all as rough as
    /// this, 0 to 1. Metals have nothing but the lobe, others lose to it what Fresnel reflects at normal incidence.
    #[arg(long, value_name = "ROUGHNESS|material", num_args = 0..=1, require_equals = true, default_missing_value = "material", allow_negative_numbers = true, conflicts_with = "figure")]
    gloss: Option<Gloss>,
    /// Width and height of the picture, or of a panel, in pixels [default: 1280x720, panels 640x360].
    #[arg(long, value_name = "WxH", allow_hyphen_values = true)]
    size: Option<Size>,
    /// Factor on the picture before the tone map of a PNG; auto is 1 / the 99th percentile of Y.
    #[arg(long, value_name = "E", default_value = "auto", allow_hyphen_values = true)]
    exposure: Exposure,
    /// How luminance of a PNG is brought below white: clip, or sigmoid, which leaves middle grey where it is.
    #[arg(long, value_name = "CURVE", default_value = "clip", value_parser = tone_map)]
    tone_map: ToneMap,
    /// Picture to write: .exr holds linear sRGB without exposure, .png the displayed picture, white-balanced to the screen.
    #[arg(short, long, value_name = "OUT.exr|OUT.png")]
    output: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
    /// JSON file for settings, device, colour differences and times.
    #[arg(long, value_name = "STATS.json")]
    stats: Option<PathBuf>,
}

/// Panels of a figure if nothing else is said.
const PANEL_SIZE: Size = Size { width: 640, height: 360 };

pub(crate) fn run(args: &PrtArgs) -> Result<(), CliError> {
    args.device.check()?;
    match (args.figure, &args.scene) {
        (Some(1), _) => figure::metacow(args),
        (Some(_), _) => figure::color_checker(args),
        (None, Some(scene)) => scene::run(args, scene),
        (None, None) => Err(CliError::Usage("name a SCENE, or a figure with --figure 1 or 2".into())),
    }
}

impl PrtArgs {
    fn coefficients(&self) -> u32 {
        self.coefficients.unwrap_or(if self.figure == Some(1) { 8 } else { 5 })
    }

    fn bands(&self) -> Result<Bands, CliError> {
        Bands::new(self.bands).map_err(CliError::usage)
    }

    fn panel_size(&self) -> Size {
        self.size.unwrap_or(PANEL_SIZE)
    }

    /// With the tone map that was asked for.
    fn toned(&self, display: Display) -> Display {
        Display { tone_map: self.tone_map, ..display }
    }

    fn picture_size(&self) -> Size {
        self.size.unwrap_or(DEFAULT_RENDER_SIZE)
    }

    /// The basis, trained on these reflectances and lights.
    ///
    /// # Errors
    /// A usage error if it has not so many coefficients.
    fn basis(&self, reflectances: &[Vec<f64>], lights: &[Vec<f64>]) -> Result<SpectralBasis, CliError> {
        let coefficients = self.coefficients() as usize;
        trained(self.basis, coefficients, reflectances, lights)
            .map_err(|error| CliError::usage(format!("--coefficients {coefficients}: {error}")))
    }
}

/// A basis, trained on these reflectances and lights.
fn trained(
    basis: Basis,
    coefficients: usize,
    reflectances: &[Vec<f64>],
    lights: &[Vec<f64>],
) -> Result<SpectralBasis, BasisError> {
    let training = Training { grid: GRID, observer: OBSERVER, reflectances, lights };
    match basis {
        Basis::Peercy => training.peercy(coefficients),
        Basis::Optimal => training.optimal(coefficients, Optimal::default()),
    }
}
