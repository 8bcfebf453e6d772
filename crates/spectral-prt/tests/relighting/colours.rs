//! Physics: what colours must be.

use frame_plan::Executor;
use glam::{DMat3, DVec3};
use spectral_core::basis::SpectralBasis;
use spectral_core::color_checker;
use spectral_core::illuminant::Illuminant;
use spectral_core::patch::{Shown, light_xyz, sampled_xyz};
use spectral_core::rgb::D65_WHITE_XYZ;
use spectral_prt::{Albedo, Exposure, IndexMap, Projection, RelightingSettings, Shot, SpectralMap};

use crate::stage::*;

/// White furnace: nothing but the illuminant's colour, on any spectral basis and under a line it was not trained on.
#[test]
fn an_unoccluded_white_ball_under_an_even_sky_shows_the_illuminant() {
    let surfaces = [ball(DMat3::IDENTITY, true)];
    let transfer = transfer(&surfaces, 1);
    let white = [GRID.sample(|_| 1.0)];
    let camera = camera(DVec3::new(1.0, 2.0, 4.0));
    let mut lights: Vec<Vec<f64>> =
        [Illuminant::A, Illuminant::D65, Illuminant::Fl4, Illuminant::Fl11].map(light).to_vec();
    lights.push(GRID.line(546.1).expect("on the grid"));
    let mut worst: f64 = 0.0;
    for coefficients in [3, 5, 8] {
        let basis = basis(coefficients);
        let projection = Projection::Spectral(&basis);
        let stage = Stage::new(&surfaces, &transfer, &projection, &white);
        for light in &lights {
            let truth = light_xyz(&GRID, OBSERVER, light);
            let sky = even(&projection.light(light));
            let picture = stage.picture(&shot(&sky, &camera));
            assert!(seen(&picture).count() > 150, "the ball is seen");
            for xyz in seen(&picture) {
                for c in 0..3 {
                    worst = worst.max((xyz[c] - truth[c]).abs() / truth[1]);
                }
            }
        }
    }
    println!("white furnace, largest error of X, Y, Z over Y: {worst:.1e}");
    assert!(worst < 1e-5, "{worst}");
    // A white that is not quite white does not pass.
    let basis = basis(5);
    let projection = Projection::Spectral(&basis);
    let grey = [GRID.sample(|_| 0.9999)];
    let sky = even(&projection.light(&lights[1]));
    let picture = Stage::new(&surfaces, &transfer, &projection, &grey).picture(&shot(&sky, &camera));
    let truth = light_xyz(&GRID, OBSERVER, &lights[1]);
    assert!(seen(&picture).all(|xyz| (xyz[1] - truth[1]).abs() > 5e-5 * truth[1]));
}

/// The share of a pixel that a white ball does not cover is what an even sky of luminance 1 lacks of 1 there; at the silhouette it is
/// neither 0 nor 1.
#[test]
fn what_no_surface_covers_is_told() {
    let surfaces = [ball(DMat3::IDENTITY, true)];
    let transfer = transfer(&surfaces, 1);
    let stage = Stage::new(&surfaces, &transfer, &RGB, &[GRID.sample(|_| 1.0)]);
    let stage = Stage { settings: RelightingSettings { samples: 3, ..stage.settings }, ..stage };
    let (sky, camera) = (even(&[1.0; 3]), camera(DVec3::new(1.0, 2.0, 4.0)));
    let relighting = stage.plan(&shot(&sky, &camera)).expect("a plan");
    let mut executor = executor(&relighting);
    executor.execute().expect("a frame");
    let (picture, uncovered) = relighting.read_with_uncovered(&mut executor).expect("a picture");
    for (xyz, share) in picture.xyz.iter().zip(&uncovered) {
        assert!((xyz[1] + share - 1.0).abs() < 1e-5, "{xyz:?} {share}");
    }
    let partly = uncovered.iter().filter(|share| (0.01..0.99).contains(*share)).count();
    let [all, none] = [0.0, 1.0].map(|whole| uncovered.iter().filter(|share| **share == whole).count());
    assert!(partly > 20 && all > 100 && none > 100, "{all} {partly} {none}");
}

/// A chart by an index map: every patch where it belongs, with the colour that the basis gives it, and white-balanced.
#[test]
fn a_chart_shows_its_patches() {
    let (surface, uvs) = square();
    let surfaces = [surface];
    let transfer = transfer(&surfaces, 1);
    let reflectances = color_checker::sampled(&GRID);
    let basis = basis(5);
    let camera = camera(DVec3::new(0.0, 0.0, 4.0));
    let fl4 = light(Illuminant::Fl4);
    let white = light_xyz(&GRID, OBSERVER, &fl4);
    let balance = Shown::under(white).expect("a white");
    let mean_and_max = |projection: Projection<'_>| {
        let mut stage = Stage::new(&surfaces, &transfer, &projection, &reflectances);
        stage.settings = RelightingSettings { size: [96, 64], samples: 1 };
        stage.index_maps = vec![IndexMap::new([6, 4], (0..24).collect()).expect("24 texels")];
        stage.albedos = vec![Albedo::Indexed { map: 0, uvs: uvs.clone() }];
        let sky = even(&projection.light(&fl4));
        let exposure = Exposure { factor: 1.0, balance: Some(balance) };
        let picture = stage.picture(&Shot { exposure, ..shot(&sky, &camera) });
        // The square's middle row and column are the picture's; its half is this many pixels.
        let half = 32.0 / (4.0 * (0.5 * camera.yfov_rad).tan());
        let errors: Vec<f64> = (0..24)
            .map(|patch| {
                let (column, row) = (f64::from(patch % 6), f64::from(patch / 6));
                let x = 48.0 + half * ((column + 0.5) / 3.0 - 1.0);
                let y = 32.0 + half * ((row + 0.5) / 2.0 - 1.0);
                let xyz = picture.xyz[y as usize * 96 + x as usize].map(f64::from);
                let reflectance = &reflectances[patch as usize];
                let of_basis = spectral_core::mat3::apply(
                    &balance.display_from_light(),
                    SpectralBasis::xyz(&projection.albedo(reflectance)[0], &projection.light(&fl4)),
                );
                for c in 0..3 {
                    assert!((xyz[c] - of_basis[c]).abs() < 1e-5, "patch {patch}: {xyz:?} {of_basis:?}");
                }
                let truth = sampled_xyz(&GRID, OBSERVER, reflectance, &fl4);
                let shown = spectral_core::mat3::apply(&balance.display_from_light(), truth);
                let lab = |xyz| spectral_core::color::lab_from_xyz(xyz, D65_WHITE_XYZ);
                spectral_core::color::delta_e_94(lab(shown), lab(xyz))
            })
            .collect();
        (errors.iter().sum::<f64>() / 24.0, errors.into_iter().fold(0.0, f64::max))
    };
    let (mean, max) = mean_and_max(Projection::Spectral(&basis));
    let (rgb_mean, rgb_max) = mean_and_max(RGB);
    println!("chart under FL4: 5 coefficients {mean:.3} / {max:.3}, RGB {rgb_mean:.3} / {rgb_max:.3}");
    assert!(mean <= 0.1 && max <= 0.5, "{mean} {max}");
    assert!((rgb_mean - 8.2).abs() < 0.1 && (rgb_max - 28.8).abs() < 0.3, "{rgb_mean} {rgb_max}");
}

/// A spectral map of two paints is linear between them, and goes on beyond its edges.
#[test]
fn a_spectral_map_is_linear_between_texels() {
    let (surface, uvs) = square();
    let surfaces = [surface];
    let transfer = transfer(&surfaces, 1);
    let basis = basis(5);
    let projection = Projection::Spectral(&basis);
    let chart = color_checker::sampled(&GRID);
    let paints = [chart[12].clone(), chart[15].clone()];
    let mut stage = Stage::new(&surfaces, &transfer, &projection, &paints);
    let camera = camera(DVec3::new(0.0, 0.0, 4.0));
    let a = light(Illuminant::A);
    let sky = even(&projection.light(&a));
    let colours =
        paints.each_ref().map(|p| SpectralBasis::xyz(&basis.albedo_coefficients(p), &projection.light(&a)));
    let across = |stage: &Stage<'_>| {
        let picture = stage.picture(&shot(&sky, &camera));
        let row = 16 * 48;
        let half = 16.0 / (4.0 * (0.5 * camera.yfov_rad).tan());
        // u and the second paint's share of the colour.
        (0..48)
            .filter(|&x| picture.xyz[row + x] != [0.0; 3])
            .map(|x| {
                let u = 0.5 + (x as f64 + 0.5 - 24.0) / (2.0 * half);
                let xyz = picture.xyz[row + x].map(f64::from);
                (u, (xyz[1] - colours[0][1]) / (colours[1][1] - colours[0][1]))
            })
            .collect::<Vec<_>>()
    };
    let texels = vec![0, 1, 0, 1];
    stage.spectral_maps = vec![SpectralMap::new(&projection, [2, 2], texels, &paints).expect("four texels")];
    stage.albedos = vec![Albedo::Mapped { map: 0, uvs: uvs.clone() }];
    let seen = across(&stage);
    assert!(seen.len() > 12);
    for (u, share) in seen {
        // Texel centres are at 1/4 and 3/4; beyond, the other one comes again.
        let expected = 1.0 - (2.0 * (u - 0.25).rem_euclid(1.0) - 1.0).abs();
        assert!((share - expected).abs() < 1e-4, "{u}: {share} {expected}");
    }
    // An index map of the same two is not linear; beside a spectral map it does what it does without.
    stage.index_maps = vec![IndexMap::new([2, 1], vec![0, 1]).expect("two texels")];
    stage.albedos = vec![Albedo::Indexed { map: 0, uvs }];
    let nearest = across(&stage);
    stage.spectral_maps.clear();
    assert_eq!(nearest, across(&stage));
    for (u, share) in nearest {
        assert!((share - if u < 0.5 { 0.0 } else { 1.0 }).abs() < 1e-4, "{u}: {share}");
    }
}

/// An RGB texture under D65: what its report says of its colours is what the frame shows of them.
#[test]
fn an_rgb_texture_keeps_its_colours_as_far_as_it_says() {
    let (surface, uvs) = square();
    let surfaces = [surface];
    let transfer = transfer(&surfaces, 1);
    let camera = camera(DVec3::new(0.0, 0.0, 4.0));
    let d65 = light(Illuminant::D65);
    let balance = Shown::under(light_xyz(&GRID, OBSERVER, &d65)).expect("a white");
    let (five, eight) = (basis(5), basis(8));
    let levels = [0, 51, 128, 204, 255];
    let cube: Vec<[u8; 3]> = (0..125).map(|i| [levels[i % 5], levels[i / 5 % 5], levels[i / 25]]).collect();
    for (name, projection) in
        [("RGB", RGB), ("5", Projection::Spectral(&five)), ("8", Projection::Spectral(&eight))]
    {
        let (_, whole) = SpectralMap::from_srgb(&projection, [25, 5], &cube).expect("125 texels");
        println!(
            "{name}: CIE94 mean {:.3}, max {:.3} at {:?}",
            whole.delta_e_mean, whole.delta_e_max, whole.worst
        );
        let greys = [[0; 3], [100; 3], [255; 3]];
        let (_, of_greys) = SpectralMap::from_srgb(&projection, [3, 1], &greys).expect("3 texels");
        assert!(of_greys.colours == 3 && of_greys.delta_e_max < 1e-6, "{name}: {of_greys:?}");

        let worst = [whole.worst; 4];
        let (map, round_trip) = SpectralMap::from_srgb(&projection, [2, 2], &worst).expect("4 texels");
        assert_eq!((round_trip.colours, round_trip.delta_e_max), (1, whole.delta_e_max));
        let mut stage = Stage::new(&surfaces, &transfer, &projection, &[GRID.sample(|_| 1.0)]);
        stage.spectral_maps = vec![map];
        stage.albedos = vec![Albedo::Mapped { map: 0, uvs: uvs.clone() }];
        let exposure = Exposure { factor: 1.0, balance: Some(balance) };
        let sky = even(&projection.light(&d65));
        let picture = stage.picture(&Shot { exposure, ..shot(&sky, &camera) });
        let lab = |xyz| spectral_core::color::lab_from_xyz(xyz, D65_WHITE_XYZ);
        let linear = whole.worst.map(|c| spectral_core::display::linear_from_srgb(f64::from(c) / 255.0));
        let asked = lab(spectral_core::rgb::xyz_from_linear_srgb(linear));
        for xyz in seen(&picture) {
            let difference = spectral_core::color::delta_e_94(asked, lab(xyz));
            assert!((difference - whole.delta_e_max).abs() < 1e-3, "{name}: {difference} {whole:?}");
        }
    }
}

#[test]
fn an_index_map_goes_on_beyond_its_edges() {
    let map = IndexMap::new([3, 2], vec![0, 1, 2, 3, 4, 5]).expect("six texels");
    for (uv, entry) in [
        ([0.0, 0.0], 0),
        ([0.34, 0.49], 1),
        ([0.99, 0.51], 5),
        ([1.0, 0.0], 0),
        ([-0.01, -0.01], 5),
        ([7.5, 3.75], 4),
        ([-1e-20, 0.0], 2),
    ] {
        assert_eq!(map.nearest(uv), entry, "{uv:?}");
    }
}
