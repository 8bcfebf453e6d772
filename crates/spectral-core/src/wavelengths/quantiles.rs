//! Wavelengths at the quantiles of a measure.

use alloc::vec;
use alloc::vec::Vec;

use crate::observer::Observer;

/// Nodes of the scheme `equal-energy` on a range, ascending, and their quadrature in nm.
///
/// The range is cut into `n` parts with equal integrals of x + y + z; each part's median stands for it.
pub(super) fn equal_energy(n: usize, range_nm: (f64, f64), observer: Observer) -> (Vec<f64>, Vec<f64>) {
    let integral = |a_nm: f64, b_nm: f64| observer.xyz_bar_integral(a_nm, b_nm).iter().sum::<f64>();
    let (nodes_nm, total) = quantiles(n, range_nm, integral);
    let density = |nm: f64| observer.xyz_bar(nm).iter().sum::<f64>();
    let quadrature = nodes_nm.iter().map(|&nm| total / n as f64 / density(nm)).collect();
    (nodes_nm, quadrature)
}

/// Nodes spread out evenly where a prism would image them, but closer where the spectrum is bright: quantiles of
/// (x + y + z)^exponent times the slope of the Cauchy IOR offset, which goes like lambda^-3.
pub(super) fn spread_out(n: usize, range_nm: (f64, f64), observer: Observer, exponent: f64) -> Vec<f64> {
    let integral = |a_nm: f64, b_nm: f64| {
        let nm = 0.5 * (a_nm + b_nm);
        let visibility: f64 = observer.xyz_bar(nm).iter().sum();
        libm::pow(visibility, exponent) / (nm * nm * nm) * (b_nm - a_nm)
    };
    quantiles(n, range_nm, integral).0
}

/// The medians of `n` parts of equal measure, and the measure of all. `integral` is that of the measure over at most
/// a nanometre, and positive.
fn quantiles(n: usize, (lo_nm, hi_nm): (f64, f64), integral: impl Fn(f64, f64) -> f64) -> (Vec<f64>, f64) {
    // The measure up to every whole nanometre, so that each quantile is searched within one.
    let mut edges_nm = vec![lo_nm];
    let whole_nm = (0..).map(|i| libm::floor(lo_nm) + f64::from(i));
    edges_nm.extend(whole_nm.skip_while(|&nm| nm <= lo_nm).take_while(|&nm| nm < hi_nm));
    edges_nm.push(hi_nm);
    let mut total = 0.0;
    let mut cumulative = vec![total];
    for edges in edges_nm.windows(2) {
        total += integral(edges[0], edges[1]);
        cumulative.push(total);
    }

    let mut nodes_nm = Vec::with_capacity(n);
    for i in 0..n {
        let target = total * (i as f64 + 0.5) / n as f64;
        let piece = cumulative.partition_point(|&c| c <= target).clamp(1, edges_nm.len() - 1) - 1;
        let (mut a_nm, mut b_nm) = (edges_nm[piece], edges_nm[piece + 1]);
        // A nanometre halved 50 times is below the spacing of f64 there.
        for _ in 0..50 {
            let middle_nm = 0.5 * (a_nm + b_nm);
            if cumulative[piece] + integral(edges_nm[piece], middle_nm) < target {
                a_nm = middle_nm;
            } else {
                b_nm = middle_nm;
            }
        }
        nodes_nm.push(0.5 * (a_nm + b_nm));
    }
    (nodes_nm, total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_is_the_median_of_its_part() {
        for observer in Observer::ALL {
            for n in [1, 2, 7, 100] {
                let (nodes, quadrature) = equal_energy(n, (402.5, 700.0), observer);
                let up_to = |nm| observer.xyz_bar_integral(402.5, nm).iter().sum::<f64>();
                let total = up_to(700.0);
                for (i, &nm) in nodes.iter().enumerate() {
                    let quantile = (i as f64 + 0.5) / n as f64;
                    assert!((up_to(nm) / total - quantile).abs() < 1e-12, "{observer} {n} {i}");
                }
                let equal = nodes
                    .iter()
                    .zip(&quadrature)
                    .map(|(&nm, q)| q * observer.xyz_bar(nm).iter().sum::<f64>());
                for share in equal {
                    assert!((share * n as f64 / total - 1.0).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn without_visibility_nodes_are_evenly_spread_by_the_prism() {
        let nodes = spread_out(9, (400.0, 700.0), Observer::Cie1931, 0.0);
        let offset = |nm: f64| 1.0 / (nm * nm);
        let part = (offset(400.0) - offset(700.0)) / 9.0;
        for (i, &nm) in nodes.iter().enumerate() {
            let expected = offset(400.0) - part * (i as f64 + 0.5);
            assert!((offset(nm) - expected).abs() < 1e-4 * part, "{i} {nm}");
        }
    }
}
