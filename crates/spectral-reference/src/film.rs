//! Sums of what lands on a receiver, and the spread between replicates.

use crate::shoot::{Film, REPLICATES};
use crate::texels::Texels;
use crate::trace::{Landing, Layer};
use crate::world::World;

/// Errors are stated at this resolution.
const COARSE: u32 = 64;

/// Y in at most 64 x 64 bins, per replicate.
#[derive(Clone, Debug)]
pub(crate) struct Coarse {
    /// Bin of each texel.
    bins: Vec<u32>,
    /// Texels per bin.
    texels: Vec<f64>,
    /// Sums over the bins' texels.
    sums: Vec<Vec<f64>>,
}

impl Coarse {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let (columns, rows) = (width.min(COARSE), height.min(COARSE));
        let bins: Vec<u32> = (0..height)
            .flat_map(|j| (0..width).map(move |i| (i, j)))
            .map(|(i, j)| {
                let scaled =
                    |k: u32, from: u32, to: u32| (u64::from(k) * u64::from(to) / u64::from(from)) as u32;
                scaled(j, height, rows) * columns + scaled(i, width, columns)
            })
            .collect();
        let count = (columns * rows) as usize;
        let mut texels = vec![0.0; count];
        bins.iter().for_each(|&b| texels[b as usize] += 1.0);
        Self { bins, texels, sums: vec![vec![0.0; count]; REPLICATES] }
    }

    pub(crate) fn add(&mut self, replicate: usize, texel: u32, y: f64) {
        self.sums[replicate][self.bins[texel as usize] as usize] += y;
    }

    /// Per bin its mean, and the variance of that mean. `scale` is what a replicate's sums must be multiplied with.
    fn moments(&self, scale: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        let n = REPLICATES as f64;
        (0..self.texels.len()).map(move |bin| {
            let value = |r: &Vec<f64>| r[bin] * scale / self.texels[bin];
            let mean = self.sums.iter().map(value).sum::<f64>() / n;
            let spread: f64 = self.sums.iter().map(|r| (value(r) - mean).powi(2)).sum();
            (mean, spread / (n - 1.0) / n)
        })
    }

    /// RMS of the standard error over RMS of the signal, of several independent layers together; 0 in the dark.
    pub(crate) fn relative_error(layers: &[(&Self, f64)]) -> f64 {
        let Some((first, _)) = layers.first() else { return 0.0 };
        let mut means = vec![0.0; first.texels.len()];
        let mut variance = 0.0;
        for (layer, scale) in layers {
            for (sum, (mean, of_mean)) in means.iter_mut().zip(layer.moments(*scale)) {
                *sum += mean;
                variance += of_mean;
            }
        }
        let signal: f64 = means.iter().map(|m| m * m).sum();
        if signal > 0.0 { (variance / signal).sqrt() } else { 0.0 }
    }
}

/// XYZ flux per texel of one receiver, in one layer.
pub(crate) struct ReceiverFilm<'a> {
    world: &'a World,
    texels: &'a Texels,
    layer: Layer,
    /// Lumens per texel, all replicates together.
    pub(crate) flux: Vec<[f64; 3]>,
    pub(crate) coarse: Coarse,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Deposit {
    texel: u32,
    xyz: [f64; 3],
}

impl<'a> ReceiverFilm<'a> {
    pub(crate) fn new(world: &'a World, texels: &'a Texels, layer: Layer) -> Self {
        let flux = vec![[0.0; 3]; texels.areas.len()];
        Self { world, texels, layer, flux, coarse: Coarse::new(texels.width, texels.height) }
    }

    /// Irradiance, XYZ with Y in lux; `scale` is for the number of paths.
    pub(crate) fn irradiance(&self, scale: f64) -> Vec<[f64; 3]> {
        let texel = |(xyz, &area): (&[f64; 3], &f64)| {
            if area > 0.0 { xyz.map(|v| v * scale / area) } else { [0.0; 3] }
        };
        self.flux.iter().zip(&self.texels.areas).map(texel).collect()
    }
}

impl Film for ReceiverFilm<'_> {
    type Deposit = Deposit;

    fn expose(&self, _lamp: usize, landing: &Landing, deposits: &mut Vec<Deposit>) -> bool {
        let Some(texel) = self.texels.texel(self.world, landing.hit) else { return false };
        if landing.layer == self.layer {
            let mut xyz = [0.0; 3];
            for (lane, power) in landing.lanes.iter().zip(landing.powers) {
                for (sum, value) in xyz.iter_mut().zip(lane.xyz) {
                    *sum += value * power * landing.flux;
                }
            }
            deposits.push(Deposit { texel, xyz });
        }
        true
    }

    fn flux(deposit: &Deposit) -> f64 {
        deposit.xyz[1]
    }

    fn add(&mut self, replicate: usize, deposits: Vec<Deposit>) {
        for Deposit { texel, xyz } in deposits {
            let at = texel as usize;
            for (sum, value) in self.flux[at].iter_mut().zip(xyz) {
                *sum += value;
            }
            self.coarse.add(replicate, texel, xyz[1] / self.texels.areas[at]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_replicates_have_no_error_and_bins_average_texels() {
        let mut coarse = Coarse::new(128, 64);
        assert_eq!(coarse.texels.len(), 64 * 64);
        for r in 0..REPLICATES {
            (0..128 * 64).for_each(|texel| coarse.add(r, texel, 2.0));
        }
        assert_eq!(Coarse::relative_error(&[(&coarse, 1.0)]), 0.0);
        assert!(coarse.moments(0.5).all(|(mean, variance)| mean == 1.0 && variance == 0.0));
    }

    /// Values 1 +- s in every bin, independent: the error of the mean of R is s / sqrt(R).
    #[test]
    fn the_spread_between_replicates_is_the_error() {
        let mut coarse = Coarse::new(64, 64);
        let mut state = 1_u64;
        for r in 0..REPLICATES {
            for texel in 0..64 * 64 {
                state = crate::sobol::mix(state);
                coarse.add(r, texel, if state >> 63 == 0 { 1.1 } else { 0.9 });
            }
        }
        let error = Coarse::relative_error(&[(&coarse, 1.0)]);
        let expected = 0.1 / (REPLICATES as f64).sqrt();
        assert!((error / expected - 1.0).abs() < 0.03, "{error} {expected}");
    }
}
