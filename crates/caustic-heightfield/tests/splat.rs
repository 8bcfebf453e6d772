//! Splatting against `exact`, and what is chosen when.

use caustic_heightfield::*;

fn waves(size: [usize; 2], amplitude_m: f64) -> HeightField {
    let scene = PondScene::default();
    let mut surface = scene.heights(size, std::path::Path::new("."), Moment::default()).expect("waves");
    surface.heights_m.iter_mut().for_each(|h| *h *= amplitude_m / 0.004);
    surface
}

fn pond(tilt_deg: f64, scattering: f64) -> Pond {
    Pond { scattering, light_direction: light_tilted_deg(tilt_deg), ..Pond::default() }
}

fn error(light: &FloorLight, surface: &HeightField, pond: &Pond) -> f64 {
    let reference = exact(surface, pond, FloorGrid::below(surface)).expect("a valid pond");
    relative_rms(&light.irradiance, &reference.irradiance)
}

/// For any form, surroundings and light, and for the cones that meet the floor in no ellipse.
#[test]
fn splats_keep_the_error_asked_for() {
    let surface = waves([40, 31], 0.01);
    let base = pond(0.0, 50.0);
    let ponds = [
        base.clone(),
        pond(60.0, 200.0),
        pond(85.0, 20.0),
        Pond { light_direction: [-0.4, 0.9, -0.8], ..base.clone() },
        Pond { outside: Outside::Periodic, light_direction: [0.5, -0.7, -0.6], ..base.clone() },
        Pond { form: Form::Paper, light_direction: [0.3, 0.3, -1.0], ..base.clone() },
        Pond { form: Form::Paper, scattering: 0.5, ..base.clone() },
        Pond { scattering: 0.0, ..base },
    ];
    for pond in &ponds {
        for target in [1e-2, 1e-4] {
            let splat = Splat::new(pond, target).expect("a valid target");
            let error = error(&splat.floor(&surface).expect("a valid pond"), &surface, pond);
            assert!(error <= target, "{target}: {error}, {pond:?}");
        }
    }
}

/// The narrower the lobe the fewer samples it covers; what is cut off is what was asked for, and not much less.
#[test]
fn narrow_lobes_are_cheap() {
    let surface = waves([64, 64], 0.004);
    let evaluations = |scattering: f64, target: f64| {
        let splat = Splat::new(&pond(20.0, scattering), target).expect("a valid target");
        splat.evaluations(&surface).expect("a valid pond")
    };
    let [wide, narrow] = [100.0, 800.0].map(|a| evaluations(a, 1e-2));
    assert!((3.0..9.0).contains(&(wide / narrow)), "{wide} {narrow}");
    assert!(evaluations(800.0, 1e-4) > 1.4 * narrow);
    let splat = Splat::new(&pond(20.0, 100.0), 1e-2).expect("a valid target");
    let error = error(&splat.floor(&surface).expect("a valid pond"), &surface, &pond(20.0, 100.0));
    assert!(error > 1e-4, "{error}");
}

/// Terms where lobes are wide, splats where terms are too many; either way the error that was asked for.
#[test]
fn the_cheaper_way_is_taken() {
    let of = |amplitude_m: f64, pond: &Pond| {
        let surface = waves([96, 96], amplitude_m);
        let sum = LobeSum::<f32>::new(std::slice::from_ref(&surface), pond, LowRankSettings::default());
        let sum = sum.expect("a lobe that is resolved");
        let (light, outside) = sum.floor(&surface).expect("a valid surface");
        assert_eq!(outside, 0);
        (sum.report().clone(), error(&light, &surface, pond))
    };
    let (wide, error_of_terms) = of(0.004, &pond(20.0, 50.0));
    assert_eq!((wide.way, wide.no_terms.clone()), (LobeWay::Terms, None));
    assert!(wide.terms_ms.is_some_and(|ms| ms < wide.splat_ms) && error_of_terms < 0.012, "{wide:?}");
    assert!(wide.terms.is_some_and(|terms| terms.terms <= 5));
    let (narrow, error_of_splats) = of(0.01, &pond(60.0, 800.0));
    assert_eq!((narrow.way, narrow.terms_ms), (LobeWay::Splat, None));
    assert!(narrow.no_terms.is_some_and(|why| why.contains("40 terms")) && error_of_splats < 0.01);
    // Light that is refracted upwards has no terms, and lands nowhere.
    let storm = HeightField::from_fn([64, 8], [1.0, 0.125], |x, _| 0.1 * (25.0 * x).sin()).expect("finite");
    let dense = Pond { ior_above: 1.0, ior_below: 0.7, ..pond(80.0, 20.0) };
    let sum = LobeSum::<f32>::new(std::slice::from_ref(&storm), &dense, LowRankSettings::default());
    let sum = sum.expect("splats take all beams");
    assert_eq!(sum.report().way, LobeWay::Splat);
    assert!(error(&sum.floor(&storm).expect("a valid surface").0, &storm, &dense) < 0.01);
}

#[test]
fn what_cannot_be_splatted_is_said() {
    assert!(
        Splat::new(&Pond::default(), 0.0).is_err_and(|error| error.to_string().contains("target error is 0"))
    );
    let splat = Splat::new(&Pond { depth_m: 0.0, ..Pond::default() }, 0.01).expect("a valid target");
    let flat = HeightField::flat([4, 4], [1.0, 1.0]).expect("flat");
    assert!(splat.floor(&flat).is_err_and(|error| error.to_string().contains("above the floor")));
    // A lobe between the samples is resolved by neither.
    let clear = Pond { scattering: 1e6, ..Pond::default() };
    let sum = LobeSum::<f32>::new(std::slice::from_ref(&flat), &clear, LowRankSettings::default());
    assert!(matches!(sum, Err(PondError::Unresolved { .. })));
}
