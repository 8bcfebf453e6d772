//! What is asserted about two results of one layer, and how.
//!
//! Parity of two executors is asserted tightly: they run the same plan, so only rounding may differ. Against
//! the oracle a method's own error shows; it is asserted only where physics leaves the method no freedom.

use crate::metrics::{Map, Metrics, compare};
use serde::Serialize;

/// Largest distances that are accepted; what is `None` is not asserted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bound {
    /// Mean CIEDE2000.
    pub delta_e_mean: Option<f64>,
    /// Relative RMS of Y at 64 x 64.
    pub rms_64: Option<f64>,
    /// Distance of the ratio of total Y from 1.
    pub total_y: Option<f64>,
}

/// Two executors: they do the same arithmetic on the same plan, so only f32 roundings differ, and with them the texel
/// of a photon that lands next to a border. `docs/src/comparing.md` has what was measured.
pub const PARITY: Bound = Bound { delta_e_mean: Some(0.25), rms_64: Some(5e-3), total_y: Some(1e-3) };

/// A method against the oracle, unblocked light: no freedom but where a silhouette's shadow ends, to a texel of
/// the method's map.
pub const DIRECT: Bound = Bound { delta_e_mean: Some(1.0), rms_64: Some(0.05), total_y: Some(0.01) };

/// A method against the oracle where light crosses a surface once, or one convex body without total reflection:
/// image space loses nothing but what is reflected inside, below a hundredth.
pub const CONVEX: Bound = Bound { delta_e_mean: None, rms_64: None, total_y: Some(0.02) };

/// What a comparison says.
pub struct Judgement {
    /// The distances, if there was something to compare.
    pub metrics: Option<Metrics>,
    /// What is wrong; empty if nothing is.
    pub problems: Vec<String>,
}

/// What any result must look like to be worth comparing.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// XYZ at Y = 1 of unblocked perpendicular light.
    pub white_xyz: [f64; 3],
    /// What the lamps can put on a texel on average, lux.
    pub max_mean_y: f64,
    /// Equal light everywhere would be wrong; only an unshadowed receiver has that.
    pub varies: bool,
}

/// Compare `a` with `b` after asking whether there is something to compare.
pub fn judge(a: &Map<'_>, b: &Map<'_>, expected: Expected, bound: Option<Bound>) -> Judgement {
    let mut problems = Vec::new();
    for (name, map) in [("a", a), ("b", b)] {
        let light = map.check_light(expected.max_mean_y);
        let light = if expected.varies { light.and_then(|()| map.check_varies()) } else { light };
        if let Err(error) = light {
            problems.push(format!("nothing to compare, {name}: {error}"));
        }
    }
    if !problems.is_empty() {
        return Judgement { metrics: None, problems };
    }
    match compare(a, b, expected.white_xyz) {
        Ok(metrics) => {
            problems.extend(bound.map(|bound| bound.violations(&metrics)).unwrap_or_default());
            Judgement { metrics: Some(metrics), problems }
        }
        Err(error) => Judgement { metrics: None, problems: vec![format!("nothing to compare: {error}")] },
    }
}

impl Bound {
    /// Which distances are larger, with the numbers.
    fn violations(&self, metrics: &Metrics) -> Vec<String> {
        let total_y = (metrics.total_y - 1.0).abs();
        [
            ("mean CIEDE2000", metrics.delta_e_mean, self.delta_e_mean),
            ("relative RMS of Y at 64 x 64", Some(metrics.rms_64), self.rms_64),
            ("|ratio of total Y - 1|", Some(total_y), self.total_y),
        ]
        .into_iter()
        .filter_map(|(name, value, limit)| {
            let (value, limit) = (value?, limit?);
            // NaN is a violation too.
            (value.is_nan() || value > limit)
                .then(|| format!("{name} is {value:.3e}, at most {limit:.1e} is accepted"))
        })
        .collect()
    }
}
