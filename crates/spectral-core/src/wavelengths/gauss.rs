//! Gauss-Legendre quadrature for any number of nodes.

use core::f64::consts::PI;

use alloc::vec;
use alloc::vec::Vec;

/// `n >= 1` nodes in ascending order and weights on a range; the weights sum to its length.
///
/// Newton's method on the Legendre polynomial from Tricomi's approximation of its roots (Davis & Rabinowitz,
/// "Methods of Numerical Integration", section 2.7); quadratic in `n`.
pub(super) fn gauss_legendre(n: usize, (lo, hi): (f64, f64)) -> (Vec<f64>, Vec<f64>) {
    let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    let (mut nodes, mut weights) = (vec![middle; n], vec![0.0; n]);
    for i in 0..n.div_ceil(2) {
        let mut x = if 2 * i + 1 == n { 0.0 } else { libm::cos(PI * (i as f64 + 0.75) / (n as f64 + 0.5)) };
        let mut slope = 1.0;
        // Convergence is quadratic from four digits on; a root that rounding keeps from settling is as good as it gets.
        for _ in 0..8 {
            let (value, derivative) = legendre(n, x);
            slope = derivative;
            let step = value / derivative;
            x -= step;
            if step.abs() < 1e-15 {
                break;
            }
        }
        let weight = half * 2.0 / ((1.0 - x * x) * slope * slope);
        (nodes[i], weights[i]) = (middle - half * x, weight);
        (nodes[n - 1 - i], weights[n - 1 - i]) = (middle + half * x, weight);
    }
    (nodes, weights)
}

/// Legendre polynomial of degree `n` at |x| < 1, and its derivative.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut current) = (1.0, x);
    for k in 2..=n {
        let k = k as f64;
        (previous, current) = (current, ((2.0 * k - 1.0) * x * current - (k - 1.0) * previous) / k);
    }
    (current, n as f64 * (previous - x * current) / (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrates_polynomials_up_to_degree_2n_minus_1_exactly() {
        for n in 1..=12_usize {
            let (nodes, weights) = gauss_legendre(n, (-1.0, 1.0));
            for degree in 0..=2 * n {
                let sum: f64 =
                    nodes.iter().zip(&weights).map(|(&x, w)| w * libm::pow(x, degree as f64)).sum();
                let exact = if degree % 2 == 0 { 2.0 / (degree as f64 + 1.0) } else { 0.0 };
                let error = (sum - exact).abs();
                if degree < 2 * n {
                    assert!(error < 1e-14, "n = {n}, degree {degree}: {error}");
                } else {
                    // Degree 2n must fail, or these are not n nodes.
                    assert!(error > 1e-8, "n = {n}, degree {degree}: {error}");
                }
            }
        }
    }

    #[test]
    fn nodes_ascend_and_weights_sum_to_the_range_for_any_count() {
        for n in [1, 2, 3, 64, 255, 1024, 4096] {
            let (nodes, weights) = gauss_legendre(n, (420.0, 680.0));
            assert!(nodes.windows(2).all(|w| w[0] < w[1]), "{n}");
            assert!(nodes[0] > 420.0 && nodes[n - 1] < 680.0, "{n}");
            assert!(weights.iter().all(|&w| w > 0.0), "{n}");
            assert!(
                (weights.iter().sum::<f64>() - 260.0).abs() < 1e-9,
                "{n}: {}",
                weights.iter().sum::<f64>()
            );
        }
    }

    #[test]
    fn five_nodes_are_the_published_ones() {
        // Abramowitz & Stegun, table 25.4.
        let (nodes, weights) = gauss_legendre(5, (-1.0, 1.0));
        for (node, expected) in nodes.iter().zip([-0.906179845938664, -0.538469310105683, 0.0]) {
            assert!((node - expected).abs() < 2e-15, "{node}");
        }
        for (weight, expected) in
            weights.iter().zip([0.236926885056189, 0.478628670499366, 0.568888888888889])
        {
            assert!((weight - expected).abs() < 2e-15, "{weight}");
        }
    }
}
