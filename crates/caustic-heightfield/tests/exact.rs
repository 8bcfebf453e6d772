//! The integral by direct summation: limits with a known answer, conservation, symmetry, and what is reported.

use std::f64::consts::{PI, TAU};

use caustic_heightfield::*;
use spectral_core::optics::fresnel_dielectric;

/// The waves of all figures: A sin(2 pi (3x + 2y)) + 0.8 A sin(2 pi (5x - 4y) + 1).
fn waves(size: [usize; 2], amplitude_m: f64) -> HeightField {
    HeightField::from_fn(size, [1.0, 1.0], |x, y| {
        amplitude_m * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * (TAU * (5.0 * x - 4.0 * y) + 1.0).sin())
    })
    .expect("finite waves")
}

fn pond(tilt_deg: f64) -> Pond {
    Pond { light_direction: light_tilted_deg(tilt_deg), ..Pond::default() }
}

fn below(surface: &HeightField, pond: &Pond) -> FloorLight {
    exact(surface, pond, FloorGrid::below(surface)).expect("a valid pond")
}

fn transmitted(tilt_deg: f64, eta: f64) -> f64 {
    fresnel_dielectric(tilt_deg.to_radians().cos(), eta).transmitted
}

fn relative(a: f64, b: f64) -> f64 {
    (a / b - 1.0).abs()
}

/// Flat water: a uniform floor, as bright as Fresnel, the cosine and the lobe's downward half say.
#[test]
fn flat_water_has_a_uniform_floor() {
    for (tilt, scattering, size) in
        [(0.0, 50.0, [48, 40]), (30.0, 50.0, [31, 40]), (60.0, 100.0, [48, 64]), (80.0, 20.5, [24, 21])]
    {
        let water = Pond { extinction_per_m: 0.0, scattering, outside: Outside::Periodic, ..pond(tilt) };
        let floor = below(&HeightField::flat(size, [1.0, 1.0]).unwrap(), &water);
        let cos = tilt.to_radians().cos();
        let cos_t = fresnel_dielectric(cos, 1.333).cos_t;
        let expected = cos * transmitted(tilt, 1.333) * downward_share(cos_t, scattering);
        for e in &floor.irradiance {
            assert!(relative(*e, floor.irradiance[0]) < 1e-12, "{e} {}", floor.irradiance[0]);
        }
        // Aliasing of a Gaussian of 0.9 samples, and what lies beyond the tiles.
        let bound = 2e-6 + floor.report.periodic_tail;
        assert!(
            relative(floor.irradiance[0], expected) < bound,
            "{tilt}: {}",
            floor.irradiance[0] / expected
        );
    }
}

/// All that passes the surface lands on a floor that is large enough.
#[test]
fn flux_arrives() {
    for (tilt, amplitude) in [(0.0, 0.01), (45.0, 0.004)] {
        let surface = waves([48, 48], amplitude);
        let water = Pond { extinction_per_m: 0.0, ..pond(tilt) };
        let wide = FloorGrid { size: [96, 96], corner_m: [-1.0, -1.5], extent_m: [4.0, 4.0] };
        let floor = exact(&surface, &water, wide).unwrap();
        let ratio = floor.flux() / floor.report.surface.transmitted_flux;
        assert!((ratio - 1.0).abs() < 1e-3, "{tilt}: {ratio}");
    }
}

/// Absorption: flux on the floor against the integral over the lobe's directions of exp(-epsilon d / cos).
#[test]
fn absorbed_flux_is_missing() {
    let (depth_m, epsilon, a) = (0.3, 2.0, 20.0);
    let water = Pond { extinction_per_m: epsilon, scattering: a, outside: Outside::Periodic, ..pond(0.0) };
    let floor = below(&HeightField::flat([32, 32], [1.0, 1.0]).unwrap(), &water);
    let steps = 200_000;
    let share: f64 = (0..steps)
        .map(|i| {
            let cos = (f64::from(i) + 0.5) / f64::from(steps);
            (2.0 * a + 1.0) * cos.powf(2.0 * a) * (-epsilon * depth_m / cos).exp()
        })
        .sum::<f64>()
        / f64::from(steps);
    let ratio = floor.flux() / floor.report.surface.transmitted_flux;
    assert!(relative(ratio, share) < 1e-6, "{ratio} {share}");
}

/// Without a step of the index nothing bends and nothing is reflected: the waves are invisible but for where they are.
#[test]
fn equal_indices_leave_light_alone() {
    let water = Pond { ior_above: 1.333, extinction_per_m: 0.0, outside: Outside::Periodic, ..pond(25.0) };
    let surface = waves([48, 48], 0.004);
    let light = SurfaceLight::new(&surface, &water).unwrap();
    let direction = water.unit_light_direction();
    assert!(light.directions.iter().all(|d| *d == direction));
    assert!(relative(light.report.transmitted_flux, light.report.incident_flux) < 1e-14);
    let floor = below(&surface, &water);
    // Facets of any slope catch together what a level sheet does.
    let mean = floor.irradiance.iter().sum::<f64>() / floor.irradiance.len() as f64;
    assert!(relative(mean, 25.0_f64.to_radians().cos()) < 1e-4, "{mean}");
}

/// Shallower and shallower, the floor sees the surface right above it; at d = 0 that is what is returned.
#[test]
fn no_depth_is_the_limit_of_little_depth() {
    let flat = HeightField::flat([40, 40], [0.004, 0.004]).unwrap();
    let lamp: Vec<f64> = (0..1600).map(|s| 1.0 + f64::from(s % 40) / 40.0).collect();
    let at = |depth_m: f64| {
        let illumination = Illumination::Map(lamp.clone());
        below(&flat, &Pond { depth_m, illumination, extinction_per_m: 0.0, ..pond(40.0) })
    };
    let (limit, shallow) = (at(0.0), at(0.001));
    let middle = 20 * 40 + 20;
    let expected = lamp[middle] * 40.0_f64.to_radians().cos() * transmitted(40.0, 1.333);
    assert!(relative(limit.irradiance[middle], expected) < 1e-9);
    // One millimetre is ten samples, which light from 40 degrees crosses by 5.5 of them.
    assert!(relative(shallow.irradiance[middle + 5], limit.irradiance[middle]) < 0.02);
    let paper = Pond { form: Form::Paper, depth_m: 0.0, ..pond(0.0) };
    assert!(exact(&flat, &paper, FloorGrid::below(&flat)).unwrap_err().to_string().contains("limit"));
}

/// a = 0: every facet is a lamp that shines evenly into half of all directions.
#[test]
fn milk_forgets_where_light_came_from() {
    let one = HeightField::flat([1, 1], [0.01, 0.01]).unwrap();
    let water = Pond { scattering: 0.0, extinction_per_m: 0.0, ..pond(0.0) };
    let grid = FloorGrid { size: [3, 1], corner_m: [-0.295, -0.195], extent_m: [0.6, 0.4] };
    let floor = exact(&one, &water, grid).unwrap();
    for (i, x) in [-0.2_f64, 0.0, 0.2].into_iter().enumerate() {
        let r2 = x * x + 0.3 * 0.3;
        let expected = transmitted(0.0, 1.333) * 1e-4 / TAU * 0.3 / (r2 * r2.sqrt());
        assert!(relative(floor.irradiance[i], expected) < 1e-12, "{x}");
    }
    assert!(relative(downward_share(1.0, 0.0), 1.0) < 1e-12);
    assert!((downward_share(0.0, 0.0) - 0.5).abs() < 1e-6);
    assert!((downward_share(0.5, 0.0) - (0.5 + (30.0_f64).to_radians() / PI)).abs() < 1e-4);
}

/// a = 1e6: where the grid resolves so narrow a lobe the floor is even; where it does not, the report says so.
#[test]
fn clear_water_needs_a_fine_grid() {
    let clear = Pond {
        scattering: 1e6,
        depth_m: 1.0,
        extinction_per_m: 0.0,
        outside: Outside::Periodic,
        ..pond(0.0)
    };
    let fine = below(&HeightField::flat([32, 32], [0.016, 0.016]).unwrap(), &clear);
    assert!((1.0..2.0).contains(&fine.report.lobe_samples), "{}", fine.report.lobe_samples);
    assert!(fine.irradiance.iter().all(|e| relative(*e, transmitted(0.0, 1.333)) < 1e-6));
    let coarse = below(&HeightField::flat([32, 32], [1.0, 1.0]).unwrap(), &clear);
    assert!(coarse.report.lobe_samples < 0.05);
    assert!(coarse.irradiance.iter().all(|e| e.is_finite()));
}

/// Waves and light seen in a mirror make the floor seen in that mirror.
#[test]
fn mirrored_waves_make_mirrored_floors() {
    let size = [37, 26];
    let surface = waves(size, 0.01);
    let flip = |values: &[f64]| -> Vec<f64> {
        values.chunks(size[0]).flat_map(|row| row.iter().rev().copied()).collect()
    };
    let mirrored = HeightField { heights_m: flip(&surface.heights_m), ..surface.clone() };
    for form in [Form::Physical, Form::Paper] {
        let water = Pond { form, light_direction: [0.3, 0.2, -1.0], ..Pond::default() };
        let there = Pond { light_direction: [-0.3, 0.2, -1.0], ..water.clone() };
        let (a, b) = (below(&surface, &water), below(&mirrored, &there));
        let worst =
            a.irradiance.iter().zip(flip(&b.irradiance)).map(|(a, b)| relative(*a, b)).fold(0.0, f64::max);
        assert!(worst < 1e-11, "{form:?}: {worst}");
    }
}

/// Eq. 2 as printed but for the sign of P_z, at one point, written out.
#[test]
fn paper_form_is_equation_2() {
    let surface = waves([9, 7], 0.01);
    let water = Pond { form: Form::Paper, normals: Normals::OneSided, scattering: 3.5, ..pond(20.0) };
    let floor = below(&surface, &water);
    let [dx, dy] = surface.pitch_m();
    let l = water.unit_light_direction();
    let (x0, y0) = (4.5 * dx, 2.5 * dy);
    let mut sum = 0.0;
    for j in 0..7 {
        for i in 0..9 {
            let h = |i: usize, j: usize| surface.heights_m[j * 9 + i];
            let (west, south) = (i.min(7), j.min(5));
            let slope = [(h(west + 1, j) - h(west, j)) / dx, (h(i, south + 1) - h(i, south)) / dy];
            let length = (1.0 + slope[0] * slope[0] + slope[1] * slope[1]).sqrt();
            let n = [-slope[0] / length, -slope[1] / length, 1.0 / length];
            let cos_i = -(l[0] * n[0] + l[1] * n[1] + l[2] * n[2]);
            let r = 1.0 / 1.333;
            let cos_t = (1.0 - r * r * (1.0 - cos_i * cos_i)).sqrt();
            // Gamma and T as the paper prints them.
            let gamma = r * cos_i - cos_t;
            let lt = [0, 1, 2].map(|k| r * l[k] + gamma * n[k]);
            let t = 2.0 * 1.333 * cos_t / cos_i
                * ((cos_i / (cos_i + 1.333 * cos_t)).powi(2) + (cos_i / (1.333 * cos_i + cos_t)).powi(2));
            let p = [x0 - (i as f64 + 0.5) * dx, y0 - (j as f64 + 0.5) * dy, -0.3 - h(i, j)];
            let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
            let cos = (lt[0] * p[0] + lt[1] * p[1] + lt[2] * p[2]) / length;
            sum += t
                * cos_i
                * (-p[2] / length)
                * (-3.5 * (1.0 - cos * cos)).exp()
                * (-0.3 * length).exp()
                * dx
                * dy;
        }
    }
    assert!(relative(floor.irradiance[2 * 9 + 4], sum) < 1e-12, "{} {sum}", floor.irradiance[2 * 9 + 4]);
}

/// Light that varies over the surface: floors add up as their lights do, and dark halves are dark.
#[test]
fn illumination_may_vary() {
    let surface = waves([24, 24], 0.004);
    let left: Vec<f64> = (0..576).map(|s| if s % 24 < 12 { 2.0 } else { 0.0 }).collect();
    let right: Vec<f64> = left.iter().map(|l| 2.0 - l).collect();
    let floor = |illumination| below(&surface, &Pond { illumination, scattering: 30.0, ..pond(10.0) });
    let (l, r) = (floor(Illumination::Map(left)), floor(Illumination::Map(right)));
    let both = floor(Illumination::Uniform(2.0));
    for ((l, r), both) in l.irradiance.iter().zip(&r.irradiance).zip(&both.irradiance) {
        assert!(relative(l + r, *both) < 1e-12);
    }
    assert!(l.irradiance[12 * 24 + 3] > 20.0 * r.irradiance[12 * 24 + 3]);
}

/// Crests that hide what is behind them: what the facets that see the light catch is what falls on the pond.
#[test]
fn grazing_light_shades_and_is_reported() {
    let steep = HeightField::from_fn([400, 3], [1.0, 0.01], |x, _| 0.08 * (TAU * 3.0 * x).sin()).unwrap();
    let water = Pond { outside: Outside::Periodic, ..pond(80.0) };
    let light = SurfaceLight::new(&steep, &water).unwrap();
    let report = light.report;
    assert!(report.self_shadowed > 0 && report.turned_away > 0 && report.past_45_degrees > 0, "{report:?}");
    assert!(relative(report.steepest_slope, 0.08 * TAU * 3.0) < 0.01);
    let falls = 80.0_f64.to_radians().cos() * 0.01;
    assert!(relative(report.incident_flux, falls) < 0.02, "{} {falls}", report.incident_flux);
    // From above all of it is seen.
    let noon = SurfaceLight::new(&steep, &pond(0.0)).unwrap().report;
    assert_eq!((noon.self_shadowed, noon.turned_away), (0, 0));
    // The more grazing, the darker: Fresnel lets less pass than the cosine alone says.
    let gentle = waves([32, 32], 1e-5);
    let passed = |tilt: f64| SurfaceLight::new(&gentle, &pond(tilt)).unwrap().report.transmitted_flux;
    assert!(passed(89.9) < 0.03 * 89.9_f64.to_radians().cos() && passed(89.9) > 0.0);
}

/// From dense to thin beyond the critical angle nothing passes, and that is counted.
#[test]
fn total_reflection_is_counted() {
    let water = Pond { ior_above: 1.5, ior_below: 1.0, ..pond(50.0) };
    let report = SurfaceLight::new(&HeightField::flat([5, 5], [1.0, 1.0]).unwrap(), &water).unwrap().report;
    assert_eq!((report.totally_reflected, report.transmitted_flux), (25, 0.0));
}

#[test]
fn depth_may_be_comparable_to_the_waves() {
    let surface = waves([32, 32], 0.01);
    let floor = below(&surface, &Pond { depth_m: 0.03, scattering: 5.0, ..pond(0.0) });
    assert!(floor.irradiance.iter().all(|e| e.is_finite() && *e > 0.0));
    let error =
        exact(&surface, &Pond { depth_m: 0.01, ..pond(0.0) }, FloorGrid::below(&surface)).unwrap_err();
    assert!(error.to_string().contains("above the floor"), "{error}");
}

#[test]
fn every_size_works() {
    for size in [[1, 1], [1, 7], [13, 1], [3, 5]] {
        for outside in [Outside::Dark, Outside::Periodic] {
            for normals in [Normals::Central, Normals::OneSided] {
                let water = Pond { outside, normals, ..pond(15.0) };
                let floor = below(&waves(size, 0.004), &water);
                assert_eq!(floor.irradiance.len(), size[0] * size[1]);
                assert!(floor.irradiance.iter().all(|e| e.is_finite() && *e > 0.0), "{size:?}");
            }
        }
    }
}

#[test]
fn impossible_ponds_are_refused() {
    let flat = HeightField::flat([2, 2], [1.0, 1.0]).unwrap();
    let refused = |pond: Pond, words: &str| {
        let error = exact(&flat, &pond, FloorGrid::below(&flat)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    let ok = Pond::default;
    refused(Pond { depth_m: f64::NAN, ..ok() }, "depth, metres, is NaN");
    refused(Pond { depth_m: -1.0, ..ok() }, "not negative");
    refused(Pond { ior_below: 0.0, ..ok() }, "index of refraction of the water is 0");
    refused(Pond { scattering: f64::INFINITY, ..ok() }, "scattering");
    refused(Pond { extinction_per_m: -0.1, ..ok() }, "extinction");
    refused(Pond { light_direction: [1.0, 0.0, 0.0], ..ok() }, "light comes from above");
    refused(Pond { light_direction: [f64::NAN, 0.0, -1.0], ..ok() }, "light direction");
    refused(
        Pond { illumination: Illumination::Map(vec![1.0; 3]), ..ok() },
        "3 values, a grid of 2 x 2 needs 4",
    );
    refused(Pond { illumination: Illumination::Map(vec![1.0, 1.0, 1.0, -1.0]), ..ok() }, "(1, 1) is -1");
}

/// A coarse grid, supersampled, is the surface that it is samples of, up to their spacing; and a whole number of waves stays periodic.
#[test]
fn supersampling_finds_the_surface_between_samples() {
    let off = |count: usize, factor: usize, outside: Outside| {
        let fine = waves([count; 2], 0.004).supersampled(factor, outside).unwrap();
        let truth = waves([count * factor; 2], 0.004);
        assert_eq!(fine.size, truth.size);
        // The middle: slopes are of lower order beside the edge of a pond that ends.
        let side = fine.size[0];
        let inner =
            |s: &usize| [s % side, s / side].iter().all(|i| (3 * factor..side - 3 * factor).contains(i));
        let error = |s: usize| (fine.heights_m[s] - truth.heights_m[s]).abs();
        (0..side * side).filter(inner).map(error).fold(0.0, f64::max)
    };
    for outside in [Outside::Dark, Outside::Periodic] {
        for factor in [2, 3] {
            let (coarse, fine) = (off(32, factor, outside), off(64, factor, outside));
            assert!(coarse < 1e-4 && fine < coarse / 12.0, "{outside:?}: {coarse} {fine}");
        }
    }
    let heights = |values: Vec<f64>, outside| {
        HeightField::from_rows(&[values], [1.0, 1.0]).unwrap().supersampled(2, outside).unwrap().heights_m
    };
    for ramp in [vec![1.0, 3.0], vec![1.0, 3.0, 5.0, 7.0, 9.0, 11.0]] {
        let expected: Vec<f64> = (0..2 * ramp.len()).map(|i| i as f64 + 0.5).collect();
        assert_eq!(heights(ramp, Outside::Dark)[..expected.len()], expected, "straight stays straight");
    }
    assert_eq!(heights(vec![2.0], Outside::Dark), [2.0; 4]);
    assert_eq!(heights(vec![2.0; 3], Outside::Periodic), [2.0; 12]);
    let surface = waves([5, 4], 0.004);
    assert_eq!(surface.supersampled(1, Outside::Dark).unwrap(), surface);
    assert!(surface.supersampled(4000, Outside::Dark).is_err());
}

/// A lobe that falls between the samples: over facets it is the integral, as a finer grid of the same waves has it.
#[test]
fn facets_resolve_a_lobe_narrower_than_the_samples() {
    let water = Pond { scattering: 2000.0, ..pond(25.0) };
    let grid = FloorGrid { size: [6, 5], corner_m: [0.3, 0.2], extent_m: [0.5, 0.6] };
    let coarse = waves([40, 40], 0.004);
    let of = |surface: &HeightField, samples: f64| {
        let floor = exact_over_facets(surface, &water, grid, samples).unwrap();
        assert_eq!((floor.grid, floor.irradiance.len()), (grid, 30));
        assert!(floor.report.lobe_samples >= samples);
        floor.irradiance
    };
    let fine = waves([160, 160], 0.004);
    let resolved = of(&coarse, 2.0);
    assert!(relative_rms(&resolved, &of(&fine, 2.0)) < 3e-3);
    assert!(relative_rms(&of(&coarse, 3.0), &resolved) < 1e-3);
    // Points of the grid as they are: dots.
    let dots = |surface: &HeightField| exact(surface, &water, grid).unwrap().irradiance;
    let error = relative_rms(&dots(&coarse), &dots(&fine));
    assert!(error > 0.1, "{error}");
    // A map of light keeps its cells.
    let lamp: Vec<f64> = (0..1600).map(|s| 1.0 + f64::from(s % 40 / 20)).collect();
    let lit = Pond { illumination: Illumination::Map(lamp), ..water.clone() };
    let lit = exact_over_facets(&coarse, &lit, grid, 2.0).unwrap().irradiance;
    let ratio = |i: usize| lit[i] / resolved[i];
    assert!(relative(ratio(0), 1.0) < 1e-9 && relative(ratio(5), 2.0) < 1e-9, "{} {}", ratio(0), ratio(5));
    assert!(exact_over_facets(&coarse, &water, grid, f64::NAN).is_err());
}
