//! Snell's law and Fresnel's equations in f64, written for cancellation.
//!
//! The oracle has its own so that an error in the passes' optics cannot hide in it too.
//!
//! ```text
//! d        unit direction of travel
//! n        unit normal on the incident side, d.n < 0
//! cos_i    -d.n, cosine of the incidence angle, 0 to 1
//! eta      n_incident / n_transmitted (the inverse of what is common in shaders)
//! ```

use glam::DVec3;

/// What an interface does to light of one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interface {
    /// Unpolarised reflectance, 0 to 1; 1 is total reflection.
    pub(crate) reflectance: f64,
    /// Cosine of the refraction angle; 0 on total reflection.
    pub(crate) cos_t: f64,
}

/// Fresnel's equations for unpolarised light (Born & Wolf, Principles of Optics, section 1.5.2).
///
/// With k = cos_t^2 the numerators of r_s and r_p are multiplied by their conjugates, which leaves 1 - eta^2 as an
/// explicit factor: n1 = n2 gives exactly 0, and an index barely above 1 loses no digits.
pub(crate) fn interface(cos_i: f64, eta: f64) -> Interface {
    let one_minus_eta2 = (1.0 - eta) * (1.0 + eta);
    let eta2 = eta * eta;
    let cos2_i = cos_i * cos_i;
    // 1 - eta^2 sin_i^2 without forming the sine.
    let k = one_minus_eta2 + eta2 * cos2_i;
    if k <= 0.0 {
        return Interface { reflectance: 1.0, cos_t: 0.0 };
    }
    let cos_t = k.sqrt();
    let s = eta * cos_i + cos_t;
    let p = cos_i + eta * cos_t;
    let r_s = one_minus_eta2 / (s * s);
    let r_p = one_minus_eta2 * (cos2_i * (1.0 + eta2) - eta2) / (p * p);
    let reflectance = 0.5 * (r_s * r_s + r_p * r_p);
    // p vanishes with cos_i and cos_t, where both amplitudes have modulus 1.
    let reflectance = if reflectance <= 1.0 { reflectance } else { 1.0 };
    Interface { reflectance, cos_t }
}

/// The refracted direction, unit length; `cos_t` as [`interface`] gives it, above 0.
pub(crate) fn refract(d: DVec3, n: DVec3, cos_i: f64, eta: f64, cos_t: f64) -> DVec3 {
    // eta cos_i - cos_t, again with 1 - eta^2 as a factor.
    let along_normal = (eta - 1.0) * (eta + 1.0) / (eta * cos_i + cos_t);
    (d * eta + n * along_normal).normalize()
}

/// The mirrored direction, unit length.
pub(crate) fn reflect(d: DVec3, n: DVec3, cos_i: f64) -> DVec3 {
    (d + n * (2.0 * cos_i)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn incident(angle: f64) -> (DVec3, DVec3) {
        (DVec3::new(angle.sin(), -angle.cos(), 0.0), DVec3::Y)
    }

    #[test]
    fn normal_incidence_reflects_by_the_square_of_the_index_step() {
        for n in [1.000_001, 1.33, 1.5, 2.4, 4.0] {
            let expected = ((n - 1.0) / (n + 1.0_f64)).powi(2);
            for eta in [n, 1.0 / n] {
                let r = interface(1.0, eta).reflectance;
                assert!((r / expected - 1.0).abs() < 1e-9, "{n}: {r} {expected}");
            }
        }
    }

    #[test]
    fn equal_indices_change_nothing() {
        for angle in [0.0, 0.3, 1.2, 1.57] {
            let (d, n) = incident(angle);
            let cos_i = -d.dot(n);
            let at = interface(cos_i, 1.0);
            assert_eq!(at.reflectance, 0.0);
            assert!((refract(d, n, cos_i, 1.0, at.cos_t) - d).length() < 1e-15);
        }
    }

    #[test]
    fn brewster_angle_halves_to_the_s_part() {
        let n = 1.5_f64;
        let brewster = n.atan();
        let at = interface(brewster.cos(), 1.0 / n);
        let r_s = ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((at.reflectance - 0.5 * r_s).abs() < 1e-15);
    }

    #[test]
    fn snell_holds_in_both_directions() {
        for degrees in (1..90).map(f64::from) {
            let (d, n) = incident(degrees.to_radians());
            let cos_i = -d.dot(n);
            let at = interface(cos_i, 1.0 / 1.7);
            let t = refract(d, n, cos_i, 1.0 / 1.7, at.cos_t);
            assert!((t.x * 1.7 - d.x).abs() < 1e-15, "{degrees}");
            let back = interface(-t.dot(n), 1.7);
            let again = refract(t, n, -t.dot(n), 1.7, back.cos_t);
            assert!((again - d).length() < 1e-13, "{degrees}");
            assert!((back.reflectance - at.reflectance).abs() < 1e-13, "{degrees}");
        }
    }

    /// The passes' optics are another derivation; both must say the same.
    #[test]
    fn the_passes_optics_agree() {
        use spectral_core::optics::{Refraction, refract as core_refract};
        for eta in [1.0 / 2.4, 1.0 / 1.5, 1.0 / 1.000_001, 1.000_001, 1.5, 2.4] {
            // Inverting the ratio rounds it, and only its distance from 1 counts.
            let bound = 1e-12_f64.max(f64::EPSILON / f64::abs(eta - 1.0));
            for degrees in (0..900).map(|i| 0.1 * f64::from(i)) {
                let (d, n) = incident(degrees.to_radians());
                let cos_i = -d.dot(n);
                let at = interface(cos_i, eta);
                // Theirs is the inverse ratio of indices.
                match core_refract(d.to_array(), n.to_array(), 1.0 / eta) {
                    Refraction::Transmitted(direction, fresnel) => {
                        let ours = refract(d, n, cos_i, eta, at.cos_t);
                        let theirs = DVec3::from_array(direction);
                        assert!((ours - theirs).length() < bound, "{eta} {degrees}: {ours} {theirs}");
                        let difference = at.reflectance - fresnel.unpolarised;
                        assert!(difference.abs() < bound, "{eta} {degrees}: {difference}");
                    }
                    Refraction::TotalReflection => assert_eq!(at.reflectance, 1.0, "{eta} {degrees}"),
                }
            }
        }
    }

    /// Closed form of the transmitted cosine just inside the critical angle: k = (1 - eta^2) + eta^2 cos^2.
    #[test]
    fn the_critical_angle_is_sharp() {
        let n = 1.5_f64;
        let critical = (1.0 / n).asin();
        for delta in [1e-6, 1e-9, 1e-12] {
            assert_eq!(interface((critical + delta).cos(), n).reflectance, 1.0);
            let at = interface((critical - delta).cos(), n);
            // cos_t^2 = 1 - n^2 sin^2(critical - delta), to first order 2 delta sqrt(n^2 - 1).
            let expected = (2.0 * delta * (n * n - 1.0).sqrt()).sqrt();
            assert!((at.cos_t / expected - 1.0).abs() < 1e-3_f64.max(1e-16 / delta * 10.0), "{delta} {at:?}");
            assert!(at.reflectance < 1.0);
        }
    }

    #[test]
    fn grazing_light_is_reflected_whole() {
        for eta in [1.0 / 1.5, 1.5, 1.0 / 1.000_01] {
            let at = interface((FRAC_PI_2 - 1e-12).cos(), eta);
            assert!(at.reflectance > 1.0 - 1e-8 && at.reflectance <= 1.0, "{eta} {at:?}");
            assert!(interface(0.0, eta).reflectance.is_finite());
        }
    }
}
