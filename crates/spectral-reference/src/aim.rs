//! Where to send paths: more to where they bring light to the receiver, each worth less there, so that the sum stays.
//!
//! A few paths in advance, of a sequence of their own, tell where the light that counts comes from. The density is
//! constant in each cell of a grid over a bundle's square: in proportion to the root of the mean square of what a path
//! brings over what it costs, which is what makes the error for a given time least, plus an even part for what the
//! paths in advance have missed.

/// A density over the unit square.
#[derive(Clone, Debug)]
pub(crate) struct Aim {
    side: usize,
    /// Of rows up to and with each, the last is 1.
    rows: Vec<f64>,
    /// Likewise within each row.
    columns: Vec<f64>,
    /// Relative to an even one.
    densities: Vec<f64>,
}

/// What paths in advance found in a cell.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Find {
    /// Sum of the squares of the flux that paths brought.
    pub(crate) squares: f64,
    /// Rays traced.
    pub(crate) rays: u64,
}

impl Aim {
    /// From the finds of `side` x `side` cells, row-major; `None` if nothing was found. `even` is the share of paths
    /// that goes everywhere alike.
    pub(crate) fn new(side: usize, finds: &[Find], even: f64) -> Option<Self> {
        // What one cell found by luck its neighbours may hold too.
        let blurred = |cell: usize| {
            let (row, column) = (cell / side, cell % side);
            let mut sum = Find::default();
            for r in row.saturating_sub(1)..(row + 2).min(side) {
                for find in &finds[r * side + column.saturating_sub(1)..r * side + (column + 2).min(side)] {
                    sum.squares += find.squares;
                    sum.rays += find.rays;
                }
            }
            sum
        };
        let worth: Vec<f64> = (0..side * side)
            .map(blurred)
            .map(|find| if find.rays > 0 { (find.squares / find.rays as f64).sqrt() } else { 0.0 })
            .collect();
        let mean = worth.iter().sum::<f64>() / worth.len() as f64;
        // NaN included.
        if !(mean > 0.0 && mean.is_finite()) {
            return None;
        }
        let densities: Vec<f64> = worth.iter().map(|w| even + (1.0 - even) * w / mean).collect();
        let sums = densities.chunks(side).map(|row| row.iter().sum()).collect::<Vec<f64>>();
        let columns = densities.chunks(side).flat_map(cumulative).collect();
        Some(Self { side, rows: cumulative(&sums), columns, densities })
    }

    /// The place that a point of an even distribution is moved to, and the density there.
    pub(crate) fn place(&self, [s, t]: [f64; 2]) -> ([f64; 2], f64) {
        let (row, s) = invert(&self.rows, s);
        let first = row * self.side;
        let (column, t) = invert(&self.columns[first..first + self.side], t);
        let scale = 1.0 / self.side as f64;
        ([(row as f64 + s) * scale, (column as f64 + t) * scale], self.densities[first + column])
    }

    /// The cell of a point in a grid of so many rows and columns.
    pub(crate) fn cell(side: usize, [s, t]: [f64; 2]) -> usize {
        let index = |x: f64| ((x * side as f64) as usize).min(side - 1);
        index(s) * side + index(t)
    }
}

fn cumulative(values: &[f64]) -> Vec<f64> {
    let total: f64 = values.iter().sum();
    let mut sum = 0.0;
    values
        .iter()
        .map(|value| {
            sum += value / total;
            sum
        })
        .collect()
}

/// The interval of a cumulative distribution that holds `u`, and the place within, 0 to 1.
fn invert(cumulative: &[f64], u: f64) -> (usize, f64) {
    // The last value is 1 up to rounding.
    let at = cumulative.partition_point(|&c| c <= u).min(cumulative.len() - 1);
    let from = if at == 0 { 0.0 } else { cumulative[at - 1] };
    (at, ((u - from) / (cumulative[at] - from)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sobol::Sequence;

    fn uneven() -> Aim {
        let side = 4;
        let find = |cell: usize| Find { squares: (cell * cell) as f64, rays: 3 + cell as u64 };
        Aim::new(side, &(0..side * side).map(find).collect::<Vec<_>>(), 0.1).unwrap()
    }

    /// Weights of 1 over the density keep every integral, and cells get their share of the points.
    #[test]
    fn moved_points_keep_integrals() {
        let aim = uneven();
        let n = 1 << 14;
        let sequence = Sequence::new(3);
        let (mut area, mut moment) = (0.0, 0.0);
        let mut hits = [0.0; 16];
        for i in 0..n {
            let ([s, t], density) = aim.place(sequence.point(i));
            area += 1.0 / density / f64::from(n);
            moment += s * s * t / density / f64::from(n);
            hits[Aim::cell(4, [s, t])] += 16.0 / f64::from(n);
        }
        assert!((area - 1.0).abs() < 1e-3, "{area}");
        assert!((moment - 1.0 / 6.0).abs() < 1e-3, "{moment}");
        for (hits, density) in hits.iter().zip(&aim.densities) {
            assert!((hits - density).abs() < 0.02, "{hits} {density}");
        }
    }

    #[test]
    fn nothing_found_is_no_aim_and_no_cell_is_left_out() {
        assert!(Aim::new(2, &[Find::default(); 4], 0.1).is_none());
        let mut finds = [Find { squares: 0.0, rays: 1 }; 64];
        finds[0].squares = 1.0;
        let aim = Aim::new(8, &finds, 0.1).unwrap();
        assert!(aim.densities.iter().all(|&d| d >= 0.1));
        assert!(aim.densities[63] == 0.1 && aim.densities[9] > 1.0);
    }
}
