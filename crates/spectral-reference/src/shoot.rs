//! Sends paths from all lights at all refractors and mirrors, on all cores, with the same result whatever their number.
//!
//! Work is cut into blocks by index, a block into chunks by place; chunks run in parallel, then their deposits are added
//! up in order. So sums are formed in one order only.

use rayon::prelude::*;

use crate::aim::{Aim, Find};
use crate::lamp::{Bundle, Lamp};
use crate::ledger::Tally;
use crate::sobol::{Sequence, mix};
use crate::trace::{Emission, Landing, Limits, Sink, Tracer};
use crate::world::World;

/// Independent randomisations: enough for an estimate of the error over thousands of texels, few enough to leave
/// each a long low-discrepancy sequence.
pub(crate) const REPLICATES: usize = 4;

/// Paths per block: enough to keep neighbours close, few enough to keep their deposits.
const BLOCK: u32 = 1 << 16;
/// Paths per chunk.
const CHUNK: usize = 256;

/// Paths sent in advance per cell, and the most per bundle.
const SCOUTS_PER_CELL: u64 = 16;
const MAX_SCOUTS: u64 = 1 << 18;

/// A map of what lands.
pub(crate) trait Film: Sync {
    type Deposit: Send;

    /// What light of a lamp leaves where it lands, at the end of `deposits`; false if that is beside the map.
    fn expose(&self, lamp: usize, landing: &Landing, deposits: &mut Vec<Self::Deposit>) -> bool;
    /// Flux of a deposit, lumens.
    fn flux(deposit: &Self::Deposit) -> f64;
    fn add(&mut self, replicate: usize, deposits: Vec<Self::Deposit>);
}

/// What one chunk of a lamp's light leaves on a film.
struct Exposure<'a, F: Film> {
    film: &'a F,
    lamp: usize,
    deposits: Vec<F::Deposit>,
}

impl<'a, F: Film> Exposure<'a, F> {
    fn new(film: &'a F, lamp: usize) -> Self {
        Self { film, lamp, deposits: Vec::new() }
    }
}

impl<F: Film> Sink for Exposure<'_, F> {
    fn land(&mut self, landing: &Landing) -> bool {
        self.film.expose(self.lamp, landing, &mut self.deposits)
    }
}

/// Everything that stays the same from path to path.
pub(crate) struct Shooter<'a> {
    pub(crate) world: &'a World,
    pub(crate) lamps: &'a [Lamp],
    bundles: Vec<Bundle>,
    /// Paths of each bundle per unit of effort.
    per_unit: Vec<u32>,
    /// Where the paths of each bundle go; `None` is everywhere alike.
    aims: Vec<Option<Aim>>,
    limits: Limits,
    seed: u64,
}

struct Block {
    bundle: usize,
    replicate: usize,
    from: u32,
    to: u32,
}

impl<'a> Shooter<'a> {
    pub(crate) fn new(
        world: &'a World,
        lamps: &'a [Lamp],
        bundles: Vec<Bundle>,
        limits: Limits,
        seed: u64,
    ) -> Self {
        let total: f64 = bundles.iter().map(|b| b.flux).sum();
        let per_unit = match bundles.len() {
            1 => vec![1],
            // Whole numbers near the share of the flux, and no bundle without any.
            count => {
                let units = 8.0 * count as f64;
                bundles.iter().map(|b| (b.flux / total * units).round().max(1.0) as u32).collect()
            }
        };
        let aims = vec![None; bundles.len()];
        Self { world, lamps, bundles, per_unit, aims, limits, seed }
    }

    /// Finds out, with up to so many paths per bundle, where those come from that bring light to the film; `even` is
    /// the share of paths that goes everywhere alike nevertheless.
    pub(crate) fn aim<F: Film>(&mut self, film: &F, paths: u64, even: f64) {
        // Some paths per cell, and a power of four cells.
        let level = (paths.clamp(1, MAX_SCOUTS) / SCOUTS_PER_CELL).checked_ilog(4).unwrap_or(0);
        let side = 1_usize << level;
        let scouts = (side * side) as u32 * SCOUTS_PER_CELL as u32;
        self.aims = (0..self.bundles.len())
            .map(|bundle| {
                let sequence = Sequence::new(mix(mix(self.seed ^ 0x5c0_0715) ^ bundle as u64));
                let mut finds = vec![Find::default(); side * side];
                let indices: Vec<u32> = (0..scouts).collect();
                let found: Vec<Vec<(usize, f64, u64)>> = indices
                    .par_chunks(CHUNK)
                    .map(|chunk| {
                        chunk.iter().map(|&i| self.scout(bundle, &sequence, i, side, film)).collect()
                    })
                    .collect();
                for (cell, flux, rays) in found.into_iter().flatten() {
                    finds[cell].squares += flux * flux;
                    finds[cell].rays += rays;
                }
                Aim::new(side, &finds, even)
            })
            .collect();
    }

    /// The cell of a path, what it brings and how many rays it takes.
    fn scout<F: Film>(
        &self,
        bundle: usize,
        sequence: &Sequence,
        index: u32,
        side: usize,
        film: &F,
    ) -> (usize, f64, u64) {
        let lamp = self.bundles[bundle].lamp;
        let mut tracer = Tracer::new(self.world, self.limits, Exposure::new(film, lamp));
        self.send(&mut tracer, bundle, sequence, index);
        let [s, t, _] = sequence.point(index);
        let flux = tracer.sink.deposits.iter().map(F::flux).sum();
        (Aim::cell(side, [s, t]), flux, tracer.tally.counts.rays)
    }

    /// Empty books for the paths.
    pub(crate) fn tally(&self) -> Tally {
        Tally::new(self.limits.bounces)
    }

    pub(crate) fn is_idle(&self) -> bool {
        self.bundles.is_empty()
    }

    /// Wavelength paths that one unit of effort stands for, all replicates together.
    pub(crate) fn photons_per_unit(&self) -> u64 {
        let lanes = |b: &Bundle| self.lamps[b.lamp].spectrum.lane_count() as u64;
        let photons: u64 =
            self.bundles.iter().zip(&self.per_unit).map(|(b, &p)| lanes(b) * u64::from(p)).sum();
        photons * REPLICATES as u64
    }

    /// The most units: indices into the sequences are 32 bits.
    pub(crate) fn max_units(&self) -> u64 {
        u64::from(u32::MAX) / u64::from(self.per_unit.iter().copied().max().unwrap_or(1))
    }

    /// What sums must be multiplied with after so many units.
    pub(crate) fn scale(&self, units: u64) -> f64 {
        1.0 / (units.max(1) as f64 * REPLICATES as f64)
    }

    /// The same for the sums of one replicate, which has seen its own share of the paths only.
    pub(crate) fn replicate_scale(&self, units: u64) -> f64 {
        self.scale(units) * REPLICATES as f64
    }

    /// Adds the effort from one number of units up to another. `done` hears the share finished.
    pub(crate) fn shoot<F: Film>(
        &self,
        film: &mut F,
        tally: &mut Tally,
        (from, to): (u64, u64),
        done: &mut dyn FnMut(f64),
    ) {
        let blocks = self.blocks(from, to);
        for (number, block) in blocks.iter().enumerate() {
            let sequence = self.sequence(block);
            let mut order: Vec<(u32, u32)> = (block.from..block.to)
                .into_par_iter()
                .map(|index| (morton(sequence.point(index)), index))
                .collect();
            order.par_sort_unstable();
            let results: Vec<(Vec<F::Deposit>, Tally)> = {
                let film = &*film;
                order.par_chunks(CHUNK).map(|chunk| self.run(block, &sequence, chunk, film)).collect()
            };
            for (deposits, part) in results {
                film.add(block.replicate, deposits);
                tally.merge(&part);
            }
            done((number + 1) as f64 / blocks.len() as f64);
        }
    }

    fn blocks(&self, from: u64, to: u64) -> Vec<Block> {
        let mut blocks = Vec::new();
        for replicate in 0..REPLICATES {
            for (bundle, &per_unit) in self.per_unit.iter().enumerate() {
                // Both fit by `max_units`.
                let (first, last) = ((from * u64::from(per_unit)) as u32, (to * u64::from(per_unit)) as u32);
                let starts = (first..last).step_by(BLOCK as usize);
                blocks.extend(starts.map(|from| Block {
                    bundle,
                    replicate,
                    from,
                    to: last.min(from.saturating_add(BLOCK)),
                }));
            }
        }
        blocks
    }

    fn sequence(&self, block: &Block) -> Sequence {
        Sequence::new(mix(mix(self.seed ^ ((block.bundle as u64) << 8)) ^ block.replicate as u64))
    }

    fn run<F: Film>(
        &self,
        block: &Block,
        sequence: &Sequence,
        chunk: &[(u32, u32)],
        film: &F,
    ) -> (Vec<F::Deposit>, Tally) {
        let lamp = self.bundles[block.bundle].lamp;
        let mut tracer = Tracer::new(self.world, self.limits, Exposure::new(film, lamp));
        for &(_, index) in chunk {
            self.send(&mut tracer, block.bundle, sequence, index);
        }
        (tracer.sink.deposits, tracer.tally)
    }

    fn send<S: Sink>(&self, tracer: &mut Tracer<S>, at: usize, sequence: &Sequence, index: u32) {
        let bundle = &self.bundles[at];
        let lamp = &self.lamps[bundle.lamp];
        let [s, t, w] = sequence.point(index);
        let (place, density) = self.aims[at].as_ref().map_or(([s, t], 1.0), |aim| aim.place([s, t]));
        let (origin, direction, flux) = bundle.path(lamp, place);
        if flux <= 0.0 {
            return;
        }
        tracer.trace(&Emission {
            origin,
            direction,
            flux: flux / (density * f64::from(self.per_unit[at])),
            nesting: bundle.nesting,
            target: Some(bundle.target),
            range_m: bundle.range_m,
            lanes: lamp.spectrum.lanes(w),
            chance: sequence.chance(index),
        });
    }
}

/// A place on the Z curve through the unit square: paths that start together share the caches.
fn morton([s, t]: [f64; 2]) -> u32 {
    let spread = |x: f64| {
        let x = (x * 65536.0) as u32;
        (0..16).fold(0, |bits, k| bits | (x >> k & 1) << (2 * k))
    };
    spread(s) << 1 | spread(t)
}
