//! Host side of `shaders/shared/footprint_books.wgsl`: what becomes of the light of cells, added up.

use super::flux::flux_part;
use super::footprint::*;
use super::footprint_cells::*;
use super::footprint_light::*;
use super::ledger::*;

/// Flux and cells of each node and row of the ledger.
pub type Sums = [[(u64, u32); LEDGER_ROWS]; MOST_NODES];

impl CellLight<'_> {
    /// What becomes of a cell's light; parts are taken off in turn, so that all of it is booked.
    pub fn keep_books(&self, emitted: &Emitted, cell_flux: u32, sums: &mut Sums) {
        let light = self.params.materials;
        for (corner, node) in self.paths() {
            let [start, end] = self
                .share(&emitted.cell, node)
                .map(|bin| flux_part(cell_flux, self.band_weight(bin, light)[1]));
            let flux = (end - start + corner) / 4;
            let mut book = |row: usize, flux: u32| {
                let sum = &mut sums[node as usize][row];
                sum.0 += u64::from(flux);
                sum.1 += u32::from(flux != 0 && corner == 0);
            };
            let of_end = |end: u32| LEDGER_FIRST_END + end as usize;
            book(LEDGER_AIMED, flux);
            let left = &self.ends[self.path(emitted, corner, node)];
            if left.end != END_MISSED && left.end != END_BLOCKED {
                book(LEDGER_EMITTED, flux);
            }
            if left.end != END_LANDED {
                book(of_end(left.end), flux);
                continue;
            }
            let (mut running, mut booked) = (0, 0);
            let mut take = |part: u32| {
                running += part;
                let own = flux_part(flux, running) - booked;
                booked += own;
                own
            };
            book(LEDGER_REFLECTED, take(left.reflected));
            book(LEDGER_ABSORBED, take(left.absorbed));
            book(LEDGER_KEPT_INSIDE, take(left.kept_inside));
            for order in 0..self.params.orders {
                let landing = self.landing(emitted, corner, node, order);
                let own = take(landing.part);
                if landing.end == END_LANDED {
                    let share = self.share(&emitted.cell, node);
                    let lands = flux_part(own, self.comes_through(landing, share, light)[1]);
                    book(LEDGER_ABSORBED, own - lands);
                    book(of_end(END_LANDED), lands);
                } else {
                    book(of_end(landing.end), own);
                }
            }
        }
    }
}
