//! Gamma and T as functions of cos(theta_i), looked up as the paper's hardware does (section 4.1), between entries linearly.
//!
//! L_t = L_i / eta + Gamma N with Gamma = cos(theta_i) / eta - cos(theta_t), Eq. 1.

use spectral_core::optics::{Real, fresnel_dielectric};

/// Entries of a table for one index of refraction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RefractionTable<'a, T> {
    /// (Gamma, T) at equally spaced cosines from 0 to 1, two or more.
    pub(crate) entries: &'a [[T; 2]],
}

/// `count` entries, two or more, for n_t / n_i = `eta`.
pub(crate) fn refraction_entries(count: usize, eta: f64) -> Vec<[f64; 2]> {
    let entry = |i: usize| {
        let cos_i = i as f64 / (count - 1) as f64;
        let fresnel = fresnel_dielectric(cos_i, eta);
        [cos_i / eta - fresnel.cos_t, fresnel.transmitted]
    };
    (0..count).map(entry).collect()
}

impl<T: Real> RefractionTable<'_, T> {
    /// L_t and T; `None` where no light passes.
    pub(crate) fn refract(&self, light: [T; 3], normal: [T; 3], cos_i: T, eta: T) -> Option<([T; 3], T)> {
        let cells = self.entries.len() - 1;
        let at = cos_i.min(T::one()) * T::from(cells)?;
        let low = at.to_usize()?.min(cells - 1);
        let share = at - T::from(low)?;
        let [gamma, transmitted] =
            [0, 1].map(|k| self.entries[low][k] + share * (self.entries[low + 1][k] - self.entries[low][k]));
        if transmitted <= T::zero() {
            return None;
        }
        let bent = [0, 1, 2].map(|k| light[k] / eta + gamma * normal[k]);
        // Between entries the rule gives a direction that is a little too short.
        let length = (bent[0] * bent[0] + bent[1] * bent[1] + bent[2] * bent[2]).sqrt();
        Some((bent.map(|x| x / length), transmitted))
    }
}
