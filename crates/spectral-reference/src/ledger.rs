//! Where the emitted light went, per wavelength, and how many paths met which end.

use serde::{Deserialize, Serialize};
use spectral_core::observer::VISIBLE_NM;

/// Width of a ledger bin, nm.
const BIN_NM: f64 = 10.0;
pub(crate) const BINS: usize = 40;

/// Ends of a path. The order is that of [`LedgerBin`]'s fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub(crate) enum End {
    Passed,
    Landed,
    LandedElsewhere,
    Absorbed,
    Reflected,
    Escaped,
    Truncated,
    WrongSide,
    TooNested,
}

const ENDS: usize = End::TooNested as usize + 1;

/// Fluxes of one range of wavelengths. The unit is lumen times the light's relative spectral power, which sums to 1
/// over the bins: a light of 1 lux sends 1 over a square metre, whatever its colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LedgerBin {
    /// From this wavelength, nm.
    pub from_nm: f64,
    /// To this wavelength, nm.
    pub to_nm: f64,
    /// Sent towards the bounds of the refractors and mirrors.
    pub emitted: f64,
    /// Passed by the refractor or mirror that it was sent to, or was blocked before it. What lands of it is direct light, which
    /// is computed from the receiver's side.
    pub passed: f64,
    /// Landed in the receiver's map after it met glass or a mirror.
    pub landed: f64,
    /// Landed on other matt objects, on the receiver's back or beside its map, after it met glass or a mirror.
    pub landed_elsewhere: f64,
    /// Absorbed by glass or a mirror.
    pub absorbed: f64,
    /// Left the scene after nothing but outside reflections.
    pub reflected: f64,
    /// Left the scene after it had been inside glass.
    pub escaped: f64,
    /// Lost: further reflections than followed, or weaker than the cutoff.
    pub truncated: f64,
    /// Lost: the smooth normal sent it through the wrong side of its facet.
    pub wrong_side: f64,
    /// Lost: entered more overlapping refractors than are kept track of.
    pub too_nested: f64,
}

impl LedgerBin {
    /// All that was lost.
    pub fn lost(&self) -> f64 {
        self.truncated + self.wrong_side + self.too_nested
    }

    /// The sum of all ends; equals `emitted` up to rounding.
    pub fn accounted(&self) -> f64 {
        self.passed
            + self.landed
            + self.landed_elsewhere
            + self.absorbed
            + self.reflected
            + self.escaped
            + self.lost()
    }
}

/// Events by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PathCounts {
    /// Rays traced through the scene, shadow rays not included.
    pub rays: u64,
    /// Rays that met nothing.
    pub misses: u64,
    /// Total internal reflections.
    pub total_reflections: u64,
    /// Branches given up because reflections, depth or strength reached their limit.
    pub truncated: u64,
    /// Branches that left the wrong side of their facet.
    pub wrong_side: u64,
    /// Branches that entered too many overlapping refractors.
    pub too_nested: u64,
}

/// Every flux accounted for: see [`LedgerBin`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// 380 to 780 nm in steps of 10 nm.
    pub bins: Vec<LedgerBin>,
    /// How often things happened.
    pub counts: PathCounts,
    /// Share of the refracted light's flux on the receiver (Y) by number of internal reflections in the last
    /// refractor passed, from 0 on; sums to 1, or is empty if there is none.
    pub reflections_share: Vec<f64>,
}

impl Ledger {
    /// Largest relative difference between what was emitted and what is accounted for, over the bins.
    pub fn imbalance(&self) -> f64 {
        let off = |bin: &LedgerBin| match bin.emitted {
            0.0 => bin.accounted().abs(),
            emitted => (bin.accounted() / emitted - 1.0).abs(),
        };
        self.bins.iter().map(off).fold(0.0, f64::max)
    }

    /// All bins together.
    pub fn total(&self) -> LedgerBin {
        let mut total = LedgerBin { from_nm: VISIBLE_NM.0, to_nm: VISIBLE_NM.1, ..LedgerBin::default() };
        for bin in &self.bins {
            total.emitted += bin.emitted;
            total.passed += bin.passed;
            total.landed += bin.landed;
            total.landed_elsewhere += bin.landed_elsewhere;
            total.absorbed += bin.absorbed;
            total.reflected += bin.reflected;
            total.escaped += bin.escaped;
            total.truncated += bin.truncated;
            total.wrong_side += bin.wrong_side;
            total.too_nested += bin.too_nested;
        }
        total
    }
}

/// Sums under way.
#[derive(Clone, Debug)]
pub(crate) struct Tally {
    emitted: [f64; BINS],
    ends: [[f64; BINS]; ENDS],
    pub(crate) counts: PathCounts,
    /// Landed Y of refracted light by number of internal reflections.
    pub(crate) by_reflections: Vec<f64>,
}

impl Tally {
    pub(crate) fn new(bounces: u32) -> Self {
        Self {
            emitted: [0.0; BINS],
            ends: [[0.0; BINS]; ENDS],
            counts: PathCounts::default(),
            by_reflections: vec![0.0; bounces as usize + 1],
        }
    }

    pub(crate) fn emit(&mut self, lambda_nm: f64, flux: f64) {
        self.emitted[bin(lambda_nm)] += flux;
    }

    pub(crate) fn end(&mut self, end: End, lambda_nm: f64, flux: f64) {
        self.ends[end as usize][bin(lambda_nm)] += flux;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        add(&mut self.emitted, &other.emitted);
        self.ends.iter_mut().zip(&other.ends).for_each(|(a, b)| add(a, b));
        add(&mut self.by_reflections, &other.by_reflections);
        let (a, b) = (&mut self.counts, &other.counts);
        a.rays += b.rays;
        a.misses += b.misses;
        a.total_reflections += b.total_reflections;
        a.truncated += b.truncated;
        a.wrong_side += b.wrong_side;
        a.too_nested += b.too_nested;
    }

    /// The finished ledger, all fluxes times `scale`.
    pub(crate) fn ledger(&self, scale: f64) -> Ledger {
        let bins = (0..BINS)
            .map(|i| {
                let of = |end: End| self.ends[end as usize][i] * scale;
                let from_nm = VISIBLE_NM.0 + BIN_NM * i as f64;
                LedgerBin {
                    from_nm,
                    to_nm: from_nm + BIN_NM,
                    emitted: self.emitted[i] * scale,
                    passed: of(End::Passed),
                    landed: of(End::Landed),
                    landed_elsewhere: of(End::LandedElsewhere),
                    absorbed: of(End::Absorbed),
                    reflected: of(End::Reflected),
                    escaped: of(End::Escaped),
                    truncated: of(End::Truncated),
                    wrong_side: of(End::WrongSide),
                    too_nested: of(End::TooNested),
                }
            })
            .collect();
        let refracted: f64 = self.by_reflections.iter().sum();
        let reflections_share = match refracted > 0.0 {
            true => self.by_reflections.iter().map(|y| y / refracted).collect(),
            false => Vec::new(),
        };
        Ledger { bins, counts: self.counts, reflections_share }
    }
}

fn bin(lambda_nm: f64) -> usize {
    (((lambda_nm - VISIBLE_NM.0) / BIN_NM) as usize).min(BINS - 1)
}
