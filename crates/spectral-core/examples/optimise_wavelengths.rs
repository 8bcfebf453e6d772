//! Finds the wavelengths and weights of the scheme `optimal` for one observer and writes `data/optimal_<observer>.csv`.
//!
//! Minimises the mean CIEDE2000 of the dispersed line (see `spectral_core::quality`) over spreads of 1, 4 and 16 px,
//! with nodes within 420 to 680 nm and free XYZ weights, for every count up to `MAX_TABULATED`. For CIE 1931 each count starts
//! from the best of one fewer with a node inserted in a gap, from the other schemes, and from nodes spread out like a prism
//! does; other observers start from its table, with the weights translated. Each start is improved by a (1+1)
//! evolution strategy that learns the covariance of successful steps (Igel, Suttorp & Hansen 2006, "A computational efficient
//! covariance matrix update and a (1+1)-CMA for evolution strategies").
//!
//! `cargo run -p spectral-core --example optimise_wavelengths -- cie1931`, then `cie1964` and `wyman2013`: ten minutes
//! on one core for the first, two for each of the others. The random numbers are fixed, so a machine with the same
//! `exp`, `ln` and `cos` writes the same file.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use spectral_core::observer::{Observer, TABLE_NM};
use spectral_core::quality::DispersedLine;
use spectral_core::wavelengths::{DEFAULT_RANGE_NM, Scheme, WavelengthSet};

const MAX_TABULATED: usize = 24;
const SPREADS_PX: [f64; 3] = [1.0, 4.0, 16.0];
const EVALUATIONS_PER_START: usize = 100_000;
/// A run ends when this many evaluations improved it by less than 1e-4.
const PATIENCE: usize = 5_000;

/// Wavelengths in nm and their XYZ weights.
type Nodes = Vec<(f64, [f64; 3])>;

struct Problem {
    observer: Observer,
    lines: Vec<DispersedLine>,
}

impl Problem {
    fn new(observer: Observer) -> Result<Self, Box<dyn Error>> {
        let lines =
            SPREADS_PX.iter().map(|&px| DispersedLine::new(observer, px)).collect::<Result<_, _>>()?;
        Ok(Self { observer, lines })
    }

    /// Mean CIEDE2000 over the spreads.
    fn error(&self, nodes: &Nodes) -> f64 {
        let (nm, weights): (Vec<f64>, Vec<[f64; 3]>) = nodes.iter().copied().unzip();
        self.lines.iter().map(|line| line.delta_e(&nm, &weights)).sum::<f64>() / self.lines.len() as f64
    }

    /// The error at a point of the search space, plus a penalty for leaving the range.
    fn objective(&self, point: &[f64]) -> f64 {
        let outside_nm: f64 =
            point.chunks(4).map(|p| (p[0] * NODE_SCALE_NM - clamp(p[0] * NODE_SCALE_NM)).abs()).sum();
        self.error(&nodes_from_point(point)) + 0.1 * outside_nm
    }

    fn weighted_by_neighbourhood(&self, nodes_nm: &[f64]) -> Nodes {
        weighted_by_neighbourhood(self.observer, nodes_nm)
    }

    /// Nodes at equal steps of an integral of visibility^exponent times d offset / d lambda, which goes like lambda^-3.
    fn spread_out(&self, n: usize, exponent: f64) -> Nodes {
        let (lo, hi) = DEFAULT_RANGE_NM;
        let steps = 2600;
        let nm = |i: usize| lo + (hi - lo) * (i as f64 + 0.5) / steps as f64;
        let density =
            |i: usize| self.observer.xyz_bar(nm(i)).iter().sum::<f64>().powf(exponent) * nm(i).powi(-3);
        let total: f64 = (0..steps).map(density).sum();
        let (mut reached, mut nodes_nm) = (0.0, Vec::new());
        for i in 0..steps {
            reached += density(i) / total * n as f64;
            if reached > nodes_nm.len() as f64 + 0.5 {
                nodes_nm.push(nm(i));
            }
        }
        self.weighted_by_neighbourhood(&nodes_nm)
    }

    /// The best of each family of starts.
    fn starts(&self, n: usize, one_fewer: Option<&Nodes>) -> Vec<Nodes> {
        if self.observer != Observer::Cie1931 {
            return self.translated(n).into_iter().collect();
        }
        let mut families = Vec::new();
        if let Some(fewer) = one_fewer {
            let mut edges_nm: Vec<f64> = fewer.iter().map(|node| node.0).collect();
            edges_nm.insert(0, DEFAULT_RANGE_NM.0);
            edges_nm.push(DEFAULT_RANGE_NM.1);
            let inserted = |gap: usize| {
                let mut nm: Vec<f64> = fewer.iter().map(|node| node.0).collect();
                nm.insert(gap, 0.5 * (edges_nm[gap] + edges_nm[gap + 1]));
                self.weighted_by_neighbourhood(&nm)
            };
            families.push((0..n).map(inserted).collect());
        }
        let schemes = [Scheme::Gauss, Scheme::Uniform, Scheme::EqualEnergy];
        let set = |scheme| WavelengthSet::new(scheme, n, DEFAULT_RANGE_NM, self.observer).ok();
        let others = schemes.into_iter().filter_map(set).flat_map(|set| {
            let own = set.wavelengths_nm.iter().copied().zip(set.relative_weights_xyz()).collect();
            [self.weighted_by_neighbourhood(&set.wavelengths_nm), own]
        });
        families.push(others.collect());
        families.push([0.15, 0.25, 0.35].map(|exponent| self.spread_out(n, exponent)).to_vec());
        let normalised = |nodes: &Nodes| nodes_from_point(&point_from_nodes(nodes));
        families
            .iter()
            .filter_map(|family: &Vec<Nodes>| {
                family.iter().map(normalised).min_by(|a, b| self.error(a).total_cmp(&self.error(b)))
            })
            .collect()
    }

    /// The set of the CIE 1931 table, its weights changed like the integrals around each node.
    fn translated(&self, n: usize) -> Option<Nodes> {
        let set = WavelengthSet::new(Scheme::Optimal, n, DEFAULT_RANGE_NM, Observer::Cie1931).ok()?;
        let ours = self.weighted_by_neighbourhood(&set.wavelengths_nm);
        let theirs = weighted_by_neighbourhood(Observer::Cie1931, &set.wavelengths_nm);
        let mut nodes: Nodes = set.wavelengths_nm.iter().copied().zip(set.relative_weights_xyz()).collect();
        for (i, (_, weight)) in nodes.iter_mut().enumerate() {
            for ((weight, ours), theirs) in weight.iter_mut().zip(ours[i].1).zip(theirs[i].1) {
                *weight *= if theirs > 0.0 { ours / theirs } else { 1.0 };
            }
        }
        Some(nodes)
    }

    /// The best that the evolution strategy makes of a start.
    fn evolve(&self, start: &Nodes, random: &mut Random) -> Nodes {
        let mut point = point_from_nodes(start);
        let n = point.len();
        let dimensions = n as f64;
        // Steps are sigma * factor * normal deviates; row-major.
        let weight_step = 0.6 / dimensions.sqrt();
        let mut factor = vec![0.0; n * n];
        for i in 0..n {
            factor[i * n + i] = if i % 4 == 0 { 1.0 } else { weight_step };
        }
        let mut sigma = 0.3;
        let target_success = 2.0 / 11.0;
        let mut success = target_success;
        let learning = 2.0 / (dimensions * dimensions + 6.0);
        let damping = 1.0 + dimensions / 2.0;

        let mut error = self.objective(&point);
        let mut error_before = error;
        for evaluation in 1..=EVALUATIONS_PER_START {
            let z: Vec<f64> = (0..n).map(|_| random.normal()).collect();
            let step: Vec<f64> =
                factor.chunks(n).map(|row| row.iter().zip(&z).map(|(a, z)| a * z).sum()).collect();
            let trial: Vec<f64> = point.iter().zip(&step).map(|(x, s)| x + sigma * s).collect();
            let trial_error = self.objective(&trial);
            let better = trial_error <= error;
            success = success * 11.0 / 12.0 + if better { 1.0 / 12.0 } else { 0.0 };
            sigma *= ((success - target_success / (1.0 - target_success) * (1.0 - success)) / damping).exp();
            if better {
                (point, error) = (trial, trial_error);
                if success < 0.44 {
                    let z2: f64 = z.iter().map(|z| z * z).sum();
                    let shrink = (1.0 - learning).sqrt();
                    let grow = shrink / z2 * ((1.0 + learning * z2 / (1.0 - learning)).sqrt() - 1.0);
                    for (row, s) in factor.chunks_mut(n).zip(&step) {
                        for (a, z) in row.iter_mut().zip(&z) {
                            *a = *a * shrink + grow * s * z;
                        }
                    }
                }
            }
            if evaluation % PATIENCE == 0 {
                if error_before - error < 1e-4 {
                    break;
                }
                error_before = error;
            }
        }
        let mut nodes = nodes_from_point(&point);
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        nodes
    }
}

/// Wavelengths are searched in steps of this size.
const NODE_SCALE_NM: f64 = 10.0;

fn clamp(nm: f64) -> f64 {
    nm.clamp(DEFAULT_RANGE_NM.0, DEFAULT_RANGE_NM.1)
}

/// Nodes weighted with the integrals over the wavelengths nearest to each.
fn weighted_by_neighbourhood(observer: Observer, nodes_nm: &[f64]) -> Nodes {
    let edge = |i: usize| match i {
        0 => TABLE_NM.0,
        i if i == nodes_nm.len() => TABLE_NM.1,
        i => 0.5 * (nodes_nm[i - 1] + nodes_nm[i]),
    };
    let weight = |i: usize| observer.xyz_bar_integral(edge(i), edge(i + 1));
    nodes_nm.iter().enumerate().map(|(i, &nm)| (nm, weight(i))).collect()
}

/// A point is, per node, its wavelength and the roots of its weights: squares are never negative.
fn nodes_from_point(point: &[f64]) -> Nodes {
    let mut nodes: Nodes = point
        .chunks(4)
        .map(|p| (clamp(p[0] * NODE_SCALE_NM), [p[1] * p[1], p[2] * p[2], p[3] * p[3]]))
        .collect();
    for c in 0..3 {
        let sum: f64 = nodes.iter().map(|node| node.1[c]).sum();
        for node in &mut nodes {
            node.1[c] /= sum;
        }
    }
    nodes
}

fn point_from_nodes(nodes: &Nodes) -> Vec<f64> {
    let sum = |c: usize| nodes.iter().map(|node| node.1[c]).sum::<f64>();
    let sums = [sum(0), sum(1), sum(2)];
    nodes
        .iter()
        .flat_map(|(nm, w)| {
            [nm / NODE_SCALE_NM, (w[0] / sums[0]).sqrt(), (w[1] / sums[1]).sqrt(), (w[2] / sums[2]).sqrt()]
        })
        .collect()
}

/// xorshift64 (Marsaglia 2003) and the Box-Muller transform.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let observer: Observer =
        std::env::args().nth(1).ok_or("which observer? cie1931, cie1964 or wyman2013")?.parse()?;
    let problem = Problem::new(observer)?;
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mut csv = String::from("n,wavelength_nm,weight_x,weight_y,weight_z\n");
    let mut one_fewer = None;
    for n in 1..=MAX_TABULATED {
        let began = Instant::now();
        let starts = problem.starts(n, one_fewer.as_ref());
        let runs: Vec<Nodes> = starts.iter().map(|s| problem.evolve(s, &mut random)).collect();
        let best = runs
            .into_iter()
            .min_by(|a, b| problem.error(a).total_cmp(&problem.error(b)))
            .ok_or("no start for this count")?;
        eprintln!("{observer} {n}: {:.4} in {:.1?}", problem.error(&best), began.elapsed());
        for (nm, w) in &best {
            csv += &format!("{n},{nm:.3},{:.7},{:.7},{:.7}\n", w[0], w[1], w[2]);
        }
        one_fewer = Some(best);
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(format!("optimal_{observer}.csv"));
    Ok(std::fs::write(path, csv)?)
}
