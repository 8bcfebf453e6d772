//! The light on the pond's floor as one plan on every executor: against the integral in f64, and against each other.

use std::f64::consts::TAU;

use caustic_heightfield::*;
use frame_plan::Executor;
use spectral_core::light::LightSpectrum;
use spectral_core::observer::Observer;
use spectral_core::rgb::D65_WHITE_XYZ;
use workspace_tests::pond_executors;

/// Relative RMS that the same plan may differ by between the CPU and a device: what f32 leaves of some thousand sums.
const PARITY: f64 = 1e-5;

fn waves(size: [usize; 2], amplitude_m: f64) -> HeightField {
    HeightField::from_fn(size, [1.0, 1.0], |x, y| {
        let second = (TAU * (5.0 * x - 4.0 * y) + 1.0).sin();
        amplitude_m * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * second)
    })
    .expect("finite waves")
}

fn pond(tilt_deg: f64, scattering: f64) -> Pond {
    Pond { scattering, light_direction: light_tilted_deg(tilt_deg), ..Pond::default() }
}

fn convolution(size: [usize; 2], pond: &Pond, settings: ConvolutionSettings) -> Convolution<f32> {
    Convolution::new(size, [1.0, 1.0], pond, settings).expect("a valid pond")
}

fn low_rank(surface: &HeightField, pond: &Pond) -> LowRank<f32> {
    LowRank::new(std::slice::from_ref(surface), pond, LowRankSettings::default()).expect("few enough terms")
}

/// What a frame is told.
enum Inputs<'a> {
    Surface(&'a HeightField),
    Impulses(&'a Ripple, &'a [Impulse], f64),
}

/// What every executor makes of a plan: twice the same bits on each, the same bits on one driver, near each other on two.
fn on_all(name: &str, plan: &PondPlan, inputs: &Inputs<'_>) -> Vec<(&'static str, PondFrame)> {
    let mut frames: Vec<(&'static str, String, PondFrame)> = Vec::new();
    for (id, mut executor) in pond_executors() {
        let executor = executor.as_mut();
        executor.prepare(&plan.plan).unwrap_or_else(|error| panic!("{name} on {id}: {error}"));
        let written = match inputs {
            Inputs::Surface(surface) => plan.write_heights(executor, surface),
            Inputs::Impulses(ripple, impulses, time_s) => {
                plan.write_impulses(executor, ripple, impulses, WallImages::Four, *time_s)
            }
        };
        written.unwrap_or_else(|error| panic!("{name} on {id}: {error}"));
        let mut frame = || {
            executor.execute().unwrap_or_else(|error| panic!("{name} on {id}: {error}"));
            plan.read(executor).unwrap_or_else(|error| panic!("{name} on {id}: {error}"))
        };
        let (first, second) = (frame(), frame());
        assert_eq!(first.light.irradiance, second.light.irradiance, "{name}: {id} gave two floors");
        assert_eq!(first.light.report, second.light.report, "{name}: {id} gave two reports");
        frames.push((id, executor.info().to_string(), second));
    }
    let (_, _, reference) = &frames[0];
    for (i, (id, device, frame)) in frames.iter().enumerate() {
        assert!(frame.light.irradiance.iter().all(|e| e.is_finite()), "{name} on {id}");
        let error = relative_rms(&frame.light.irradiance, &reference.light.irradiance);
        assert!(error <= PARITY, "{name}: {id} is {error} from the CPU");
        for (other_id, _, other) in frames[..i].iter().filter(|(_, other, _)| other == device) {
            let equal = frame.light.irradiance == other.light.irradiance;
            assert!(equal, "{name}: {id} and {other_id}, on one driver");
            assert_eq!(frame.light.report, other.light.report, "{name}: {id} and {other_id}, on one driver");
        }
    }
    frames.into_iter().map(|(id, _, frame)| (id, frame)).collect()
}

/// A plan for the surface, on all.
fn floors(name: &str, plan: &PondPlan, surface: &HeightField) -> Vec<(&'static str, PondFrame)> {
    on_all(name, plan, &Inputs::Surface(surface))
}

/// Low-rank floors are the integral's to the error asked for, with light from anywhere; another refraction, another light or one
/// term less is not.
#[test]
fn low_rank_is_the_integral_on_every_executor() {
    for (tilt, scattering, amplitude) in [(0.0, 50.0, 0.004), (40.0, 50.0, 0.004), (40.0, 50.0, 0.01)] {
        let (surface, pond) = (waves([64, 64], amplitude), pond(tilt, scattering));
        let reference = exact(&surface, &pond, FloorGrid::below(&surface)).unwrap().irradiance;
        let method = low_rank(&surface, &pond);
        let plan = method.plan(&PlanSettings::default()).unwrap();
        let name = format!("{tilt} degrees, waves of {amplitude} m");
        for (id, frame) in floors(&name, &plan, &surface) {
            let error = relative_rms(&frame.light.irradiance, &reference);
            assert!(error < 0.011, "{name} on {id}: {error}");
            assert_eq!((frame.outside_states, frame.upward_beams), (0, 0), "{name} on {id}");
        }
        for (what, spoiled) in [
            ("index", Pond { ior_below: 1.4, ..pond.clone() }),
            ("light", Pond { light_direction: light_tilted_deg(tilt + 2.0), ..pond.clone() }),
            ("normals", Pond { normals: Normals::OneSided, ..pond.clone() }),
        ] {
            let mut plan = plan.clone();
            let (_, mut cpu) = pond_executors().swap_remove(0);
            cpu.prepare(&plan.plan).unwrap();
            plan.write_light(cpu.as_mut(), &spoiled).unwrap();
            plan.write_heights(cpu.as_mut(), &surface).unwrap();
            cpu.execute().unwrap();
            let spoiled = plan.read(cpu.as_mut()).unwrap().light.irradiance;
            assert!(relative_rms(&spoiled, &reference) > 0.011, "{name}: another {what} went unnoticed");
        }
    }
}

/// The paper's convolutions, in space and through spectra, in both forms and surroundings, on grids of any size.
#[test]
fn convolution_is_that_of_f64_on_every_executor() {
    let flat = pond(10.0, 30.0);
    let ponds = [
        flat.clone(),
        Pond { form: Form::Paper, normals: Normals::OneSided, ..flat.clone() },
        Pond { outside: Outside::Periodic, ..flat },
    ];
    for size in [[37, 50], [64, 32], [1, 1], [1, 19]] {
        for pond in &ponds {
            let surface = waves(size, 0.004);
            for (kernel_samples, convolve) in [(Some(7), Convolve::Spatial), (None, Convolve::Fft)] {
                let settings = ConvolutionSettings { kernel_samples, convolve };
                let method = Convolution::<f64>::new(size, [1.0, 1.0], pond, settings).unwrap();
                let expected = method.floor(&surface).unwrap();
                let plan = method.plan(&PlanSettings::default()).unwrap();
                let name = format!("{size:?}, {:?}, {:?}, {convolve:?}", pond.form, pond.outside);
                for (id, frame) in floors(&name, &plan, &surface) {
                    let error = relative_rms(&frame.light.irradiance, &expected.irradiance);
                    assert!(error < 2e-5, "{name} on {id}: {error}");
                    let (got, wanted) = (frame.light.report.surface, expected.report.surface);
                    for (got, wanted) in [
                        (got.incident_flux, wanted.incident_flux),
                        (got.transmitted_flux, wanted.transmitted_flux),
                        (got.steepest_slope, wanted.steepest_slope),
                    ] {
                        assert!((got - wanted).abs() <= 1e-4 * wanted, "{name} on {id}: {got} {wanted}");
                    }
                }
            }
        }
    }
    // A sample that is moved by a tenth of a millimetre is seen.
    let surface = waves([37, 50], 0.004);
    let plan = convolution([37, 50], &ponds[0], Default::default()).plan(&PlanSettings::default()).unwrap();
    let mut moved = surface.clone();
    moved.heights_m[700] += 1e-4;
    let [got, other] =
        [&surface, &moved].map(|s| floors("one sample", &plan, s).remove(0).1.light.irradiance);
    assert!(relative_rms(&other, &got) > PARITY);
}

/// Light that varies over the surface (the paper's Fig. 3) does so on every executor.
#[test]
fn illumination_varies_on_every_executor() {
    let size = [37, 50];
    let ramp = (0..size[0] * size[1]).map(|i| 0.5 + (i % size[0]) as f64 / size[0] as f64).collect();
    let even = pond(10.0, 30.0);
    let mapped = Pond { illumination: Illumination::Map(ramp), ..even.clone() };
    let surface = waves(size, 0.004);
    let floor = |pond| {
        let method = Convolution::<f64>::new(size, [1.0, 1.0], pond, Default::default()).unwrap();
        method.floor(&surface).unwrap().irradiance
    };
    let (expected, uniform) = (floor(&mapped), floor(&even));
    let plan = convolution(size, &mapped, Default::default()).plan(&PlanSettings::default()).unwrap();
    for (id, frame) in floors("a ramp", &plan, &surface) {
        let error = relative_rms(&frame.light.irradiance, &expected);
        assert!(error < 2e-5, "{id}: {error}");
        assert!(relative_rms(&frame.light.irradiance, &uniform) > 0.1, "{id} has uniform light");
    }
}

/// Level water over a floor that goes on for ever: the light is the same everywhere, to rounding.
#[test]
fn level_water_lights_its_floor_evenly() {
    for size in [[32, 32], [21, 35]] {
        let flat = HeightField::flat(size, [1.0, 1.0]).unwrap();
        let pond = Pond { outside: Outside::Periodic, ..pond(30.0, 20.0) };
        let plans = [
            ("convolution", convolution(size, &pond, Default::default()).plan(&PlanSettings::default())),
            ("low-rank", low_rank(&flat, &pond).plan(&PlanSettings::default())),
        ];
        for (name, plan) in plans {
            for (id, frame) in floors(name, &plan.unwrap(), &flat) {
                let e = &frame.light.irradiance;
                let (low, high) = e.iter().fold((f64::MAX, f64::MIN), |(l, h), &e| (l.min(e), h.max(e)));
                assert!((high - low) / high < 5e-6, "{name} {size:?} on {id}: {low} to {high}");
            }
        }
    }
}

/// Milk, and water that is no water: a = 0 and n_i = n_t.
#[test]
fn limits_of_the_water_are_met() {
    let surface = waves([48, 40], 0.004);
    for (name, pond) in [
        ("a = 0", pond(20.0, 0.0)),
        ("n_i = n_t", Pond { ior_below: 1.0, ..pond(20.0, 40.0) }),
        ("n_i > n_t", Pond { ior_above: 1.333, ior_below: 1.0, ..pond(20.0, 20.0) }),
        ("no extinction", Pond { extinction_per_m: 0.0, ..pond(20.0, 40.0) }),
        ("d comparable to h", Pond { depth_m: 0.03, ..pond(0.0, 5.0) }),
    ] {
        let reference = exact(&surface, &pond, FloorGrid::below(&surface)).unwrap();
        let plan = low_rank(&surface, &pond).plan(&PlanSettings::default()).unwrap();
        for (id, frame) in floors(name, &plan, &surface) {
            let error = relative_rms(&frame.light.irradiance, &reference.irradiance);
            assert!(error < 0.011, "{name} on {id}: {error}");
            let (got, wanted) = (frame.light.report.surface, reference.report.surface);
            assert_eq!(got.totally_reflected, wanted.totally_reflected, "{name} on {id}");
            if name == "n_i = n_t" {
                let share = got.transmitted_flux / got.incident_flux;
                assert!((share - 1.0).abs() < 1e-6, "{id}: {share} passes what is no surface");
            }
        }
    }
}

/// Water without depth has no kernels on any executor, and a surface on the floor is refused before a frame.
#[test]
fn no_depth_is_refused() {
    let grounded = Pond { depth_m: 0.0, ..pond(0.0, 50.0) };
    assert!(Convolution::<f32>::new([8, 8], [1.0, 1.0], &grounded, Default::default()).is_err());
    let flat = HeightField::flat([8, 8], [1.0, 1.0]).unwrap();
    assert!(LowRank::<f32>::new(&[flat], &grounded, Default::default()).is_err());
}

/// Light that grazes steep waves leaves what is behind crests dark: as many samples as the f64 march finds, but for those at the
/// shadow's very edge.
#[test]
fn crests_throw_shadows() {
    for outside in [Outside::Dark, Outside::Periodic] {
        let surface = waves([64, 64], 0.02);
        let pond =
            Pond { outside, scattering: 10.0, light_direction: light_tilted_deg(75.0), ..Pond::default() };
        let settings = ConvolutionSettings { kernel_samples: Some(9), ..Default::default() };
        let expected =
            Convolution::<f64>::new([64, 64], [1.0, 1.0], &pond, settings).unwrap().floor(&surface).unwrap();
        let wanted = expected.report.surface;
        assert!(wanted.self_shadowed > 100 && wanted.turned_away > 100, "{wanted:?}");
        let plan = convolution([64, 64], &pond, settings).plan(&PlanSettings::default()).unwrap();
        for (id, frame) in floors("grazing light", &plan, &surface) {
            let got = frame.light.report.surface;
            assert!(got.self_shadowed.abs_diff(wanted.self_shadowed) <= 4, "{id}: {got:?} {wanted:?}");
            assert_eq!(got.turned_away, wanted.turned_away, "{id}");
            assert_eq!(got.past_45_degrees, wanted.past_45_degrees, "{id}");
        }
    }
}

/// Impulses anywhere and at any time, and thousands of them, make the heights that they make in f64.
#[test]
fn impulses_are_the_same_waves_on_every_executor() {
    let impulse =
        |x: f64, y: f64, start_s: f64, amplitude_m: f64| Impulse { position_m: [x, y], start_s, amplitude_m };
    let thousands: Vec<Impulse> = (0..3000)
        .map(f64::from)
        .map(|i| impulse((0.618 * i).fract(), (0.414 * i).fract(), 0.0002 * i, 5e-5))
        .collect();
    let cases: [(&str, &[Impulse], f64); 6] = [
        ("in the middle", &[impulse(0.4, 0.6, 0.0, 0.003)], 0.8),
        ("on a wall", &[impulse(0.0, 0.5, 0.0, 0.003)], 0.8),
        ("in a corner", &[impulse(1.0, 0.0, 0.0, 0.003)], 0.8),
        ("before it falls", &[impulse(0.4, 0.6, 0.0, 0.003)], -0.5),
        ("hours later", &[impulse(0.4, 0.6, 10_000.0, 0.003)], 10_000.9),
        ("thousands", &thousands, 1.0),
    ];
    let (size, pond) = ([30, 25], pond(0.0, 30.0));
    let method = convolution(size, &pond, Default::default());
    for levels in [None, Some(256)] {
        let heights = HeightSource::Impulses { capacity: 15_000, distance_levels: levels };
        let settings = PlanSettings { heights, refraction_entries: levels, ..PlanSettings::default() };
        let plan = method.plan(&settings).unwrap();
        for (name, impulses, time_s) in cases {
            if levels.is_some() && impulses.len() > 1 {
                continue;
            }
            let four = WallImages::Four;
            let surface = match levels {
                None => impulse_heights(size, [1.0, 1.0], &Ripple::PEBBLE, impulses, four, time_s),
                Some(levels) => {
                    let table = DistanceTable::new(size, [1.0, 1.0], levels).unwrap();
                    heights_by_table(&table, &Ripple::PEBBLE, impulses, four, time_s)
                }
            };
            let expected = method.floor(&surface.unwrap()).unwrap();
            for (id, frame) in on_all(name, &plan, &Inputs::Impulses(&Ripple::PEBBLE, impulses, time_s)) {
                let error = relative_rms(&frame.light.irradiance, &expected.irradiance);
                // Tables of Gamma and T err by themselves.
                let bound = if levels.is_some() { 1e-3 } else { 1e-4 };
                assert!(error < bound, "{name} on {id}, {levels:?}: {error}");
            }
            if name == "in the middle" {
                let later = Inputs::Impulses(&Ripple::PEBBLE, impulses, time_s + 0.01);
                for (id, frame) in on_all("10 ms later", &plan, &later) {
                    let error = relative_rms(&frame.light.irradiance, &expected.irradiance);
                    assert!(error > 2e-3, "10 ms went unnoticed on {id}, {levels:?}: {error}");
                }
            }
        }
    }
}

/// Waves down to the floor, which only the device knows of, are refused when the frame is read.
#[test]
fn impulses_that_touch_the_floor_are_refused() {
    let (size, pond) = ([30, 20], pond(0.0, 30.0));
    let heights = HeightSource::Impulses { capacity: 5, distance_levels: None };
    let plan = convolution(size, &pond, Default::default());
    let plan = plan.plan(&PlanSettings { heights, ..PlanSettings::default() }).unwrap();
    for (id, mut executor) in pond_executors() {
        let executor = executor.as_mut();
        executor.prepare(&plan.plan).unwrap();
        for amplitude_m in [0.003, 1.0] {
            let pebble = Impulse { position_m: [0.4, 0.6], start_s: 0.0, amplitude_m };
            plan.write_impulses(executor, &Ripple::PEBBLE, &[pebble], WallImages::Four, 0.8).unwrap();
            executor.execute().unwrap();
            let read = plan.read(executor).map(|_| ());
            let surface =
                impulse_heights(size, [1.0, 1.0], &Ripple::PEBBLE, &[pebble], WallImages::Four, 0.8).unwrap();
            match (surface.heights_m.iter().filter(|&&h| h <= -pond.depth_m).count(), read) {
                (0, Ok(())) => assert_eq!(amplitude_m, 0.003, "{id}"),
                (expected, Err(PondError::Grounded { got, samples: 600 })) => {
                    assert!(amplitude_m == 1.0 && got.abs_diff(expected) <= 1, "{id}: {got} {expected}");
                }
                (expected, read) => panic!("{id}: {expected} samples on the floor, and {read:?}"),
            }
        }
    }
}

/// What a host shows is the light on the floor, in the light's colour, to the bit.
#[test]
fn the_picture_is_the_floor_in_the_lights_colour() {
    let (size, pond) = ([40, 30], pond(0.0, 30.0));
    let candle = LightSpectrum::cct(1900.0).unwrap().unit_xyz(Observer::default());
    let settings = PlanSettings { picture: Some(candle), ..PlanSettings::default() };
    let plan = convolution(size, &pond, Default::default()).plan(&settings).unwrap();
    for (id, mut executor) in pond_executors() {
        let executor = executor.as_mut();
        executor.prepare(&plan.plan).unwrap();
        let mut shown = |amplitude_m: f64| {
            plan.write_heights(executor, &waves(size, amplitude_m)).unwrap();
            executor.execute().unwrap();
            let irradiance = plan.read(executor).unwrap().light.irradiance;
            let bytes = executor.read(plan.picture().unwrap()).unwrap();
            let picture: Vec<[f32; 4]> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
            let white = candle.map(|w| w as f32);
            assert!(relative_rms(&candle, &D65_WHITE_XYZ) > 0.3, "a candle is no daylight");
            let floor: Vec<[f32; 4]> = irradiance
                .iter()
                .map(|&y| [white[0] * y as f32, white[1] * y as f32, white[2] * y as f32, 0.0])
                .collect();
            (picture, floor)
        };
        let (gentle, floor) = shown(0.004);
        assert!(gentle == floor, "{id}");
        let (steep, _) = shown(0.01);
        assert!(steep != floor, "{id}: another floor");
    }
    let without = convolution(size, &pond, Default::default()).plan(&PlanSettings::default()).unwrap();
    assert_eq!(without.picture(), None);
}

/// Pebbles fall, the sun moves: after the second frame nothing is made, and each frame is that of its own time.
#[test]
fn moving_frames_make_nothing() {
    let (size, pond) = ([40, 32], pond(0.0, 30.0));
    let heights = HeightSource::Impulses { capacity: 64, distance_levels: None };
    let settings = PlanSettings { heights, refraction_entries: Some(256), ..PlanSettings::default() };
    let still = convolution(size, &pond, Default::default()).plan(&settings).unwrap();
    let moved = |plan: &mut PondPlan, executor: &mut dyn Executor, frame: u32| {
        let pebble = |i: u32| Impulse {
            position_m: [0.1 * f64::from(i), 0.5],
            start_s: 0.05 * f64::from(i),
            amplitude_m: 0.002,
        };
        let pebbles: Vec<Impulse> = (0..=frame).map(pebble).collect();
        let sun = Pond { light_direction: light_tilted_deg(f64::from(frame)), ..pond.clone() };
        plan.write_light(executor, &sun).unwrap();
        let time_s = 0.3 + 0.1 * f64::from(frame);
        plan.write_impulses(executor, &Ripple::PEBBLE, &pebbles, WallImages::Four, time_s).unwrap();
        executor.execute().unwrap();
    };
    for (id, mut executor) in pond_executors() {
        let executor = executor.as_mut();
        let mut plan = still.clone();
        executor.prepare(&plan.plan).unwrap();
        let mut by_second = None;
        for frame in 0..8 {
            moved(&mut plan, executor, frame);
            if frame == 1 {
                by_second = Some(executor.made());
            }
        }
        assert_eq!(Some(executor.made()), by_second, "{id}");
        let last = plan.read(executor).unwrap().light.irradiance;
        // The same moment and the one before, each of a plan of its own.
        for (frame, is_last) in [(7, true), (6, false)] {
            let mut plan = still.clone();
            executor.prepare(&plan.plan).unwrap();
            moved(&mut plan, executor, frame);
            assert_eq!(plan.read(executor).unwrap().light.irradiance == last, is_last, "{id}: frame {frame}");
        }
    }
}
