//! A sky in a JSON file: lights with spectra and shapes in spherical harmonics.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::light_xyz;
use spectral_prt::figures::{GRID, OBSERVER, power};
use spectral_prt::{Bands, Resampling, SpectralSky, shape_of_bands};

use super::environment::unit;
use crate::error::CliError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SkyFile {
    /// They add up.
    lights: Vec<SkyLight>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SkyLight {
    /// Scaled to luminance 1.
    spectrum: Spectrum,
    /// Radiance as a multiple of that: coefficients of harmonics, band by band.
    bands: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Spectrum {
    Illuminant(Illuminant),
    /// Two columns, nm and power; from the sky file's folder.
    Csv(PathBuf),
}

/// The sky in a file.
///
/// # Errors
/// What cannot be read, and where.
pub(super) fn open(path: &Path, bands: Bands) -> Result<SpectralSky, CliError> {
    let failed = |problem: String| CliError::failed(format!("{}: {problem}", path.display()));
    let text = fs::read_to_string(path).map_err(|error| failed(error.to_string()))?;
    let file: SkyFile = serde_json::from_str(&text).map_err(|error| failed(error.to_string()))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut sky: Option<SpectralSky> = None;
    for (i, SkyLight { spectrum, bands: written }) in file.lights.iter().enumerate() {
        let shape = shape_of_bands(bands, written).map_err(|error| failed(format!("light {i}: {error}")))?;
        let power = match spectrum {
            Spectrum::Illuminant(illuminant) => power(*illuminant),
            Spectrum::Csv(csv) => tabulated(&folder.join(csv))?,
        };
        let light = SpectralSky::of_shape(bands, GRID, &shape, &unit(&power));
        sky = Some(match sky {
            None => light,
            Some(sky) => sky.plus(&light),
        });
    }
    sky.ok_or_else(|| failed("it has no lights; a sky has one at least".into()))
}

/// A spectrum of wavelengths in nm and powers, brought to the grid. A first line that is no numbers is a heading.
fn tabulated(path: &Path) -> Result<Vec<f64>, CliError> {
    let failed = |problem: String| CliError::failed(format!("{}: {problem}", path.display()));
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| failed(error.to_string()))?;
    let (mut wavelengths_nm, mut powers) = (Vec::new(), Vec::new());
    for (i, record) in reader.records().enumerate() {
        let record = record.map_err(|error| failed(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |column: usize| record.get(column).and_then(|field| field.parse::<f64>().ok());
        match (number(0), number(1), record.len()) {
            (Some(lambda_nm), Some(power), 2) if power.is_finite() && power >= 0.0 => {
                wavelengths_nm.push(lambda_nm);
                powers.push(power);
            }
            (None, None, 2) if i == 0 => {}
            _ => {
                let got = record.iter().collect::<Vec<_>>().join(",");
                return Err(failed(format!(
                    "line {line} is `{got}`; it is a wavelength in nm and a power that is finite and not negative"
                )));
            }
        }
    }
    let resampling = Resampling::new(&wavelengths_nm, &GRID).map_err(|error| failed(error.to_string()))?;
    let power = resampling.apply(&powers);
    if light_xyz(&GRID, OBSERVER, &power)[1] > 0.0 {
        Ok(power)
    } else {
        Err(failed("no power that is seen: nothing would be lit".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn opened(json: &str, csv: &str) -> Result<SpectralSky, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("sky.json");
        fs::write(&path, json).expect("written");
        fs::write(folder.path().join("lamp.csv"), csv).expect("written");
        open(&path, Bands::default()).map_err(|error| error.to_string())
    }

    const EVEN: f64 = 3.544_907_701_811_032; // 2 sqrt(pi)

    #[test]
    fn an_even_file_is_its_illuminant_at_luminance_1() {
        let json = format!(r#"{{"lights": [{{"spectrum": {{"illuminant": "FL4"}}, "bands": [[{EVEN}]]}}]}}"#);
        let mean = opened(&json, "").expect("a sky").mean();
        let fl4 = power(Illuminant::Fl4);
        let y = light_xyz(&GRID, OBSERVER, &fl4)[1];
        for (got, expected) in mean.iter().zip(&fl4) {
            assert!((got - expected / y).abs() < 1e-12, "{got} {expected}");
        }
    }

    #[test]
    fn a_table_of_the_illuminant_is_the_illuminant() {
        let of = |spectrum: &str| {
            format!(r#"{{"lights": [{{"spectrum": {spectrum}, "bands": [[1.0], [0.2, 0.5, 0.1]]}}]}}"#)
        };
        let mut csv = "wavelength_nm,power\n# FL2\n".to_owned();
        for l in (380..=780).step_by(5) {
            csv += &format!("{l}, {}\n", Illuminant::Fl2.relative_power(l.into()));
        }
        let by_table = opened(&of(r#"{"csv": "lamp.csv"}"#), &csv).expect("a sky");
        let by_name = opened(&of(r#"{"illuminant": "FL2"}"#), "").expect("a sky");
        assert_eq!(by_table, by_name);
        assert_ne!(by_table, opened(&of(r#"{"illuminant": "FL3"}"#), "").expect("a sky"));
    }

    #[test]
    fn what_is_no_sky_is_refused_with_its_place() {
        let refused = |json: &str, csv: &str, said: &str| {
            let problem = opened(json, csv).expect_err(json);
            assert!(problem.contains(said) && problem.lines().count() <= 2, "{problem}");
        };
        refused("{", "", "sky.json: EOF");
        refused(r#"{"lights": []}"#, "", "no lights");
        refused(r#"{"lights": [{"spectrum": {"illuminant": "FL13"}, "bands": [[1]]}]}"#, "", "FL13");
        refused(
            r#"{"lights": [{"spectrum": {"illuminant": "A"}, "bands": [[1], [1]]}]}"#,
            "",
            "light 0: band 1 has 1",
        );
        refused(r#"{"lights": [{"spectrum": {"illuminant": "A"}, "bands": [[-1]]}]}"#, "", "above 0");
        refused(
            r#"{"lights": [{"spectrum": {"illuminant": "A"}, "bands": [[1]], "power": 2}]}"#,
            "",
            "power",
        );
        let lamp = r#"{"lights": [{"spectrum": {"csv": "lamp.csv"}, "bands": [[1]]}]}"#;
        refused(lamp, "400,1\n700", "lamp.csv: line 2 is `700`");
        refused(lamp, "nm,W\n400,1\n700,-1\n", "line 3 is `700,-1`");
        refused(lamp, "400,1\n550,NaN\n700,1\n", "line 2 is `550,NaN`");
        refused(lamp, "400,1\nred,1\n700,1\n", "line 2 is `red,1`");
        refused(lamp, "400,1\n700,1\n500,1\n", "500 nm after 700 nm");
        refused(lamp, "450,1\n700,1\n", "400 to 700 nm are needed");
        refused(lamp, "400,0\n700,0\n", "nothing would be lit");
        refused(&lamp.replace("lamp", "no-lamp"), "", "no-lamp.csv");
    }
}
