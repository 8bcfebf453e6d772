//! Light of several wavelengths, each with the water's index at it.
//!
//! Water's n(lambda) is the catalogue's ([`spectral_core::glass`]) brought to the pond's index at the d line: n(lambda) - 1 is scaled, which
//! keeps the Abbe number, so that a step of no index stays one. Every method takes one index at a time; what this adds is which
//! ones, the XYZ weight of each, and whether that is worth doing.

use serde::Serialize;
use spectral_core::glass;
use spectral_core::light::LightSpectrum;
use spectral_core::observer::Observer;
use spectral_core::optics::{Refraction, refract};
use spectral_core::wavelengths::{Scheme, WavelengthSet};

use crate::error::PondError;
use crate::floor::{FloorGrid, FloorLight, FloorReport};
use crate::height_field::HeightField;
use crate::normals::{normal_of_slopes, slopes};
use crate::pond::Pond;

/// Ends of what counts as visible when landing positions are compared, nm: the eye has 0.4 % or less of its best response there.
pub const SEEN_NM: [f64; 2] = [400.0, 700.0];
/// Wavelengths are chosen from here, nm, as for bakes.
const RANGE_NM: (f64, f64) = (380.0, 780.0);
/// More than that many wavelengths are evenly spaced.
const MOST_OPTIMAL: usize = 12;
/// Dispersion is visible from this spread on, texels.
pub const VISIBLE_TEXELS: f64 = 1.0;
/// The share of beams that may be spread wider than what is reported: single facets are not seen.
const SHARE: f64 = 0.01;

/// Wavelengths, and what the pond is at each.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bands {
    /// Vacuum wavelengths, nm, ascending.
    pub wavelengths_nm: Vec<f64>,
    /// Index of refraction below the surface at each.
    pub iors_below: Vec<f64>,
    /// XYZ of each per unit of Y of the light: none negative, with the light's XYZ as their sum.
    pub weights_xyz: Vec<[f64; 3]>,
}

/// Colour on the floor.
#[derive(Clone, Debug)]
pub struct FloorColor {
    /// Where.
    pub grid: FloorGrid,
    /// Irradiance as CIE 1931 XYZ, Y in the unit of the pond's illumination; row-major, x fastest.
    pub xyz: Vec<[f64; 3]>,
    /// What is noteworthy, at the wavelength with the largest Y; its flux is the Y of all.
    pub report: FloorReport,
}

/// How far dispersion moves light on the floor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Distance between where light of 400 nm and of 700 nm lands, in texels of the floor below the surface: exceeded by one beam
    /// in a hundred.
    pub texels: f64,
    /// Whether that is at least [`VISIBLE_TEXELS`].
    pub visible: bool,
}

/// The index of the pond's water at a wavelength; `ior_below` is that at the d line.
///
/// # Errors
/// A wavelength at which water has no index.
pub fn ior_below_at(pond: &Pond, lambda_nm: f64) -> Result<f64, PondError> {
    let water = glass::by_name("water").expect("water is in the catalogue");
    let ior = 1.0 + (pond.ior_below - 1.0) * (water.ior(lambda_nm) - 1.0) / (water.n_d() - 1.0);
    if ior.is_finite() && ior > 0.0 {
        return Ok(ior);
    }
    Err(PondError::Setting {
        name: "index of refraction of the water",
        got: ior,
        expected: "finite and above 0",
    })
}

impl Bands {
    /// `count` wavelengths of a light above the pond's water.
    ///
    /// # Errors
    /// No wavelengths, or too many.
    pub fn of_water(pond: &Pond, light: &LightSpectrum, count: usize) -> Result<Self, PondError> {
        Self::new(light, count, |lambda_nm| ior_below_at(pond, lambda_nm))
    }

    /// `count` wavelengths of a light above a liquid of this index.
    ///
    /// # Errors
    /// No wavelengths, or too many; what `ior` says.
    pub fn new(
        light: &LightSpectrum,
        count: usize,
        ior: impl Fn(f64) -> Result<f64, PondError>,
    ) -> Result<Self, PondError> {
        let scheme = if count > MOST_OPTIMAL { Scheme::Uniform } else { Scheme::Optimal };
        let set = WavelengthSet::new(scheme, count, RANGE_NM, Observer::default()).map_err(|_| {
            let expected = "1 to 4096";
            PondError::Setting { name: "number of wavelengths", got: count as f64, expected }
        })?;
        let iors_below = set.wavelengths_nm.iter().map(|&nm| ior(nm)).collect::<Result<_, _>>()?;
        Ok(Self { iors_below, weights_xyz: set.light_weights(light), wavelengths_nm: set.wavelengths_nm })
    }

    /// The pond as it is at each wavelength.
    pub fn ponds<'a>(&'a self, pond: &'a Pond) -> impl Iterator<Item = Pond> + 'a {
        self.iors_below.iter().map(|&ior_below| Pond { ior_below, ..pond.clone() })
    }

    /// The colour on the floor, with the light of each band by `floor`, which is given its place among [`Self::ponds`].
    ///
    /// # Errors
    /// What `floor` says.
    pub fn color<E: From<PondError>>(
        &self,
        mut floor: impl FnMut(usize) -> Result<FloorLight, E>,
    ) -> Result<FloorColor, E> {
        let mut color: Option<FloorColor> = None;
        let mut largest_y = 0.0;
        for (band, weight) in self.weights_xyz.iter().enumerate() {
            let light = floor(band)?;
            let color = color.get_or_insert_with(|| FloorColor {
                grid: light.grid,
                xyz: vec![[0.0; 3]; light.irradiance.len()],
                report: light.report,
            });
            if weight[1] > largest_y {
                (largest_y, color.report) = (weight[1], light.report);
            }
            for (xyz, e) in color.xyz.iter_mut().zip(&light.irradiance) {
                (0..3).for_each(|c| xyz[c] += weight[c] * e);
            }
        }
        let mut color = color.ok_or(PondError::Setting {
            name: "number of wavelengths",
            got: 0.0,
            expected: "1 to 4096",
        })?;
        color.report.floor_flux = color.xyz.iter().map(|xyz| xyz[1]).sum::<f64>() * color.grid.cell_m2();
        Ok(color)
    }
}

impl Spread {
    /// Of a surface's beams on the floor below it.
    ///
    /// # Errors
    /// As [`Pond::check`].
    pub fn new(surface: &HeightField, pond: &Pond) -> Result<Self, PondError> {
        pond.check(surface)?;
        let light = pond.unit_light_direction();
        let pitch_m = surface.pitch_m();
        let mut etas = [0.0; 2];
        for (eta, nm) in etas.iter_mut().zip(SEEN_NM) {
            *eta = ior_below_at(pond, nm)? / pond.ior_above;
        }
        // Offset in texels from the point below the surface to where light lands; none where it does not get there.
        let lands = |normal: [f64; 3], above_m: f64, eta: f64| -> Option<[f64; 2]> {
            match refract(light, normal, eta) {
                Refraction::Transmitted([x, y, z], _) if z < 0.0 => {
                    Some([x / -z * above_m / pitch_m[0], y / -z * above_m / pitch_m[1]])
                }
                _ => None,
            }
        };
        let mut spreads: Vec<f64> = slopes(surface, pond.normals, pond.outside)
            .into_iter()
            .zip(&surface.heights_m)
            .filter_map(|(slope, h)| {
                let normal = normal_of_slopes(slope);
                let faces = (0..3).map(|k| light[k] * normal[k]).sum::<f64>() < 0.0;
                let [violet, red] = etas.map(|eta| lands(normal, pond.depth_m + h, eta).filter(|_| faces));
                let (violet, red) = (violet?, red?);
                Some((violet[0] - red[0]).hypot(violet[1] - red[1]))
            })
            .collect();
        spreads.sort_by(f64::total_cmp);
        let place = ((1.0 - SHARE) * spreads.len() as f64) as usize;
        let texels = spreads.get(place.min(spreads.len().saturating_sub(1))).copied().unwrap_or(0.0);
        Ok(Self { texels, visible: texels >= VISIBLE_TEXELS })
    }
}
