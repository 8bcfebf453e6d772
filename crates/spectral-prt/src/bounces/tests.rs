use std::f64::consts::PI;

use glam::DVec3;
use spectral_core::color_checker;

use super::*;
use crate::transfer::precompute;

const GRID: SpectralGrid = SpectralGrid::SCHWENK_2010;

/// Walls of the unit cube seen from inside, each a smooth square of `n` by `n` quads; `open` leaves the ceiling out.
fn room(n: u32, open: bool) -> Vec<Surface> {
    let walls = [
        (DVec3::ZERO, DVec3::X, DVec3::Y),
        (DVec3::ZERO, DVec3::Y, DVec3::Z),
        (DVec3::ZERO, DVec3::Z, DVec3::X),
        (DVec3::X, DVec3::Z, DVec3::Y),
        (DVec3::Y, DVec3::X, DVec3::Z),
        (DVec3::Z, DVec3::Y, DVec3::X),
    ];
    walls[..if open { 5 } else { 6 }]
        .iter()
        .map(|&(corner, u, v)| {
            let step = 1.0 / f64::from(n);
            let at = |i: u32, j: u32| corner + u * (f64::from(i) * step) + v * (f64::from(j) * step);
            let positions: Vec<DVec3> =
                (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| at(i, j)).collect();
            let triangles: Vec<[u32; 3]> = (0..n)
                .flat_map(|j| (0..n).map(move |i| j * (n + 1) + i))
                .flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]])
                .collect();
            Surface::new(&positions, &vec![u.cross(v); positions.len()], &triangles).expect("a wall")
        })
        .collect()
}

fn direct(surfaces: &[Surface], bands: u8, rays: u32) -> Transfer {
    let settings = TransferSettings { bands: Bands::new(bands).expect("1 to 10"), rays };
    precompute(surfaces, &settings, &mut |_| {}).expect("good settings")
}

fn bounced(
    surfaces: &[Surface],
    direct: &Transfer,
    reflectances: &[Vec<f64>],
    settings: BounceSettings,
) -> SpectralTransfer {
    add_bounces(surfaces, direct, GRID, reflectances, &settings, &mut |_| {}).expect("good reflectances")
}

fn all(surfaces: &[Surface], reflectance: f64) -> Vec<Vec<f64>> {
    vec![GRID.sample(|_| reflectance); surfaces.len()]
}

/// Irradiance over pi under an even sky of radiance 1, for each vertex of a surface, at a wavelength.
fn under_even_sky(transfer: &SpectralTransfer, surface: usize, sample: usize) -> Vec<f64> {
    let n = transfer.bands().coefficients();
    transfer.at_sample(surface, sample).chunks(n).map(|t| t[0] * 2.0 * PI.sqrt() / PI).collect()
}

/// Weights of a wall's vertices by area, the integral of a function that is linear over each triangle.
fn areas(surface: &Surface) -> Vec<f64> {
    let mut areas = vec![0.0; surface.positions().len()];
    for t in surface.triangles() {
        let [a, b, c] = t.map(|v| surface.positions()[v as usize]);
        t.iter().for_each(|&v| areas[v as usize] += (b - a).cross(c - a).length() / 6.0);
    }
    areas
}

/// In a closed white box every bounce carries on all of the power there is: lit on one wall, and on one alone, five times
/// the power has arrived after four bounces.
#[test]
fn a_closed_white_box_conserves_energy() {
    let closed = room(8, false);
    let lit = Transfer {
        bands: Bands::new(1).unwrap(),
        vertices: vec![81; 6],
        coefficients: (0..6 * 81).map(|v| if v < 81 { 1.0 } else { 0.0 }).collect(),
    };
    let power = |reflectance, bounces| {
        let transfer =
            bounced(&closed, &lit, &all(&closed, reflectance), BounceSettings { rays: 1024, bounces });
        let of_wall = |s: usize| -> f64 {
            transfer.at_sample(s, 0).iter().zip(areas(&closed[s])).map(|(e, a)| e * a).sum()
        };
        (0..6).map(of_wall).sum::<f64>()
    };
    assert!((power(1.0, 0) - 1.0).abs() < 1e-6);
    let ratio = power(1.0, 4) / 5.0;
    println!("closed white box, four bounces: {ratio:.5} of the power is there");
    assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
    // The control: walls that absorb a hundredth are told apart.
    let less = power(0.99, 4) / 5.0;
    assert!(less < 0.99, "{less}");
}

/// Furnace with bounces: where nothing absorbs, an even sky is seen in every direction, directly or by reflection.
#[test]
fn an_open_white_box_shows_the_sky_everywhere() {
    let open = room(6, true);
    let transfer =
        bounced(&open, &direct(&open, 1, 1024), &all(&open, 1.0), BounceSettings { rays: 1024, bounces: 60 });
    assert_eq!(transfer.functions().len(), 1);
    let mut worst: f64 = 0.0;
    for surface in 0..5 {
        for e in under_even_sky(&transfer, surface, 30) {
            worst = worst.max((e - 1.0).abs());
        }
    }
    println!(
        "open white box, 60 bounces: within {worst:.5}, the last adds {:.1e}",
        transfer.last_bounce_share()
    );
    assert!(worst < 0.005, "{worst}");
    assert!(transfer.last_bounce_share() < 1e-4);
}

/// A wavelength at a time, coloured walls are grey ones of their reflectance there.
#[test]
fn spectral_transfer_is_grey_transfer_at_each_wavelength() {
    let open = room(3, true);
    let paints = color_checker::sampled(&GRID);
    // Blue, green, red, yellow and white walls.
    let walls = [12, 13, 14, 15, 18].map(|p| paints[p].clone()).to_vec();
    let direct = direct(&open, 3, 256);
    let settings = BounceSettings { rays: 256, bounces: 3 };
    let spectral = bounced(&open, &direct, &walls, settings);
    println!("five paints, three bounces: {} functions", spectral.functions().len());
    for sample in [0, 17, 30, 44, 60] {
        let greys: Vec<Vec<f64>> = walls.iter().map(|w| GRID.sample(|_| w[sample])).collect();
        let grey = bounced(&open, &direct, &greys, settings);
        for surface in 0..5 {
            for (a, b) in spectral.at_sample(surface, sample).iter().zip(grey.at_sample(surface, 0)) {
                assert!((a - b).abs() < 2e-5, "{sample} {surface} {a} {b}");
            }
        }
    }
    // There is colour: the white wall takes more red than blue from its neighbours.
    let mean = |sample| under_even_sky(&spectral, 4, sample).iter().sum::<f64>();
    assert!(mean(44) > 1.02 * mean(10), "{} {}", mean(44), mean(10));
}

#[test]
fn black_walls_and_no_bounces_change_nothing_and_backs_are_black() {
    let open = room(3, true);
    let direct = direct(&open, 2, 256);
    let same = |transfer: SpectralTransfer| {
        for surface in 0..5 {
            for (a, b) in transfer.at_sample(surface, 7).iter().zip(direct.surface(surface)) {
                assert!((a - f64::from(*b)).abs() < 1e-6, "{a} {b}");
            }
        }
    };
    same(bounced(&open, &direct, &all(&open, 0.0), BounceSettings { rays: 256, bounces: 3 }));
    same(bounced(&open, &direct, &all(&open, 0.8), BounceSettings { rays: 256, bounces: 0 }));
    // A floor under a lid that looks upwards sees the lid's back.
    let square = |z: f64| {
        let corners = [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]].map(DVec3::from);
        Surface::new(&corners, &[DVec3::Z; 4], &[[0, 1, 2], [0, 2, 3]]).expect("a square")
    };
    let shelf = [square(0.0), square(0.5)];
    let direct =
        precompute(&shelf, &TransferSettings { bands: Bands::default(), rays: 512 }, &mut |_| {}).unwrap();
    let transfer = bounced(&shelf, &direct, &all(&shelf, 1.0), BounceSettings { rays: 512, bounces: 2 });
    for (a, b) in transfer.at_sample(0, 0).iter().zip(direct.surface(0)) {
        assert!((a - f64::from(*b)).abs() < 1e-6);
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let open = room(4, true);
    let walls = [12, 13, 14, 15, 18].map(|p| color_checker::sampled(&GRID)[p].clone()).to_vec();
    let direct = direct(&open, 2, 64);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bounced(&open, &direct, &walls, BounceSettings { rays: 64, bounces: 2 }))
    };
    assert_eq!(with(1), with(5));
}

#[test]
fn bad_requests_are_refused_with_the_numbers() {
    let open = room(2, true);
    let direct = direct(&open, 2, 4);
    let refused = |direct: &Transfer, reflectances: &[Vec<f64>], bounces| {
        let settings = BounceSettings { rays: 4, bounces };
        add_bounces(&open, direct, GRID, reflectances, &settings, &mut |_| {}).expect_err("bad").to_string()
    };
    let good = all(&open, 0.5);
    assert_eq!(refused(&direct, &good, 257), "257 bounces; 0 to 256 are possible");
    assert_eq!(refused(&direct, &good[1..], 1), "4 reflectances for 5 surfaces; there is one for each");
    let other =
        precompute(&open[..2], &TransferSettings { bands: Bands::default(), rays: 1 }, &mut |_| {}).unwrap();
    assert_eq!(
        refused(&other, &good, 1),
        "the direct transfer has 450 numbers, these surfaces and bands need 1125"
    );
    for bad in [1.5, -0.5, f64::NAN] {
        let mut walls = good.clone();
        walls[3][9] = bad;
        let settings = BounceSettings { rays: 4, bounces: 1 };
        let refused = add_bounces(&open, &direct, GRID, &walls, &settings, &mut |_| {}).unwrap_err();
        assert!(matches!(refused, PrtError::Reflectance { surface: 3, .. }), "{refused}");
    }
}
