//! Real spherical harmonics: orthonormal, invariant under rotation, and the clamped cosine in them.

use std::f64::consts::PI;

use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;
use spectral_prt::sh::{self, ShRotation};
use spectral_prt::{Bands, cosine_lobe};

/// Gauss-Legendre nodes and weights on -1..1, by Newton's method on the Legendre polynomial.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut before, mut p) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Directions and weights that integrate polynomials of degree 2 n - 1 over the sphere exactly.
fn sphere(n: usize) -> Vec<(DVec3, f64)> {
    let turns = 2 * n;
    gauss_legendre(n)
        .into_iter()
        .flat_map(|(z, weight)| {
            (0..turns).map(move |k| {
                let phi = 2.0 * PI * k as f64 / turns as f64;
                let r = (1.0 - z * z).sqrt();
                (DVec3::new(r * phi.cos(), r * phi.sin(), z), weight * 2.0 * PI / turns as f64)
            })
        })
        .collect()
}

fn bands() -> impl Strategy<Value = Bands> {
    (1_u8..=10).prop_map(|n| Bands::new(n).expect("1 to 10"))
}

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0, 0.0..2.0 * PI).prop_map(|(z, phi): (f64, f64)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    })
}

fn rotation() -> impl Strategy<Value = DMat3> {
    (direction(), -PI..PI).prop_map(|(axis, angle)| DMat3::from_quat(DQuat::from_axis_angle(axis, angle)))
}

/// A function with coefficients from -1 to 1.
fn function() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0, 100)
}

#[test]
fn ten_bands_are_orthonormal() {
    let n = Bands::MAX.coefficients();
    let mut gram = vec![0.0; n * n];
    for (direction, weight) in sphere(12) {
        let y = sh::harmonics(Bands::MAX, direction);
        for i in 0..n {
            for j in 0..n {
                gram[i * n + j] += weight * y[i] * y[j];
            }
        }
    }
    for i in 0..n {
        for j in 0..n {
            let expected = if i == j { 1.0 } else { 0.0 };
            assert!((gram[i * n + j] - expected).abs() < 1e-13, "{i} {j} {}", gram[i * n + j]);
        }
    }
}

/// Sloan 2008, "Stupid spherical harmonics tricks", appendix A2, with the signs of no Condon-Shortley phase.
#[test]
fn first_bands_are_the_published_polynomials() {
    let d = DVec3::new(0.36, -0.48, 0.8);
    let y = sh::harmonics(Bands::new(3).unwrap(), d);
    let one = (3.0 / (4.0 * PI)).sqrt();
    let two = (15.0 / (4.0 * PI)).sqrt();
    let published = [
        0.5 / PI.sqrt(),
        one * d.y,
        one * d.z,
        one * d.x,
        two * d.x * d.y,
        two * d.y * d.z,
        (5.0 / (16.0 * PI)).sqrt() * (3.0 * d.z * d.z - 1.0),
        two * d.x * d.z,
        0.5 * two * (d.x * d.x - d.y * d.y),
    ];
    for (y, published) in y.iter().zip(published) {
        assert!((y - published).abs() < 1e-15, "{y} {published}");
    }
}

#[test]
fn the_poles_are_no_exception() {
    for pole in [DVec3::Z, DVec3::NEG_Z] {
        for (i, y) in sh::harmonics(Bands::MAX, pole).into_iter().enumerate() {
            let l = i.isqrt();
            let zonal = if i == l * l + l { ((2 * l + 1) as f64 / (4.0 * PI)).sqrt() } else { 0.0 };
            assert!((y.abs() - zonal).abs() < 1e-13, "{i} {y}");
        }
    }
}

/// pi, 2 pi / 3, pi / 4, 0, -pi / 24, 0, pi / 64 (Ramamoorthi & Hanrahan 2001, eq. 8), and against quadrature.
#[test]
fn the_clamped_cosine_has_its_closed_form() {
    let factors = cosine_lobe::degree_factors(Bands::MAX);
    let published = [PI, 2.0 * PI / 3.0, PI / 4.0, 0.0, -PI / 24.0, 0.0, PI / 64.0];
    for (factor, published) in factors.iter().zip(published) {
        assert!((factor - published).abs() < 1e-15, "{factor} {published}");
    }
    for (l, factor) in factors.into_iter().enumerate() {
        // 2 pi times the integral of mu P_l(mu) over 0..1; the harmonic at the pole's distance is P_l's multiple.
        let integral: f64 = gauss_legendre(16)
            .into_iter()
            .map(|(x, w)| {
                let mu = 0.5 * (x + 1.0);
                let d = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                let zonal = l * l + l;
                let at = |d| sh::harmonics(Bands::MAX, d)[zonal];
                0.5 * w * 2.0 * PI * mu * at(d) / at(DVec3::Z)
            })
            .sum();
        assert!((factor - integral).abs() < 1e-13, "{l} {factor} {integral}");
    }
}

#[test]
fn what_is_no_rotation_is_refused_with_the_numbers() {
    for bad in [DMat3::ZERO, DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)), 2.0 * DMat3::IDENTITY] {
        assert!(ShRotation::new(Bands::default(), bad).is_err(), "{bad}");
    }
    let nan = DMat3::from_cols(DVec3::NAN, DVec3::Y, DVec3::Z);
    assert!(ShRotation::new(Bands::default(), nan).is_err());
    assert_eq!(
        ShRotation::new(Bands::default(), 2.0 * DMat3::IDENTITY).unwrap_err().to_string(),
        "not a rotation: M M^T differs from the identity by 3.000e0, the determinant is 8.000000; rotations have 0 and 1"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// sum_m Y_lm(a) Y_lm(b) = (2 l + 1) / (4 pi) P_l(a . b): at a = b it is the same everywhere.
    #[test]
    fn each_degree_has_the_same_power_everywhere(d in direction()) {
        let y = sh::harmonics(Bands::MAX, d);
        for l in 0..10 {
            let power: f64 = y[l * l..(l + 1) * (l + 1)].iter().map(|y| y * y).sum();
            prop_assert!((power - (2 * l + 1) as f64 / (4.0 * PI)).abs() < 1e-12, "{l} {power}");
        }
    }

    #[test]
    fn a_rotated_function_has_its_values_at_rotated_directions(
        bands in bands(), r in rotation(), f in function(), d in direction(),
    ) {
        let f = &f[..bands.coefficients()];
        let turned = ShRotation::new(bands, r).expect("a rotation").rotate(f);
        prop_assert!((sh::value(bands, &turned, r * d) - sh::value(bands, f, d)).abs() < 1e-11);
    }

    #[test]
    fn rotation_keeps_the_inner_product_of_each_degree(r in rotation(), f in function(), g in function()) {
        let rotation = ShRotation::new(Bands::MAX, r).expect("a rotation");
        let (rf, rg) = (rotation.rotate(&f), rotation.rotate(&g));
        for l in 0..10 {
            let product = |a: &[f64], b: &[f64]| (l * l..(l + 1) * (l + 1)).map(|i| a[i] * b[i]).sum::<f64>();
            prop_assert!((product(&rf, &rg) - product(&f, &g)).abs() < 1e-11);
        }
    }

    #[test]
    fn rotations_follow_each_other(a in rotation(), b in rotation(), f in function()) {
        let turn = |r, f: &[f64]| ShRotation::new(Bands::MAX, r).expect("a rotation").rotate(f);
        for (one, two) in turn(b * a, &f).iter().zip(turn(b, &turn(a, &f))) {
            prop_assert!((one - two).abs() < 1e-11);
        }
        for (back, f) in turn(a.transpose(), &turn(a, &f)).iter().zip(&f) {
            prop_assert!((back - f).abs() < 1e-11);
        }
    }

    /// Turning the sky and the normal together changes nothing.
    #[test]
    fn irradiance_is_invariant_under_rotation(bands in bands(), r in rotation(), n in direction(), f in function()) {
        let light = &f[..bands.coefficients()];
        let turned = ShRotation::new(bands, r).expect("a rotation").rotate(light);
        let irradiance = |normal, light: &[f64]| {
            let mut t = vec![0.0; light.len()];
            cosine_lobe::evaluate(bands, normal, &mut t);
            t.iter().zip(light).map(|(t, l)| t * l).sum::<f64>()
        };
        prop_assert!((irradiance(r * n, &turned) - irradiance(n, light)).abs() < 1e-11);
    }
}
