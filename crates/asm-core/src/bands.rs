//! Wavelengths of every light, with the weights and materials that go with them.

use spectral_core::light::LightSpectrum;
use spectral_core::observer::{Observer, VISIBLE_NM};
use spectral_core::rgb::luminance;
use spectral_core::upsample::SmoothSpectrum;
use spectral_core::wavelengths::WavelengthSet;
use spectral_scene::{Effects, Light, Material, Scene};

use crate::shared::footprint_light::RunningBand;

use crate::shared::flux::WHOLE;
use crate::shared::footprint::{FootprintCell, SPECTRUM_BINS, node_bin, share_start};
use crate::shared::optics::Optics;
use crate::shared::photons::Band;
use crate::{Method, PlanError, Settings};

/// d, the wavelength of glTF's index of refraction, nm.
pub(crate) const D_LINE_NM: f64 = 587.56;

/// Absorption that leaves nothing over any length that f32 tells from 0.
const OPAQUE_PER_UNIT: f64 = 1e20;

/// A light's wavelengths.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LightBands {
    pub(crate) wavelengths_nm: Vec<f64>,
    /// XYZ lux (directional) or candela that each wavelength carries.
    pub(crate) weights_xyz: Vec<[f64; 3]>,
    /// What all of them, and what lies between, carry together.
    pub(crate) xyz: [f64; 3],
    /// Of that, what a surface of each material reflects.
    pub(crate) reflected_xyz: Vec<[f64; 3]>,
    /// What each wavelength carries after such a reflection, wavelength x material; all of them together carry `reflected_xyz`.
    pub(crate) reflected_weights_xyz: Vec<[f64; 3]>,
    /// The largest component of any weight, which a whole part stands for; no part exceeds one.
    pub(crate) largest: f64,
    /// Of a light whose cells land as footprints.
    spectrum: Option<SpectrumBins>,
}

/// A light's whole spectrum in bins, even in 1 / wavelength^2 from red to violet.
#[derive(Clone, Debug, PartialEq)]
struct SpectrumBins {
    /// Lower ends of the bins, and the upper end of the last.
    edges_nm: Vec<f64>,
    /// XYZ lux (directional) or candela of all bins before each edge, after a reflection by each material, and last as the light
    /// has it: edge x (material + 1).
    before_xyz: Vec<[f64; 3]>,
    /// Integrals of place in the spectrum, 0 to 1, times XYZ; as `before_xyz`.
    moments_xyz: Vec<[f64; 3]>,
}

impl SpectrumBins {
    /// One bin holds all light of a light that no glass splits.
    fn whole(lambda_nm: f64, xyz: [f64; 3], reflected_xyz: &[[f64; 3]]) -> Self {
        let all = reflected_xyz.iter().copied().chain([xyz]);
        let none = vec![[0.0; 3]; reflected_xyz.len() + 1];
        let before_xyz: Vec<_> = none.into_iter().chain(all).collect();
        let moments_xyz = before_xyz.iter().map(|xyz| xyz.map(|c| 0.5 * c)).collect();
        Self { edges_nm: vec![lambda_nm; 2], before_xyz, moments_xyz }
    }

    fn split(
        light: &LightSpectrum,
        observer: Observer,
        xyz: [f64; 3],
        reflected_xyz: &[[f64; 3]],
        reflectances: &[SmoothSpectrum],
    ) -> Self {
        let (low_nm, high_nm) = VISIBLE_NM;
        let (first, last) = (1.0 / (high_nm * high_nm), 1.0 / (low_nm * low_nm));
        let bins = SPECTRUM_BINS as usize;
        let edges_nm: Vec<f64> =
            (0..=bins).map(|i| (first + (last - first) * i as f64 / bins as f64).sqrt().recip()).collect();
        let columns: Vec<Vec<[[f64; 3]; 2]>> = reflectances
            .iter()
            .map(Some)
            .chain([None])
            .zip(reflected_xyz.iter().copied().chain([xyz]))
            .map(|(rho, whole)| before_edges(light, observer, rho, &edges_nm, whole))
            .collect();
        let rows = (0..=bins).flat_map(|i| columns.iter().map(move |c| c[i]));
        let (before_xyz, moments_xyz) = rows.map(|[before, moment]| (before, moment)).unzip();
        Self { edges_nm, before_xyz, moments_xyz }
    }

    fn bins(&self) -> u32 {
        self.edges_nm.len() as u32 - 1
    }

    /// XYZ of the light itself before an edge.
    fn light_before(&self, edge: usize) -> [f64; 3] {
        let columns = self.before_xyz.len() / self.edges_nm.len();
        self.before_xyz[edge * columns + columns - 1]
    }
}

/// XYZ of a light's spectrum beyond each wavelength, as `rho` reflects it, scaled per channel so that all of it is `whole`; and the
/// integral of its place in 1 / wavelength^2, from 0 to 1, times it.
///
/// The integrand is linear in tables between whole nanometres: the trapezoidal rule on quarters of those.
fn before_edges(
    light: &LightSpectrum,
    observer: Observer,
    rho: Option<&SmoothSpectrum>,
    edges_nm: &[f64],
    whole: [f64; 3],
) -> Vec<[[f64; 3]; 2]> {
    const STEP_NM: f64 = 0.25;
    let (low_nm, high_nm) = VISIBLE_NM;
    let density = |nm: f64| {
        let power = light.relative_power(nm) * rho.map_or(1.0, |rho| rho.at(nm));
        observer.xyz_bar(nm).map(|bar| power * bar)
    };
    // From the red end down, as bins are numbered.
    let steps = ((high_nm - low_nm) / STEP_NM) as usize;
    let mut running = vec![[[0.0; 3]; 2]];
    let place = |nm: f64| {
        (1.0 / (nm * nm) - 1.0 / (high_nm * high_nm)) / (1.0 / (low_nm * low_nm) - 1.0 / (high_nm * high_nm))
    };
    for i in 0..steps {
        let nm = [high_nm - STEP_NM * i as f64, high_nm - STEP_NM * (i + 1) as f64];
        let ([a, b], [at_a, at_b]) = (nm.map(density), nm.map(place));
        let [before, moment] = running[i];
        running.push([
            std::array::from_fn(|c| before[c] + 0.5 * STEP_NM * (a[c] + b[c])),
            std::array::from_fn(|c| moment[c] + 0.5 * STEP_NM * (at_a * a[c] + at_b * b[c])),
        ]);
    }
    let [total, _] = running[steps];
    let at = |nm: f64| {
        let place = ((high_nm - nm) / STEP_NM).clamp(0.0, steps as f64);
        let i = (place as usize).min(steps - 1);
        let share = place - i as f64;
        [0, 1].map(|k| {
            std::array::from_fn(|c| {
                let integral = running[i][k][c] + share * (running[i + 1][k][c] - running[i][k][c]);
                if total[c] > 0.0 { whole[c] * integral / total[c] } else { 0.0 }
            })
        })
    };
    let mut edges: Vec<_> = edges_nm.iter().map(|&nm| at(nm)).collect();
    if let Some([last, _]) = edges.last_mut() {
        *last = whole;
    }
    edges
}

impl LightBands {
    /// `reflectances` are of the materials that light is seen on; [`SmoothSpectrum::ONE`] leaves it as it arrives.
    pub(crate) fn new(
        light: &Light,
        settings: &Settings,
        one: bool,
        reflectances: &[SmoothSpectrum],
    ) -> Result<Self, PlanError> {
        let strength = light.intensity * luminance(light.color);
        let unit_xyz = light.spectrum.unit_xyz(settings.observer);
        let (wavelengths_nm, unit_weights) = if let Some(line_nm) = light.spectrum.line_nm() {
            (vec![line_nm], vec![unit_xyz])
        } else if one || settings.wavelength_count() == 1 {
            (vec![D_LINE_NM], vec![unit_xyz])
        } else {
            let count = settings.wavelength_count() as usize;
            let set = WavelengthSet::new(settings.scheme(), count, settings.range_nm(), settings.observer)?;
            let weights = set.light_weights(&light.spectrum);
            (set.wavelengths_nm, weights)
        };
        let weights_xyz: Vec<_> = unit_weights.iter().map(|w| w.map(|c| c.max(0.0) * strength)).collect();
        let xyz = unit_xyz.map(|c| c * strength);
        if settings.method == Method::Footprint {
            return Ok(Self::of_footprints(light, settings, one, xyz, reflectances));
        }
        let (mut reflected_xyz, mut reflected) = (Vec::new(), Vec::new());
        let shares = shares_reflected(&light.spectrum, settings.observer, reflectances);
        for (share, reflectance) in shares.into_iter().zip(reflectances) {
            let rho: Vec<f64> = wavelengths_nm.iter().map(|&nm| reflectance.at(nm)).collect();
            reflected.push(reflected_weights(&weights_xyz, &rho, share));
            reflected_xyz.push(std::array::from_fn(|c| xyz[c] * share[c]));
        }
        let reflected_weights_xyz: Vec<_> =
            (0..wavelengths_nm.len()).flat_map(|k| reflected.iter().map(move |m| m[k])).collect();
        let all = weights_xyz.iter().chain(&reflected_weights_xyz).flatten();
        let largest = all.copied().fold(0.0, f64::max);
        let spectrum = None;
        Ok(Self { wavelengths_nm, weights_xyz, xyz, reflected_xyz, reflected_weights_xyz, largest, spectrum })
    }

    /// All of the spectrum in bins; the wavelengths are those that whole cells are traced at.
    fn of_footprints(
        light: &Light,
        settings: &Settings,
        one: bool,
        xyz: [f64; 3],
        reflectances: &[SmoothSpectrum],
    ) -> Self {
        let spectrum = &light.spectrum;
        let shares = shares_reflected(spectrum, settings.observer, reflectances);
        let reflected_xyz: Vec<[f64; 3]> =
            shares.into_iter().map(|share| std::array::from_fn(|c| xyz[c] * share[c])).collect();
        let line_nm = spectrum.line_nm().or((one || settings.wavelength_count() == 1).then_some(D_LINE_NM));
        let (nodes, bins) = match line_nm {
            Some(nm) => (1, SpectrumBins::whole(nm, xyz, &reflected_xyz)),
            None => {
                let observer = settings.observer;
                let bins = SpectrumBins::split(spectrum, observer, xyz, &reflected_xyz, reflectances);
                (settings.wavelength_count(), bins)
            }
        };
        let whole =
            FootprintCell { at: Default::default(), level: Default::default(), first: 0, bins: bins.bins() };
        let wavelengths_nm =
            (0..nodes).map(|node| bins.edges_nm[node_bin(nodes, node, &whole) as usize]).collect();
        let weights_xyz = (0..nodes)
            .map(|node| {
                let [start, end] =
                    [node, node + 1].map(|n| bins.light_before(share_start(nodes, n, whole.bins) as usize));
                std::array::from_fn(|c| end[c] - start[c])
            })
            .collect();
        let largest = bins.before_xyz.iter().flatten().copied().fold(0.0, f64::max);
        Self {
            wavelengths_nm,
            weights_xyz,
            xyz,
            reflected_xyz,
            reflected_weights_xyz: Vec::new(),
            largest,
            spectrum: Some(bins),
        }
    }

    /// Bins of the spectrum, of a light whose cells land as footprints; 0 for others.
    pub(crate) fn bins(&self) -> u32 {
        self.spectrum.as_ref().map_or(0, SpectrumBins::bins)
    }

    /// Rows of [`LightBands::bands`] and [`LightBands::optics`].
    pub(crate) fn rows(&self) -> u32 {
        self.spectrum.as_ref().map_or(&self.wavelengths_nm, |s| &s.edges_nm).len() as u32
    }

    /// Lumens of a unit of each wavelength's row in the ledger, of 1 unit through `extent`.
    pub(crate) fn lumens_per_unit(&self, extent: f64) -> Vec<f64> {
        let of = |xyz: &[f64; 3]| if self.spectrum.is_some() { self.largest } else { xyz[1] };
        self.weights_xyz.iter().map(|xyz| of(xyz) * extent).collect()
    }

    fn parts(&self, xyz: [f64; 3]) -> [u32; 3] {
        xyz.map(|c| (c / self.largest * f64::from(WHOLE)).round() as u32)
    }

    /// Weights as parts of the largest, wavelength x material where they land.
    pub(crate) fn bands(&self) -> impl Iterator<Item = Band> + '_ {
        self.reflected_weights_xyz.iter().map(|&xyz| Band { weight: self.parts(xyz), reserved: 0 })
    }

    /// What lies before each edge of the bins as parts of the largest weight: edge x (material where it lands, and the light
    /// itself). Only lights whose cells land as footprints have any.
    pub(crate) fn running_bands(&self) -> impl Iterator<Item = RunningBand> + '_ {
        let bins = self.spectrum.iter();
        bins.flat_map(|s| s.before_xyz.iter().zip(&s.moments_xyz)).map(|(&weight, &moment)| RunningBand {
            weight: self.parts(weight),
            reserved0: 0,
            moment: self.parts(moment),
            reserved1: 0,
        })
    }

    /// Materials at each wavelength, or at each edge of bins: wavelength x material.
    pub(crate) fn optics<'a>(
        &'a self,
        materials: &'a [Glass],
        metres_per_unit: f64,
    ) -> impl Iterator<Item = Optics> + 'a {
        self.spectrum
            .as_ref()
            .map_or(&self.wavelengths_nm, |s| &s.edges_nm)
            .iter()
            .flat_map(move |&nm| materials.iter().map(move |glass| glass.optics(nm, metres_per_unit)))
    }
}

/// Shares of a light's X, Y and Z that each reflectance leaves: integrals over its whole spectrum. White leaves exactly 1.
///
/// Tables of spectra and observers are linear between whole nanometres: Simpson's rule on such pieces.
fn shares_reflected(
    light: &LightSpectrum,
    observer: Observer,
    reflectances: &[SmoothSpectrum],
) -> Vec<[f64; 3]> {
    let nodes: Vec<(f64, [f64; 3])> = if let Some(line_nm) = light.line_nm() {
        vec![(line_nm, [1.0; 3])]
    } else {
        let (low_nm, high_nm) = VISIBLE_NM;
        let last = 2 * (high_nm - low_nm) as u32;
        let node = |i: u32| {
            let nm = low_nm + 0.5 * f64::from(i);
            let ends = if i == 0 || i == last { 0.5 } else { 1.0 };
            let simpson = if i % 2 == 1 { 4.0 } else { 2.0 * ends };
            let power = simpson * light.relative_power(nm);
            (nm, observer.xyz_bar(nm).map(|bar| power * bar))
        };
        (0..=last).map(node).collect()
    };
    let sum = |rho: &dyn Fn(f64) -> f64| -> [f64; 3] {
        nodes.iter().fold([0.0; 3], |sum, (nm, xyz)| {
            let rho = rho(*nm);
            std::array::from_fn(|c| sum[c] + xyz[c] * rho)
        })
    };
    let whole = sum(&|_| 1.0);
    let share = |rho: &SmoothSpectrum| {
        let reflected = sum(&|nm| rho.at(nm));
        std::array::from_fn(|c| if whole[c] > 0.0 { reflected[c] / whole[c] } else { 0.0 })
    };
    reflectances.iter().map(share).collect()
}

/// A light's weights after a reflection of `rho` at each wavelength, scaled per channel so that they add up to `share` of
/// the light's: with few wavelengths too, surfaces have the colour that the whole spectrum gives them. Where `rho` leaves
/// nothing of a channel at the chosen wavelengths, though it does between them, every wavelength is reflected alike.
fn reflected_weights(weights_xyz: &[[f64; 3]], rho: &[f64], share: [f64; 3]) -> Vec<[f64; 3]> {
    let sum = |c: usize, rho: &dyn Fn(usize) -> f64| -> f64 {
        weights_xyz.iter().enumerate().map(|(k, w)| w[c] * rho(k)).sum()
    };
    let scales: [Option<f64>; 3] = std::array::from_fn(|c| {
        let scale = sum(c, &|_| 1.0) * share[c] / sum(c, &|k| rho[k]);
        scale.is_finite().then_some(scale)
    });
    let reflected = |(w, rho): (&[f64; 3], &f64)| {
        std::array::from_fn(|c| scales[c].map_or(w[c] * share[c], |scale| w[c] * rho * scale))
    };
    weights_xyz.iter().zip(rho).map(reflected).collect()
}

/// Whether one wavelength stands for all: nothing in the scene treats two of them differently.
pub(crate) fn one_wavelength(scene: &Scene, effects: &Effects) -> bool {
    let tints = |m: &Material| {
        (m.is_refractor() || m.is_mirror()) && m.base_color.iter().any(|c| *c != m.base_color[0])
    };
    !effects.dispersion.on && !effects.absorption.on && !scene.materials.iter().any(tints)
}

/// A material as photons see it.
pub(crate) struct Glass<'a> {
    material: &'a Material,
    /// Transmittance over a distance in metres.
    attenuation: Option<(SmoothSpectrum, f64)>,
    color: SmoothSpectrum,
}

impl<'a> Glass<'a> {
    pub(crate) fn of(scene: &'a Scene) -> Vec<Self> {
        scene
            .materials
            .iter()
            .map(|material| Self {
                material,
                attenuation: material
                    .attenuation
                    .map(|a| (SmoothSpectrum::reflectance(a.color), a.distance_m)),
                color: SmoothSpectrum::reflectance(material.base_color),
            })
            .collect()
    }

    /// Of an opaque surface.
    pub(crate) fn reflectance(&self) -> SmoothSpectrum {
        self.color
    }

    pub(crate) fn optics(&self, lambda_nm: f64, metres_per_unit: f64) -> Optics {
        if self.material.is_mirror() {
            let surface = self.color.at(lambda_nm) as f32;
            return Optics { index: 1.0, absorption: 0.0, surface, reserved: 0.0 };
        }
        if !self.material.is_refractor() {
            return Optics { index: 1.0, absorption: 0.0, surface: 1.0, reserved: 0.0 };
        }
        let absorption = self.attenuation.as_ref().map_or(0.0, |(color, distance_m)| {
            (-color.at(lambda_nm).ln() * metres_per_unit / distance_m).clamp(0.0, OPAQUE_PER_UNIT)
        });
        Optics {
            index: self.material.dispersion.ior(lambda_nm) as f32,
            absorption: absorption as f32,
            surface: (self.material.transmission * self.color.at(lambda_nm)) as f32,
            reserved: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_after_a_reflection_are_defined_where_the_wavelengths_see_none_of_it() {
        let weights = [[0.5, 1.0, 0.0], [0.25, 0.0, 0.0]];
        // What lies between the wavelengths is reflected, what lies at them is not.
        let between = reflected_weights(&weights, &[0.0, 0.0], [0.2, 0.4, 0.6]);
        assert_eq!(between, [[0.1, 0.4, 0.0], [0.05, 0.0, 0.0]]);
        // The first alone: it stands for all of X.
        let first = reflected_weights(&weights, &[1e-320, 0.0], [0.2, 0.4, 0.6]);
        assert!(first.iter().flatten().all(|w| w.is_finite() && *w >= 0.0), "{first:?}");
        let one = reflected_weights(&weights, &[0.5, 0.0], [0.2, 0.4, 0.6]);
        assert!((one[0][0] - 0.15).abs() < 1e-15 && one[1][0] == 0.0, "{one:?}");
        assert_eq!(one[0][2], 0.0);
    }

    #[test]
    fn white_leaves_weights_as_they_are() {
        let light = LightSpectrum::illuminant("FL4").expect("FL4");
        let share = shares_reflected(&light, Observer::Cie1931, &[SmoothSpectrum::ONE])[0];
        assert_eq!(share, [1.0; 3]);
        let weights = [[0.3, 0.1, 0.7], [0.123, 0.456, 0.789]];
        assert_eq!(reflected_weights(&weights, &[1.0; 2], share), weights);
    }
}
