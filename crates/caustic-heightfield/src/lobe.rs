//! How light spreads from a point of the surface to the floor.
//!
//! ```text
//! D      height of the surface above the floor, metres
//! P      from the surface to the floor: (offset, -D)
//! cos    L_t . P / |P|
//! ```

use std::f64::consts::PI;

use crate::pond::{Form, Pond};

/// Share of its peak below which the lobe counts as 0. A floor sums at most 1e9 of them.
const NEGLIGIBLE: f64 = 1e-18;
/// Share of light that may fall outside of the tiles that a periodic pond is summed over.
const TAIL: f64 = 1e-12;
/// Most tiles on each side of a periodic pond.
const MAX_TILES: i64 = 6;
/// Steps of the integral over the lobe.
const SHARE_STEPS: u32 = 20_000;

/// The irradiance on the floor per flux of a beam.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe {
    form: Form,
    exponent: f64,
    /// `exponent` where it is a whole number: its power is products, which are faster.
    whole: Option<i32>,
    extinction_per_m: f64,
    /// Smallest cos^2 whose lobe is not negligible.
    cos2_min: f64,
}

impl Lobe {
    pub(crate) fn new(pond: &Pond) -> Self {
        let exponent = pond.scattering;
        let whole = (exponent.fract() == 0.0 && exponent <= 1e6).then_some(exponent as i32);
        let cos2_min = match pond.form {
            Form::Physical if exponent > 0.0 => (NEGLIGIBLE.ln() / exponent).exp(),
            Form::Paper if exponent > 0.0 => (1.0 + NEGLIGIBLE.ln() / exponent).max(0.0),
            _ => 0.0,
        };
        Self { form: pond.form, exponent, whole, extinction_per_m: pond.extinction_per_m, cos2_min }
    }

    /// Where along x (0) or y (1) a beam's lobe is not 0 on the floor, metres from the point below the beam; everywhere if its edge
    /// reaches the horizon.
    pub(crate) fn extent_m(&self, direction: [f64; 3], above_m: f64, k: usize) -> [f64; 2] {
        let cone = cone_extent_m(direction, above_m, 1.0 - self.cos2_min, k);
        // Wider by what rounding may do.
        let slack_m = 1e-9 * above_m;
        cone.map_or([f64::NEG_INFINITY, f64::INFINITY], |[low, high]| [low - slack_m, high + slack_m])
    }

    /// Irradiance at `offset_m` from the point below the beam, per flux, for D = `above_m` > 0.
    ///
    /// Physical: p |P_z / P| |P|^-2 exp(-epsilon |P|) with p = max(0, cos)^(2a) (2a + 1) / (2 pi). Paper: |P_z / P|
    /// exp(-a (1 - cos^2)) exp(-epsilon |P|), which is even in its cosine.
    #[inline]
    pub(crate) fn at(&self, direction: [f64; 3], above_m: f64, offset_m: [f64; 2]) -> f64 {
        let [x, y] = offset_m;
        let r2 = x * x + y * y + above_m * above_m;
        let along = direction[0] * x + direction[1] * y - direction[2] * above_m;
        let cos2 = along * along / r2;
        if cos2 < self.cos2_min || (along <= 0.0 && self.form == Form::Physical) {
            return 0.0;
        }
        let r = r2.sqrt();
        match self.form {
            Form::Physical => {
                let power = match self.whole {
                    Some(whole) => cos2.powi(whole),
                    None => cos2.powf(self.exponent),
                };
                let scale = (2.0 * self.exponent + 1.0) / (2.0 * PI);
                scale * power * (-self.extinction_per_m * r).exp() * above_m / (r2 * r)
            }
            Form::Paper => (self.exponent * (cos2 - 1.0) - self.extinction_per_m * r).exp() * above_m / r,
        }
    }

    /// Tiles on each side over which a periodic pond is summed, and what is left out at most: the share of the beam's light, or
    /// in the paper's form, which is no share of anything, the largest value of the lobe.
    ///
    /// `tilt` is the largest angle between a beam and straight down, radians.
    pub(crate) fn periodic_tiles(&self, extent_m: [f64; 2], above_m: f64, tilt: f64) -> (i64, f64) {
        let shortest = extent_m[0].min(extent_m[1]);
        let tail = |tiles: i64| {
            let radius = (tiles as f64 + 0.5) * shortest;
            let off = ((radius / above_m).atan() - tilt).clamp(0.0, PI / 2.0);
            let lobe = match self.form {
                Form::Physical => {
                    let solid_angle = above_m / radius.hypot(above_m);
                    (2.0 * self.exponent + 1.0) * off.cos().powf(2.0 * self.exponent) * solid_angle
                }
                Form::Paper => (-self.exponent * off.sin().powi(2)).exp(),
            };
            (lobe * (-self.extinction_per_m * radius).exp()).min(1.0)
        };
        let tiles = (0..MAX_TILES).find(|&tiles| tail(tiles) <= TAIL).unwrap_or(MAX_TILES);
        (tiles, tail(tiles))
    }
}

/// From where to where along x (0) or y (1) a cone about a beam lies on the floor, metres from the point below the beam: it meets
/// the floor in an ellipse. `None` if it does not, as its edge reaches the horizon. `sin2` is of the angle between them.
pub(crate) fn cone_extent_m([x, y, z]: [f64; 3], above_m: f64, sin2: f64, k: usize) -> Option<[f64; 2]> {
    let excess = z * z - sin2;
    if z >= 0.0 || excess <= 1e-6 {
        return None;
    }
    let along = [x, y][k];
    let middle = above_m * along * -z / excess;
    // Half axes: across the tilt D sin / sqrt(excess), along it D sin cos / excess, with the angle of the cone.
    let across = above_m * above_m * sin2 / excess;
    let stretch = (1.0 - sin2) / excess - 1.0;
    let tilt2 = (x * x + y * y).max(f64::MIN_POSITIVE);
    let half = (across * (1.0 + stretch * along * along / tilt2)).sqrt();
    Some([middle - half, middle + half])
}

/// Share of the light of a physical lobe that travels downwards, for a beam with this cosine to straight down.
///
/// The lobe covers the half of all directions around its beam, so a tilted one reaches above the horizon.
#[must_use]
pub fn downward_share(cos_down: f64, scattering: f64) -> f64 {
    let cot_tilt = cos_down / (1.0 - cos_down * cos_down).max(f64::MIN_POSITIVE).sqrt();
    // u = cos^(2a + 1) of the angle to the beam is uniform for light of the lobe.
    let ring = |u: f64| {
        let cos = u.powf(1.0 / (2.0 * scattering + 1.0));
        let cot = cos / (1.0 - cos * cos).max(f64::MIN_POSITIVE).sqrt();
        (-(cot_tilt * cot)).clamp(-1.0, 1.0).acos() / PI
    };
    let steps = f64::from(SHARE_STEPS);
    (0..SHARE_STEPS).map(|i| ring((f64::from(i) + 0.5) / steps)).sum::<f64>() / steps
}
