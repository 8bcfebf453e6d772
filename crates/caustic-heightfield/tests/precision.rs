//! The six passes in frame buffers of few bits against the same passes in f64: the paper's correctness experiment (section 5.2).

mod papers_experiment;

use caustic_heightfield::adjusted::{Fixed, Float, Format};
use caustic_heightfield::*;
use half::f16;
use papers_experiment::{papers_pond, pebbles};

const PAPERS_KERNEL: SixPassSettings =
    SixPassSettings { kernel_samples: Some(7), accumulation: Accumulation::PerTerm };

fn fixed(bits: u32) -> Fixed {
    Fixed::new(bits).expect("4 to 16")
}

fn passes<F: Format>(
    surface: &HeightField,
    pond: &Pond,
    settings: SixPassSettings,
    format: F,
) -> SixPasses<F> {
    SixPasses::new(std::slice::from_ref(surface), pond, settings, format).expect("a pond that can be stored")
}

fn in_f64(surface: &HeightField, pond: &Pond, settings: SixPassSettings) -> Vec<f64> {
    let settings = ConvolutionSettings { kernel_samples: settings.kernel_samples, ..Default::default() };
    let method =
        Convolution::<f64>::new(surface.size, surface.extent_m, pond, settings).expect("a valid pond");
    method.floor(surface).expect("a valid surface").irradiance
}

/// Relative RMS error of the passes in this format against f64; no point is further off than the report says.
fn error<F: Format>(surface: &HeightField, pond: &Pond, settings: SixPassSettings, format: F) -> f64 {
    let method = passes(surface, pond, settings, format);
    let (floor, _) = method.irradiance(surface).expect("a valid surface");
    let reference = in_f64(surface, pond, settings);
    let worst = floor.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let bound = method.report().error_bound;
    assert!(worst <= bound, "{}: {worst}, bound {bound}", format.name());
    relative_rms(&floor, &reference)
}

/// What the paper saw as 26 % in the worst case lies between what 8 bits lose where sums are wide and where every tap is rounded.
#[test]
fn eight_bits_cost_what_the_paper_saw() {
    let (surface, pond) = (pebbles([128, 128]), papers_pond());
    let per_tap = SixPassSettings { accumulation: Accumulation::PerTap, ..PAPERS_KERNEL };
    let of = |settings, format| error(&surface, &pond, settings, format);
    let compiled = [of(PAPERS_KERNEL, fixed(8)), of(per_tap, fixed(8))];
    let by_hand = [of(PAPERS_KERNEL, fixed(8).by_hand()), of(per_tap, fixed(8).by_hand())];
    assert!((0.03..0.06).contains(&compiled[0]) && (0.08..0.15).contains(&compiled[1]), "{compiled:?}");
    assert!((0.04..0.07).contains(&by_hand[0]) && (0.8..1.1).contains(&by_hand[1]), "{by_hand:?}");
    assert!(by_hand[0] < 0.26 && 0.26 < by_hand[1]);
    // Clear water raises the cosine to a higher power, which loses more.
    let clear = Pond { scattering: 200.0, ..pond.clone() };
    let clear = error(&surface, &clear, PAPERS_KERNEL, fixed(8));
    assert!((2.0..6.0).contains(&(clear / compiled[0])), "{clear} {compiled:?}");
}

/// Two bits more are three to eight times better; f16 is between 10 and 12 bits, f32 needs no further look.
#[test]
fn bits_buy_accuracy() {
    let (surface, pond) = (pebbles([128, 128]), papers_pond());
    let errors: Vec<f64> =
        [8, 12, 16].into_iter().map(|bits| error(&surface, &pond, PAPERS_KERNEL, fixed(bits))).collect();
    assert!(errors.windows(2).all(|pair| (10.0..60.0).contains(&(pair[0] / pair[1]))), "{errors:?}");
    let half = error(&surface, &pond, PAPERS_KERNEL, Float::<f16>::default());
    assert!((errors[1]..0.01).contains(&half), "{half} {errors:?}");
    assert!(error(&surface, &pond, PAPERS_KERNEL, Float::<f32>::default()) < 2e-6);
}

/// In all that ponds can be, f32 frame buffers hold what f64 does, and 12 bits keep their bound.
#[test]
fn every_pond_can_be_stored() {
    let base = Pond { scattering: 20.0, ..Pond::default() };
    let ramp: Vec<f64> = (0..24 * 17).map(|s| 100.0 * f64::from(s % 24)).collect();
    let ponds = [
        Pond { light_direction: light_tilted_deg(12.0), ..base.clone() },
        Pond { outside: Outside::Periodic, normals: Normals::OneSided, ..base.clone() },
        Pond { illumination: Illumination::Map(ramp), ..papers_pond() },
        Pond { ior_above: 1.333, ior_below: 1.0, ..base.clone() },
        Pond { ior_above: 1.333, ..base.clone() },
        Pond { illumination: Illumination::Uniform(0.0), ..base.clone() },
        Pond { illumination: Illumination::Uniform(1e5), scattering: 0.0, ..base },
    ];
    let size = [24, 17];
    let surface = pebbles(size);
    for pond in &ponds {
        for settings in [SixPassSettings::default(), PAPERS_KERNEL] {
            let dark = pond.illumination == Illumination::Uniform(0.0);
            let single = error(&surface, pond, settings, Float::<f32>::default());
            assert!(dark || single < 1e-5, "{single}, {pond:?}");
            let twelve = error(&surface, pond, settings, fixed(12));
            assert!(dark || twelve < 0.06, "{twelve}, {pond:?}");
        }
    }
}

/// Level water has no slopes to lose: the same code everywhere, off by no more than the light's and the sum's rounding.
#[test]
fn level_water_stays_level() {
    let flat = HeightField::flat([33, 20], [1.0, 0.7]).expect("flat");
    let pond = Pond { outside: Outside::Periodic, ..Pond::default() };
    let method = passes(&flat, &pond, PAPERS_KERNEL, fixed(8));
    let floor = method.floor(&flat).expect("a valid surface");
    assert!(floor.light.irradiance.iter().all(|e| *e == floor.light.irradiance[0]));
    assert_eq!((floor.light.report.surface.samples, floor.clamped), (660, 0));
    assert!(error(&flat, &pond, PAPERS_KERNEL, fixed(8)) < 0.02);
}

/// Ranges are those of the waves that were shown; higher ones are clamped, counted, and clamped alike.
#[test]
fn waves_beyond_their_range_are_clamped() {
    let gentle = pebbles([48, 48]);
    let method = passes(&gentle, &papers_pond(), PAPERS_KERNEL, fixed(12));
    let raised = |factor: f64| HeightField {
        heights_m: gentle.heights_m.iter().map(|h| factor * h).collect(),
        ..gentle.clone()
    };
    let clamped = |factor| method.irradiance(&raised(factor)).expect("a valid surface").1;
    assert!(clamped(4.0) > clamped(1.0) + 1000, "{} {}", clamped(4.0), clamped(1.0));
}

#[test]
fn what_cannot_be_done_is_said() {
    let surface = pebbles([16, 16]);
    let refused = |examples: &[HeightField], pond: Pond, settings| {
        SixPasses::new(examples, &pond, settings, fixed(8)).err().expect("not to be had").to_string()
    };
    let even = SixPassSettings { kernel_samples: Some(8), ..PAPERS_KERNEL };
    assert!(refused(std::slice::from_ref(&surface), papers_pond(), even).contains("odd"));
    assert!(refused(&[], papers_pond(), PAPERS_KERNEL).contains("number of surfaces is 0"));
    let other = HeightField::flat([8, 8], [1.0, 1.0]).expect("flat");
    assert!(refused(&[surface.clone(), other], papers_pond(), PAPERS_KERNEL).contains("[8, 8]"));
    // Milk has (-L_z)^-1, which has no bound where light may leave along the surface.
    let milk = Pond {
        scattering: 0.0,
        ior_above: 1.5,
        ior_below: 1.0,
        light_direction: light_tilted_deg(60.0),
        ..papers_pond()
    };
    let problem = refused(std::slice::from_ref(&surface), milk, PAPERS_KERNEL);
    assert!(problem.contains("(-L_tz)^(n-1)") && problem.contains("fixed8"), "{problem}");
    let method = passes(&surface, &papers_pond(), PAPERS_KERNEL, fixed(8));
    assert!(method.floor(&pebbles([8, 16])).is_err());
}
