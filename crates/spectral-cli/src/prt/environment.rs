//! The sky that `--environment` names.

use std::path::Path;

use glam::DVec3;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::{Shown, light_xyz};
use spectral_prt::figures::{GRID, OBSERVER, lamps, power};
use spectral_prt::{Bands, Panorama, SpectralPanorama, SpectralSky};

use super::sky_file;
use crate::error::CliError;

/// Where light comes from.
#[derive(Clone, Debug)]
pub struct Environment {
    /// At every wavelength.
    pub sky: SpectralSky,
    /// The light whose white becomes the screen's.
    pub white: Vec<f64>,
}

impl Environment {
    /// An illuminant's name, or a file: a sky file (`.json`), a spectral picture or one in RGB (`.exr`).
    ///
    /// # Errors
    /// A usage error for what is neither; what the file says.
    pub(super) fn open(name: Option<&str>, bands: Bands) -> Result<Self, CliError> {
        let name = name.unwrap_or("D65");
        if let Ok(lamp) = name.parse() {
            let white = power(lamp);
            return Ok(Self { sky: SpectralSky::even(bands, GRID, &white), white });
        }
        let path = Path::new(name);
        if !path.exists() {
            let known: Vec<&str> = Illuminant::ALL.into_iter().map(Illuminant::name).collect();
            return Err(CliError::Usage(format!(
                "--environment {name}: no such file, and no such illuminant; there is: {}",
                known.join(", ")
            )));
        }
        let failed = |problem: &dyn std::fmt::Display| CliError::failed(format!("{name}: {problem}"));
        let sky = if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
            sky_file::open(path, bands)?
        } else if SpectralPanorama::is_in(path) {
            let panorama = SpectralPanorama::from_exr(path).map_err(|error| failed(&error))?;
            SpectralSky::from_spectral_panorama(bands, GRID, &panorama).map_err(|error| failed(&error))?
        } else {
            let panorama = Panorama::from_exr(path).map_err(CliError::failed)?;
            let sky = SpectralSky::from_panorama(bands, GRID, OBSERVER, &panorama);
            // Whoever made a picture in RGB has balanced it: its white is D65 with Y = 1.
            return Ok(Self { sky, white: unit(&power(Illuminant::D65)) });
        };
        let white = sky.mean();
        if light_xyz(&GRID, OBSERVER, &white)[1] <= 0.0 {
            return Err(failed(&"no light from 400 to 700 nm: nothing would be lit"));
        }
        Ok(Self { sky, white })
    }

    /// As bright from everywhere in another lamp's light.
    #[must_use]
    pub fn in_light(&self, lamp: Illuminant) -> Self {
        let y = light_xyz(&GRID, OBSERVER, &self.white)[1];
        let lamp = unit(&power(lamp));
        Self { sky: self.sky.in_light(OBSERVER, &lamp), white: lamp.iter().map(|l| l * y).collect() }
    }

    /// Lights that a basis should know, each once: all lamps, and what comes from the sky here and there.
    pub(super) fn training(&self) -> Vec<Vec<f64>> {
        let mut lights = lamps();
        let mut known: Vec<Vec<f64>> = lights.iter().map(|light| unit(light)).collect();
        let from_sky = directions().map(|direction| self.sky.radiance(direction));
        for light in [self.sky.mean()].into_iter().chain(from_sky) {
            // Between strong lights few bands ring below zero.
            if light.iter().any(|l| *l < 0.0) || light_xyz(&GRID, OBSERVER, &light)[1] <= 0.0 {
                continue;
            }
            let shape = unit(&light);
            if !known.iter().any(|known| is_same(known, &shape)) {
                known.push(shape);
                lights.push(light);
            }
        }
        lights
    }

    /// From the colours under it to the screen's.
    #[must_use]
    pub fn balance(&self) -> Option<Shown> {
        Shown::under(light_xyz(&GRID, OBSERVER, &self.white))
    }
}

/// With Y = 1.
pub(super) fn unit(light: &[f64]) -> Vec<f64> {
    let y = light_xyz(&GRID, OBSERVER, light)[1];
    light.iter().map(|l| l / y).collect()
}

/// Whether two spectra are one but for what a file's numbers round.
fn is_same(a: &[f64], b: &[f64]) -> bool {
    let largest = a.iter().fold(0.0, |largest: f64, v| largest.max(*v));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * largest)
}

/// To the faces and corners of a cube.
fn directions() -> impl Iterator<Item = DVec3> {
    let along = |i: i32| f64::from(i - 1);
    let all = (0..27).map(move |i| DVec3::new(along(i % 3), along(i / 3 % 3), along(i / 9)));
    let used = |v: &DVec3| [1, 3].contains(&v.to_array().iter().filter(|c| **c != 0.0).count());
    all.filter(used).map(DVec3::normalize)
}
