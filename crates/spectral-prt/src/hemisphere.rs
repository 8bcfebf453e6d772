//! Directions about a normal, denser where the cosine is larger.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// The golden ratio's fractional part: consecutive multiples of it are spread most evenly over the unit interval.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Reciprocal powers of the real root of x^3 = x + 1, the same for two dimensions (Roberts 2018, "The unreasonable
/// effectiveness of quasirandom sequences").
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// A fixed number of directions with density cos(theta) / pi: a Fibonacci lattice on the unit square, shifted by
/// another offset for each stream, so that neighbouring vertices do not share an error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Directions {
    count: u32,
    shift: [f64; 2],
}

impl Directions {
    pub(crate) fn new(count: u32, stream: u64) -> Self {
        // Below 2^32 vertices the product keeps 20 bits behind the point.
        let shift = PLASTIC.map(|step| (stream as f64 * step).fract());
        Self { count, shift }
    }

    /// About the unit vector `normal`.
    pub(crate) fn about(self, normal: DVec3) -> impl Iterator<Item = DVec3> {
        let (x, y) = normal.any_orthonormal_pair();
        (0..self.count).map(move |i| {
            let u = ((f64::from(i) + 0.5) / f64::from(self.count) + self.shift[0]).fract();
            let v = (f64::from(i) * GOLDEN + self.shift[1]).fract();
            let (sin_phi, cos_phi) = (TAU * v).sin_cos();
            let radius = u.sqrt();
            (x * (radius * cos_phi) + y * (radius * sin_phi) + normal * (1.0 - u).sqrt()).normalize()
        })
    }

    /// What each direction's value is multiplied with so that their sum is the integral with max(n . omega, 0).
    pub(crate) fn weight(self) -> f64 {
        PI / f64::from(self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bands::Bands;
    use crate::{cosine_lobe, sh};

    /// The sum over the directions approaches the clamped cosine's own coefficients faster than 1/sqrt(n).
    #[test]
    fn directions_integrate_the_cosine_lobe() {
        let bands = Bands::default();
        let normal = DVec3::new(0.48, -0.6, 0.64);
        let mut exact = vec![0.0; bands.coefficients()];
        cosine_lobe::evaluate(bands, normal, &mut exact);
        for stream in [0, 17, 123_456] {
            let worst = |count| {
                let directions = Directions::new(count, stream);
                let mut sums = vec![0.0; bands.coefficients()];
                for direction in directions.about(normal) {
                    assert!(direction.dot(normal) >= 0.0);
                    for (sum, y) in sums.iter_mut().zip(sh::harmonics(bands, direction)) {
                        *sum += y * directions.weight();
                    }
                }
                sums.iter().zip(&exact).map(|(s, e)| (s - e).abs()).fold(0.0, f64::max)
            };
            let (few, many) = (worst(256), worst(16_384));
            // Chance would fall by 8.
            assert!(few < 0.02 && many < few / 20.0, "{stream} {few} {many}");
        }
    }
}
