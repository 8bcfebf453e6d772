//! Surroundings as an equirectangular picture with a spectrum at every texel.

use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{ReadChannels, ReadLayers, read};
use std::collections::HashMap;

use crate::resampling::{WavelengthsError, ascending};

/// The version of the layout.
const LAYOUT_VERSION: &str = "1.0";
/// Units of radiance that files name. The layout's own leaves out that it is one per wavelength.
const UNITS: [&str; 2] = ["W.m^-2.sr^-1", "W.m^-2.sr^-1.nm^-1"];

/// Spectral radiance from all directions, W/(m^2 sr nm) or in any other unit.
///
/// The first row is straight up, +Y. The middle column looks along -Z, and +X is to its right.
#[derive(Clone, Debug, PartialEq)]
pub struct SpectralPanorama {
    size: [usize; 2],
    wavelengths_nm: Vec<f64>,
    /// One for each wavelength: radiance, row after row.
    channels: Vec<Vec<f32>>,
}

/// Why a spectral picture lights nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpectralPanoramaError {
    /// Not one channel for each wavelength.
    #[error("{channels} channels for {wavelengths} wavelengths; there is one for each")]
    Channels {
        /// Channels there are.
        channels: usize,
        /// Wavelengths there are.
        wavelengths: usize,
    },
    /// No texels, or not as many as the size says.
    #[error("{texels} texels at {lambda_nm} nm for a panorama of {width} x {height}")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Where, nm.
        lambda_nm: f64,
        /// Texels there are.
        texels: usize,
    },
    /// Wavelengths that make no spectrum.
    #[error(transparent)]
    Wavelengths(#[from] WavelengthsError),
    /// An undefined, infinite or negative radiance.
    #[error(
        "the texel in column {column}, row {row} is {got} at {lambda_nm} nm; radiance is finite and not negative"
    )]
    Radiance {
        /// Its column, from 0.
        column: usize,
        /// Its row, from 0.
        row: usize,
        /// Where, nm.
        lambda_nm: f64,
        /// What it holds.
        got: f32,
    },
    /// Every texel is 0.
    #[error("all texels are black: nothing would be lit")]
    Dark,
    /// A file that is no EXR.
    #[error("cannot be read as an EXR: {problem}")]
    File {
        /// What is wrong with it.
        problem: String,
    },
    /// Another layout.
    #[error("its spectralLayoutVersion is {got}; {LAYOUT_VERSION} can be read")]
    Layout {
        /// What it has.
        got: String,
    },
    /// Not radiance.
    #[error("its emissiveUnits are {got}; radiance is in {} or {}", UNITS[0], UNITS[1])]
    Units {
        /// What it has.
        got: String,
    },
    /// What surfaces reflect, and no light.
    #[error(
        "it has reflectances (channels such as `{example}`) and no light; light is in channels named S0.<nm>nm"
    )]
    Reflective {
        /// One of its channels.
        example: String,
    },
    /// No spectrum at all.
    #[error("it has no channel named S0.<nm>nm, such as S0.550,0nm")]
    NoLight,
    /// A channel that cannot be used.
    #[error("its channel `{name}` {problem}")]
    Channel {
        /// Its name.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl SpectralPanorama {
    /// A picture of `size` columns and rows: for each of the wavelengths, which ascend, its radiance, row after row.
    ///
    /// # Errors
    /// [`SpectralPanoramaError`] for another number of channels or texels, wavelengths that do not ascend, radiances that are NaN,
    /// infinite or negative, and if all are 0.
    pub fn new(
        size: [usize; 2],
        wavelengths_nm: Vec<f64>,
        channels: Vec<Vec<f32>>,
    ) -> Result<Self, SpectralPanoramaError> {
        let [width, height] = size;
        if channels.len() != wavelengths_nm.len() {
            let (channels, wavelengths) = (channels.len(), wavelengths_nm.len());
            return Err(SpectralPanoramaError::Channels { channels, wavelengths });
        }
        ascending(&wavelengths_nm)?;
        for (&lambda_nm, radiance) in wavelengths_nm.iter().zip(&channels) {
            let texels = radiance.len();
            if texels == 0 || width.checked_mul(height) != Some(texels) {
                return Err(SpectralPanoramaError::Size { width, height, lambda_nm, texels });
            }
            if let Some(at) = radiance.iter().position(|v| !(v.is_finite() && *v >= 0.0)) {
                let (column, row, got) = (at % width, at / width, radiance[at]);
                return Err(SpectralPanoramaError::Radiance { column, row, lambda_nm, got });
            }
        }
        if channels.iter().flatten().all(|v| *v == 0.0) {
            return Err(SpectralPanoramaError::Dark);
        }
        Ok(Self { size, wavelengths_nm, channels })
    }

    /// Whether an EXR file has spectra, or says that it has.
    pub fn is_in(path: &Path) -> bool {
        let Ok(file) = MetaData::read_from_file(path, false) else { return false };
        file.headers.iter().any(|header| {
            let mut names = header.channels.list.iter().map(|channel| channel.name.to_string());
            let others = [&header.own_attributes.other, &header.shared_attributes.other];
            attribute(others, "spectralLayoutVersion").is_some()
                || names.any(|n| is_light(&n) || is_reflective(&n))
        })
    }

    /// The first layer with light of an EXR file in the layout of Fichet, Pacanowski & Wilkie 2021, "A spectral image format with
    /// OpenEXR", JCGT 10(3): channels named `S0.<nm>nm` with a decimal comma, and the attributes `spectralLayoutVersion` and
    /// `emissiveUnits`. Channels in colour, of polarisation (S1 to S3) and of reflectance (T) are passed over.
    ///
    /// # Errors
    /// As [`SpectralPanorama::new`], and those of [`SpectralPanoramaError`] that say what the file has.
    pub fn from_exr(path: &Path) -> Result<Self, SpectralPanoramaError> {
        let image = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_file(path)
            .map_err(|error| SpectralPanoramaError::File { problem: error.to_string() })?;
        let names = || {
            let layers = image.layer_data.iter();
            layers.flat_map(|layer| &layer.channel_data.list).map(|channel| channel.name.to_string())
        };
        let lit = image
            .layer_data
            .iter()
            .find(|layer| layer.channel_data.list.iter().any(|channel| is_light(&channel.name.to_string())));
        let Some(layer) = lit else {
            return Err(match names().find(|name| is_reflective(name)) {
                Some(example) => SpectralPanoramaError::Reflective { example },
                None => SpectralPanoramaError::NoLight,
            });
        };
        let others = [&layer.attributes.other, &image.attributes.other];
        let told = |name| attribute(others, name).unwrap_or_else(|| "missing".into());
        let layout = told("spectralLayoutVersion");
        if layout != LAYOUT_VERSION {
            return Err(SpectralPanoramaError::Layout { got: layout });
        }
        let units = told("emissiveUnits");
        if !UNITS.contains(&&*units) {
            return Err(SpectralPanoramaError::Units { got: units });
        }
        let mut channels = Vec::new();
        for channel in &layer.channel_data.list {
            let name = channel.name.to_string();
            if !is_light(&name) {
                continue;
            }
            let wrong = |problem| SpectralPanoramaError::Channel { name: name.clone(), problem };
            let lambda_nm = lambda_nm(&name).ok_or_else(|| {
                wrong("names no wavelength: S0., nanometres with a decimal comma, nm, as in S0.550,5nm")
            })?;
            if channel.sampling.x() != 1 || channel.sampling.y() != 1 {
                return Err(wrong("leaves out texels; all are needed"));
            }
            channels.push((lambda_nm, channel.sample_data.values_as_f32().collect::<Vec<_>>()));
        }
        // Files have channels in the order of their names.
        channels.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let (wavelengths_nm, channels) = channels.into_iter().unzip();
        Self::new([layer.size.width(), layer.size.height()], wavelengths_nm, channels)
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Where there is a channel, ascending, nm.
    pub fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelengths_nm
    }

    /// For each wavelength the radiance of every texel, row after row.
    pub fn channels(&self) -> &[Vec<f32>] {
        &self.channels
    }
}

fn is_light(channel: &str) -> bool {
    channel.starts_with("S0.")
}

fn is_reflective(channel: &str) -> bool {
    channel.starts_with("T.")
}

/// The wavelength that a channel of light is named after.
fn lambda_nm(channel: &str) -> Option<f64> {
    let number = channel.strip_prefix("S0.")?.strip_suffix("nm")?;
    let is_number = number.starts_with(|c: char| c.is_ascii_digit()) && !number.contains('.');
    let lambda_nm: f64 = is_number.then(|| number.replace(',', ".").parse().ok()).flatten()?;
    (lambda_nm.is_finite() && lambda_nm > 0.0).then_some(lambda_nm)
}

fn attribute(of: [&HashMap<Text, AttributeValue>; 2], name: &str) -> Option<String> {
    let name = Text::from(name);
    let value = of.iter().find_map(|attributes| attributes.get(&name))?;
    Some(match value {
        AttributeValue::Text(text) => text.to_string(),
        _ => "no text".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_named_after_wavelengths_with_a_decimal_comma() {
        for (name, expected) in [
            ("S0.550nm", Some(550.0)),
            ("S0.414,2857nm", Some(414.2857)),
            ("S0.4,5E2nm", Some(450.0)),
            ("S0.550.5nm", None),
            ("S0.550", None),
            ("S0.500THz", None),
            ("S0.nm", None),
            ("S0.-5nm", None),
            ("S0.infnm", None),
            ("S0.0nm", None),
        ] {
            assert_eq!(lambda_nm(name), expected, "{name}");
        }
    }

    #[test]
    fn what_lights_nothing_is_refused_with_its_place() {
        let refused = |wavelengths_nm: &[f64], channels: &[&[f32]]| {
            let channels = channels.iter().map(|channel| channel.to_vec()).collect();
            SpectralPanorama::new([2, 2], wavelengths_nm.to_vec(), channels).unwrap_err().to_string()
        };
        let good: &[f32] = &[1.0, 2.0, 3.0, 4.0];
        assert_eq!(refused(&[400.0, 700.0], &[good]), "1 channels for 2 wavelengths; there is one for each");
        assert_eq!(
            refused(&[400.0, 700.0], &[good, &good[..3]]),
            "3 texels at 700 nm for a panorama of 2 x 2"
        );
        assert_eq!(refused(&[700.0, 400.0], &[good, good]), "400 nm after 700 nm; wavelengths ascend");
        assert_eq!(refused(&[400.0, 400.0], &[good, good]), "400 nm after 400 nm; wavelengths ascend");
        assert_eq!(
            refused(&[400.0, 700.0], &[&[0.0; 4], &[0.0; 4]]),
            "all texels are black: nothing would be lit"
        );
        for bad in [-0.5, f32::NAN, f32::INFINITY] {
            assert_eq!(
                refused(&[400.0, 700.0], &[good, &[1.0, 1.0, 1.0, bad]]),
                format!(
                    "the texel in column 1, row 1 is {bad} at 700 nm; radiance is finite and not negative"
                )
            );
        }
    }
}
