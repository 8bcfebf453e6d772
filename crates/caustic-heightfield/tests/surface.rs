//! The water surface: impulses, walls, the table of distances, the wave equation, files.

use std::f64::consts::FRAC_PI_2;

use caustic_heightfield::*;
use proptest::prelude::*;

const RIPPLE: Ripple = Ripple::PEBBLE;

fn pebble(x: f64, y: f64) -> Impulse {
    Impulse { position_m: [x, y], start_s: 0.0, amplitude_m: 0.01 }
}

fn heights(size: [usize; 2], impulses: &[Impulse], images: WallImages, time_s: f64) -> HeightField {
    impulse_heights(size, [1.0, 1.0], &RIPPLE, impulses, images, time_s).expect("a valid pond")
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn nothing_moves_ahead_of_the_wavefront_or_before_the_pebble_falls() {
    assert_eq!(RIPPLE.at(-0.1, 0.0), 0.0);
    assert_eq!(RIPPLE.at(1.0, 0.500001), 0.0);
    assert_ne!(RIPPLE.at(1.0, 0.499), 0.0);
    let early = heights([33, 17], &[pebble(0.3, 0.6)], WallImages::Four, -1.0);
    assert!(early.heights_m.iter().all(|&h| h == 0.0));
}

/// A factor of exp(-1) after 1 / alpha seconds at a fixed distance behind the front, and after 1 / beta metres behind it.
#[test]
fn damping_is_what_it_says() {
    let ripple = Ripple { wave_number_rad_m: 0.0, frequency_rad_s: 0.0, ..RIPPLE };
    // sin(0) is 0, so the envelope is read at the sine's top.
    let envelope = |t: f64, d: f64| {
        let k = (std::f64::consts::FRAC_PI_2) / d;
        Ripple { wave_number_rad_m: k, ..ripple }.at(t, d)
    };
    let ratio = envelope(1.0 + 1.0 / 0.4, 0.25 + 0.5 / 0.4) / envelope(1.0, 0.25);
    assert!((ratio - (-1.0_f64).exp()).abs() < 1e-12, "{ratio}");
    let ratio = envelope(2.0, 1.0 - 1.0 / 3.0) / envelope(2.0, 1.0);
    assert!((ratio - (-1.0_f64).exp()).abs() < 1e-12, "{ratio}");
}

/// The four images as the paper places them, and on a wall and in a corner.
#[test]
fn walls_mirror_impulses() {
    let at = |x: f64, y: f64, images: WallImages| {
        // The images as the heights show them: a pond with one pebble equals an unbounded one with all of them.
        heights([24, 24], &[pebble(x, y)], images, 1.2)
    };
    let four = at(0.2, 0.7, WallImages::Four);
    let by_hand = [(0.2, 0.7), (-0.2, 0.7), (1.8, 0.7), (0.2, -0.7), (0.2, 1.3)].map(|(x, y)| pebble(x, y));
    let unbounded = heights([24, 24], &by_hand, WallImages::None, 1.2);
    assert!(largest(four.heights_m.iter().zip(&unbounded.heights_m).map(|(a, b)| a - b)) < 1e-16);
    // On a wall, an image falls onto its original.
    let wall = at(0.0, 0.4, WallImages::Four);
    let twice = Impulse { amplitude_m: 0.02, ..pebble(0.0, 0.4) };
    let rest = [(2.0, 0.4), (0.0, -0.4), (0.0, 1.6)].map(|(x, y)| pebble(x, y));
    let unbounded = heights([24, 24], &[vec![twice], rest.to_vec()].concat(), WallImages::None, 1.2);
    assert!(largest(wall.heights_m.iter().zip(&unbounded.heights_m).map(|(a, b)| a - b)) < 1e-16);
    // In a corner with all images: four on one place, before other walls are reached.
    let corner = heights([24, 24], &[pebble(0.0, 0.0)], WallImages::Tiles(1), 1.2);
    let open = heights([24, 24], &[pebble(0.0, 0.0)], WallImages::None, 1.2);
    assert!(largest(open.heights_m.iter().copied()) > 1e-4);
    assert!(largest(corner.heights_m.iter().zip(&open.heights_m).map(|(a, b)| a - 4.0 * b)) < 1e-16);
}

/// With all images the surface is level where it meets a wall; with the paper's four it is not once corners matter.
#[test]
fn further_images_keep_the_surface_level_at_walls() {
    let slope = |images: WallImages| {
        // Samples just inside and, by the images of a pond twice as wide, just outside of the wall x = 0.
        let inside =
            impulse_heights([64, 64], [1.0, 1.0], &RIPPLE, &[pebble(0.3, 0.45)], images, 2.6).unwrap();
        let mirrored: Vec<Impulse> = vec![pebble(-0.3, 0.45)];
        let other = impulse_heights([64, 64], [1.0, 1.0], &RIPPLE, &mirrored, images, 2.6).unwrap();
        largest((0..64).map(|j| inside.heights_m[j * 64] - other.heights_m[j * 64]))
    };
    assert!(slope(WallImages::Tiles(2)) < 1e-15);
    assert!(slope(WallImages::Four) > 1e-5);
}

#[test]
fn thousands_of_impulses_add_up() {
    let many: Vec<Impulse> = (0..3000)
        .map(|i| Impulse {
            start_s: -f64::from(i % 7) * 0.1,
            ..pebble(f64::from(i % 61) / 61.0, f64::from(i % 53) / 53.0)
        })
        .collect();
    let all = heights([16, 16], &many, WallImages::Four, 0.5);
    let halves = [&many[..1500], &many[1500..]].map(|half| heights([16, 16], half, WallImages::Four, 0.5));
    let sum = halves[0].heights_m.iter().zip(&halves[1].heights_m).map(|(a, b)| a + b);
    assert!(largest(all.heights_m.iter().copied()) > 0.01);
    assert!(largest(all.heights_m.iter().zip(sum).map(|(a, b)| a - b)) < 1e-12);
}

/// The table agrees with direct evaluation to what its levels allow: half a level of distance times the steepest slope of h, and
/// to rounding where distances fall onto levels. An impulse on a sample, so that only the levels are to blame.
#[test]
fn distance_table_agrees_with_direct_evaluation() {
    let size = [48, 32];
    let on_sample = pebble(10.5 / 48.0, 20.5 / 32.0);
    let time_s = 0.8;
    let direct = heights(size, &[on_sample], WallImages::Four, time_s);
    let error = |levels: usize| {
        let table = DistanceTable::new(size, [1.0, 1.0], levels).unwrap();
        let by_table = heights_by_table(&table, &RIPPLE, &[on_sample], WallImages::Four, time_s).unwrap();
        let front_m = RIPPLE.front_m_s * time_s;
        // At the front h is discontinuous: a level on its other side is wrong by all of h. Those samples are left out.
        let near_front = |i: usize| {
            let [x, y] = [(i % 48) as f64 + 0.5, (i / 48) as f64 + 0.5];
            let d = (x / 48.0 - on_sample.position_m[0]).hypot(y / 32.0 - on_sample.position_m[1]);
            (d - front_m).abs() <= table.level_m()
        };
        let differences = (0..48 * 32).filter(|&i| !near_front(i));
        let worst = largest(differences.map(|i| direct.heights_m[i] - by_table.heights_m[i]));
        (worst, 0.5 * table.level_m() * 0.01 * (RIPPLE.wave_number_rad_m + RIPPLE.beta_per_m))
    };
    let (coarse, coarse_bound) = error(256);
    assert!(coarse <= coarse_bound, "{coarse} > {coarse_bound}");
    assert!(coarse > 0.01 * coarse_bound, "256 levels must show: {coarse}");
    let (fine, fine_bound) = error(1 << 20);
    assert!(fine <= fine_bound, "{fine} > {fine_bound}");
}

/// A standing wave between reflecting walls swings with its eigenfrequency and decays with the damping.
#[test]
fn wave_equation_swings_as_a_basin_does() {
    let size = [64, 48];
    let pi = std::f64::consts::PI;
    let mode = |x: f64, y: f64| 0.01 * (pi * 2.0 * x).cos() * (pi * y / 0.75).cos();
    let start = HeightField::from_fn(size, [1.0, 0.75], mode).unwrap();
    let (speed, damping) = (1.5, 0.3);
    let mut water = WaveEquation::new(start.clone(), speed, damping, Walls::Reflecting, 0.002).unwrap();
    for _ in 0..700 {
        water.advance();
    }
    let wave_number = pi * (4.0_f64 + 1.0 / 0.5625).sqrt();
    let swing = ((speed * wave_number).powi(2) - damping * damping).sqrt();
    let t = water.time_s();
    assert!((t - 1.4).abs() < 1e-12);
    let expected = (-damping * t).exp() * ((swing * t).cos() + damping / swing * (swing * t).sin());
    let error =
        largest(water.heights().heights_m.iter().zip(&start.heights_m).map(|(h, h0)| h - h0 * expected));
    // Second order: (k dx)^2 / 24 of the phase, some 9 turns.
    assert!(error < 0.01 * 0.02, "{error}");
}

#[test]
fn wave_equation_keeps_the_water() {
    for walls in [Walls::Reflecting, Walls::Periodic] {
        let mut water =
            WaveEquation::new(HeightField::flat([17, 9], [1.0, 0.6]).unwrap(), 1.0, 0.0, walls, 0.02)
                .unwrap();
        water.push(3, 8, 0.01);
        water.push(99, 1, 1.0);
        for _ in 0..200 {
            water.advance();
        }
        let total: f64 = water.heights().heights_m.iter().sum();
        assert!((total - 0.01).abs() < 1e-12, "{walls:?}: {total}");
        assert!(largest(water.heights().heights_m.iter().copied()) < 0.02);
    }
}

#[test]
fn unstable_time_steps_are_refused() {
    let flat = HeightField::flat([100, 1], [1.0, 1.0]).unwrap();
    let error = WaveEquation::new(flat, 2.0, 0.0, Walls::Periodic, 0.01).unwrap_err();
    assert!(error.to_string().contains("0.01 s is unstable"), "{error}");
}

#[test]
fn files_keep_heights_and_say_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("heights.exr");
    let waves = HeightField::from_fn([5, 3], [1.0, 0.5], |x, y| 0.01 * x - 0.25 * y).unwrap();
    waves.to_exr(&path).unwrap();
    let read = HeightField::from_exr(&path, [1.0, 0.5]).unwrap();
    assert_eq!(read.size, [5, 3]);
    for (a, b) in read.heights_m.iter().zip(&waves.heights_m) {
        assert_eq!(*a, f64::from(*b as f32));
    }
    // NaN and infinity, written past our own check.
    for (bad, word) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf")] {
        exr::prelude::write_rgb_file(&path, 3, 2, |x, y| {
            if (x, y) == (2, 1) { (bad, bad, bad) } else { (0.0, 0.0, 0.0) }
        })
        .unwrap();
        let error = HeightField::from_exr(&path, [1.0, 1.0]).unwrap_err().to_string();
        assert!(error.contains("channels") && error.contains("heights.exr"), "{error}");
        let mono = |_| bad;
        let channels = exr::prelude::SpecificChannels::build().with_channel("Y").with_pixel_fn(
            move |position: exr::prelude::Vec2<usize>| (if position.0 == 2 { mono(()) } else { 0.0_f32 },),
        );
        use exr::prelude::WritableImage;
        exr::prelude::Image::from_channels((3, 2), channels).write().to_file(&path).unwrap();
        let error = HeightField::from_exr(&path, [1.0, 1.0]).unwrap_err().to_string();
        assert!(error.contains("(2, 0)") && error.contains(word) && error.contains("finite"), "{error}");
    }
    std::fs::write(&path, b"").unwrap();
    let error = HeightField::from_exr(&path, [1.0, 1.0]).unwrap_err().to_string();
    assert!(error.contains("cannot be read as an EXR"), "{error}");
    assert!(HeightField::from_exr(&folder.path().join("absent.exr"), [1.0, 1.0]).is_err());
}

#[test]
fn grids_that_are_none_are_refused() {
    let text = |result: Result<HeightField, PondError>| result.unwrap_err().to_string();
    assert!(text(HeightField::from_rows(&[], [1.0, 1.0])).contains("0 x 0"));
    let ragged = [vec![0.0, 0.0], vec![0.0]];
    assert!(text(HeightField::from_rows(&ragged, [1.0, 1.0])).contains("row 1 has 1 values, row 0 has 2"));
    assert!(text(HeightField::from_values([2, 2], [1.0, 1.0], vec![0.0; 3])).contains("needs 4"));
    assert!(
        text(HeightField::from_values([2, 1], [1.0, 1.0], vec![0.0, f64::NAN])).contains("(1, 0) is NaN")
    );
    assert!(text(HeightField::flat([2, 1], [1.0, 0.0])).contains("extent in y"));
    assert!(text(HeightField::flat([1 << 20, 1], [1.0, 1.0])).contains("16384"));
    let growing = Ripple { alpha_per_s: -1.0, ..RIPPLE };
    let grown = impulse_heights([2, 2], [1.0, 1.0], &growing, &[], WallImages::None, 0.0);
    assert!(text(grown).contains("alpha"));
    let nowhere =
        impulse_heights([2, 2], [1.0, 1.0], &RIPPLE, &[pebble(f64::NAN, 0.0)], WallImages::None, 0.0);
    assert!(text(nowhere).contains("x of an impulse"));
}

proptest! {
    /// Any size, 1 and odd ones too: finite heights, and the mirrored pebble makes the mirrored wave.
    #[test]
    fn mirrored_pebbles_make_mirrored_waves(
        width in 1_usize..40, height in 1_usize..40, x in 0.0..1.0, y in 0.0..1.0, time_s in -1.0..6.0,
    ) {
        let left = heights([width, height], &[pebble(x, y)], WallImages::Tiles(1), time_s);
        let right = heights([width, height], &[pebble(1.0 - x, y)], WallImages::Tiles(1), time_s);
        for j in 0..height {
            for i in 0..width {
                let (a, b) = (left.heights_m[j * width + i], right.heights_m[j * width + width - 1 - i]);
                // A sample within rounding of the front may be on either side of it.
                let near_front = (a == 0.0) != (b == 0.0);
                prop_assert!(near_front || (a - b).abs() < 1e-12, "{a} {b}");
            }
        }
    }
}

/// A basin's first mode, and water into which a pebble falls, from a scene's file: the mode swings with the basin's frequency, a
/// pebble brings no water, and a step that is too long is refused.
#[test]
fn scenes_have_the_wave_equation() {
    let scene = |step_s: f64, from: Option<Surface>, pebbles: Vec<Pebble>| PondScene {
        extent_m: [1.0, 0.5],
        surface: Surface::WaveEquation(Swell {
            from: from.map(Box::new),
            pebbles,
            speed_m_s: 1.5,
            damping_per_s: 0.0,
            walls: Walls::Reflecting,
            step_s,
            time_s: 0.0,
        }),
        ..PondScene::default()
    };
    let size = [64, 32];
    let at = |scene: &PondScene, after_s: f64| {
        scene.heights(size, std::path::Path::new(""), Moment { frame: 0, after_s })
    };
    // cos(2 pi x / 1 m): two half waves across, which walls throw back; omega = 2 pi c.
    let wave = Wave { amplitude_m: 0.01, cycles: [1.0, 0.0], phase_rad: FRAC_PI_2, frequency_rad_s: 0.0 };
    let mode = scene(0.004, Some(Surface::Waves(vec![wave])), Vec::new());
    assert!(mode.varies() && !mode.has_own_grid());
    let start = at(&mode, 0.0).unwrap();
    for after_s in [0.1, 0.123_4, 0.5, 2.0] {
        let share = (std::f64::consts::TAU * 1.5 * after_s).cos();
        let now = at(&mode, after_s).unwrap();
        let worst = now.heights_m.iter().zip(&start.heights_m).map(|(h, h0)| (h - share * h0).abs());
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 3e-4, "{after_s} s: {worst} m");
    }
    assert_eq!(at(&mode, -1.0).unwrap(), start);

    let pebble = Pebble { position_m: [0.4, 0.2], start_s: 0.05, height_m: 0.01, radius_m: 0.03 };
    let falling = scene(0.005, None, vec![pebble]);
    let level = |after_s: f64| at(&falling, after_s).unwrap().heights_m;
    assert!(level(0.04).iter().all(|h| *h == 0.0));
    for after_s in [0.051, 0.2, 0.6] {
        let heights = level(after_s);
        let (mean, highest) =
            (heights.iter().sum::<f64>() / 2048.0, heights.iter().copied().fold(0.0, f64::max));
        assert!(mean.abs() < 1e-6 && highest > 2e-4, "{after_s} s: {mean} {highest}");
    }
    // Control: what has no trough brings water.
    let hump = HeightField::from_fn(size, [1.0, 0.5], |x, y| {
        0.01 * (-((x - 0.4).powi(2) + (y - 0.2).powi(2)) / 0.0018).exp()
    });
    assert!(hump.unwrap().heights_m.iter().sum::<f64>() / 2048.0 > 5e-5);

    let refused = |scene: &PondScene, after_s: f64| at(scene, after_s).unwrap_err().to_string();
    // 1.5 m/s on cells of 1/64 m: 7.37 ms.
    let unstable = refused(&scene(0.008, None, Vec::new()), 1.0);
    assert!(unstable.contains("unstable") && unstable.contains("0.00736"), "{unstable}");
    assert!(refused(&scene(1e-7, None, Vec::new()), 1.0).contains("number of steps"));
    let early = scene(0.005, None, vec![Pebble { start_s: -1.0, ..pebble }]);
    assert!(refused(&early, 1.0).contains("start of a pebble"));
    let no_hump = scene(0.005, None, vec![Pebble { radius_m: 0.0, ..pebble }]);
    assert!(refused(&no_hump, 1.0).contains("radius"));
}
