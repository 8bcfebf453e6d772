//! Wavelengths of a light, drawn where the eye looks.

use spectral_core::light::LightSpectrum;
use spectral_core::observer::{Observer, VISIBLE_NM};

/// Wavelengths carried together by one path until glass separates them.
pub(crate) const LANES: usize = 4;

/// Share of the samples that follow the light's power instead of its colour, so that the ledger sees the spectrum's
/// invisible ends too.
const POWER_SHARE: f64 = 0.1;

/// A light's spectrum in cells of constant width, and the density to draw wavelengths from.
#[derive(Clone, Debug)]
pub(crate) struct Spectrum {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Line { lambda_nm: f64, xyz: [f64; 3] },
    Cells { step_nm: f64, cells: Vec<Cell> },
}

#[derive(Clone, Copy, Debug)]
struct Cell {
    /// XYZ of the cell when Y of the whole light is 1.
    xyz: [f64; 3],
    /// Share of the light's power.
    power: f64,
    probability: f64,
    /// Sum of the probabilities up to and with this cell.
    cumulative: f64,
}

/// One wavelength of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Lane {
    /// Vacuum wavelength, nm.
    pub(crate) lambda_nm: f64,
    /// XYZ that the lane stands for when Y of the whole light is 1.
    pub(crate) xyz: [f64; 3],
    /// Share of the light's power that the lane stands for.
    pub(crate) power: f64,
    /// Its place among the samples' density, 0 to 1, rising with the wavelength.
    pub(crate) quantile: f64,
}

/// The lanes of one path; the rest of the array is unused.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lanes {
    pub(crate) lanes: [Lane; LANES],
    pub(crate) len: usize,
}

impl Spectrum {
    /// `step_nm` is the width of the cells, within which the density of colour and power is constant.
    pub(crate) fn new(light: &LightSpectrum, observer: Observer, step_nm: f64) -> Self {
        if let Some(lambda_nm) = light.line_nm() {
            return Self { kind: Kind::Line { lambda_nm, xyz: light.unit_xyz(observer) } };
        }
        let (lo_nm, hi_nm) = VISIBLE_NM;
        let count = ((hi_nm - lo_nm) / step_nm).round().max(1.0) as usize;
        let step_nm = (hi_nm - lo_nm) / count as f64;
        let centres: Vec<f64> = (0..count).map(|i| lo_nm + (i as f64 + 0.5) * step_nm).collect();
        let xyz = light.spectral_lux(observer, &centres, step_nm);
        let powers: Vec<f64> = centres.iter().map(|&nm| light.relative_power(nm).max(0.0)).collect();
        let total_power: f64 = powers.iter().sum();
        let brightness = |xyz: &[f64; 3]| xyz.iter().sum::<f64>();
        let total_brightness: f64 = xyz.iter().map(brightness).sum();
        let mut cumulative = 0.0;
        let cells = xyz
            .iter()
            .zip(&powers)
            .map(|(xyz, power)| {
                // A light without power, which no constructor makes, is taken as even.
                let power = if total_power > 0.0 { power / total_power } else { 1.0 / count as f64 };
                let probability =
                    POWER_SHARE * power + (1.0 - POWER_SHARE) * brightness(xyz) / total_brightness;
                cumulative += probability;
                Cell { xyz: *xyz, power, probability, cumulative }
            })
            .collect();
        Self { kind: Kind::Cells { step_nm, cells } }
    }

    /// All light has one wavelength.
    pub(crate) fn is_line(&self) -> bool {
        matches!(self.kind, Kind::Line { .. })
    }

    /// Wavelengths per path.
    pub(crate) fn lane_count(&self) -> usize {
        if self.is_line() { 1 } else { LANES }
    }

    /// Stratified wavelengths from one number in 0..1.
    pub(crate) fn lanes(&self, u: f64) -> Lanes {
        let mut lanes = [Lane::default(); LANES];
        match &self.kind {
            Kind::Line { lambda_nm, xyz } => {
                lanes[0] = Lane { lambda_nm: *lambda_nm, xyz: *xyz, power: 1.0, quantile: 0.5 };
                Lanes { lanes, len: self.lane_count() }
            }
            Kind::Cells { step_nm, cells } => {
                for (j, lane) in lanes.iter_mut().enumerate() {
                    *lane = draw(cells, *step_nm, (j as f64 + u) / LANES as f64);
                }
                Lanes { lanes, len: self.lane_count() }
            }
        }
    }
}

fn draw(cells: &[Cell], step_nm: f64, u: f64) -> Lane {
    // The last cumulative value is 1 up to rounding.
    let at = cells.partition_point(|c| c.cumulative <= u).min(cells.len() - 1);
    let cell = &cells[at];
    let within = ((u - (cell.cumulative - cell.probability)) / cell.probability).clamp(0.0, 1.0);
    let weight = 1.0 / (cell.probability * LANES as f64);
    Lane {
        lambda_nm: VISIBLE_NM.0 + (at as f64 + within) * step_nm,
        xyz: cell.xyz.map(|v| v * weight),
        power: cell.power * weight,
        quantile: u,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(spectrum: &Spectrum, n: u32) -> ([f64; 3], f64) {
        let mut xyz = [0.0; 3];
        let mut power = 0.0;
        for i in 0..n {
            let drawn = spectrum.lanes((f64::from(i) + 0.5) / f64::from(n));
            for lane in &drawn.lanes[..drawn.len] {
                (0..3).for_each(|c| xyz[c] += lane.xyz[c] / f64::from(n));
                power += lane.power / f64::from(n);
            }
        }
        (xyz, power)
    }

    #[test]
    fn samples_add_up_to_the_light() {
        for light in [
            LightSpectrum::default(),
            LightSpectrum::illuminant("E").unwrap(),
            LightSpectrum::illuminant("FL4").unwrap(),
            LightSpectrum::line(546.1).unwrap(),
        ] {
            for step_nm in [1.0, 5.0] {
                let spectrum = Spectrum::new(&light, Observer::Cie1931, step_nm);
                let (xyz, power) = mean(&spectrum, 20_000);
                let unit = light.unit_xyz(Observer::Cie1931);
                for c in 0..3 {
                    assert!((xyz[c] - unit[c]).abs() < 1e-4, "{light:?} {xyz:?} {unit:?}");
                }
                assert!((power - 1.0).abs() < 1e-4, "{light:?} {power}");
            }
        }
    }

    #[test]
    fn wavelengths_stay_visible_and_in_order() {
        let spectrum = Spectrum::new(&LightSpectrum::default(), Observer::Cie1931, 1.0);
        for u in [0.0, 0.5, 1.0 - 1e-16] {
            let drawn = spectrum.lanes(u);
            let lanes = &drawn.lanes[..drawn.len];
            assert!(lanes.windows(2).all(|w| w[0].lambda_nm < w[1].lambda_nm));
            assert!(lanes.iter().all(|l| (380.0..=780.0).contains(&l.lambda_nm)));
        }
    }
}
