//! `convolution` and `low-rank` against `exact`.

use std::f64::consts::TAU;

use caustic_heightfield::*;

const SIZE: [usize; 2] = [128, 128];
const GENTLE_M: f64 = 0.004;
const STEEP_M: f64 = 0.01;

/// The waves of all figures, `phase` of a period later.
fn waves(size: [usize; 2], amplitude_m: f64, phase: f64) -> HeightField {
    HeightField::from_fn(size, [1.0, 1.0], |x, y| {
        let second = (TAU * (5.0 * x - 4.0 * y - phase) + 1.0).sin();
        amplitude_m * ((TAU * (3.0 * x + 2.0 * y + phase)).sin() + 0.8 * second)
    })
    .expect("finite waves")
}

fn pond(tilt_deg: f64, scattering: f64) -> Pond {
    Pond { scattering, light_direction: light_tilted_deg(tilt_deg), ..Pond::default() }
}

/// Error at every fifth sample, which are others than those that terms are chosen by.
fn error(floor: &FloorLight, surface: &HeightField, pond: &Pond) -> f64 {
    let reference = exact(surface, pond, FloorGrid::below(surface).every(5)).expect("a valid pond");
    let [width, height] = reference.grid.size;
    let picked: Vec<f64> = (0..height)
        .flat_map(|j| (0..width).map(move |i| (i, j)))
        .map(|(i, j)| floor.irradiance[j * 5 * floor.grid.size[0] + i * 5])
        .collect();
    relative_rms(&picked, &reference.irradiance)
}

fn low_rank<T: Sample>(surface: &HeightField, pond: &Pond, target_error: f64) -> LowRank<T> {
    let settings = LowRankSettings { target_error, ..LowRankSettings::default() };
    LowRank::new(std::slice::from_ref(surface), pond, settings).expect("few enough terms")
}

fn convolved<T: Sample>(surface: &HeightField, pond: &Pond, settings: ConvolutionSettings) -> FloorLight {
    let method = Convolution::<T>::new(surface.size, surface.extent_m, pond, settings).expect("a valid pond");
    method.floor(surface).expect("a valid surface")
}

/// As many terms as the book says, and not more, hold what was asked at points that were not used to choose them.
#[test]
fn few_terms_reach_the_error_asked_for() {
    let steep = |tilt, scattering, percent, tenth| (STEEP_M, tilt, scattering, percent, tenth);
    let gentle = |tilt, scattering, percent, tenth| (GENTLE_M, tilt, scattering, percent, tenth);
    let cases = [
        gentle(0.0, 50.0, 4, 7),
        gentle(60.0, 200.0, 9, 15),
        steep(60.0, 50.0, 10, 18),
        steep(20.0, 200.0, 14, 26),
    ];
    for (amplitude, tilt, scattering, percent, tenth) in cases {
        let surface = waves(SIZE, amplitude, 0.0);
        let pond = pond(tilt, scattering);
        for (target, most) in [(1e-2, percent), (1e-3, tenth)] {
            let method = low_rank::<f64>(&surface, &pond, target);
            let report = method.report();
            let floor = method.floor(&surface).unwrap();
            let error = error(&floor.light, &surface, &pond);
            let case =
                format!("A {amplitude}, {tilt} degrees, a {scattering}: {error} with {} terms", report.terms);
            assert!(report.terms <= most + 1, "{case}");
            // Chosen at 121 points, held at 625.
            assert!(error <= 1.1 * target, "{case}");
            assert!((error / report.error - 1.0).abs() < 0.2, "{case}, {} reported", report.error);
            assert!(report.bound > error, "{case}, bound {}", report.bound);
            assert_eq!(floor.outside_states, 0);
        }
    }
}

/// The paper's accuracy where it is good, and its failure where light comes from elsewhere.
#[test]
fn three_convolutions_are_for_vertical_light() {
    let surface = waves(SIZE, GENTLE_M, 0.0);
    let of = |tilt, scattering, form| {
        let pond = Pond { form, ..pond(tilt, scattering) };
        error(&convolved::<f64>(&surface, &pond, ConvolutionSettings::default()), &surface, &pond)
    };
    let paper = of(0.0, 50.0, Form::Paper);
    assert!((0.05..0.07).contains(&paper), "{paper}");
    let physical = of(0.0, 50.0, Form::Physical);
    assert!((0.03..0.05).contains(&physical), "{physical}");
    for form in [Form::Paper, Form::Physical] {
        let oblique = of(20.0, 50.0, form);
        assert!((0.9..1.0).contains(&oblique), "{form:?}: {oblique}");
        assert!(of(20.0, 200.0, form) > 0.99);
    }
}

/// Level water under vertical light leaves nothing to expand: every method is exact.
#[test]
fn level_water_is_exact() {
    let flat = HeightField::flat([33, 20], [1.0, 0.7]).unwrap();
    for (form, outside) in
        [(Form::Physical, Outside::Dark), (Form::Paper, Outside::Dark), (Form::Physical, Outside::Periodic)]
    {
        let pond = Pond { form, outside, ..pond(0.0, 20.0) };
        let reference = exact(&flat, &pond, FloorGrid::below(&flat)).unwrap();
        // The paper's own lobe is no power of a cosine.
        if form == Form::Physical {
            let paper = convolved::<f64>(&flat, &pond, ConvolutionSettings::default());
            assert!(relative_rms(&paper.irradiance, &reference.irradiance) < 1e-9);
        }
        for (tilt, target) in [(0.0, 1e-5), (0.0, 1e-3), (30.0, 1e-2), (30.0, 1e-4)] {
            let pond = Pond { light_direction: light_tilted_deg(tilt), ..pond.clone() };
            let reference = exact(&flat, &pond, FloorGrid::below(&flat)).unwrap();
            let terms = low_rank::<f64>(&flat, &pond, target);
            assert_eq!(terms.report().terms, 1);
            let floor = terms.floor(&flat).unwrap().light;
            assert!(relative_rms(&floor.irradiance, &reference.irradiance) < target);
        }
    }
}

/// In the paper's form and for periodic ponds too, on grids of any size.
#[test]
fn terms_follow_form_and_surroundings() {
    for (form, outside) in [(Form::Paper, Outside::Dark), (Form::Physical, Outside::Periodic)] {
        for size in [[27, 40], [1, 1], [1, 9]] {
            // Samples of 2 cm, whatever their number: a lobe must span some.
            let surface =
                HeightField { extent_m: size.map(|n| 0.02 * n as f64), ..waves(size, GENTLE_M, 0.2) };
            let pond = Pond { form, outside, ..pond(30.0, 20.0) };
            let floor = low_rank::<f64>(&surface, &pond, 1e-3).floor(&surface).unwrap().light;
            let reference = exact(&surface, &pond, FloorGrid::below(&surface)).unwrap();
            let error = relative_rms(&floor.irradiance, &reference.irradiance);
            assert!(error < 1.2e-3, "{form:?} {outside:?} {size:?}: {error}");
            assert!((floor.report.floor_flux / reference.report.floor_flux - 1.0).abs() < 1e-3);
        }
    }
}

/// Terms made for some moments of waves serve the moments between; waves that are steeper are counted.
#[test]
fn terms_serve_other_waves_of_their_kind() {
    let pond = pond(30.0, 50.0);
    let examples: Vec<HeightField> = (0..3).map(|i| waves([64, 64], GENTLE_M, f64::from(i) / 7.0)).collect();
    let terms = LowRank::<f64>::new(&examples, &pond, LowRankSettings::default()).unwrap();
    let other = waves([64, 64], GENTLE_M, 0.9);
    let floor = terms.floor(&other).unwrap();
    let error = error(&floor.light, &other, &pond);
    assert!(error < 0.012, "{error}");
    assert!(floor.outside_states < 64 * 64 / 50, "{}", floor.outside_states);
    let steeper = terms.floor(&waves([64, 64], STEEP_M, 0.0)).unwrap();
    assert!(steeper.outside_states > 64 * 64 / 4, "{}", steeper.outside_states);
}

/// f32 is as good as the error asked for, and both ways to convolve are the same sum.
#[test]
fn precision_and_way_do_not_matter() {
    let surface = waves([96, 80], GENTLE_M, 0.0);
    let pond = pond(20.0, 50.0);
    let double = low_rank::<f64>(&surface, &pond, 1e-3).floor(&surface).unwrap().light;
    let single = low_rank::<f32>(&surface, &pond, 1e-3).floor(&surface).unwrap().light;
    assert!(relative_rms(&single.irradiance, &double.irradiance) < 1e-6);
    let way = |convolve, kernel_samples| {
        let settings = ConvolutionSettings { kernel_samples, convolve };
        convolved::<f64>(&surface, &pond, settings).irradiance
    };
    for kernel in [Some(7), Some(31), None] {
        let difference = relative_rms(&way(Convolve::Fft, kernel), &way(Convolve::Spatial, kernel));
        assert!(difference < 1e-12, "{kernel:?}: {difference}");
    }
    // Seven samples at 96 across catch about half of the light: the paper's pond was shallow or its water clear.
    let share =
        way(Convolve::Auto, Some(7)).iter().sum::<f64>() / way(Convolve::Auto, None).iter().sum::<f64>();
    assert!((0.3..0.7).contains(&share), "{share}");
}

#[test]
fn small_kernels_are_summed_and_large_ones_transformed() {
    let way = |kernel_samples| {
        let settings = ConvolutionSettings { kernel_samples, ..ConvolutionSettings::default() };
        Convolution::<f32>::new(SIZE, [1.0, 1.0], &pond(0.0, 50.0), settings).unwrap().is_fft()
    };
    assert!(!way(Some(7)));
    assert!(way(None));
}

#[test]
fn what_cannot_be_done_is_said() {
    let surface = waves([32, 32], STEEP_M, 0.0);
    let text = |pond: Pond, settings: LowRankSettings| {
        let surfaces = std::slice::from_ref(&surface);
        LowRank::<f64>::new(surfaces, &pond, settings).err().expect("not to be had").to_string()
    };
    let few = LowRankSettings { max_terms: 3, ..LowRankSettings::default() };
    assert!(text(pond(40.0, 50.0), few).starts_with("3 terms leave an error of"));
    // A lobe narrower than a sample is no function on the grid.
    assert!(text(pond(0.0, 1e6), LowRankSettings::default()).contains("samples wide on the floor"));
    assert!(text(Pond { depth_m: 0.0, ..pond(0.0, 50.0) }, few).contains("above the floor"));
    let nothing = LowRankSettings { target_error: 0.0, ..few };
    assert!(text(pond(0.0, 50.0), nothing).contains("target error is 0"));
    assert!(LowRank::<f64>::new(&[], &pond(0.0, 50.0), few).is_err());

    let refused = |pond: Pond, settings| {
        Convolution::<f64>::new([8, 8], [1.0, 1.0], &pond, settings).err().expect("not to be had").to_string()
    };
    let even = ConvolutionSettings { kernel_samples: Some(6), ..ConvolutionSettings::default() };
    assert!(refused(pond(0.0, 50.0), even).contains("samples across a kernel is 6; it must be odd"));
    assert!(
        refused(Pond { depth_m: 0.0, ..pond(0.0, 50.0) }, ConvolutionSettings::default()).contains("limit")
    );
    let method =
        Convolution::<f64>::new([8, 8], [1.0, 1.0], &pond(0.0, 50.0), ConvolutionSettings::default());
    let other = method.unwrap().floor(&surface).unwrap_err().to_string();
    assert!(other.contains("[32, 32]") && other.contains("[8, 8]"), "{other}");
}
