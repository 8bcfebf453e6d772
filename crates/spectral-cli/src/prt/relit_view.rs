//! Surfaces to be relit in a window, with their transfer.

use spectral_core::basis::{BasisError, SpectralBasis};
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_prt::figures::{self, Figure, GRID, power, sky_shape};
use spectral_prt::{
    Bands, GlossTransfer, Palette, Projection, RelitScene, SceneTransfer, SpectralSky, Transfer,
};

use super::environment::Environment;
use super::gloss::{Shine, transfers};
use super::scene::painted;
use super::trained;
use crate::choices::Basis;
use crate::error::CliError;
use crate::scene_argument;
use crate::values::Gloss;

/// What a window relights. Everything that is the same in all frames, and how it begins.
pub struct RelitView {
    /// What it is called.
    pub name: String,
    /// The surfaces and who looks at them.
    pub figure: Figure,
    /// Their transfer.
    transfer: Transfer,
    /// What shines of them.
    shine: Option<(Shine, GlossTransfer)>,
    /// The sky that it begins under.
    pub environment: Environment,
    /// Whose light that is; none for a file's own.
    pub lamp: Option<Illuminant>,
    /// How spectra become coefficients, to begin with.
    pub basis: Basis,
    /// How many, to begin with.
    pub coefficients: usize,
    /// Reflectances and lights that bases are trained on.
    training: [Vec<Vec<f64>>; 2],
}

/// What is to be relit, and how it begins: nothing is opened yet.
#[derive(Clone, Debug)]
pub struct RelitRequest {
    pub(crate) scene: String,
    pub(crate) environment: Option<String>,
    pub(crate) basis: Basis,
    pub(crate) coefficients: Option<u32>,
    pub(crate) bands: Bands,
    pub(crate) gloss: Option<Gloss>,
}

/// The paper's figures by their names in the window.
pub(crate) const METACOW: &str = "metacow";
pub(crate) const COLOR_CHECKER: &str = "color-checker";

impl RelitRequest {
    /// Open the scene or figure and its sky, and find the transfer: minutes where the user's cache has none.
    ///
    /// # Errors
    /// What scene, sky and cache say; a usage error if the basis has not so many coefficients.
    pub fn open(&self) -> Result<RelitView, CliError> {
        let (scene, environment) = (self.scene.as_str(), self.environment.as_deref());
        let (basis, bands) = (self.basis, self.bands);
        let (environment, lamp) = match environment.unwrap_or("D65").parse::<Illuminant>() {
            // There would be nothing to turn under a sky that is the same everywhere.
            Ok(lamp) => (from_one_side(bands, lamp), Some(lamp)),
            Err(_) => (Environment::open(environment, bands)?, None),
        };
        let (figure, mut shine) = match scene {
            METACOW | COLOR_CHECKER if self.gloss.is_some() => {
                return Err(CliError::usage(format!("--gloss is for scenes, {scene} is matt")));
            }
            METACOW => (figures::metacow().map_err(CliError::failed)?.0, None),
            COLOR_CHECKER => (figures::painted_knot(), None),
            _ => {
                let opened = scene_argument::open(scene)?;
                painted(&opened.scene, scene, self.gloss, &mut Vec::new())?
            }
        };
        let mut reflectances = color_checker::sampled(&GRID);
        reflectances.extend(figure.reflectances.iter().cloned());
        reflectances.extend(shine.iter().flat_map(|shine| shine.reflectances().iter().cloned()));
        let training = [reflectances, environment.training()];
        let coefficients = self.coefficients.unwrap_or(if scene == METACOW { 8 } else { 5 }) as usize;
        trained(basis, coefficients, &training[0], &training[1])
            .map_err(|error| CliError::usage(format!("--coefficients {coefficients}: {error}")))?;
        let (transfer, gloss) = transfers(&figure, shine.as_mut(), bands, &mut Vec::new())?;
        let (name, shine) = (scene.into(), shine.zip(gloss));
        Ok(RelitView { name, figure, transfer, shine, environment, lamp, basis, coefficients, training })
    }
}

impl RelitView {
    /// Its paints, and lobes, in these coefficients.
    pub fn palette(&self, projection: &Projection<'_>) -> Palette {
        let palette = Palette::new(projection, &self.figure.reflectances);
        match &self.shine {
            Some((shine, _)) => shine.on(palette, projection),
            None => palette,
        }
    }

    /// As a plan wants it; the palette is [`RelitView::palette`].
    pub fn scene<'a>(&'a self, palette: &'a Palette) -> RelitScene<'a> {
        let gloss = self.shine.as_ref().map(|(_, gloss)| gloss);
        RelitScene { gloss, ..self.figure.scene(SceneTransfer::Direct(&self.transfer), palette) }
    }

    /// A basis for the surfaces and lights here.
    ///
    /// # Errors
    /// If it has not so many coefficients.
    pub fn trained(&self, basis: Basis, coefficients: usize) -> Result<SpectralBasis, BasisError> {
        trained(basis, coefficients, &self.training[0], &self.training[1])
    }
}

/// The figures' sky in a lamp's light.
fn from_one_side(bands: Bands, lamp: Illuminant) -> Environment {
    let white = power(lamp);
    Environment { sky: SpectralSky::of_shape(bands, GRID, &sky_shape(bands), &white), white }
}
