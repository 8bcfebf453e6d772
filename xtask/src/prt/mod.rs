//! The figures of spectral transfer that executors are compared on and measured with: the paper's two, flat patches and a white furnace,
//! as plans in spectra and in RGB, and in f64.

mod colour_distance;
mod fault;
mod reference;
mod subject;

use std::fmt;
use std::path::Path;

use anyhow::Result;
use frame_plan::{Executor, Limits};
use glam::DMat3;
use serde::Serialize;
use spectral_core::basis::{Optimal, SpectralBasis, Training};
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::{Shown, light_xyz, sampled_xyz};
use spectral_prt::figures::{Figure, GRID, OBSERVER, lamps, power};
use spectral_prt::{
    Bands, Exposure, Palette, Projection, Relighting, RelightingError, RelightingSettings, SceneTransfer,
    Shot, Sky, Transfer, TransferSettings, cache,
};

pub use colour_distance::{ColourDistance, PixelDistance, colour_map, something_to_compare};
pub use fault::{Fault, fault, spoiled};
pub use reference::Reference;
pub use subject::{PRICED_PRT, PRT, PrtSubject, SkyShape, is_prt, named_prt};

/// What stands in place of spectra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "basis", content = "coefficients", rename_all = "kebab-case")]
pub enum Way {
    /// So many coefficients of the basis that is best for the colours shown.
    Optimal(usize),
    /// So many of the spectra's own singular vectors.
    Peercy(usize),
    /// Linear sRGB.
    Rgb,
}

impl Way {
    /// Without the number.
    #[must_use]
    pub const fn basis(self) -> &'static str {
        match self {
            Self::Optimal(_) => "optimal",
            Self::Peercy(_) => "peercy",
            Self::Rgb => "rgb",
        }
    }

    /// Numbers in place of a light's spectrum.
    #[must_use]
    pub const fn coefficients(self) -> usize {
        match self {
            Self::Optimal(coefficients) | Self::Peercy(coefficients) => coefficients,
            Self::Rgb => 3,
        }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Optimal(coefficients) | Self::Peercy(coefficients) => {
                write!(f, "{}, {coefficients}", self.basis())
            }
            Self::Rgb => write!(f, "rgb"),
        }
    }
}

/// A way with its basis.
pub struct Colours {
    /// Which one.
    pub way: Way,
    basis: Option<SpectralBasis>,
}

impl Colours {
    /// From spectra to coefficients.
    #[must_use]
    pub fn projection(&self) -> Projection<'_> {
        self.basis.as_ref().map_or(Projection::Rgb(GRID, OBSERVER), Projection::Spectral)
    }
}

/// A subject with its transfer: all that frames and references are made of.
pub struct Stage {
    /// What it is called and lit by.
    pub subject: &'static PrtSubject,
    /// Surfaces, paints, camera.
    pub figure: Figure,
    /// As many bands as were asked for.
    pub transfer: Transfer,
}

impl Stage {
    /// Make the figure; its transfer is kept in `folder`.
    ///
    /// # Errors
    /// An optimiser that fails, a folder that cannot be written.
    pub fn open(subject: &'static PrtSubject, bands: Bands, folder: &Path) -> Result<Self> {
        let figure = (subject.figure)()?;
        let settings = TransferSettings { bands, rays: subject.rays };
        let kept = cache::load_or_precompute(folder, &figure.surfaces, &settings, &mut |_| {})?;
        Ok(Self { subject, figure, transfer: kept.transfer })
    }

    /// The basis of a way, for the figure's paints under all lamps.
    ///
    /// # Errors
    /// More coefficients than the rank.
    pub fn colours(&self, way: Way) -> Result<Colours> {
        let lights = lamps();
        let reflectances = &self.figure.reflectances;
        let training = Training { grid: GRID, observer: OBSERVER, reflectances, lights: &lights };
        let basis = match way {
            Way::Optimal(coefficients) => Some(training.optimal(coefficients, Optimal::default())?),
            Way::Peercy(coefficients) => Some(training.peercy(coefficients)?),
            Way::Rgb => None,
        };
        Ok(Colours { way, basis })
    }

    /// Frames with this transfer, which may have fewer bands than the stage's; they start under the first lamp.
    ///
    /// # Errors
    /// What does not fit into `limits`.
    pub fn relighting(
        &self,
        colours: &Colours,
        reflectances: &[Vec<f64>],
        transfer: &Transfer,
        size: [u32; 2],
        limits: &Limits,
    ) -> Result<Relighting, RelightingError> {
        let palette = Palette::new(&colours.projection(), reflectances);
        let scene = self.figure.scene(SceneTransfer::Direct(transfer), &palette);
        let sky = self.sky(colours, &power(self.subject.lamps[0]), transfer.bands());
        let settings = RelightingSettings { size, samples: 1 };
        Relighting::new(&scene, &self.shot(&sky, Exposure::default()), &settings, limits)
    }

    /// The next frame of a prepared plan, under a lamp: XYZ per pixel, relative to D65, multiplied by `factor`.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn frame(
        &self,
        relighting: &Relighting,
        executor: &mut dyn Executor,
        colours: &Colours,
        light: Lit,
        fault: Option<Fault>,
    ) -> Result<Vec<[f32; 3]>, RelightingError> {
        let Lit { lamp, bands, factor } = light;
        let light = fault.map_or_else(|| power(lamp), |fault| fault.light(lamp));
        let sky = self.sky(colours, &light, bands);
        let rotation = fault.map_or(DMat3::IDENTITY, Fault::rotation);
        let exposure = Exposure { factor, balance: Some(balance(lamp)) };
        relighting.write(executor, &Shot { rotation, ..self.shot(&sky, exposure) })?;
        executor.execute()?;
        Ok(relighting.read(executor)?.xyz)
    }

    fn sky(&self, colours: &Colours, light: &[f64], bands: Bands) -> Sky {
        Sky::of_shape(bands, &self.subject.sky.shape(bands), &colours.projection().light(light))
    }

    fn shot<'a>(&'a self, sky: &'a Sky, exposure: Exposure) -> Shot<'a> {
        Shot { sky, rotation: DMat3::IDENTITY, camera: &self.figure.camera, exposure }
    }

    /// What each paint is under a lamp, XYZ relative to D65: sampled every 5 nm, or as these colours have it.
    #[must_use]
    pub fn paints(&self, lamp: Illuminant, colours: Option<&Colours>) -> Vec<[f64; 3]> {
        let light = power(lamp);
        let display_from_light = balance(lamp).display_from_light();
        let paint = |reflectance: &Vec<f64>| {
            let xyz = match colours {
                None => sampled_xyz(&GRID, OBSERVER, reflectance, &light),
                Some(colours) => colours.projection().seen(reflectance, &light),
            };
            spectral_core::mat3::apply(&display_from_light, xyz)
        };
        self.figure.reflectances.iter().map(paint).collect()
    }

    /// The figure in f64 by the stage's transfer.
    #[must_use]
    pub fn reference(&self, size: [u32; 2]) -> Reference {
        let shape = self.subject.sky.shape(self.transfer.bands());
        Reference::draw(&self.figure, &self.transfer, &shape, size)
    }
}

/// A frame's lamp and exposure.
#[derive(Clone, Copy, Debug)]
pub struct Lit {
    /// Its light, and the white that becomes D65.
    pub lamp: Illuminant,
    /// Of the transfer.
    pub bands: Bands,
    /// XYZ is multiplied by it.
    pub factor: f64,
}

/// Shows an illuminant as D65.
fn balance(lamp: Illuminant) -> Shown {
    Shown::under(light_xyz(&GRID, OBSERVER, &power(lamp))).expect("every illuminant has a white")
}
