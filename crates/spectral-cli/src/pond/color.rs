//! One index of refraction or several wavelengths: which, and the floor that comes of it.

use asm_core::Settings;
use caustic_heightfield::{
    Bands, FloorLight, FloorReport, HeightField, Pond, PondError, PondScene, Spread, VISIBLE_TEXELS,
};
use clap::Args;
use serde::Serialize;
use serde_json::Value;
use spectral_core::rgb::D65_WHITE_XYZ;

use super::floors::Floor;
use super::method::{MethodArgs, Prepared};
use super::water::Water;
use crate::choices::{Dispersed, PondMethod};
use crate::error::CliError;
use crate::messages;
use crate::values;

/// Wavelengths if dispersion is on and nothing else is said.
const DEFAULT_WAVELENGTHS: usize = 7;

#[derive(Debug, Args)]
pub(crate) struct ColorArgs {
    /// Whether wavelengths are refracted apart: on, off, or auto for where a texel or more lies between red and violet [default: auto;
    /// on with --wavelengths].
    #[arg(long, value_name = "WHEN")]
    dispersion: Option<Dispersed>,
    /// Wavelengths that light is computed at [default: 7; 3 for photon, which has all colours between them].
    #[arg(long, value_name = "N", value_parser = values::traced_wavelengths, allow_negative_numbers = true)]
    wavelengths: Option<usize>,
}

/// What was decided about dispersion, and why.
#[derive(Serialize)]
pub(super) struct DispersionStats {
    /// Whether wavelengths are refracted apart.
    on: bool,
    because: String,
    /// Texels between where red and violet land.
    spread: Spread,
    /// Texels from which that is visible.
    visible_from_texels: f64,
    /// Of a method that is asked for one after the other.
    bands: Option<Bands>,
}

/// The methods of a floor: one, or one per wavelength.
pub(super) struct ColorMethod {
    methods: Vec<Prepared>,
    pub(super) stats: DispersionStats,
}

/// A floor in grey or in colour.
pub(super) struct Image {
    pub(super) size: [usize; 2],
    pub(super) pixels: Pixels,
    pub(super) report: FloorReport,
    /// As of one floor, summed over wavelengths.
    pub(super) outside: usize,
}

pub(super) enum Pixels {
    /// Irradiance.
    Y(Vec<f64>),
    /// The same as XYZ.
    Xyz(Vec<[f64; 3]>),
}

impl ColorArgs {
    /// Decide, and make the methods for surfaces like these.
    ///
    /// # Errors
    /// Options that contradict each other; what the method says.
    pub(super) fn prepare(
        &self,
        scene: &PondScene,
        examples: &[HeightField],
        how: &MethodArgs,
        measured: bool,
    ) -> Result<ColorMethod, CliError> {
        let pond = &scene.pond;
        let mut spread = Spread::default();
        for surface in examples {
            let of_this = Spread::new(surface, pond).map_err(CliError::failed)?;
            spread = if of_this.texels > spread.texels { of_this } else { spread };
        }
        let (on, because) = match (self.dispersion, self.wavelengths) {
            (Some(Dispersed::Off), Some(n)) => {
                let problem =
                    format!("--wavelengths {n}: --dispersion off has one index; leave one of them out");
                return Err(CliError::Usage(problem));
            }
            (Some(Dispersed::Off), None) => (false, "--dispersion off".to_owned()),
            (Some(Dispersed::On), _) => (true, "--dispersion on".to_owned()),
            (None, Some(n)) => (true, format!("--wavelengths {n}")),
            (None | Some(Dispersed::Auto), _) => {
                let texels = spread.texels;
                (
                    spread.visible,
                    format!("red and violet land {texels:.2} texels apart, visible from {VISIBLE_TEXELS} on"),
                )
            }
        };
        let photon = how.method == PondMethod::Photon;
        let default =
            if photon { Settings::default().wavelength_count() as usize } else { DEFAULT_WAVELENGTHS };
        let count = self.wavelengths.unwrap_or(default);
        let bands = (on && !photon).then(|| Bands::of_water(pond, &scene.spectrum, count)).transpose();
        let bands = bands.map_err(CliError::failed)?;
        let ponds: Vec<Pond> = match &bands {
            Some(bands) => bands.ponds(pond).collect(),
            None => vec![pond.clone()],
        };
        if on && self.dispersion.is_none() && self.wavelengths.is_none() {
            messages::warn(&format!(
                "{because}: light is computed at {count} wavelengths; --dispersion off for one index"
            ));
        }
        let methods = if photon {
            vec![how.photon(scene, &examples[0], on.then_some(self.wavelengths))?]
        } else {
            ponds.iter().map(|pond| how.prepare(scene, examples, pond, measured)).collect::<Result<_, _>>()?
        };
        let stats = DispersionStats { on, because, spread, visible_from_texels: VISIBLE_TEXELS, bands };
        Ok(ColorMethod { methods, stats })
    }
}

impl ColorMethod {
    /// What the methods say about themselves: one, or a list in the order of the wavelengths.
    pub(super) fn details(&self) -> Value {
        match self.methods.as_slice() {
            [only] => only.details.clone(),
            several => several.iter().map(|method| method.details.clone()).collect(),
        }
    }

    /// The floor below the water.
    ///
    /// # Errors
    /// What the method says.
    pub(super) fn floor(&self, water: &Water<'_>) -> Result<Image, CliError> {
        let (grid, pixels, report, outside) = match &self.stats.bands {
            Some(bands) => {
                let mut outside = 0;
                let of = |band: usize| -> Result<FloorLight, PondError> {
                    let floor = (self.methods[band].floor)(water)?;
                    outside += floor.outside;
                    Ok(floor.light)
                };
                let color = bands.color(of).map_err(CliError::failed)?;
                (color.grid, Pixels::Xyz(color.xyz), color.report, outside)
            }
            None => {
                let Floor { light, outside, xyz } =
                    (self.methods[0].floor)(water).map_err(CliError::failed)?;
                (light.grid, xyz.map_or(Pixels::Y(light.irradiance), Pixels::Xyz), light.report, outside)
            }
        };
        Ok(Image { size: grid.size, pixels, report, outside })
    }
}

impl Pixels {
    /// As XYZ; grey is D65's.
    pub(super) fn xyz(&self) -> Vec<[f32; 3]> {
        match self {
            Self::Y(values) => values.iter().map(|y| D65_WHITE_XYZ.map(|w| (w * y) as f32)).collect(),
            Self::Xyz(values) => values.iter().map(|xyz| xyz.map(|v| v as f32)).collect(),
        }
    }
}
