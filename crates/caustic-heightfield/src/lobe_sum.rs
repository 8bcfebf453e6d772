//! The exact lobe under any light, by whichever is estimated to cost less: low-rank terms or splatting.
//!
//! Several expansion centres are no third way. Where terms go through spectra each costs the same whatever it covers, and the terms of a
//! union of states are never more than those of its parts together; a tile of the pond that is convolved by itself needs room for the
//! kernel around it and, until it is smaller than half a wave, as many terms as the whole (`docs/src/methods/pond.md`).

use serde::Serialize;

use crate::convolve::Sample;
use crate::error::PondError;
use crate::floor::FloorLight;
use crate::height_field::HeightField;
use crate::low_rank::{LowRank, LowRankReport, LowRankSettings};
use crate::pond::Pond;
use crate::splat::Splat;

/// Nanoseconds on one core of x86-64, as measured: a value of the lobe, a coefficient of a sample, and a point of a transform per
/// doubling of its size.
const LOBE_NS: f64 = 25.0;
const COEFFICIENT_NS: f64 = 10.0;
const TRANSFORM_NS: f64 = 0.8;

/// How the lobe is summed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LobeWay {
    /// By low-rank terms.
    Terms,
    /// By splatting.
    Splat,
}

/// What was chosen, and from what.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LobeReport {
    /// How the lobe is summed.
    pub way: LobeWay,
    /// Estimated milliseconds of a floor on one core, without its surface.
    pub splat_ms: f64,
    /// The same by terms, if there are few enough.
    pub terms_ms: Option<f64>,
    /// Why there are no terms.
    pub no_terms: Option<String>,
    /// What the terms are worth, if there are any.
    #[serde(flatten)]
    pub terms: Option<LowRankReport>,
}

/// The cheaper of both for one pond and grid, and for waves like those it was shown. `T` is what terms are computed in.
pub struct LobeSum<T: Sample> {
    terms: Option<LowRank<T>>,
    splat: Splat,
    report: LobeReport,
}

impl<T: Sample> LobeSum<T> {
    /// For surfaces like `examples`, as [`LowRank::new`]; where terms do not reach the target the lobe is splatted.
    ///
    /// # Errors
    /// As [`LowRank::new`], but for [`PondError::Terms`] and [`PondError::UpwardBeams`].
    pub fn new(examples: &[HeightField], pond: &Pond, settings: LowRankSettings) -> Result<Self, PondError> {
        let splat = Splat::new(pond, settings.target_error)?;
        let (terms, no_terms) = match LowRank::<T>::new(examples, pond, settings) {
            Ok(terms) => (Some(terms), None),
            Err(why @ (PondError::Terms { .. } | PondError::UpwardBeams { .. })) => {
                (None, Some(why.to_string()))
            }
            Err(error) => return Err(error),
        };
        let mut evaluations = 0.0_f64;
        for surface in examples {
            evaluations = evaluations.max(splat.evaluations(surface)?);
        }
        let splat_ms = 1e-6 * LOBE_NS * evaluations;
        let terms_ms = terms.as_ref().map(|terms| terms_ms(terms.report(), examples[0].size));
        let way = match terms_ms {
            Some(terms_ms) if terms_ms <= splat_ms => LobeWay::Terms,
            _ => LobeWay::Splat,
        };
        let of_terms = terms.as_ref().map(|terms| terms.report().clone());
        let report = LobeReport { way, splat_ms, terms_ms, no_terms, terms: of_terms };
        let terms = terms.filter(|_| way == LobeWay::Terms);
        Ok(Self { terms, splat, report })
    }

    /// What was chosen, and from what.
    #[must_use]
    pub fn report(&self) -> &LobeReport {
        &self.report
    }

    /// The terms, unless the lobe is splatted.
    #[must_use]
    pub fn terms(&self) -> Option<&LowRank<T>> {
        self.terms.as_ref()
    }

    /// The terms themselves.
    ///
    /// # Errors
    /// The method, if its lobe is splatted.
    pub fn into_terms(self) -> Result<LowRank<T>, Box<Self>> {
        match self.terms {
            Some(terms) => Ok(terms),
            None => Err(Box::new(self)),
        }
    }

    /// The light on the floor below `surface`, and how many of its samples have a state that terms were not made for and were given the
    /// nearest; none where the lobe is splatted.
    ///
    /// # Errors
    /// As [`LowRank::floor`].
    pub fn floor(&self, surface: &HeightField) -> Result<(FloorLight, usize), PondError> {
        match &self.terms {
            Some(terms) => terms.floor(surface).map(|floor| (floor.light, floor.outside_states)),
            None => self.splat.floor(surface).map(|light| (light, 0)),
        }
    }
}

/// A transform of each term and one back, with room for the kernel, and coefficients of every sample.
fn terms_ms(report: &LowRankReport, size: [usize; 2]) -> f64 {
    let terms = report.terms as f64;
    let points: f64 = (0..2).map(|k| (size[k] + report.window[k] / 2) as f64).product();
    let transforms = (terms + 1.0) * TRANSFORM_NS * points * points.log2().max(1.0);
    let coefficients = terms * COEFFICIENT_NS * (size[0] * size[1]) as f64;
    1e-6 * (transforms + coefficients)
}
