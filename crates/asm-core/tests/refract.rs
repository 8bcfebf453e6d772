//! The f32 Snell and Fresnel of the shaders against f64, where cancellation would show.

use asm_core::shared::flux::{WHOLE, flux_part, part_from};
use asm_core::shared::refract::refract_light;
use glam::{DVec3, Vec3};

/// Cosine of the refracted ray and reflectance in f64 of the same f32 inputs, from the textbook; `None` beyond critical.
fn exact(direction: Vec3, eta: f32) -> Option<(DVec3, f64)> {
    let d = direction.as_dvec3().normalize();
    let (cos_i, eta) = (-d.y, f64::from(eta));
    let cos2_t = 1.0 - (1.0 - cos_i * cos_i) / (eta * eta);
    if cos2_t < 0.0 {
        return None;
    }
    let cos_t = cos2_t.sqrt();
    let bent = d / eta + (cos_i / eta - cos_t) * DVec3::Y;
    let r_s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let r_p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    Some((bent, 0.5 * (r_s * r_s + r_p * r_p)))
}

fn incident(cos_i: f64) -> Vec3 {
    DVec3::new((1.0 - cos_i * cos_i).sqrt(), -cos_i, 0.0).as_vec3()
}

#[test]
fn follows_f64_over_angles_and_indices() {
    for eta in [0.4, 0.66, 0.9999, 1.000001, 1.0001, 1.33, 1.5, 2.4] {
        for i in 1..=1000 {
            let direction = incident(f64::from(i) / 1000.0);
            let got = refract_light(direction, Vec3::Y, eta);
            match exact(direction, eta) {
                None => assert!(got.total || got.reflectance > 0.99, "{eta} {i}"),
                Some((bent, reflectance)) => {
                    // What an error of f32 in the cosine of incidence does to the refracted cosine.
                    let bound = 1e-6 + 3e-7 / (f64::from(eta * eta) * -bent.y);
                    if got.total {
                        assert!(bent.y > -2e-3, "{eta} {i}");
                        continue;
                    }
                    let error = (got.direction.as_dvec3() - bent).length();
                    assert!(error < bound, "{eta} {i}: {} {bent}", got.direction);
                    // Relative where it is small, since the contrast is factored out.
                    let error = (f64::from(got.reflectance) - reflectance).abs();
                    assert!(
                        error <= 10.0 * bound * reflectance + 1e-12,
                        "{eta} {i}: {} {reflectance}",
                        got.reflectance
                    );
                }
            }
        }
    }
}

#[test]
fn nothing_happens_without_contrast() {
    for cos_i in [1.0, 0.7, 1e-3, 1e-7, 0.0] {
        let direction = incident(cos_i);
        let got = refract_light(direction, Vec3::Y, 1.0);
        assert!(!got.total && got.reflectance == 0.0);
        assert!((got.direction - direction).length() < 1e-7, "{direction} {}", got.direction);
    }
}

#[test]
fn critical_angles_within_a_millionth_are_told_apart() {
    for n in [1.1_f64, 1.5, 2.4] {
        let eta = (1.0 / n) as f32;
        let critical = f64::from(eta).asin();
        for (offset, total) in [(1e-6, true), (-1e-6, false)] {
            let angle = critical + offset;
            let direction = DVec3::new(angle.sin(), -angle.cos(), 0.0).as_vec3();
            // f32 moves the angle itself by 6e-8.
            let got = refract_light(direction, Vec3::Y, eta);
            assert_eq!(got.total, total, "n {n}, {offset:e}");
            assert!(got.reflectance <= 1.0 && got.reflectance > 0.97 && got.direction.is_finite(), "{got:?}");
        }
    }
}

#[test]
fn grazing_and_normal_incidence_have_their_limits() {
    let normal = refract_light(Vec3::NEG_Y, Vec3::Y, 1.5);
    assert_eq!(normal.direction, Vec3::NEG_Y);
    assert!((normal.reflectance - 0.04).abs() < 1e-8);
    let grazing = refract_light(incident(1e-6), Vec3::Y, 1.5);
    assert!(grazing.reflectance > 0.99999 && grazing.reflectance <= 1.0);
    let along = refract_light(Vec3::X, Vec3::Y, 1.5);
    assert_eq!(along.reflectance, 1.0);
    assert!((f64::from(along.direction.x) - 1.0 / 1.5).abs() < 1e-6);
}

#[test]
fn parts_of_flux_round_to_nearest_and_keep_the_whole() {
    assert_eq!(part_from(1.0), WHOLE);
    assert_eq!(part_from(0.0), 0);
    assert_eq!(part_from(f32::NAN), 0);
    for flux in [0, 1, 2, 12345, 1 << 30, (1 << 30) - 1, 1 << 31] {
        assert_eq!(flux_part(flux, WHOLE), flux);
        assert_eq!(flux_part(flux, 0), 0);
        for part in [1, 7, 1 << 16, 0x5555_5555, WHOLE / 2, WHOLE - 1] {
            let exact = f64::from(flux) * f64::from(part) / f64::from(WHOLE);
            assert!((f64::from(flux_part(flux, part)) - exact).abs() <= 0.5, "{flux} {part}");
        }
    }
}
