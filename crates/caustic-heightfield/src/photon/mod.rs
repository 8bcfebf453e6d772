//! The water as a refractor: `asm-core`'s footprints of light through the surface as a mesh, in colour.
//!
//! What the other methods have and this one has not is the lobe: the water scatters nothing, as theirs does in the limit of a large
//! exponent a. What they have not is a surface that is one between its samples, light that is followed through crests, and
//! all wavelengths in one plan.

mod scene;

use asm_core::{BakePlan, Planner, Settings, Statistics, UpdateError};
use frame_plan::{Executor, Limits};
use spectral_core::light::LightSpectrum;

use crate::error::PondError;
use crate::exact::check_clear_of_floor;
use crate::floor::{FloorGrid, FloorLight, FloorReport};
use crate::height_field::HeightField;
use crate::pond::{Form, Illumination, Pond};
use crate::surface_light::{SurfaceLight, SurfaceReport};

pub use scene::water_dispersion;

/// Cells of the emission view along each side, at least and at most, where the settings do not ask for more.
const EMISSION_SIZES: (u32, u32) = (128, 1024);

/// How the method works.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PhotonSettings {
    /// Whether every wavelength has its own index ([`crate::ior_below_at`]), or all of them the pond's.
    pub dispersion: bool,
    /// The light's spectrum.
    pub spectrum: LightSpectrum,
    /// Facets along each side of a sample; `None` is as many as keep facets no larger than half a texel of the floor.
    pub facets_per_sample: Option<usize>,
    /// How `asm-core` traces; its emission view gets as many cells as the surface has samples across.
    pub footprints: Settings,
}

/// Plans for one pond, surface after surface.
pub struct Photon {
    pond: Pond,
    settings: PhotonSettings,
    planner: Planner,
    prepared: Option<PhotonPlan>,
}

/// The plan of one surface: for executors of [`asm_core::PASSES`].
#[derive(Clone, Debug)]
pub struct PhotonPlan {
    /// What an executor runs, and moves on from to the plan of the next surface ([`BakePlan::update`]).
    pub bake: BakePlan,
    /// Facets along each side of a sample.
    pub facets_per_sample: usize,
    grid: FloorGrid,
    /// Texels of the bake around the grid.
    guard: usize,
    surface: SurfaceReport,
    periodic_tiles: i64,
}

/// Light on the floor, with what is known besides.
#[derive(Clone, Debug)]
pub struct PhotonFloor {
    /// Its Y, in texel means; the report has no lobe.
    pub light: FloorLight,
    /// CIE 1931 XYZ, Y in the unit of the pond's illumination; row-major, x fastest.
    pub xyz: Vec<[f64; 3]>,
    /// Where the light went.
    pub statistics: Statistics,
}

/// Texels around a floor that are baked with it: cells of light that its edge would cut land whole. They are about as large as a
/// sample of the surface.
fn guard_texels(surface: &HeightField, floor: &FloorGrid) -> usize {
    const AT_LEAST: f64 = 4.0;
    let pitch_m = surface.pitch_m();
    let of_cells = |k: usize| 2.0 * pitch_m[k] * floor.size[k] as f64 / floor.extent_m[k];
    of_cells(0).max(of_cells(1)).max(AT_LEAST).ceil() as usize
}

impl Photon {
    /// The method for a pond in the physical form under even light; its scattering is not looked at.
    ///
    /// # Errors
    /// A pond that is none of this, or light that goes from dense to thin.
    pub fn new(pond: &Pond, settings: PhotonSettings) -> Result<Self, PondError> {
        check(pond)?;
        Ok(Self { pond: pond.clone(), settings, planner: Planner::default(), prepared: None })
    }

    /// From now on light and water are this pond's: the next plan follows, by numbers alone where only they differ.
    ///
    /// # Errors
    /// As [`Photon::new`].
    pub fn set_pond(&mut self, pond: &Pond) -> Result<(), PondError> {
        check(pond)?;
        self.pond.clone_from(pond);
        Ok(())
    }

    /// The plan that was prepared last.
    #[must_use]
    pub fn prepared(&self) -> Option<&PhotonPlan> {
        self.prepared.as_ref()
    }

    /// The plan for the light on `floor` below `surface`.
    ///
    /// # Errors
    /// As [`Pond::check`]; a surface that touches the floor; those of `asm-core`.
    pub fn plan(
        &mut self,
        surface: &HeightField,
        floor: FloorGrid,
        limits: &Limits,
    ) -> Result<PhotonPlan, PondError> {
        let light = SurfaceLight::new(surface, &self.pond)?;
        check_clear_of_floor(surface, &self.pond)?;
        crate::height_field::check_grid(floor.size, floor.extent_m)?;
        let facets_per_sample = self.facets_per_sample(surface, &floor)?;
        let facets = surface.supersampled(facets_per_sample, self.pond.outside)?;
        let guard = guard_texels(surface, &floor);
        let wide = floor.widened(guard);
        let margins = scene::margins_m(surface, &self.pond, &light, &wide);
        let scene = scene::scene(&facets, &self.pond, &self.settings, &wide, margins)?;
        let across = surface.size[0].max(surface.size[1]) as u32;
        let (least, most) = EMISSION_SIZES;
        let asked = &self.settings.footprints;
        let settings = Settings {
            emission_size: asked.emission_size.max(across.clamp(least, most)),
            // Light that is split by nothing but grey water needs one wavelength.
            wavelengths: if self.settings.dispersion { asked.wavelengths } else { Some(1) },
            ..asked.clone()
        };
        let size = wide.size.map(|side| side as u32);
        let bake = self.planner.bake(&scene, scene::FLOOR, size, &settings, limits)?;
        let widest = (0..2).map(|k| margins[k].iter().fold(0.0_f64, |m, &x| m.max(x)) / surface.extent_m[k]);
        let periodic_tiles = widest.fold(0.0, f64::max).ceil() as i64;
        Ok(PhotonPlan { bake, facets_per_sample, grid: floor, guard, surface: light.report, periodic_tiles })
    }

    /// Have the plan for `surface` on an executor of [`asm_core::PASSES`], which runs nothing else from then on. Where one for
    /// another surface of the same grid is, only numbers are written.
    ///
    /// # Errors
    /// As [`Photon::plan`], and those of the executor.
    pub fn prepare(
        &mut self,
        surface: &HeightField,
        floor: FloorGrid,
        executor: &mut dyn Executor,
    ) -> Result<&PhotonPlan, PondError> {
        let limits = executor.limits();
        let mut next = self.plan(surface, floor, &limits)?;
        if let Some(PhotonPlan { mut bake, .. }) = self.prepared.take() {
            match bake.update(executor, next.bake) {
                Ok(()) => return Ok(self.prepared.insert(PhotonPlan { bake, ..next })),
                Err(UpdateError::Execute(error)) => return Err(error.into()),
                // Another structure: its plan went with the attempt.
                Err(_) => next = self.plan(surface, floor, &limits)?,
            }
        }
        executor.prepare(&next.bake.plan)?;
        Ok(self.prepared.insert(next))
    }

    /// The light on `floor` below `surface`: [`Photon::prepare`], a frame, and what it left behind.
    ///
    /// # Errors
    /// As [`Photon::prepare`].
    pub fn floor(
        &mut self,
        surface: &HeightField,
        floor: FloorGrid,
        executor: &mut dyn Executor,
    ) -> Result<PhotonFloor, PondError> {
        let plan = self.prepare(surface, floor, executor)?;
        executor.execute()?;
        plan.read(executor)
    }

    fn facets_per_sample(&self, surface: &HeightField, floor: &FloorGrid) -> Result<usize, PondError> {
        match self.settings.facets_per_sample {
            Some(0) => Err(PondError::Setting {
                name: "facets along each side of a sample",
                got: 0.0,
                expected: "1 or more",
            }),
            Some(facets) => Ok(facets),
            None => {
                let pitch_m = surface.pitch_m();
                let texels = |k: usize| pitch_m[k] * floor.size[k] as f64 / floor.extent_m[k];
                Ok(((2.0 * texels(0).max(texels(1)) - 1e-9).ceil() as usize).max(1))
            }
        }
    }
}

/// Whether light goes through its water as here.
fn check(pond: &Pond) -> Result<(), PondError> {
    if pond.form == Form::Paper {
        return Err(PondError::Photon { what: "the paper's form, which is no flux; take physical" });
    }
    if let Illumination::Map(_) = pond.illumination {
        return Err(PondError::Photon { what: "light that varies over the surface; take another method" });
    }
    if pond.eta() < 1.0 {
        return Err(PondError::Photon {
            what: "light that goes from the dense to the thin side; take another method",
        });
    }
    Ok(())
}

impl PhotonPlan {
    /// What the last frame of `executor`, which runs [`PhotonPlan::bake`], left behind.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn read(&self, executor: &mut dyn Executor) -> Result<PhotonFloor, PondError> {
        let (maps, statistics) = self.bake.read(executor)?;
        let rows = maps.refracted.chunks(maps.width as usize).skip(self.guard).take(self.grid.size[1]);
        let inner = rows.flat_map(|row| &row[self.guard..][..self.grid.size[0]]);
        let xyz: Vec<[f64; 3]> = inner.map(|xyz| xyz.map(f64::from)).collect();
        let irradiance: Vec<f64> = xyz.iter().map(|xyz| xyz[1]).collect();
        let report = FloorReport {
            surface: self.surface,
            floor_flux: irradiance.iter().sum::<f64>() * self.grid.cell_m2(),
            lobe_samples: 0.0,
            periodic_tiles: self.periodic_tiles,
            periodic_tail: 0.0,
        };
        Ok(PhotonFloor { light: FloorLight { grid: self.grid, irradiance, report }, xyz, statistics })
    }
}
