//! What a light's spectrum makes of a set's weights.

use alloc::vec;
use alloc::vec::Vec;

use crate::light::LightSpectrum;
use crate::observer::VISIBLE_NM;
use crate::wavelengths::{WavelengthSet, neighbourhoods_nm};

impl WavelengthSet {
    /// XYZ that each wavelength carries of a light with luminance 1: none negative, each channel with the sum
    /// [`LightSpectrum::unit_xyz`] up to rounding.
    ///
    /// A wavelength stands for all that are nearer to it than to any other of the set. Its weight is the set's own
    /// times the mean spectral power over that neighbourhood, weighted with the colour-matching function, so that narrow
    /// lines between the wavelengths are not missed; then each channel is scaled to its sum. A single line thus
    /// falls to the nearest wavelength as a whole. Where a channel comes to nothing although the light has some of it
    /// (the set's weight is zero just where the light is), the light's own distribution over the neighbourhoods
    /// takes the place of the product.
    pub fn light_weights(&self, light: &LightSpectrum) -> Vec<[f64; 3]> {
        let unit_xyz = light.unit_xyz(self.observer);
        let own = self.relative_weights_xyz();
        let neighbourhoods = neighbourhoods_nm(&self.wavelengths_nm);
        let shares = self.light_shares(light, &neighbourhoods);
        let mut product = vec![[0.0; 3]; self.len()];
        for ((product, own), share) in product.iter_mut().zip(&own).zip(&shares) {
            for c in 0..3 {
                product[c] = own[c] * share.mean_power[c];
            }
        }
        let mut weights = vec![[0.0; 3]; self.len()];
        for c in 0..3 {
            let sum = product.iter().map(|w| w[c]).sum::<f64>();
            let fallback_sum = shares.iter().map(|s| s.power[c]).sum::<f64>();
            for ((weight, product), share) in weights.iter_mut().zip(&product).zip(&shares) {
                weight[c] = if sum > 0.0 {
                    product[c] / sum * unit_xyz[c]
                } else if fallback_sum > 0.0 {
                    share.power[c] / fallback_sum * unit_xyz[c]
                } else {
                    // A spectrum without power in this channel has none of it in its XYZ either, unless it is an
                    // authored colour: then there is no wavelength to prefer.
                    unit_xyz[c] / self.len() as f64
                };
            }
        }
        weights
    }

    fn light_shares(&self, light: &LightSpectrum, neighbourhoods_nm: &[(f64, f64)]) -> Vec<Share> {
        if let Some(line_nm) = light.line_nm() {
            let bar = self.observer.xyz_bar(line_nm);
            let lit = neighbourhoods_nm.iter().position(|&(_, hi_nm)| line_nm < hi_nm);
            return (0..neighbourhoods_nm.len())
                .map(
                    |i| if Some(i) == lit { Share { power: bar, mean_power: bar } } else { Share::default() },
                )
                .collect();
        }
        // Lights are integrated over the visible range; what lies outside gets nothing.
        let visible = |nm: f64| nm.clamp(VISIBLE_NM.0, VISIBLE_NM.1);
        neighbourhoods_nm
            .iter()
            .map(|&(lo_nm, hi_nm)| self.share(light, visible(lo_nm), visible(hi_nm)))
            .collect()
    }

    fn share(&self, light: &LightSpectrum, lo_nm: f64, hi_nm: f64) -> Share {
        // Midpoints at most 1 nm apart, the step of the finest table.
        let steps = libm::ceil(hi_nm - lo_nm).max(1.0);
        let step_nm = (hi_nm - lo_nm) / steps;
        let (mut power, mut equal_energy) = ([0.0; 3], [0.0; 3]);
        for i in 0..steps as u32 {
            let nm = lo_nm + (f64::from(i) + 0.5) * step_nm;
            let (bar, relative_power) = (self.observer.xyz_bar(nm), light.relative_power(nm));
            for c in 0..3 {
                power[c] += bar[c] * relative_power * step_nm;
                equal_energy[c] += bar[c] * step_nm;
            }
        }
        let mean_power =
            core::array::from_fn(|c| if equal_energy[c] > 0.0 { power[c] / equal_energy[c] } else { 0.0 });
        Share { power, mean_power }
    }
}

/// What of a light falls to one neighbourhood, per channel, on an arbitrary scale.
#[derive(Clone, Copy, Default)]
struct Share {
    /// Integral of spectrum times colour-matching function.
    power: [f64; 3],
    /// That, divided by the integral of the colour-matching function.
    mean_power: [f64; 3],
}
