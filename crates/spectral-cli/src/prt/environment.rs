//! The sky that `--environment` names.

use std::path::Path;

use spectral_core::basis::SpectralBasis;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::{Shown, light_xyz};
use spectral_core::upsample::SmoothSpectrum;
use spectral_prt::figures::{GRID, OBSERVER};
use spectral_prt::{Bands, Panorama, Sky};

use super::{lamps, power};
use crate::error::CliError;

/// Colours that skies of pictures are made of, linear sRGB: what a basis should know besides lamps.
const SKY_COLOURS: [[f64; 3]; 6] =
    [[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.1, 0.1, 0.9], [0.9, 0.9, 0.1], [0.1, 0.9, 0.9], [0.9, 0.1, 0.9]];

/// Where light comes from.
pub(super) enum Environment {
    /// Evenly from everywhere.
    Lamp(Illuminant),
    /// As in a picture, in D65 times the spectra of its colours.
    Picture(Panorama),
}

impl Environment {
    /// An illuminant's name, or a file.
    ///
    /// # Errors
    /// A usage error for what is neither; what the file says.
    pub(super) fn open(name: Option<&str>) -> Result<Self, CliError> {
        let name = name.unwrap_or("D65");
        if let Ok(lamp) = name.parse() {
            return Ok(Self::Lamp(lamp));
        }
        let path = Path::new(name);
        if !path.exists() {
            let known: Vec<&str> = Illuminant::ALL.into_iter().map(Illuminant::name).collect();
            return Err(CliError::Usage(format!(
                "--environment {name}: no such file, and no such illuminant; there is: {}",
                known.join(", ")
            )));
        }
        Panorama::from_exr(path).map(Self::Picture).map_err(CliError::failed)
    }

    /// Lights that a basis should know.
    pub(super) fn training(&self) -> Vec<Vec<f64>> {
        let mut lights = lamps();
        if let Self::Picture(_) = self {
            let day = power(Illuminant::D65);
            lights.extend(SKY_COLOURS.map(|colour| {
                let spectrum = SmoothSpectrum::reflectance(colour);
                (0..GRID.samples()).map(|i| day[i] * spectrum.at(GRID.lambda_nm(i))).collect()
            }));
        }
        lights
    }

    /// The light and the white that becomes the screen's.
    pub(super) fn sky(&self, bands: Bands, basis: &SpectralBasis) -> (Sky, Option<Shown>) {
        match self {
            Self::Lamp(lamp) => {
                let power = power(*lamp);
                let white = Shown::under(light_xyz(&GRID, OBSERVER, &power));
                (Sky::even(bands, &basis.light_coefficients(&power)), white)
            }
            Self::Picture(panorama) => {
                let white = Shown::under(light_xyz(&GRID, OBSERVER, &power(Illuminant::D65)));
                (Sky::from_panorama(bands, panorama, basis), white)
            }
        }
    }
}
