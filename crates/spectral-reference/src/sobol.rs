//! Owen-scrambled Sobol points.
//!
//! A scrambled Sobol sequence stays a (t, m, s)-net, and any two scramblings are independent: the spread between a
//! few of them is an unbiased estimate of the error that ordinary Monte Carlo statistics cannot give for
//! low-discrepancy points (Owen, "Monte Carlo variance of scrambled net quadrature", 1997).

/// Dimensions of [`Sequence::point`].
pub(crate) const DIMENSIONS: usize = 4;

/// Direction numbers by Joe & Kuo (new-joe-kuo-6.21201): degree s, coefficients a, initial m; the first dimension
/// is the van der Corput sequence.
const JOE_KUO: [(usize, u32, [u32; 3]); DIMENSIONS - 1] =
    [(1, 0, [1, 0, 0]), (2, 1, [1, 3, 0]), (3, 1, [1, 3, 1])];

const DIRECTIONS: [[u32; 32]; DIMENSIONS] = directions();

const fn directions() -> [[u32; 32]; DIMENSIONS] {
    let mut v = [[0_u32; 32]; DIMENSIONS];
    let mut bit = 0;
    while bit < 32 {
        v[0][bit] = 1 << (31 - bit);
        bit += 1;
    }
    let mut dimension = 1;
    while dimension < DIMENSIONS {
        let (s, a, m) = JOE_KUO[dimension - 1];
        let mut i = 0;
        while i < 32 {
            v[dimension][i] = if i < s {
                m[i] << (31 - i)
            } else {
                let mut value = v[dimension][i - s] ^ (v[dimension][i - s] >> s);
                let mut k = 1;
                while k < s {
                    if (a >> (s - 1 - k)) & 1 == 1 {
                        value ^= v[dimension][i - k];
                    }
                    k += 1;
                }
                value
            };
            i += 1;
        }
        dimension += 1;
    }
    v
}

/// Mixes 64 bits (the finaliser of SplitMix64 by Steele, Lea & Flood).
pub(crate) const fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// One randomisation of the sequence; seeds give independent ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sequence {
    seed: u64,
    seeds: [u64; DIMENSIONS],
}

impl Sequence {
    pub(crate) fn new(seed: u64) -> Self {
        let mut seeds = [0; DIMENSIONS];
        for (dimension, slot) in seeds.iter_mut().enumerate() {
            *slot = mix(mix(seed) ^ dimension as u64);
        }
        Self { seed, seeds }
    }

    /// Chance for what is not worth a dimension, another one for each index.
    pub(crate) fn chance(&self, index: u32) -> Chance {
        Chance(mix(self.seed ^ mix(u64::from(index) << 1 | 1)))
    }

    /// The point of an index below 2^32, each coordinate in the open unit interval.
    pub(crate) fn point<const N: usize>(&self, index: u32) -> [f64; N] {
        const { assert!(N <= DIMENSIONS) };
        let mut point = [0.0; N];
        for (dimension, coordinate) in point.iter_mut().enumerate() {
            let mut bits = 0;
            let mut rest = index;
            while rest != 0 {
                bits ^= DIRECTIONS[dimension][rest.trailing_zeros() as usize];
                rest &= rest - 1;
            }
            let bits = scramble(bits, self.seeds[dimension]);
            *coordinate = (f64::from(bits) + 0.5) / 4_294_967_296.0;
        }
        point
    }
}

/// Nested uniform scrambling: a bit is flipped by a coin that belongs to the bits above it.
fn scramble(bits: u32, seed: u64) -> u32 {
    let mut flips = 0;
    for bit in 0..32 {
        // A leading 1 tells prefixes of different length apart.
        let prefix = (1_u64 << bit) | u64::from(bits.checked_shr(32 - bit).unwrap_or(0));
        flips |= ((mix(seed ^ prefix) >> 63) as u32) << (31 - bit);
    }
    bits ^ flips
}

/// Independent random numbers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Chance(u64);

impl Chance {
    /// In [0, 1).
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = mix(self.0);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The defining property of a (0, m, 2)-net in base 2: every dyadic box of area 2^-m holds one of 2^m points.
    #[test]
    fn scrambled_points_are_a_net() {
        for seed in [1, 99] {
            let sequence = Sequence::new(seed);
            for m in [4_u32, 8] {
                for split in 0..=m {
                    let (nu, nv) = (1_u32 << split, 1_u32 << (m - split));
                    let mut hits = vec![0; 1 << m];
                    for index in 0..1 << m {
                        let [u, v] = sequence.point::<2>(index);
                        let cell = (v * f64::from(nv)) as u32 * nu + (u * f64::from(nu)) as u32;
                        hits[cell as usize] += 1;
                    }
                    assert!(hits.iter().all(|&h| h == 1), "seed {seed} m {m} split {split}");
                }
            }
        }
    }

    /// A smooth integral in all dimensions: the error must fall much faster than with random points.
    #[test]
    fn integrals_converge_faster_than_random() {
        let error = |n: u32, seed| {
            let sequence = Sequence::new(seed);
            let sum: f64 =
                (0..n).map(|i| sequence.point::<4>(i).iter().map(|x| 1.5 * x.sqrt()).product::<f64>()).sum();
            (sum / f64::from(n) - 1.0).powi(2)
        };
        let rms = |n| ((0..8).map(|seed| error(n, seed)).sum::<f64>() / 8.0).sqrt();
        // Random points: the integrand's standard deviation is about 0.77, so 0.77 / 128 = 0.006 at 2^14.
        assert!(rms(1 << 14) < 3e-4, "{}", rms(1 << 14));
    }

    #[test]
    fn seeds_give_different_points() {
        assert_ne!(Sequence::new(1).point::<4>(5), Sequence::new(2).point::<4>(5));
    }
}
