//! The paper's three convolutions (section 4.1).
//!
//! The lobe is expanded to first order about the vertical, (L_t . P)^n ~ (L_z P_z)^(n - 1) (L_z P_z + n L_x P_x + n L_y P_y) with
//! n = 2a, and the surface is taken to be at z = 0 (d >> h). Both are good only for light from nearly straight above.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spectral_core::optics::Real;

use crate::convolve::{Convolve, Sample, TermSum, Window};
use crate::error::PondError;
use crate::exact::largest_tilt;
use crate::floor::{FloorGrid, FloorLight, floor_light};
use crate::height_field::HeightField;
use crate::lobe::Lobe;
use crate::plan::{Method, PlanSettings, PondPlan};
use crate::pond::{Form, Outside, Pond};
use crate::surface_light::{SurfaceLight, SurfaceReport, beams};

/// How the paper's convolutions are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConvolutionSettings {
    /// Samples across the kernels, an odd number; 7 is the paper's. `None` for as far as there is a pond.
    pub kernel_samples: Option<usize>,
    /// In space or by FFT.
    pub convolve: Convolve,
}

/// The paper's method for one pond and grid, its kernels computed. `T` is what it computes in.
pub struct Convolution<T: Sample> {
    pond: Pond,
    size: [usize; 2],
    extent_m: [f64; 2],
    tiles: i64,
    tail: f64,
    terms: TermSum<T>,
}

impl<T: Sample> Convolution<T> {
    /// The kernels for surfaces of this grid.
    ///
    /// # Errors
    /// As [`Pond::check`]; a kernel of no or an even number of samples; no depth.
    pub fn new(
        size: [usize; 2],
        extent_m: [f64; 2],
        pond: &Pond,
        settings: ConvolutionSettings,
    ) -> Result<Self, PondError> {
        let Kernels { window, values, tiles, tail } =
            Kernels::new(size, extent_m, pond, settings.kernel_samples)?;
        let kernels = values.map(|kernel| kernel.into_iter().map(T::rounded).collect::<Vec<T>>());
        let terms = TermSum::new(size, pond.outside, window, kernels.into(), settings.convolve);
        Ok(Self { pond: pond.clone(), size, extent_m, tiles, tail, terms })
    }

    /// Whether convolutions go through spectra.
    #[must_use]
    pub fn is_fft(&self) -> bool {
        self.terms.is_fft()
    }

    /// The method as a plan for executors.
    ///
    /// # Errors
    /// No room for impulses, or a table of fewer than 2 entries or levels.
    pub fn plan(&self, settings: &PlanSettings) -> Result<PondPlan, PondError> {
        PondPlan::new(
            &Method {
                pond: &self.pond,
                extent_m: self.extent_m,
                tiles: (self.tiles, self.tail),
                table: None,
                terms: &self.terms,
            },
            settings,
        )
    }

    /// The light on the floor below `surface`.
    ///
    /// # Errors
    /// As [`Pond::check`]; a surface of another grid; one that touches the floor.
    pub fn floor(&self, surface: &HeightField) -> Result<FloorLight, PondError> {
        Ok(self.sum(&self.sources(surface)?))
    }

    /// What is convolved (passes 1 to 5): flux L_j (-L_z)^(n - 1) for j = x, y and flux (-L_z)^n for z.
    ///
    /// # Errors
    /// As [`Self::floor`].
    pub fn sources(&self, surface: &HeightField) -> Result<ConvolutionSources<T>, PondError> {
        check_same_grid(surface, self.size, self.extent_m)?;
        crate::exact::check_clear_of_floor(surface, &self.pond)?;
        let exponent = T::rounded(2.0 * self.pond.scattering - 1.0);
        let mut images = [(); 3].map(|()| vec![T::zero(); surface.heights_m.len()]);
        let [x, y, z] = images.each_mut().map(|image| image.par_chunks_mut(self.size[0]));
        let rows = x.zip(y).zip(z);
        let report = beams::<T, _>(surface, &self.pond, rows, |((x, y), z), i, beam| {
            [x[i], y[i], z[i]] = source_products(beam.direction, beam.flux, exponent);
        })?;
        Ok(ConvolutionSources { images, report })
    }

    /// The light on the floor of these sources (pass 6).
    ///
    /// # Panics
    /// If they are those of another grid.
    #[must_use]
    pub fn sum(&self, sources: &ConvolutionSources<T>) -> FloorLight {
        let irradiance = self.terms.sum(&sources.images).into_iter().map(T::widened).collect();
        let grid = FloorGrid { size: self.size, corner_m: [0.0; 2], extent_m: self.extent_m };
        let pitch_m = [0, 1].map(|k| self.extent_m[k] / self.size[k] as f64);
        floor_light(pitch_m, &self.pond, sources.report, grid, irradiance, (self.tiles, self.tail))
    }
}

/// What the paper convolves: one image for each component of the light's direction.
#[derive(Clone, Debug)]
pub struct ConvolutionSources<T> {
    images: [Vec<T>; 3],
    report: SurfaceReport,
}

/// Flux times (-L_z)^`exponent` times L_x, L_y and -L_z, with `exponent` = n - 1.
pub(crate) fn source_products<T: Real>([x, y, z]: [T; 3], flux: T, exponent: T) -> [T; 3] {
    // Light that travels upwards meets no floor.
    if z >= T::zero() {
        return [T::zero(); 3];
    }
    // In f32 -z says too little about a direction that is nearly vertical: there ln(-z) = ln(1 - x^2 - y^2) / 2.
    let half = T::one() / (T::one() + T::one());
    let sin2 = x * x + y * y;
    let log = if sin2 < half { half * (-sin2).ln_1p() } else { (-z).ln() };
    let power = flux * (exponent * log).exp();
    [x, y, -z].map(|component| power * component)
}

/// The three kernels: what belongs to the x, y and z of L_t.
pub(crate) struct Kernels {
    pub(crate) window: Window,
    pub(crate) values: [Vec<f64>; 3],
    pub(crate) tiles: i64,
    pub(crate) tail: f64,
}

impl Kernels {
    /// For surfaces of this grid; `samples` across, or as far as there is a pond.
    ///
    /// # Errors
    /// As [`Convolution::new`].
    pub(crate) fn new(
        size: [usize; 2],
        extent_m: [f64; 2],
        pond: &Pond,
        samples: Option<usize>,
    ) -> Result<Self, PondError> {
        let level = HeightField::flat(size, extent_m)?;
        let light = Pond { illumination: crate::pond::Illumination::Uniform(1.0), ..pond.clone() };
        if pond.depth_m == 0.0 {
            let expected = "above 0: kernels have no limit at d = 0, `exact` has";
            return Err(PondError::Setting { name: "depth, metres,", got: 0.0, expected });
        }
        // What level water does: kernels are expanded about the vertical anyway.
        let tilt = largest_tilt(&SurfaceLight::new(&level, &light)?);
        let (tiles, tail, mut radius) = reach(size, extent_m, pond, pond.depth_m, tilt);
        if let Some(samples) = samples {
            if samples % 2 == 0 {
                let got = samples as f64;
                return Err(PondError::Setting { name: "samples across a kernel", got, expected: "odd" });
            }
            radius = radius.map(|r| r.min(samples / 2));
        }
        let window = Window::centred(radius);
        Ok(Self { window, values: kernels(window, level.pitch_m(), pond), tiles, tail })
    }
}

fn kernels(window: Window, pitch_m: [f64; 2], pond: &Pond) -> [Vec<f64>; 3] {
    let n = 2.0 * pond.scattering;
    let d = pond.depth_m;
    let mut kernels = [const { Vec::new() }; 3];
    for index in 0..window.len() {
        let offset = window.offset(index);
        let [x, y] = [0, 1].map(|k| offset[k] as f64 * pitch_m[k]);
        let r = (x * x + y * y + d * d).sqrt();
        let spread = match pond.form {
            Form::Physical => (n + 1.0) / std::f64::consts::TAU * d / (r * r * r),
            Form::Paper => d / r,
        };
        let common = spread * (d / r).powf(n - 1.0) * (-pond.extinction_per_m * r).exp();
        for (kernel, component) in kernels.iter_mut().zip([n * x / r, n * y / r, d / r]) {
            kernel.push(common * component);
        }
    }
    kernels
}

/// Tiles that a periodic pond is summed over, the share beyond, and the largest offset that matters in samples, for beams from
/// `above_m` over the floor and up to `tilt` radians off the vertical.
pub(crate) fn reach(
    size: [usize; 2],
    extent_m: [f64; 2],
    pond: &Pond,
    above_m: f64,
    tilt: f64,
) -> (i64, f64, [usize; 2]) {
    match pond.outside {
        Outside::Dark => (0, 0.0, size.map(|side| side - 1)),
        Outside::Periodic => {
            let (tiles, tail) = Lobe::new(pond).periodic_tiles(extent_m, above_m, tilt);
            (tiles, tail, size.map(|side| tiles as usize * side + side / 2))
        }
    }
}

/// Whether a surface has the grid that kernels were made for.
pub(crate) fn check_same_grid(
    surface: &HeightField,
    size: [usize; 2],
    extent_m: [f64; 2],
) -> Result<(), PondError> {
    surface.check()?;
    if surface.size == size && surface.extent_m == extent_m {
        return Ok(());
    }
    Err(PondError::OtherGrid { got: surface.size, got_m: surface.extent_m, size, extent_m })
}
