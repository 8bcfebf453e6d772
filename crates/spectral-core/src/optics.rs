//! Reflection and refraction at a smooth interface between two dielectrics, for f32 and f64.
//!
//! ```text
//! direction  unit direction of travel of the incident light
//! normal     unit normal of the interface, on either side
//! cos_i      cosine of the angle of incidence, 0 (grazing) to 1 (normal)
//! cos_t      cosine of the angle of refraction, likewise
//! eta        n_transmitted / n_incident at this wavelength
//! w          eta cos_t, which is sqrt(cos_i^2 + eta^2 - 1)
//! ```
//!
//! The textbook forms subtract nearly equal numbers near the critical angle, for eta near 1 and, for the amplitude of
//! reflection, almost everywhere. Here the differences are multiplied out with cos_i^2 - w^2 = 1 - eta^2, whose factor
//! eta - 1 is exact, and w^2 is summed without rounding. So all results have a few units of rounding error for the
//! given `cos_i` and `eta`, except that the p amplitude has an absolute one near its zero, Brewster's angle.

use num_traits::Float;

/// f32 or f64.
pub trait Real: Float + sealed::Real {}

impl Real for f32 {}
impl Real for f64 {}

mod sealed {
    /// What products need to be split without rounding.
    pub trait Real {
        /// 2^ceil(p / 2) + 1 for p bits of mantissa (Dekker 1971).
        const SPLITTER: Self;
    }

    impl Real for f32 {
        const SPLITTER: Self = 4097.0;
    }

    impl Real for f64 {
        const SPLITTER: Self = 134_217_729.0;
    }
}

/// What becomes of unpolarised or linearly polarised light at an interface, as shares of the incident power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fresnel<T> {
    /// Reflectance for the electric field perpendicular to the plane of incidence.
    pub rs: T,
    /// Reflectance for the electric field in the plane of incidence.
    pub rp: T,
    /// Reflectance of unpolarised light, the mean of `rs` and `rp`.
    pub unpolarised: T,
    /// Transmittance of unpolarised light. It is 1 - `unpolarised`, but keeps its digits where that is nearly 0.
    pub transmitted: T,
    /// Cosine of the angle of refraction; 0 in total reflection.
    pub cos_t: T,
}

/// Where light goes that is not reflected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refraction<T> {
    /// The refracted unit direction, and the shares of power.
    Transmitted([T; 3], Fresnel<T>),
    /// Nowhere: all light is reflected.
    TotalReflection,
}

/// Fresnel's equations for two dielectrics.
///
/// `cos_i` is clamped to 0..1, NaN to 0. `eta` must be finite and above 0. With `eta` = 1 nothing is reflected, at
/// grazing incidence too. At and beyond the critical angle everything is.
pub fn fresnel_dielectric<T: Real>(cos_i: T, eta: T) -> Fresnel<T> {
    let (zero, one) = (T::zero(), T::one());
    let cos_i = cos_i.max(zero).min(one);
    if eta == one {
        return Fresnel { rs: zero, rp: zero, unpolarised: zero, transmitted: one, cos_t: cos_i };
    }
    let w2 = squared_w(cos_i, eta);
    // An invalid eta must not leave here as NaN.
    if w2.is_nan() || w2 <= zero {
        return Fresnel { rs: one, rp: one, unpolarised: one, transmitted: zero, cos_t: zero };
    }
    let two = one + one;
    let w = w2.sqrt();
    let eta2 = eta * eta;
    let contrast = (eta - one) * (eta + one);
    let (sum_s, sum_p) = (cos_i + w, eta2 * cos_i + w);
    // (eta^2 + 1) cos_i^2 - 1, which vanishes at Brewster's angle, as a difference of terms that are not larger than
    // the smaller of 1 and eta^2 there.
    let brewster = if eta > one {
        (eta2 + one) * cos_i * cos_i - one
    } else {
        w2 - eta2 * ((one - cos_i) * (one + cos_i))
    };
    // (cos_i - w) / sum_s and (eta^2 cos_i - w) / sum_p, multiplied out.
    let amplitude_s = contrast / (sum_s * sum_s);
    let amplitude_p = contrast * brewster / (sum_p * sum_p);
    let rs = (amplitude_s * amplitude_s).min(one);
    let rp = (amplitude_p * amplitude_p).min(one);
    let half_ts = two * (cos_i / sum_s) * (w / sum_s);
    let half_tp = two * (eta2 * cos_i / sum_p) * (w / sum_p);
    Fresnel {
        rs,
        rp,
        unpolarised: (rs + rp) / two,
        transmitted: (half_ts + half_tp).min(one),
        cos_t: (w / eta).min(one),
    }
}

/// Snell's law: the refracted direction of light travelling along `direction`.
///
/// The normal may point to either side. `eta` = 1 returns `direction` itself, bit for bit. The result has unit length
/// as far as the arguments have.
pub fn refract<T: Real>(direction: [T; 3], normal: [T; 3], eta: T) -> Refraction<T> {
    let along = dot(direction, normal);
    let cos_i = along.abs();
    let fresnel = fresnel_dielectric(cos_i, eta);
    if eta == T::one() {
        return Refraction::Transmitted(direction, fresnel);
    }
    if fresnel.cos_t == T::zero() {
        return Refraction::TotalReflection;
    }
    // w - cos_i, the length by which the direction times eta is bent along the normal.
    let bend = (eta - T::one()) * (eta + T::one()) / (cos_i.min(T::one()) + eta * fresnel.cos_t);
    let bend = if along < T::zero() { -bend } else { bend };
    let refracted = [0, 1, 2].map(|i| (direction[i] + normal[i] * bend) / eta);
    Refraction::Transmitted(refracted, fresnel)
}

/// The direction of light reflected at the interface; the normal may point to either side.
pub fn reflect<T: Real>(direction: [T; 3], normal: [T; 3]) -> [T; 3] {
    let twice = dot(direction, normal) * (T::one() + T::one());
    [0, 1, 2].map(|i| direction[i] - normal[i] * twice)
}

fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// cos_i^2 + eta^2 - 1, rounded once or twice at its own magnitude. Not positive in total reflection.
fn squared_w<T: Real>(cos_i: T, eta: T) -> T {
    let (eta2, eta2_error) = exact_square(eta);
    let (cos2, cos2_error) = exact_square(cos_i);
    let (excess, excess_error) = exact_sum(eta2, -T::one());
    let (high, high_error) = exact_sum(excess, cos2);
    // Near the critical angle the high parts cancel down to the size of the errors, so these are summed as carefully.
    let (low, low_error) = exact_sum(eta2_error, cos2_error);
    let (sum, sum_error) = exact_sum(high, low);
    sum + (sum_error + (high_error + (excess_error + low_error)))
}

/// a^2 as its rounded value and the rounding error (Dekker 1971; no fused multiply-add, which is slow where the
/// processor has none).
fn exact_square<T: Real>(a: T) -> (T, T) {
    let shifted = T::SPLITTER * a;
    let high = shifted - (shifted - a);
    let low = a - high;
    let square = a * a;
    (square, ((high * high - square) + (high * low + high * low)) + low * low)
}

/// a + b as its rounded value and the rounding error (Knuth's two-sum).
fn exact_sum<T: Real>(a: T, b: T) -> (T, T) {
    let sum = a + b;
    let b_part = sum - a;
    (sum, (a - (sum - b_part)) + (b - b_part))
}

#[cfg(test)]
mod tests;
