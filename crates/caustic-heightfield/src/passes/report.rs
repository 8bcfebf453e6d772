//! Words of a frame's report; mirrors `shaders/shared/pond_report.wgsl`.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::surface_light::SurfaceReport;

pub(crate) const PAST_45_DEGREES: usize = 0;
pub(crate) const SELF_SHADOWED: usize = 1;
pub(crate) const TURNED_AWAY: usize = 2;
pub(crate) const TOTALLY_REFLECTED: usize = 3;
pub(crate) const GROUNDED: usize = 4;
pub(crate) const STEEPEST: usize = 5;
pub(crate) const OUTSIDE_STATES: usize = 6;
pub(crate) const UPWARDS: usize = 7;
pub(crate) const INCIDENT: usize = 8;
pub(crate) const TRANSMITTED: usize = 10;
pub(crate) const REPORT_WORDS: usize = 12;

/// The most units of flux of one sample; mirrors `MOST_UNITS` in `shaders/pond_surface.wgsl`.
const MOST_UNITS: f32 = 33_554_432.0;
/// Units that light of the whole illumination on a level sample would have. A sample of the largest count is 32 times as bright.
const UNITS_PER_SAMPLE: f64 = 1_048_576.0;

/// Units per flux, where level samples under the strongest illumination have `flux` each.
pub(crate) fn units_per_flux(flux: f64) -> f64 {
    // Kept inside f32, in which the darkest and the brightest lights count as 0 and as the most.
    if flux > 0.0 { (UNITS_PER_SAMPLE / flux).min(1e30) } else { 1.0 }
}

/// The counts of one row, which a mirror keeps to itself until the row is done.
#[derive(Default)]
pub(crate) struct Tally {
    counts: [u32; REPORT_WORDS],
    steepest: f32,
    units: [u64; REPORT_WORDS],
}

impl Tally {
    pub(crate) fn add(&mut self, word: usize) {
        self.counts[word] += 1;
    }

    pub(crate) fn steepness(&mut self, slope: f32) {
        self.steepest = self.steepest.max(slope);
    }

    pub(crate) fn add_flux(&mut self, word: usize, flux: f32, units_per_flux: f32) {
        self.units[word] += ((flux * units_per_flux).min(MOST_UNITS) + 0.5) as u64;
    }

    /// Add them to the report.
    pub(crate) fn flush(self, report: &[AtomicU32]) {
        const COUNTS: [usize; 7] = [
            PAST_45_DEGREES,
            SELF_SHADOWED,
            TURNED_AWAY,
            TOTALLY_REFLECTED,
            GROUNDED,
            OUTSIDE_STATES,
            UPWARDS,
        ];
        for word in COUNTS {
            report[word].fetch_add(self.counts[word], Ordering::Relaxed);
        }
        report[STEEPEST].fetch_max(self.steepest.to_bits(), Ordering::Relaxed);
        for word in [INCIDENT, TRANSMITTED] {
            let [low, high] = [self.units[word] as u32, (self.units[word] >> 32) as u32];
            let before = report[word].fetch_add(low, Ordering::Relaxed);
            let carry = u32::from(before.checked_add(low).is_none());
            report[word + 1].fetch_add(high + carry, Ordering::Relaxed);
        }
    }
}

/// What the words say.
pub(crate) fn decoded(words: &[u32], samples: usize, units_per_flux: f64) -> SurfaceReport {
    let flux = |word: usize| {
        (f64::from(words[word + 1]) * 4_294_967_296.0 + f64::from(words[word])) / units_per_flux
    };
    SurfaceReport {
        samples,
        past_45_degrees: words[PAST_45_DEGREES] as usize,
        steepest_slope: f64::from(f32::from_bits(words[STEEPEST])),
        self_shadowed: words[SELF_SHADOWED] as usize,
        turned_away: words[TURNED_AWAY] as usize,
        totally_reflected: words[TOTALLY_REFLECTED] as usize,
        incident_flux: flux(INCIDENT),
        transmitted_flux: flux(TRANSMITTED),
    }
}
