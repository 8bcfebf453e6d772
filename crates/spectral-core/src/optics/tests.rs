extern crate std;

use super::*;
use dashu_float::{FBig, round::mode::HalfEven};
use proptest::prelude::*;
use std::fmt::Debug;

/// 300 bits: even squared differences of neighbouring f64 keep plenty.
type Exact = FBig<HalfEven, 2>;

fn exact(v: f64) -> Exact {
    Exact::try_from(v).unwrap().with_precision(300).value()
}

/// Both precisions, each with its f64 value and unit of rounding.
trait TestReal: Real + Debug {
    const EPSILON: f64;
    fn of(v: f64) -> Self;
    fn f64(self) -> f64;
    fn next_up(self) -> Self;
    fn next_down(self) -> Self;
}

macro_rules! test_real {
    ($t:ty) => {
        impl TestReal for $t {
            const EPSILON: f64 = <$t>::EPSILON as f64;
            fn of(v: f64) -> Self {
                v as $t
            }
            fn f64(self) -> f64 {
                f64::from(self)
            }
            fn next_up(self) -> Self {
                <$t>::next_up(self)
            }
            fn next_down(self) -> Self {
                <$t>::next_down(self)
            }
        }
    };
}
test_real!(f32);
test_real!(f64);

/// Textbook Fresnel in 300 bits: (rs, rp, transmitted, cos_t) and the size of the terms that cancel in the p
/// amplitude at Brewster's angle.
fn textbook(cos_i: f64, eta: f64) -> Option<[f64; 5]> {
    let (c, eta, one) = (exact(cos_i), exact(eta), exact(1.0));
    let sin_t2 = (&one - &c * &c) / (&eta * &eta);
    if sin_t2 >= one {
        return None;
    }
    let cos_t = (&one - sin_t2).sqrt();
    let s = (&c - &eta * &cos_t) / (&c + &eta * &cos_t);
    let p = (&eta * &c - &cos_t) / (&eta * &c + &cos_t);
    let (rs, rp) = (&s * &s, &p * &p);
    let transmitted = &one - (&rs + &rp) / exact(2.0);
    let p_sum = &eta * &eta * &c + &eta * &cos_t;
    let p_factor =
        (&eta * &eta - &one) / (&p_sum * &p_sum) * if eta < one { &eta * &eta } else { one.clone() };
    Some([rs, rp, transmitted, cos_t, p_factor].map(|v| v.to_f64().value()))
}

/// Checks one point against the textbook: few units of rounding, relative everywhere but at Brewster's zero.
fn check<T: TestReal>(cos_i: T, eta: T) {
    let got = fresnel_dielectric(cos_i, eta);
    let context = std::format!("cos_i {cos_i:?} eta {eta:?}: {got:?}");
    let Some([rs, rp, transmitted, cos_t, p_factor]) = textbook(cos_i.f64(), eta.f64()) else {
        let one = T::one();
        assert_eq!(
            got,
            Fresnel { rs: one, rp: one, unpolarised: one, transmitted: T::zero(), cos_t: T::zero() },
            "{context}"
        );
        return;
    };
    let units = |got: T, expected: f64| (got.f64() - expected).abs() / (T::EPSILON * expected.abs());
    if rs > f64::from(f32::MIN_POSITIVE) {
        assert!(units(got.rs, rs) < 12.0, "{context} rs {rs:e}");
    }
    assert!(units(got.transmitted, transmitted) < 12.0, "{context} transmitted {transmitted:e}");
    assert!(units(got.cos_t, cos_t) < 3.0, "{context} cos_t {cos_t:e}");
    let amplitude_error = 12.0 * T::EPSILON * (rp.sqrt() + p_factor.abs());
    assert!(
        (got.rp.f64() - rp).abs() <= amplitude_error * (2.0 * rp.sqrt() + amplitude_error),
        "{context} rp {rp:e}"
    );
}

const INDICES: [f64; 7] = [1.000_000_3, 1.000_293, 1.31, 1.5168, 1.92286, 2.4175, 4.0];

fn near_critical<T: TestReal>() {
    for n in INDICES {
        let eta = T::of(1.0 / n);
        let cos_critical = (1.0 - eta.f64() * eta.f64()).sqrt();
        let critical = cos_critical.acos();
        // Angles on both sides, from 1e-6 rad down to where neighbouring floats are the same angle.
        for offset in [1e-6, 3e-7, 1e-7, 1e-8, 1e-10, 1e-12, 1e-14, 0.0] {
            for sign in [-1.0, 1.0] {
                let mut cos_i = T::of((critical + sign * offset).cos());
                check(cos_i, eta);
                for _ in 0..20 {
                    cos_i = cos_i.next_up();
                    check(cos_i, eta);
                }
                for _ in 0..40 {
                    cos_i = cos_i.next_down();
                    check(cos_i, eta);
                }
            }
        }
    }
}

#[test]
fn near_critical_angles_agree_with_300_bits_in_f32() {
    near_critical::<f32>();
}

#[test]
fn near_critical_angles_agree_with_300_bits_in_f64() {
    near_critical::<f64>();
}

/// The reference must be able to object: the textbook form in the arithmetic under test misses by far.
#[test]
fn naive_arithmetic_fails_the_check_near_the_critical_angle() {
    let eta = 1.0_f32 / 1.5168;
    let cos_i = (1.0 - eta * eta).sqrt() * (1.0 + 1e-6);
    let naive_cos_t = (1.0 - (1.0 - cos_i * cos_i) / (eta * eta)).sqrt();
    let [.., cos_t, _] = textbook(f64::from(cos_i), f64::from(eta)).unwrap();
    assert!(
        (f64::from(naive_cos_t) / cos_t - 1.0).abs() > 1e3 * f64::from(f32::EPSILON),
        "{naive_cos_t} {cos_t}"
    );
}

fn grazing_and_normal<T: TestReal>() {
    for n in INDICES {
        for eta in [T::of(n), T::of(1.0 / n)] {
            for cos_i in [1.0, 1.0 - 1e-7, 1.0 - 1e-15, 1e-3, 1e-6, 1e-12, 1e-18] {
                check(T::of(cos_i), eta);
            }
            let normal = fresnel_dielectric(T::one(), eta);
            let expected = ((eta.f64() - 1.0) / (eta.f64() + 1.0)).powi(2);
            for r in [normal.rs, normal.rp] {
                assert!(
                    (r.f64() - expected).abs() <= 12.0 * T::EPSILON * expected,
                    "{eta:?}: {r:?} {expected}"
                );
            }
            assert_eq!(normal.cos_t, T::one());
            let grazing = fresnel_dielectric(T::zero(), eta);
            assert!((grazing.unpolarised - T::one()).f64().abs() <= 4.0 * T::EPSILON, "{eta:?}: {grazing:?}");
            assert_eq!(grazing.transmitted, T::zero());
        }
    }
}

#[test]
fn grazing_and_normal_incidence_in_f32() {
    grazing_and_normal::<f32>();
}

#[test]
fn grazing_and_normal_incidence_in_f64() {
    grazing_and_normal::<f64>();
}

/// Near grazing, transmittance grows linearly: T / cos_i tends to 2 (1 + eta^2) / sqrt(eta^2 - 1), the mean of both
/// polarisations' 4 / w and 4 eta^2 / w.
#[test]
fn grazing_transmittance_has_its_slope() {
    let eta = 1.5_f64;
    let slope = 2.0 * (1.0 + eta * eta) / (eta * eta - 1.0).sqrt();
    let t = fresnel_dielectric(1e-9, eta).transmitted;
    assert!((t / (slope * 1e-9) - 1.0).abs() < 1e-7, "{t}");
}

#[test]
fn an_index_just_above_one_keeps_its_digits() {
    for cos_i in [1.0, 0.7, 0.1, 1e-3, 1e-5] {
        for steps in 1..8_u32 {
            let eta32 = 1.0_f32 + steps as f32 * f32::EPSILON;
            check(cos_i as f32, eta32);
            check(cos_i as f32, 1.0 / eta32);
            let eta64 = 1.0_f64 + f64::from(steps) * f64::EPSILON;
            check(cos_i, eta64);
            check(cos_i, 1.0 / eta64);
        }
    }
}

#[test]
fn equal_indices_reflect_nothing_and_bend_nothing() {
    for cos_i in [0.0, 1e-30, 0.3, 1.0] {
        let f = fresnel_dielectric(cos_i, 1.0_f64);
        assert_eq!((f.rs, f.rp, f.unpolarised, f.transmitted, f.cos_t), (0.0, 0.0, 0.0, 1.0, cos_i));
    }
    for (direction, normal) in [
        ([0.36_f32, -0.48, 0.8], [0.0, 1.0, 0.0]),
        ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ([0.1, 0.7, -0.7], [0.577_350_26, 0.577_350_26, 0.577_350_26]),
    ] {
        let Refraction::Transmitted(refracted, f) = refract(direction, normal, 1.0) else {
            panic!("reflected")
        };
        assert_eq!((refracted, f.unpolarised), (direction, 0.0));
    }
}

#[test]
fn p_light_is_not_reflected_at_brewsters_angle() {
    for n in INDICES {
        for eta in [n, 1.0 / n] {
            let brewster = eta.atan();
            let f = fresnel_dielectric(brewster.cos(), eta);
            // The square of what rounding cos_i leaves in the amplitude.
            assert!(f.rp < 1e-29, "{eta}: {f:?}");
            // Reflected and refracted rays are perpendicular there.
            assert!((f.cos_t - brewster.sin()).abs() < 1e-15 * 4.0, "{eta}: {f:?}");
        }
    }
}

#[test]
fn total_reflection_begins_at_the_critical_angle() {
    for n in INDICES {
        let eta = 1.0 / n;
        let critical = eta.asin();
        assert!(fresnel_dielectric((critical - 1e-6).cos(), eta).transmitted > 0.0, "{n}");
        assert_eq!(fresnel_dielectric((critical + 1e-6).cos(), eta).unpolarised, 1.0, "{n}");
        let inside = [(critical + 1e-6).sin(), -(critical + 1e-6).cos(), 0.0];
        assert_eq!(refract(inside, [0.0, 1.0, 0.0], eta), Refraction::TotalReflection);
    }
}

#[test]
fn snells_law_holds_and_the_normals_side_does_not_matter() {
    let theta = 0.7_f64;
    let direction = [theta.sin(), -theta.cos(), 0.0];
    for eta in [1.5, 1.0 / 1.2] {
        let up = refract(direction, [0.0, 1.0, 0.0], eta);
        assert_eq!(up, refract(direction, [0.0, -1.0, 0.0], eta));
        let Refraction::Transmitted(t, f) = up else { panic!("reflected") };
        assert!((t[0] * eta - theta.sin()).abs() < 1e-15 && t[2] == 0.0, "{t:?}");
        assert!((t[1] + f.cos_t).abs() < 1e-15, "{t:?} {f:?}");
    }
    assert_eq!(reflect(direction, [0.0, 1.0, 0.0]), [direction[0], -direction[1], 0.0]);
    assert_eq!(reflect(direction, [0.0, -1.0, 0.0]), reflect(direction, [0.0, 1.0, 0.0]));
}

#[test]
fn nothing_becomes_nan() {
    for bad in [f64::NAN, -0.5, 1.5, f64::INFINITY] {
        for eta in [0.5, 1.0, 1.5] {
            let f = fresnel_dielectric(bad, eta);
            assert!(
                [f.rs, f.rp, f.unpolarised, f.transmitted, f.cos_t].iter().all(|v| (0.0..=1.0).contains(v)),
                "{f:?}"
            );
        }
    }
    assert_eq!(fresnel_dielectric(0.5, f64::NAN).unpolarised, 1.0);
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > 1e-3).then(|| v.map(|x| x / length))
}

proptest! {
    #[test]
    fn any_incidence_agrees_with_300_bits(cos_i in 0.0..=1.0, log_eta in -1.5..1.5) {
        let eta: f64 = f64::exp(log_eta);
        check(cos_i, eta);
        check(cos_i as f32, eta as f32);
    }

    #[test]
    fn energy_is_conserved(cos_i in 0.0..=1.0, log_eta in -1.5..1.5) {
        let eta: f64 = f64::exp(log_eta);
        let f = fresnel_dielectric(cos_i, eta);
        prop_assert!((f.unpolarised + f.transmitted - 1.0).abs() < 8.0 * f64::EPSILON, "{:?}", f);
        let f = fresnel_dielectric(cos_i as f32, eta as f32);
        prop_assert!((f.unpolarised + f.transmitted - 1.0).abs() < 8.0 * f32::EPSILON, "{:?}", f);
    }

    /// Helmholtz: the way back transmits as much as the way there.
    #[test]
    fn transmittance_is_reciprocal(cos_i in 0.01..=1.0_f64, eta in 1.0001..4.0_f64) {
        let there = fresnel_dielectric(cos_i, eta);
        let back = fresnel_dielectric(there.cos_t, 1.0 / eta);
        // The way back starts from a rounded cosine, which counts most where its refraction is steepest.
        let tolerance = 16.0 * f64::EPSILON * (1.0 + (there.cos_t * eta / cos_i).powi(2));
        prop_assert!((back.cos_t - cos_i).abs() < tolerance, "{:?} {:?}", there, back);
        prop_assert!((there.transmitted - back.transmitted).abs() < 4.0 * tolerance, "{:?} {:?}", there, back);
    }

    /// Refraction keeps the plane of incidence, unit length and Snell's law; refracting back restores the direction.
    #[test]
    fn refraction_is_geometry(
        d in prop::array::uniform3(-1.0..1.0), n in prop::array::uniform3(-1.0..1.0), eta in 0.3..3.0,
    ) {
        let (Some(d), Some(n)) = (unit(d), unit(n)) else { return Ok(()) };
        let r = reflect(d, n);
        prop_assert!((dot(r, r) - 1.0).abs() < 1e-14 && (dot(r, n) + dot(d, n)).abs() < 1e-14);
        let Refraction::Transmitted(t, f) = refract(d, n, eta) else {
            prop_assert!(1.0 - dot(d, n).powi(2) >= eta * eta * (1.0 - 1e-12));
            return Ok(());
        };
        prop_assert!((dot(t, t) - 1.0).abs() < 1e-14 / (eta * eta), "{:?} {}", t, dot(t, t));
        prop_assert!((dot(t, n).abs() - f.cos_t).abs() < 1e-14 / eta);
        prop_assert!(dot(t, n) * dot(d, n) > 0.0);
        let tangential = |v: [f64; 3]| [0, 1, 2].map(|i| v[i] - n[i] * dot(v, n));
        let (before, after) = (tangential(d), tangential(t));
        for i in 0..3 {
            prop_assert!((before[i] - eta * after[i]).abs() < 1e-14 * eta.max(1.0), "{:?} {:?}", before, after);
        }
        if f.cos_t > 0.01 && dot(d, n).abs() > 0.01 {
            let Refraction::Transmitted(back, _) = refract(t, n, 1.0 / eta) else { panic!("no way back") };
            for i in 0..3 {
                prop_assert!((back[i] - d[i]).abs() < 1e-11, "{:?} {:?}", back, d);
            }
        }
    }
}
