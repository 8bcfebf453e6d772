//! Plans on the CPU executor against the methods that they are made of, and what they may be given.

use std::f64::consts::TAU;

use caustic_heightfield::*;
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;

fn waves(size: [usize; 2], amplitude_m: f64) -> HeightField {
    HeightField::from_fn(size, [1.0, 1.0], |x, y| {
        let second = (TAU * (5.0 * x - 4.0 * y) + 1.0).sin();
        amplitude_m * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * second)
    })
    .expect("finite waves")
}

fn started(plan: &PondPlan) -> CpuExecutor {
    let mut cpu = CpuExecutor::new(PASSES, Some(2)).expect("a CPU");
    cpu.prepare(&plan.plan).expect("a valid plan");
    cpu
}

fn floor(plan: &PondPlan, cpu: &mut CpuExecutor, surface: &HeightField) -> PondFrame {
    plan.write_heights(cpu, surface).expect("heights of the plan's grid");
    cpu.execute().expect("a frame");
    plan.read(cpu).expect("a floor")
}

fn ponds() -> Vec<Pond> {
    let tilted = Pond { scattering: 50.0, light_direction: light_tilted_deg(20.0), ..Pond::default() };
    vec![
        tilted.clone(),
        Pond { form: Form::Paper, normals: Normals::OneSided, ..tilted.clone() },
        Pond { outside: Outside::Periodic, ior_above: 1.5, ..tilted },
    ]
}

#[test]
fn the_papers_plan_gives_the_papers_floor() {
    for size in [[48, 33], [1, 1], [1, 40]] {
        for pond in ponds() {
            let surface = waves(size, 0.004);
            let settings = ConvolutionSettings { kernel_samples: Some(9), ..Default::default() };
            let method = Convolution::<f64>::new(size, [1.0, 1.0], &pond, settings).unwrap();
            let expected = method.floor(&surface).unwrap();
            let plan = method.plan(&PlanSettings::default()).unwrap();
            let got = floor(&plan, &mut started(&plan), &surface).light;
            let error = relative_rms(&got.irradiance, &expected.irradiance);
            assert!(error < 2e-5, "{size:?} {:?} {:?}: {error}", pond.form, pond.outside);
            let (a, b) = (got.report.surface, expected.report.surface);
            assert!((a.transmitted_flux / b.transmitted_flux - 1.0).abs() < 1e-5, "{a:?} {b:?}");
            assert!((a.incident_flux / b.incident_flux - 1.0).abs() < 1e-5, "{a:?} {b:?}");
            assert!((a.steepest_slope - b.steepest_slope).abs() < 1e-4, "{a:?} {b:?}");
        }
    }
}

#[test]
fn low_rank_plans_give_low_rank_floors() {
    for pond in ponds() {
        let surface = waves([48, 33], 0.004);
        let method = LowRank::<f32>::new(std::slice::from_ref(&surface), &pond, LowRankSettings::default());
        let method = method.unwrap();
        let expected = method.floor(&surface).unwrap().light;
        let plan = method.plan(&PlanSettings::default()).unwrap();
        let mut cpu = started(&plan);
        let got = floor(&plan, &mut cpu, &surface);
        let error = relative_rms(&got.light.irradiance, &expected.irradiance);
        assert!(error < 2e-5, "{:?} {:?}: {error}", pond.form, pond.outside);
        assert_eq!((got.outside_states, got.upward_beams), (0, 0));
        // Waves that the terms were not made for are noticed.
        assert!(floor(&plan, &mut cpu, &waves([48, 33], 0.01)).outside_states > 100);
    }
}

#[test]
fn heights_of_impulses_are_made_on_the_device() {
    let impulses: Vec<Impulse> = (0..3)
        .map(|i| Impulse {
            position_m: [0.3 * f64::from(i), 0.4],
            start_s: 0.2 * f64::from(i),
            amplitude_m: 0.002,
        })
        .collect();
    let (size, pond) = ([40, 30], Pond { scattering: 20.0, ..Pond::default() });
    let method = Convolution::<f32>::new(size, [1.0, 1.0], &pond, ConvolutionSettings::default()).unwrap();
    for distance_levels in [None, Some(256)] {
        let heights = HeightSource::Impulses { capacity: 5000, distance_levels };
        let plan = method.plan(&PlanSettings { heights, ..PlanSettings::default() }).unwrap();
        let mut cpu = started(&plan);
        for time_s in [-1.0, 0.0, 0.7, 1000.3] {
            let surface = match distance_levels {
                None => {
                    impulse_heights(size, [1.0, 1.0], &Ripple::PEBBLE, &impulses, WallImages::Four, time_s)
                }
                Some(levels) => {
                    let table = DistanceTable::new(size, [1.0, 1.0], levels).unwrap();
                    heights_by_table(&table, &Ripple::PEBBLE, &impulses, WallImages::Four, time_s)
                }
            };
            plan.write_impulses(&mut cpu, &Ripple::PEBBLE, &impulses, WallImages::Four, time_s).unwrap();
            cpu.execute().unwrap();
            let got = plan.read(&mut cpu).unwrap().light;
            let expected = method.floor(&surface.unwrap()).unwrap();
            let error = relative_rms(&got.irradiance, &expected.irradiance);
            assert!(error < 5e-5, "{distance_levels:?} {time_s} s: {error}");
        }
    }
}

/// In space and through spectra a plan computes the same sums, whatever is around the pond and however long its lines are.
#[test]
fn both_ways_to_convolve_are_the_same_sum() {
    let cases = [([17, 40], 40.0), ([32, 16], 20.0), ([1, 1], 5.0), ([600, 2], 300.0), ([2, 1500], 700.0)];
    for ([width, height], scattering) in cases {
        for outside in [Outside::Dark, Outside::Periodic] {
            let size = [width, height];
            let pond = Pond { scattering, outside, ..Pond::default() };
            let surface = waves(size, 0.004);
            let by = |convolve| {
                let settings = ConvolutionSettings { kernel_samples: None, convolve };
                let method = Convolution::<f32>::new(size, [1.0, 1.0], &pond, settings).unwrap();
                let plan = method.plan(&PlanSettings::default()).unwrap();
                let kept = |pass: &str| plan.plan.decisions.iter().any(|d| d.pass == pass && d.kept);
                assert_eq!(kept("pond_fft"), convolve == Convolve::Fft);
                assert_eq!(kept("pond_convolve"), convolve == Convolve::Spatial);
                floor(&plan, &mut started(&plan), &surface).light.irradiance
            };
            let error = relative_rms(&by(Convolve::Fft), &by(Convolve::Spatial));
            assert!(error < 2e-6, "{size:?} {outside:?}: {error}");
        }
    }
}

/// Tables of Gamma and T err less the more entries they have, as linear interpolation does.
#[test]
fn tables_of_refraction_converge() {
    let pond = Pond { scattering: 20.0, light_direction: light_tilted_deg(10.0), ..Pond::default() };
    let surface = waves([32, 32], 0.01);
    let method = Convolution::<f32>::new([32, 32], [1.0, 1.0], &pond, Default::default()).unwrap();
    let error = |entries| {
        let settings = PlanSettings { refraction_entries: Some(entries), ..PlanSettings::default() };
        let plan = method.plan(&settings).unwrap();
        let got = floor(&plan, &mut started(&plan), &surface).light;
        relative_rms(&got.irradiance, &method.floor(&surface).unwrap().irradiance)
    };
    let [coarse, fine] = [error(8), error(64)];
    assert!(fine < coarse / 10.0 && fine < 1e-3, "{coarse} {fine}");
}

/// A frame with another light is that of a plan made for it.
#[test]
fn light_moves_without_a_new_plan() {
    let first = Pond { scattering: 20.0, illumination: Illumination::Map(vec![1.0; 400]), ..Pond::default() };
    let levels = (0..400).map(|i| f64::from(i % 7)).collect();
    let second = Pond {
        light_direction: [0.3, -0.2, -1.0],
        ior_below: 1.4,
        illumination: Illumination::Map(levels),
        ..first.clone()
    };
    let surface = waves([20, 20], 0.004);
    let method = |pond| Convolution::<f32>::new([20, 20], [1.0, 1.0], pond, Default::default()).unwrap();
    let settings = PlanSettings { refraction_entries: Some(128), ..PlanSettings::default() };
    let mut moved = method(&first).plan(&settings).unwrap();
    let made = method(&second).plan(&settings).unwrap();
    let mut cpu = started(&moved);
    let before = floor(&moved, &mut cpu, &surface).light.irradiance;
    moved.write_light(&mut cpu, &second).unwrap();
    let after = floor(&moved, &mut cpu, &surface).light.irradiance;
    assert_eq!(after, floor(&made, &mut started(&made), &surface).light.irradiance);
    assert!(relative_rms(&after, &before) > 0.1);
    let deeper = Pond { depth_m: 0.4, ..second.clone() };
    let error = moved.write_light(&mut cpu, &deeper).unwrap_err().to_string();
    assert!(error.starts_with("the depth of the pond is another"), "{error}");
}

#[test]
fn what_a_plan_cannot_take_is_said() {
    let pond = Pond { scattering: 20.0, ..Pond::default() };
    let method = Convolution::<f32>::new([8, 8], [1.0, 1.0], &pond, Default::default()).unwrap();
    let refused = |heights| {
        let settings = PlanSettings { heights, ..PlanSettings::default() };
        method.plan(&settings).unwrap_err().to_string()
    };
    let nothing = HeightSource::Impulses { capacity: 0, distance_levels: None };
    assert!(refused(nothing).contains("room for impulses is 0; it must be 1 to 2^20"));
    let one_level = HeightSource::Impulses { capacity: 1, distance_levels: Some(1) };
    assert!(refused(one_level).contains("levels of distance is 1"));
    let settings = PlanSettings { refraction_entries: Some(1), ..PlanSettings::default() };
    assert!(method.plan(&settings).is_err());

    let ripple = Ripple {
        front_m_s: 1.0,
        alpha_per_s: 0.0,
        beta_per_m: 0.0,
        wave_number_rad_m: 1.0,
        frequency_rad_s: 1.0,
    };
    let impulses = [Impulse { position_m: [0.5, 0.5], start_s: 0.0, amplitude_m: 1e-3 }; 3];
    let heights = HeightSource::Impulses { capacity: 2, distance_levels: None };
    let plan = method.plan(&PlanSettings { heights, ..PlanSettings::default() }).unwrap();
    let mut cpu = started(&plan);
    let write = |cpu: &mut CpuExecutor, impulses: &[Impulse], time_s| {
        plan.write_impulses(cpu, &ripple, impulses, WallImages::None, time_s)
    };
    let error = write(&mut cpu, &impulses, 0.1).unwrap_err().to_string();
    assert!(
        error.starts_with("3 impulses and images make waves in the pond; the plan has room for 2"),
        "{error}"
    );
    // None of them has fallen yet.
    write(&mut cpu, &impulses, -0.1).unwrap();
    assert!(write(&mut cpu, &impulses, f64::NAN).is_err());
    // Waves of 3 cm over water of 30, and of 3 m.
    for (amplitude_m, grounded) in [(0.3, false), (30.0, true)] {
        let impulse = Impulse { amplitude_m, ..impulses[0] };
        write(&mut cpu, &[impulse], 0.1).unwrap();
        cpu.execute().unwrap();
        let read = plan.read(&mut cpu);
        assert_eq!(matches!(read, Err(PondError::Grounded { .. })), grounded, "{read:?}");
    }
    let other = HeightField::flat([9, 8], [1.0, 1.0]).unwrap();
    assert!(plan.write_heights(&mut cpu, &other).is_err());
    let grounded = HeightField::from_fn([8, 8], [1.0, 1.0], |_, _| -0.3).unwrap();
    assert!(plan.write_heights(&mut cpu, &grounded).is_err());
}

/// A sun that is dragged: the plan of one light takes the terms of another, and gives to the bit what that light's own plan gives.
#[test]
fn terms_of_other_light_go_into_a_prepared_plan() {
    let surface = waves([64, 32], 0.006);
    let lit = |tilt_deg: f64, outside: Outside| {
        let pond = Pond { light_direction: light_tilted_deg(tilt_deg), outside, ..Pond::default() };
        (
            LowRank::<f32>::new(std::slice::from_ref(&surface), &pond, LowRankSettings::default()).unwrap(),
            pond,
        )
    };
    for outside in [Outside::Dark, Outside::Periodic] {
        let ((high, _), (low, low_pond)) = (lit(0.0, outside), lit(50.0, outside));
        let room =
            Room { terms: low.report().terms.max(high.report().terms) + 3, states: 30_000, offsets: 0 };
        let mut plan = high.plan(&PlanSettings { room, ..PlanSettings::default() }).unwrap();
        let mut cpu = started(&plan);
        let before = floor(&plan, &mut cpu, &surface);
        let made = cpu.made();
        low.refit(&mut plan, &mut cpu).unwrap();
        let after = floor(&plan, &mut cpu, &surface);
        assert_eq!(cpu.made(), made, "something was made");
        let reference = exact(&surface, &low_pond, FloorGrid::below(&surface)).unwrap().irradiance;
        let error = relative_rms(&after.light.irradiance, &reference);
        assert!(error < 0.011 && after.outside_states == 0, "{error}, {} outside", after.outside_states);
        // Control: only the light, with the terms of the other.
        let mut stale = high.plan(&PlanSettings::default()).unwrap();
        let mut cpu_of_stale = started(&stale);
        stale.write_light(&mut cpu_of_stale, &low_pond).unwrap();
        let stale = floor(&stale, &mut cpu_of_stale, &surface);
        assert!(relative_rms(&stale.light.irradiance, &reference) > 0.05 && stale.outside_states > 1000);
        // And back again.
        high.refit(&mut plan, &mut cpu).unwrap();
        assert_eq!(floor(&plan, &mut cpu, &surface).light.irradiance, before.light.irradiance);
    }
}

/// Kernels that are summed in space reach to other places under other light and in other water, and in fewer parts.
#[test]
fn kernels_in_space_may_reach_elsewhere() {
    let surface = waves([32, 32], 0.004);
    let terms = |tilt_deg: f64, scattering: f64, outside: Outside| {
        let settings = LowRankSettings { convolve: Convolve::Spatial, ..LowRankSettings::default() };
        let pond =
            Pond { scattering, outside, light_direction: light_tilted_deg(tilt_deg), ..Pond::default() };
        LowRank::<f32>::new(std::slice::from_ref(&surface), &pond, settings).unwrap()
    };
    let plan_with =
        |of: &LowRank<f32>, room| of.plan(&PlanSettings { room, ..PlanSettings::default() }).unwrap();
    for outside in [Outside::Dark, Outside::Periodic] {
        let (wide, narrow, slanting) =
            (terms(0.0, 3.0, outside), terms(0.0, 500.0, outside), terms(30.0, 500.0, outside));
        let most = wide.report().terms.max(narrow.report().terms).max(slanting.report().terms);
        let room = Room { terms: most, states: 30_000, offsets: 4096 };
        for (first, second) in [(&wide, &narrow), (&narrow, &slanting), (&slanting, &narrow)] {
            let mut plan = plan_with(first, room);
            let mut cpu = started(&plan);
            let before = floor(&plan, &mut cpu, &surface).light.irradiance;
            second.refit(&mut plan, &mut cpu).unwrap();
            let after = floor(&plan, &mut cpu, &surface).light.irradiance;
            let own = plan_with(second, Room::default());
            let expected = floor(&own, &mut started(&own), &surface).light.irradiance;
            assert!(relative_rms(&after, &expected) < 1e-6, "{outside:?}");
            assert!(relative_rms(&before, &expected) > 0.01, "{outside:?}: the same floor");
        }
        let mut plan = plan_with(&narrow, Room { offsets: 0, ..room });
        let mut cpu = started(&plan);
        let refused = wide.refit(&mut plan, &mut cpu).unwrap_err().to_string();
        assert!(refused.contains("the offsets of their kernels"), "{refused}");
    }
}

/// What there is no room for is said, and leaves the plan as it was.
#[test]
fn terms_without_room_leave_the_plan_alone() {
    let surface = waves([32, 32], 0.006);
    let terms = |target_error: f64, scattering: f64| {
        let settings = LowRankSettings { target_error, ..LowRankSettings::default() };
        let pond = Pond { scattering, ..Pond::default() };
        LowRank::<f32>::new(std::slice::from_ref(&surface), &pond, settings).unwrap()
    };
    let (few, many) = (terms(0.05, 20.0), terms(0.001, 20.0));
    let plan_with = |room: Room| few.plan(&PlanSettings { room, ..PlanSettings::default() }).unwrap();
    let mut plan = plan_with(Room::default());
    let mut cpu = started(&plan);
    let before = floor(&plan, &mut cpu, &surface).light.irradiance;
    let refused = many.refit(&mut plan, &mut cpu).unwrap_err();
    assert!(matches!(refused, PondError::Room { what: "terms", .. }), "{refused}");
    assert!(refused.to_string().contains("make it anew"), "{refused}");
    assert_eq!(floor(&plan, &mut cpu, &surface).light.irradiance, before);
    let mut plan = plan_with(Room { terms: 40, ..Room::default() });
    let mut cpu = started(&plan);
    let refused = many.refit(&mut plan, &mut cpu).unwrap_err();
    assert!(matches!(refused, PondError::Room { what: "states of their table", .. }), "{refused}");
    let other_form = Pond { form: Form::Paper, ..Pond::default() };
    let other = LowRank::<f32>::new(std::slice::from_ref(&surface), &other_form, LowRankSettings::default());
    assert!(matches!(other.unwrap().refit(&mut plan, &mut cpu), Err(PondError::OtherKernels { .. })));
    let settings = ConvolutionSettings::default();
    let paper = Convolution::<f32>::new([32, 32], [1.0, 1.0], &Pond::default(), settings).unwrap();
    let mut paper = paper.plan(&PlanSettings::default()).unwrap();
    let mut cpu = started(&paper);
    assert!(few.refit(&mut paper, &mut cpu).is_err());
}
