//! The parsers of the command line's values: what is valid parses to what was meant, everything else is refused.

use proptest::prelude::*;
use spectral_cli::values::{
    Exposure, MAX_BOUNCES, MAX_PHOTONS, MAX_SIDE, MAX_THREADS, MAX_TRACED_WAVELENGTHS, Size, WavelengthRange,
    adapter, any_wavelengths, bounces, noise, photons, seed, set_wavelengths, threads, traced_wavelengths,
};

/// Numbers no option means: signs, blanks, blown-up exponents, things that parse as f64 and are none.
const NONSENSE: [&str; 13] =
    ["", " ", "-1", "1 ", "NaN", "nan", "inf", "-inf", "infinity", "1e999", "0x10", "seven", "١"];

#[test]
fn nonsense_is_refused_by_every_parser() {
    for text in NONSENSE {
        assert!(text.parse::<Size>().is_err(), "size {text:?}");
        assert!(text.parse::<WavelengthRange>().is_err(), "range {text:?}");
        assert!(photons(text).is_err(), "photons {text:?}");
        assert!(set_wavelengths(text).is_err(), "set {text:?}");
        assert!(traced_wavelengths(text).is_err(), "wavelengths {text:?}");
        assert!(any_wavelengths(text).is_err(), "wavelengths {text:?}");
        assert!(threads(text).is_err(), "threads {text:?}");
        assert!(bounces(text).is_err(), "bounces {text:?}");
        assert!(seed(text).is_err(), "seed {text:?}");
        assert!(text.parse::<Exposure>().is_err(), "exposure {text:?}");
        assert!(noise(text).is_err(), "noise {text:?}");
    }
}

#[test]
fn sizes_outside_the_limits_are_refused_with_the_limit() {
    for text in [
        "0x10",
        "10x0",
        "1000000x1000000",
        "8193x1",
        "18446744073709551616x1",
        "256",
        "256x",
        "x256",
        "1x2x3",
    ] {
        assert!(text.parse::<Size>().is_err(), "{text}");
    }
    assert!("1000000x1".parse::<Size>().expect_err("too wide").contains("8192"));
    assert_eq!("8192X1".parse(), Ok(Size { width: 8192, height: 1 }));
}

#[test]
fn seeds_are_any_64_bits() {
    assert_eq!(seed("0"), Ok(0));
    assert_eq!(seed("18446744073709551615"), Ok(u64::MAX));
    let problem = seed("18446744073709551616").expect_err("too large");
    assert!(problem.contains("0 to 18446744073709551615"), "{problem}");
}

#[test]
fn ranges_run_upwards_inside_the_tables() {
    for text in
        ["680..420", "420..420", "420", "420-680", "100..680", "420..2000", "NaN..680", "..680", "420.."]
    {
        assert!(text.parse::<WavelengthRange>().is_err(), "{text}");
    }
    assert!("680..420".parse::<WavelengthRange>().expect_err("reversed").contains("420..680"));
    assert_eq!("360..830".parse(), Ok(WavelengthRange { low_nm: 360.0, high_nm: 830.0 }));
}

#[test]
fn exposures_are_positive_factors_or_auto() {
    for text in ["0", "-0", "-1", "1e-320", "1e400", "AUTO"] {
        assert!(text.parse::<Exposure>().is_err(), "{text}");
    }
    assert_eq!("auto".parse(), Ok(Exposure::Auto));
    assert_eq!("2.5e-3".parse(), Ok(Exposure::Factor(2.5e-3)));
}

#[test]
fn counts_have_both_ends() {
    assert_eq!((set_wavelengths("1"), set_wavelengths("4096")), (Ok(1), Ok(4096)));
    assert!(set_wavelengths("0").is_err() && set_wavelengths("4097").is_err());
    assert_eq!(traced_wavelengths(&MAX_TRACED_WAVELENGTHS.to_string()), Ok(MAX_TRACED_WAVELENGTHS));
    assert!(
        traced_wavelengths("0").is_err()
            && traced_wavelengths(&(MAX_TRACED_WAVELENGTHS + 1).to_string()).is_err()
    );
    assert_eq!(any_wavelengths("1000000"), Ok(1_000_000));
    assert!(any_wavelengths("0").is_err() && any_wavelengths("4294967296").is_err());
    assert_eq!(adapter("NVIDIA"), Ok("NVIDIA".into()));
    assert!(adapter("").is_err() && adapter(" ").is_err());
    assert_eq!(threads(&MAX_THREADS.to_string()), Ok(MAX_THREADS));
    assert!(threads("0").is_err() && threads(&(MAX_THREADS + 1).to_string()).is_err());
    assert_eq!(bounces("0"), Ok(0));
    assert_eq!(bounces(&MAX_BOUNCES.to_string()), Ok(MAX_BOUNCES));
    assert!(bounces(&(MAX_BOUNCES + 1).to_string()).is_err());
    assert_eq!(photons("4e6"), Ok(4_000_000));
    assert_eq!(photons("1e15"), Ok(MAX_PHOTONS as u64));
    assert!(photons("0").is_err() && photons("0.5").is_err() && photons("1e16").is_err());
    assert_eq!(noise("0.25"), Ok(0.25));
    assert!(noise("0").is_err() && noise("1").is_err());
}

proptest! {
    #[test]
    fn any_text_is_parsed_or_refused_without_a_panic(text in ".{0,24}") {
        // Whatever is accepted is inside the limits.
        if let Ok(size) = text.parse::<Size>() {
            prop_assert!((1..=MAX_SIDE).contains(&size.width) && (1..=MAX_SIDE).contains(&size.height));
        }
        if let Ok(range) = text.parse::<WavelengthRange>() {
            prop_assert!(360.0 <= range.low_nm && range.low_nm < range.high_nm && range.high_nm <= 830.0);
        }
        if let Ok(Exposure::Factor(factor)) = text.parse::<Exposure>() {
            prop_assert!(factor.is_finite() && factor > 0.0);
        }
        if let Ok(n) = photons(&text) {
            prop_assert!((1..=MAX_PHOTONS as u64).contains(&n));
        }
        if let Ok(x) = noise(&text) {
            prop_assert!(x > 0.0 && x < 1.0);
        }
        let _ = (set_wavelengths(&text), traced_wavelengths(&text), threads(&text), bounces(&text));
    }

    #[test]
    fn number_like_text_is_parsed_or_refused_without_a_panic(text in "[-+0-9a-fx.eE]{0,16}") {
        if let Ok(size) = text.parse::<Size>() {
            prop_assert_eq!(size.texels(), u64::from(size.width) * u64::from(size.height));
            prop_assert!(size.width >= 1 && size.height >= 1);
        }
        if let Ok(Exposure::Factor(factor)) = text.parse::<Exposure>() {
            prop_assert!(factor.is_finite() && factor > 0.0);
        }
        if let Ok(n) = photons(&text) {
            prop_assert!(n >= 1);
        }
    }

    #[test]
    fn sizes_round_trip(width in 1..=MAX_SIDE, height in 1..=MAX_SIDE) {
        let size = Size { width, height };
        prop_assert_eq!(size.to_string().parse(), Ok(size));
    }

    #[test]
    fn ranges_round_trip(low_nm in 360.0..829.0_f64, width_nm in 0.001..1.0_f64) {
        let range = WavelengthRange { low_nm, high_nm: low_nm + width_nm };
        prop_assert_eq!(range.to_string().parse(), Ok(range));
    }

    #[test]
    fn reversed_ranges_are_refused(low_nm in 360.0..829.0_f64, width_nm in 0.0..1.0_f64) {
        let range = format!("{}..{low_nm}", low_nm + width_nm);
        prop_assert!(range.parse::<WavelengthRange>().is_err());
    }

    #[test]
    fn photon_counts_round_trip(n in 1..=1_000_000_000_000_000_u64) {
        prop_assert_eq!(photons(&n.to_string()), Ok(n));
        prop_assert_eq!(photons(&format!("{n}e0")), Ok(n));
    }

    #[test]
    fn factors_round_trip(factor in 1e-300..1e300_f64) {
        prop_assert_eq!(factor.to_string().parse(), Ok(Exposure::Factor(factor)));
    }
}
