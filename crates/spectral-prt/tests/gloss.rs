//! Glossy lobes against direct integration.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use spectral_core::grid::SpectralGrid;
use spectral_prt::{
    Bands, BounceSettings, GlossTransfer, PhongLobe, Surface, Transfer, TransferSettings, add_bounces,
    cosine_lobe, precompute, sh,
};

const FIVE: u8 = 5;

fn bands(count: u8) -> Bands {
    Bands::new(count).expect("up to ten")
}

fn lobe(exponent: f64) -> PhongLobe {
    PhongLobe::new(exponent).expect("a lobe")
}

/// A small horizontal triangle at the origin that looks up.
fn probe() -> Surface {
    let corners = [DVec3::ZERO, DVec3::X * 1e-3, DVec3::Y * 1e-3];
    Surface::new(&corners, &[DVec3::Z; 3], &[[0, 1, 2]]).expect("a triangle")
}

/// A wall behind it, at x = -1e-3, that blocks half of its sky.
fn wall() -> Surface {
    let far = 1e3;
    let corners =
        [[-1e-3, -far, -far], [-1e-3, far, -far], [-1e-3, far, far], [-1e-3, -far, far]].map(DVec3::from);
    Surface::new(&corners, &[], &[[0, 1, 2], [0, 2, 3]]).expect("a wall")
}

fn transfer(surfaces: &[Surface], rays: u32) -> Transfer {
    precompute(surfaces, &TransferSettings { bands: bands(2 * FIVE - 1), rays }, &mut |_| {})
        .expect("good settings")
}

/// The lobe as so many bands have it.
fn banded(lobe: PhongLobe, count: u8, cosine: f64) -> f64 {
    let (mut before, mut p, mut sum) = (0.0, 1.0, 0.0);
    for (l, factor) in lobe.degree_factors(bands(count)).into_iter().enumerate() {
        let l = l as f64;
        sum += factor * (2.0 * l + 1.0) / (4.0 * PI) * p;
        (before, p) = (p, ((2.0 * l + 1.0) * cosine * p - l * before) / (l + 1.0));
    }
    sum
}

fn phong(lobe: PhongLobe, cosine: f64) -> f64 {
    (lobe.exponent() + 2.0) / TAU * cosine.max(0.0).powf(lobe.exponent())
}

/// The harmonic coefficients of a function over the directions above the ground that are `seen`, by the midpoint rule.
fn over_sky(seen: impl Fn(DVec3) -> bool, value: impl Fn(DVec3) -> f64) -> Vec<f64> {
    const RINGS: u32 = 2000;
    const STEPS: u32 = 200;
    let mut sums = vec![0.0; bands(FIVE).coefficients()];
    let mut harmonics = sums.clone();
    for ring in 0..RINGS {
        let z = (f64::from(ring) + 0.5) / f64::from(RINGS);
        let radius = (1.0 - z * z).sqrt();
        for step in 0..STEPS {
            let phi = TAU * (f64::from(step) + 0.5) / f64::from(STEPS);
            let direction = DVec3::new(radius * phi.cos(), radius * phi.sin(), z);
            if seen(direction) {
                sh::evaluate(bands(FIVE), direction, &mut harmonics);
                let weight = value(direction) * TAU / f64::from(RINGS * STEPS);
                sums.iter_mut().zip(&harmonics).for_each(|(sum, y)| *sum += weight * y);
            }
        }
    }
    sums
}

/// What a lobe with these coefficients sends of an even sky of radiance 1.
fn of_even_sky(coefficients: &[f64]) -> f64 {
    coefficients[0] * 2.0 * PI.sqrt()
}

const MIRRORED: [DVec3; 3] = [DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.64, 0.48, 0.6)];

/// Matrices, harmonics and factors together are the integral of the banded lobe over the seen sky, with the cosine.
#[test]
fn lobes_are_integrals_over_the_seen_sky() {
    let open = transfer(&[probe()], 1);
    let half = transfer(&[probe(), wall()], 16_384);
    for (name, transfer, lobes, seen, tolerance) in [
        ("open", &open, vec![Some(lobe(7.0))], (|_| true) as fn(DVec3) -> bool, 2e-5),
        ("half", &half, vec![Some(lobe(7.0)), None], |d: DVec3| d.x > 0.0, 2e-3),
    ] {
        let gloss = GlossTransfer::new(transfer, bands(FIVE), &lobes).expect("enough bands");
        for mirrored in MIRRORED {
            let toward = gloss.toward(0, 0, mirrored).remove(0);
            let value = |d: DVec3| d.z * banded(lobe(7.0), FIVE, mirrored.dot(d));
            for (k, (found, truth)) in toward.iter().zip(over_sky(seen, value)).enumerate() {
                assert!((found - truth).abs() < tolerance, "{name} {mirrored} {k}: {found} {truth}");
            }
            // A wall in the way of the lobe is no rounding.
            let blocked = of_even_sky(&over_sky(|_| true, value)) - of_even_sky(&toward);
            assert!(name == "open" || mirrored.x > 0.0 || blocked > 0.1, "{mirrored}: {blocked}");
        }
    }
}

/// Under an even sky the lobe itself, without bands, sends all of what comes in towards the normal and less elsewhere; what bands
/// leave of it is near.
#[test]
fn a_white_lobe_sends_no_more_than_comes_in() {
    let open = transfer(&[probe()], 1);
    let mut last = 1.0;
    for exponent in [1.0, 4.0, 10.0, 30.0] {
        let lobe = lobe(exponent);
        let gloss = GlossTransfer::new(&open, bands(FIVE), &[Some(lobe)]).expect("enough bands");
        let mut worst: f64 = 0.0;
        for mirrored in MIRRORED {
            let truth = of_even_sky(&over_sky(|_| true, |d| d.z * phong(lobe, mirrored.dot(d))));
            assert!(truth < 1.0 + 1e-4, "{exponent} {mirrored}: {truth}");
            if mirrored == DVec3::Z {
                assert!((truth - 1.0).abs() < 1e-4, "{exponent}: {truth}");
            }
            let found = of_even_sky(&gloss.toward(0, 0, mirrored)[0]);
            worst = worst.max((found - truth).abs());
        }
        let held = lobe.held_by(bands(FIVE));
        println!("exponent {exponent}: five bands hold {held:.4}, an even sky is off by {worst:.1e} at most");
        assert!(worst < 0.02, "{exponent}: {worst}");
        assert!(held <= last, "sharper lobes are held less: {held} after {last}");
        last = held;
    }
    assert!(last < 0.9, "a sharp lobe is said to be held: {last}");
}

/// Above a wide white floor a lobe that looks down sees as much light as one that looks up: the floor sends back what the even sky sends it.
/// Without bounces the floor is black, and a red floor is red.
#[test]
fn lobes_see_what_surfaces_send() {
    let grid = SpectralGrid::SCHWENK_2010;
    let far = 1e3;
    let corners =
        [[-far, -far, -1.0], [far, -far, -1.0], [far, far, -1.0], [-far, far, -1.0]].map(DVec3::from);
    let floor = Surface::new(&corners, &[DVec3::Z; 4], &[[0, 1, 2], [0, 2, 3]]).expect("a floor");
    // It looks to the side, so half of what it sees is the floor.
    let probe = [DVec3::ZERO, DVec3::Y * 1e-3, DVec3::Z * 1e-3];
    let probe = Surface::new(&probe, &[DVec3::X; 3], &[[0, 1, 2]]).expect("a triangle");
    let surfaces = [probe, floor];
    let wide = transfer(&surfaces, 4096);
    let direct = wide.with_bands(bands(FIVE));
    let sky_alone = GlossTransfer::new(&wide, bands(FIVE), &[Some(lobe(6.0)), None]).expect("enough bands");
    let [down, up] = [DVec3::new(0.6, 0.0, -0.8), DVec3::new(0.6, 0.0, 0.8)];
    let black = of_even_sky(&sky_alone.toward(0, 0, down)[0]);
    let full = of_even_sky(&sky_alone.toward(0, 0, up)[0]) + black;
    assert!(black < 0.1 * full, "{black} {full}");
    let of_floor = |paint: &dyn Fn(f64) -> f64| {
        let paints = [grid.sample(|_| 0.0), grid.sample(paint)];
        let settings = BounceSettings { rays: 64, bounces: 1 };
        let bounced = add_bounces(&surfaces, &direct, grid, &paints, &settings, &mut |_| {}).expect("paints");
        let gloss =
            sky_alone.clone().with_bounces(&surfaces, &bounced, 4096, &mut |_| {}).expect("the same scene");
        // At the ends of the spectrum.
        let toward = gloss.toward(0, 0, down);
        [0, grid.samples() - 1].map(|sample| {
            bounced.functions().iter().zip(&toward).map(|(g, t)| g[sample] * of_even_sky(t)).sum::<f64>()
        })
    };
    for seen in of_floor(&|_| 1.0) {
        assert!((seen - full).abs() < 2e-3 * full, "white: {seen} of {full}");
    }
    let [blue, red] = of_floor(&|lambda_nm| if lambda_nm > 600.0 { 0.8 } else { 0.1 });
    assert!((blue - (0.9 * black + 0.1 * full)).abs() < 5e-3 * full, "blue of a red floor: {blue} of {full}");
    assert!((red - (0.2 * black + 0.8 * full)).abs() < 5e-3 * full, "red of a red floor: {red} of {full}");
}

/// The sharpest lobe is held, a sharper one is not.
#[test]
fn bands_hold_lobes_up_to_a_sharpness() {
    for (count, exponent) in [(3, 3.2), (4, 6.3), (5, 10.2)] {
        let sharpest = PhongLobe::sharpest(bands(count), 0.9).expect("a lobe");
        println!("{count} bands hold 9 tenths of an exponent of {:.1}", sharpest.exponent());
        assert!((sharpest.exponent() - exponent).abs() < 0.1, "{count}: {}", sharpest.exponent());
        assert!(sharpest.held_by(bands(count)) >= 0.9);
        assert!(lobe(1.01 * sharpest.exponent()).held_by(bands(count)) < 0.9);
    }
    assert_eq!(PhongLobe::sharpest(bands(1), 0.9), None, "one band holds the mean alone");
}

/// An exponent of 1 about the normal is the clamped cosine times 3 / (2 pi).
#[test]
fn a_lobe_of_exponent_1_is_a_cosine() {
    let cosine = cosine_lobe::degree_factors(Bands::MAX);
    for (lobe, cosine) in lobe(1.0).degree_factors(Bands::MAX).iter().zip(cosine) {
        assert!((lobe - 1.5 / PI * cosine).abs() < 1e-14, "{lobe} {cosine}");
    }
}

/// glTF's roughness: 1 is the broadest lobe, 0 as good as a mirror, whose factors are all 1.
#[test]
fn roughness_becomes_an_exponent() {
    assert_eq!(PhongLobe::of_roughness(1.0).exponent(), 0.0);
    assert!((PhongLobe::of_roughness(0.5).exponent() - 7.5).abs() < 1e-12);
    assert!((lobe(7.5).roughness() - 0.5).abs() < 1e-12);
    for factor in PhongLobe::of_roughness(0.0).degree_factors(Bands::MAX) {
        assert!((factor - 1.0).abs() < 1e-4, "{factor}");
    }
}

#[test]
fn what_makes_no_gloss_is_refused() {
    let open = transfer(&[probe()], 1);
    let text = |bands_of_light, lobes: &[Option<PhongLobe>]| {
        GlossTransfer::new(&open, bands(bands_of_light), lobes).expect_err("no gloss").to_string()
    };
    assert_eq!(text(6, &[None]), "a lobe under 6 bands of light needs transfer of 11 bands, this has 9");
    assert_eq!(
        text(5, &[]),
        "0 lobes for 1 surfaces; there is one for each, or none for what does not shine"
    );
    assert_eq!(text(5, &[None]), "no surface has a lobe; leave gloss out where nothing shines");
    for exponent in [-0.1, f64::NAN, 2e6] {
        let error = PhongLobe::new(exponent).expect_err("no lobe").to_string();
        assert_eq!(error, format!("a lobe of exponent {exponent}; 0 to 1000000 are possible"));
    }
}
