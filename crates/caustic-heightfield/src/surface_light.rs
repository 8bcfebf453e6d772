//! What passes the surface: passes 1 to 3 of the paper without their tables, in f64.

use rayon::prelude::*;
use serde::Serialize;
use spectral_core::optics::{Refraction, refract};

use crate::error::PondError;
use crate::height_field::HeightField;
use crate::normals::{normal_of_slopes, slopes};
use crate::pond::{Form, Pond};
use crate::shadow::self_shadowed;

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

/// Samples that are worth a task of their own.
const CHUNK: usize = 512;

/// What became of the light at one sample.
struct Beam {
    fate: Fate,
    direction: [f64; 3],
    incident: f64,
    flux: f64,
}

enum Fate {
    Passed,
    TurnedAway,
    SelfShadowed,
    TotallyReflected,
}

impl Beam {
    fn dark(fate: Fate, incident: f64) -> Self {
        Self { fate, direction: [0.0, 0.0, -1.0], incident, flux: 0.0 }
    }
}

impl SurfaceReport {
    fn count(&mut self, beam: &Beam, steepness: f64) {
        self.steepest_slope = self.steepest_slope.max(steepness);
        self.past_45_degrees += usize::from(steepness > 1.0);
        self.incident_flux += beam.incident;
        self.transmitted_flux += beam.flux;
        match beam.fate {
            Fate::Passed => {}
            Fate::TurnedAway => self.turned_away += 1,
            Fate::SelfShadowed => self.self_shadowed += 1,
            Fate::TotallyReflected => self.totally_reflected += 1,
        }
    }
}

impl SurfaceLight {
    /// The light below `surface`.
    ///
    /// # Errors
    /// As [`Pond::check`].
    pub fn new(surface: &HeightField, pond: &Pond) -> Result<Self, PondError> {
        pond.check(surface)?;
        let light = pond.unit_light_direction();
        let eta = pond.eta();
        let cell_m2 = surface.pitch_m().iter().product::<f64>();
        let shadows = match pond.form {
            Form::Physical => self_shadowed(surface, light, pond.outside),
            Form::Paper => vec![false; surface.heights_m.len()],
        };
        let beam = |(sample, slope): (usize, &[f64; 2])| {
            let normal = normal_of_slopes(*slope);
            let cos_i = -(light[0] * normal[0] + light[1] * normal[1] + light[2] * normal[2]);
            let facet_m2 = match pond.form {
                Form::Physical => cell_m2 / normal[2],
                Form::Paper => cell_m2,
            };
            let incident = pond.illumination.at(sample) * cos_i * facet_m2;
            if cos_i <= 0.0 {
                return Beam::dark(Fate::TurnedAway, 0.0);
            }
            if shadows[sample] {
                return Beam::dark(Fate::SelfShadowed, 0.0);
            }
            match refract(light, normal, eta) {
                Refraction::Transmitted(direction, fresnel) => {
                    let flux = incident * fresnel.transmitted;
                    Beam { fate: Fate::Passed, direction, incident, flux }
                }
                Refraction::TotalReflection => Beam::dark(Fate::TotallyReflected, incident),
            }
        };
        let slopes = slopes(surface, pond.normals, pond.outside);
        let beams: Vec<Beam> = slopes.par_iter().enumerate().with_min_len(CHUNK).map(beam).collect();
        let mut report = SurfaceReport { samples: beams.len(), ..SurfaceReport::default() };
        for (beam, slope) in beams.iter().zip(&slopes) {
            report.count(beam, slope[0].hypot(slope[1]));
        }
        let directions = beams.iter().map(|beam| beam.direction).collect();
        let flux = beams.iter().map(|beam| beam.flux).collect();
        Ok(Self { size: surface.size, directions, flux, report })
    }
}
