//! What differs between two pictures, as seen.

use serde::Serialize;
use spectral_core::color::{delta_e_94, lab_from_xyz};
use spectral_core::rgb::D65_WHITE_XYZ;

/// CIE94 over the pixels that show something.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Differences {
    /// Mean.
    pub mean: f64,
    /// 95th percentile.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

/// CIE94 of each pixel from the reference's, both XYZ times `exposure` under D65, without tone map.
#[must_use]
pub fn differences(reference: &[[f32; 3]], xyz: &[[f32; 3]], exposure: f64) -> Vec<f64> {
    let lab = |xyz: &[f32; 3]| lab_from_xyz(xyz.map(|v| f64::from(v) * exposure), D65_WHITE_XYZ);
    reference.iter().zip(xyz).map(|(r, p)| delta_e_94(lab(r), lab(p))).collect()
}

impl Differences {
    /// Of the pixels where the reference is not black.
    #[must_use]
    pub fn of(reference: &[[f32; 3]], differences: &[f64]) -> Self {
        let shown = reference.iter().zip(differences).filter(|(xyz, _)| xyz[1] > 0.0);
        let mut seen: Vec<f64> = shown.map(|(_, d)| *d).collect();
        seen.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let last = seen.len().saturating_sub(1);
            seen.get((share * last as f64).round() as usize).copied().unwrap_or(0.0)
        };
        Self { mean: seen.iter().sum::<f64>() / seen.len().max(1) as f64, p95: at(0.95), max: at(1.0) }
    }
}
