//! What the paper's two figures show: METACOW (Fairchild & Johnson 2004), whose halves match by daylight, and the ColorChecker
//! on an object that shades itself. Meshes are ours, the same bits every time.

mod cow;
mod knot;
mod metacow;
mod painted_knot;

use glam::DVec3;
use spectral_core::grid::SpectralGrid;
use spectral_core::illuminant::Illuminant;
use spectral_core::observer::Observer;
use spectral_scene::Camera;

pub use cow::cow;
pub use knot::knot;
pub use metacow::{Pair, metacow};
pub use painted_knot::painted_knot;

use crate::bands::Bands;
use crate::cosine_lobe;
use crate::relighting::{Albedo, IndexMap, Palette, RelitScene, SceneTransfer};
use crate::surface::Surface;

/// The wavelengths of all reflectances here.
pub const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;
/// Whose eyes.
pub const OBSERVER: Observer = Observer::Cie1931;

/// An illuminant's power on [`GRID`].
#[must_use]
pub fn power(illuminant: Illuminant) -> Vec<f64> {
    GRID.sample(|lambda_nm| illuminant.relative_power(lambda_nm))
}

/// All illuminants on [`GRID`]: what a basis should know.
#[must_use]
pub fn lamps() -> Vec<Vec<f64>> {
    Illuminant::ALL.into_iter().map(power).collect()
}

/// What comes from the whole sky, as a part of what comes from its brightest place.
const OVERCAST: f64 = 0.3;
/// Where that is.
const KEY: DVec3 = DVec3::new(-0.5, 1.0, 0.8);

/// Painted surfaces and who looks at them.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The surfaces, metres.
    pub surfaces: Vec<Surface>,
    /// Paints: reflectances, 0 to 1, on [`GRID`].
    pub reflectances: Vec<Vec<f64>>,
    /// Which paint is where.
    pub index_maps: Vec<IndexMap>,
    /// Of each surface.
    pub albedos: Vec<Albedo>,
    /// Who looks.
    pub camera: Camera,
    /// Rays per vertex that its transfer needs.
    pub rays: u32,
}

impl Figure {
    /// As a plan wants it; the palette has [`Figure::reflectances`].
    pub fn scene<'a>(&'a self, transfer: SceneTransfer<'a>, palette: &'a Palette) -> RelitScene<'a> {
        RelitScene {
            surfaces: &self.surfaces,
            transfer,
            gloss: None,
            palette,
            index_maps: &self.index_maps,
            spectral_maps: &[],
            albedos: &self.albedos,
        }
    }
}

/// The sky over the figures: bright about one direction, a third of that elsewhere; harmonic coefficients for
/// [`crate::Sky::of_shape`].
pub fn sky_shape(bands: Bands) -> Vec<f64> {
    let mut shape = vec![0.0; bands.coefficients()];
    cosine_lobe::evaluate(bands, KEY.normalize(), &mut shape);
    shape[0] += OVERCAST * 2.0 * std::f64::consts::PI.sqrt();
    shape
}
