//! What passes the surface: passes 1 to 3 of the paper without their tables, in f64.

use rayon::prelude::*;
use serde::Serialize;
use spectral_core::optics::{Real, Refraction, refract};

use crate::error::PondError;
use crate::height_field::{CHUNK, HeightField};
use crate::normals::{normal_of_slopes, slopes_at};
use crate::pond::{Form, Pond};
use crate::refraction_table::RefractionTable;
use crate::shadow::Shadows;

/// Light just below the surface, one beam per sample.
#[derive(Clone, Debug)]
pub struct SurfaceLight {
    /// Samples in x and y.
    pub size: [usize; 2],
    /// Unit directions of travel L_t. Where no light passes, straight down.
    pub directions: Vec<[f64; 3]>,
    /// Flux per sample, illumination times square metres. In the paper's form without the facet's 1 / N_z.
    pub flux: Vec<f64>,
    /// What became of the light at the surface.
    pub report: SurfaceReport,
}

/// What is noteworthy about a surface under its light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SurfaceReport {
    /// Samples of the surface.
    pub samples: usize,
    /// Samples whose slope is past 45 degrees, where a height field is a doubtful model of water.
    pub past_45_degrees: usize,
    /// Largest slope, rise over run.
    pub steepest_slope: f64,
    /// Samples behind other water. They face the light and do not see it: they are dark, as the light that has passed a
    /// crest is not followed. 0 in the paper's form, which assumes that there are none.
    pub self_shadowed: usize,
    /// Samples whose facet is turned away from the light: dark.
    pub turned_away: usize,
    /// Samples that reflect all light, which needs n_i > n_t: dark.
    pub totally_reflected: usize,
    /// Flux that reaches the surface.
    pub incident_flux: f64,
    /// Flux that passes it.
    pub transmitted_flux: f64,
}

/// Light as every sample of the surface meets it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sun<'a, T> {
    /// L_i.
    pub(crate) direction: [T; 3],
    /// n_t / n_i.
    pub(crate) eta: T,
    /// Area of a sample from above, square metres.
    pub(crate) cell_m2: T,
    /// Facets are 1 / N_z times that large, which the paper leaves out.
    pub(crate) facets_are_larger: bool,
    /// Gamma and T where they are looked up.
    pub(crate) table: Option<RefractionTable<'a, T>>,
}

/// What became of the light at one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beam<T> {
    pub(crate) fate: Fate,
    /// L_t; straight down where no light passes.
    pub(crate) direction: [T; 3],
    /// Flux that reaches the facet.
    pub(crate) incident: T,
    /// Flux that passes it.
    pub(crate) flux: T,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    Passed,
    TurnedAway,
    SelfShadowed,
    TotallyReflected,
}

impl<T: Real> Sun<'_, T> {
    /// The light below a facet with these slopes, which `illumination` reaches unless the facet is behind others.
    pub(crate) fn beam(&self, slopes: [T; 2], illumination: T, shadowed: impl FnOnce() -> bool) -> Beam<T> {
        let normal = normal_of_slopes(slopes);
        let light = self.direction;
        let cos_i = -(light[0] * normal[0] + light[1] * normal[1] + light[2] * normal[2]);
        if cos_i <= T::zero() {
            return Beam::dark(Fate::TurnedAway, T::zero());
        }
        if shadowed() {
            return Beam::dark(Fate::SelfShadowed, T::zero());
        }
        let facet_m2 = if self.facets_are_larger { self.cell_m2 / normal[2] } else { self.cell_m2 };
        let incident = illumination * cos_i * facet_m2;
        let refracted = match &self.table {
            Some(table) => table.refract(light, normal, cos_i, self.eta),
            None => match refract(light, normal, self.eta) {
                Refraction::Transmitted(direction, fresnel) => Some((direction, fresnel.transmitted)),
                Refraction::TotalReflection => None,
            },
        };
        match refracted {
            Some((direction, transmitted)) => {
                Beam { fate: Fate::Passed, direction, incident, flux: incident * transmitted }
            }
            None => Beam::dark(Fate::TotallyReflected, incident),
        }
    }
}

impl<T: Real> Beam<T> {
    fn dark(fate: Fate, incident: T) -> Self {
        Self { fate, direction: [T::zero(), T::zero(), -T::one()], incident, flux: T::zero() }
    }
}

impl SurfaceReport {
    fn count<T: Real>(&mut self, beam: &Beam<T>, [sx, sy]: [f64; 2]) {
        let steepness = (sx * sx + sy * sy).sqrt();
        let wide = |flux: T| flux.to_f64().expect("f32 and f64 fit into f64");
        self.steepest_slope = self.steepest_slope.max(steepness);
        self.past_45_degrees += usize::from(steepness > 1.0);
        self.incident_flux += wide(beam.incident);
        self.transmitted_flux += wide(beam.flux);
        match beam.fate {
            Fate::Passed => {}
            Fate::TurnedAway => self.turned_away += 1,
            Fate::SelfShadowed => self.self_shadowed += 1,
            Fate::TotallyReflected => self.totally_reflected += 1,
        }
    }

    /// Of both parts of a surface.
    fn plus(self, other: Self) -> Self {
        Self {
            samples: self.samples + other.samples,
            past_45_degrees: self.past_45_degrees + other.past_45_degrees,
            steepest_slope: self.steepest_slope.max(other.steepest_slope),
            self_shadowed: self.self_shadowed + other.self_shadowed,
            turned_away: self.turned_away + other.turned_away,
            totally_reflected: self.totally_reflected + other.totally_reflected,
            incident_flux: self.incident_flux + other.incident_flux,
            transmitted_flux: self.transmitted_flux + other.transmitted_flux,
        }
    }
}

impl SurfaceLight {
    /// The light below `surface`.
    ///
    /// # Errors
    /// As [`Pond::check`].
    pub fn new(surface: &HeightField, pond: &Pond) -> Result<Self, PondError> {
        let width = surface.size[0];
        let mut directions = vec![[0.0; 3]; surface.heights_m.len()];
        let mut flux = vec![0.0; surface.heights_m.len()];
        let rows = directions.par_chunks_mut(width).zip(flux.par_chunks_mut(width));
        let report = beams::<f64, _>(surface, pond, rows, |(directions, flux), i, beam| {
            (directions[i], flux[i]) = (beam.direction, beam.flux);
        })?;
        Ok(Self { size: surface.size, directions, flux, report })
    }
}

/// The beams below `surface`, computed in `T` from slopes in f64: `take` has one at a time, with its column and what `rows` has for its row.
///
/// # Errors
/// As [`Pond::check`].
pub(crate) fn beams<T: Real + Send + Sync, R: Send>(
    surface: &HeightField,
    pond: &Pond,
    rows: impl IndexedParallelIterator<Item = R>,
    take: impl Fn(&mut R, usize, &Beam<T>) + Sync,
) -> Result<SurfaceReport, PondError> {
    pond.check(surface)?;
    let real = |x: f64| T::from(x).expect("f32 and f64 hold it");
    let light = pond.unit_light_direction();
    let shadows = (pond.form == Form::Physical).then(|| Shadows::new(surface, light, pond.outside));
    let sun = Sun {
        direction: light.map(real),
        eta: real(pond.eta()),
        cell_m2: real(surface.pitch_m().iter().product()),
        facets_are_larger: pond.form == Form::Physical,
        table: None,
    };
    let heights = surface.view(pond.outside);
    let width = surface.size[0];
    let light_row = |(j, mut row): (usize, R)| {
        let mut report = SurfaceReport { samples: width, ..SurfaceReport::default() };
        for i in 0..width {
            let slopes = slopes_at(&heights, pond.normals, i, j);
            let illumination = real(pond.illumination.at(j * width + i));
            let hidden = || shadows.is_some_and(|shadows| shadows.hide(i, j));
            let beam = sun.beam(slopes.map(real), illumination, hidden);
            report.count(&beam, slopes);
            take(&mut row, i, &beam);
        }
        report
    };
    let rows = rows.with_min_len(CHUNK.div_ceil(width)).enumerate();
    let reports: Vec<SurfaceReport> = rows.map(light_row).collect();
    // In order: the same sums on any number of threads.
    Ok(reports.into_iter().fold(SurfaceReport::default(), SurfaceReport::plus))
}
