//! Powers of a clamped cosine about an axis, in Legendre polynomials.

/// The integrals of x^s P_l(x) over x from 0 to 1, for each degree l below `degrees`; the exponent s is 0 or more.
///
/// By integrating Legendre's equation against x^s twice by parts, I_l = I_(l-2) (s - l + 2) / (s + l + 1), from I_0 = 1 / (s + 1) and
/// I_1 = 1 / (s + 2).
pub(crate) fn legendre_integrals(exponent: f64, degrees: usize) -> Vec<f64> {
    let mut integrals = vec![1.0 / (exponent + 1.0), 1.0 / (exponent + 2.0)];
    for l in 2..degrees {
        let degree = l as f64;
        integrals.push(integrals[l - 2] * (exponent - degree + 2.0) / (exponent + degree + 1.0));
    }
    integrals.truncate(degrees);
    integrals
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against Simpson's rule, with Legendre polynomials by Bonnet's recursion.
    #[test]
    fn integrals_are_those_of_a_sum() {
        const STEPS: usize = 20_000;
        for exponent in [0.0, 1.0, 2.5, 20.0] {
            let mut sums = [0.0; 10];
            for i in 0..=STEPS {
                let x = i as f64 / STEPS as f64;
                let weight = if i == 0 || i == STEPS { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
                let (mut before, mut p) = (0.0, 1.0);
                for (l, sum) in sums.iter_mut().enumerate() {
                    *sum += weight * x.powf(exponent) * p / (3 * STEPS) as f64;
                    let l = l as f64;
                    (before, p) = (p, ((2.0 * l + 1.0) * x * p - l * before) / (l + 1.0));
                }
            }
            for (l, (sum, integral)) in sums.iter().zip(legendre_integrals(exponent, 10)).enumerate() {
                assert!((sum - integral).abs() < 1e-6, "{exponent} {l}: {sum} {integral}");
            }
        }
    }
}
