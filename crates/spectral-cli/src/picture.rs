//! A camera's picture on its way to a file.

use spectral_core::display::Display;
use spectral_core::rgb::linear_srgb_from_xyz;

use crate::error::CliError;
use crate::values::{Exposure, Size};

/// XYZ, Y in cd/m^2, row-major from the top left.
pub(crate) struct Picture {
    pub(crate) size: Size,
    pub(crate) xyz: Vec<[f32; 3]>,
}

/// The exposure that brings the 99th percentile of Y to display white; the largest Y if that percentile is dark; 1 for a
/// black picture.
#[must_use]
pub fn auto_exposure(xyz: &[[f32; 3]]) -> f64 {
    match white_y(xyz) {
        y if y > 0.0 => 1.0 / y,
        _ => 1.0,
    }
}

fn white_y(xyz: &[[f32; 3]]) -> f64 {
    let mut y: Vec<f32> = xyz.iter().map(|xyz| xyz[1]).collect();
    let Some(last) = y.len().checked_sub(1) else { return 0.0 };
    let (_, percentile, above) =
        y.select_nth_unstable_by((last as f64 * AUTO_QUANTILE).round() as usize, f32::total_cmp);
    if *percentile > 0.0 { f64::from(*percentile) } else { above.iter().copied().fold(0.0, f32::max).into() }
}

/// The share of pixels that auto exposure keeps at or below display white.
const AUTO_QUANTILE: f64 = 0.99;

impl Picture {
    /// Exposure and tone map.
    pub(crate) fn display(&self, exposure: Exposure) -> Display {
        let exposure = match exposure {
            Exposure::Factor(factor) => factor,
            Exposure::Auto => auto_exposure(&self.xyz),
        };
        Display { exposure, ..Display::default() }
    }

    /// All values are numbers that a file can hold.
    ///
    /// # Errors
    /// Says how many are not.
    pub(crate) fn check(&self) -> Result<(), CliError> {
        match self.xyz.iter().filter(|xyz| !xyz.iter().all(|v| v.is_finite())).count() {
            0 => Ok(()),
            wrong => Err(CliError::Failed(format!(
                "{wrong} pixels are not finite, nothing is written: are the scene's lights too strong or too near?"
            ))),
        }
    }

    /// Linear sRGB as it is: negative outside the gamut, without exposure.
    pub(crate) fn linear_srgb(&self) -> Vec<[f32; 3]> {
        self.xyz.iter().map(|xyz| linear_srgb_from_xyz(xyz.map(f64::from)).map(|v| v as f32)).collect()
    }

    /// The displayed picture: exposure, tone map, gamut map, sRGB.
    pub(crate) fn srgb8(&self, display: &Display) -> Vec<[u8; 3]> {
        self.xyz.iter().map(|xyz| display.srgb8_from_xyz(xyz.map(f64::from))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(y: &[f32]) -> Picture {
        let size = Size { width: y.len() as u32, height: 1 };
        Picture { size, xyz: y.iter().map(|&y| [0.95047 * y, y, 1.08883 * y]).collect() }
    }

    #[test]
    fn auto_exposure_brings_the_99th_percentile_to_white() {
        let ramp: Vec<f32> = (0..=100).map(|i| i as f32).collect();
        assert_eq!(picture(&ramp).display(Exposure::Auto).exposure, 1.0 / 99.0);
        let shown = picture(&ramp).srgb8(&picture(&ramp).display(Exposure::Auto));
        assert_eq!((shown[0], shown[99], shown[100]), ([0; 3], [255; 3], [255; 3]));
    }

    #[test]
    fn auto_exposure_of_dark_pictures_is_finite() {
        let mut dark = vec![0.0; 1000];
        assert_eq!(picture(&dark).display(Exposure::Auto).exposure, 1.0);
        dark[500] = 4.0;
        assert_eq!(picture(&dark).display(Exposure::Auto).exposure, 0.25);
    }

    #[test]
    fn pictures_that_are_not_finite_are_refused() {
        assert!(picture(&[0.0, 1e38]).check().is_ok());
        for bad in [f32::INFINITY, f32::NAN] {
            let message = picture(&[bad, 1.0, bad]).check().expect_err("refused").to_string();
            assert!(message.contains("2 pixels"), "{message}");
        }
    }

    #[test]
    fn a_given_exposure_is_taken_as_it_is() {
        assert_eq!(picture(&[1.0, 2.0]).display(Exposure::Factor(0.125)).exposure, 0.125);
    }

    #[test]
    fn linear_srgb_of_white_is_one_in_every_channel() {
        for v in picture(&[1.0]).linear_srgb()[0] {
            assert!((v - 1.0).abs() < 1e-6, "{v}");
        }
    }
}
