extern crate std;

use super::*;
use alloc::vec;
use proptest::prelude::*;
use std::string::ToString;

/// SCHOTT's N-BK7: the tests of formulas need one real glass.
pub(super) fn bk7() -> Dispersion {
    Dispersion::sellmeier([
        [1.039_612_12, 0.006_000_698_67],
        [0.231_792_344, 0.020_017_914_4],
        [1.010_469_45, 103.560_653],
    ])
    .unwrap()
}

#[test]
fn sellmeier_gives_schotts_indices() {
    // SCHOTT's data sheet of N-BK7: n at C, d, F, and g.
    for (nm, n) in [(656.2725, 1.514_32), (587.5618, 1.516_80), (486.1327, 1.522_38), (435.8343, 1.526_68)] {
        assert!((bk7().ior(nm) - n).abs() < 6e-6, "{nm}: {}", bk7().ior(nm));
    }
    assert!((bk7().abbe_v_d() - 64.17).abs() < 6e-3, "{}", bk7().abbe_v_d());
}

#[test]
fn cauchy_is_its_formula() {
    let medium = Dispersion::cauchy(&[1.5046, 0.0042]).unwrap();
    assert!((medium.ior(500.0) - (1.5046 + 0.0042 / 0.25)).abs() < 1e-15);
    let medium = Dispersion::cauchy(&[1.5, 0.004, 1e-4]).unwrap();
    assert!((medium.ior(500.0) - (1.5 + 0.004 / 0.25 + 1e-4 / 0.0625)).abs() < 1e-15);
}

#[test]
fn khr_dispersion_is_twenty_over_v_d() {
    // Diamond and water as the extension lists them, V_d = 10, next to none, and n next to 1.
    for (ior, dispersion) in [(2.42, 0.36), (1.33, 0.38), (1.5, 2.0), (1.5, 1e-6), (1.000_001, 0.5)] {
        let medium = Dispersion::from_khr(ior, dispersion).unwrap();
        assert!((medium.n_d() - ior).abs() < 1e-15 * ior, "{}", medium.n_d());
        // The spread n_F - n_C is a difference of indices near `ior`, so its rounding is relative to it.
        let spread = (ior - 1.0) * dispersion / 20.0;
        let bound = 4.0 * f64::EPSILON * ior / spread + 1e-14;
        assert!((medium.abbe_v_d() * dispersion / 20.0 - 1.0).abs() < bound, "{ior} {dispersion}");
        assert!((medium.khr_dispersion() / dispersion - 1.0).abs() < bound, "{ior} {dispersion}");
        assert!(medium.is_dispersive());
    }
}

#[test]
fn no_dispersion_is_a_constant() {
    let medium = Dispersion::from_khr(1.5, 0.0).unwrap();
    assert_eq!(medium, Dispersion::Constant { n: 1.5 });
    assert!(!medium.is_dispersive());
    assert_eq!((medium.abbe_v_d(), medium.khr_dispersion()), (f64::INFINITY, 0.0));
    for convention in OffsetConvention::ALL {
        assert_eq!(Dispersion::from_abbe(convention, 1.5, f64::INFINITY), Ok(medium.clone()));
    }
    // Formulas without slope do not disperse either, whatever rounding makes of n_F - n_C.
    assert!(!Dispersion::cauchy(&[1.7, 0.0, 0.0]).unwrap().is_dispersive());
    assert_eq!(Dispersion::sellmeier([[1.3, 0.0]]).unwrap().abbe_v_d(), f64::INFINITY);
    assert_eq!(Dispersion::constant(1.0).unwrap().khr_dispersion(), 0.0);
}

#[test]
fn abbe_numbers_from_10_to_infinity_hold_in_both_conventions() {
    for convention in OffsetConvention::ALL {
        for v in [10.0, 20.0, 64.17, 1e3, 1e6] {
            let medium = Dispersion::from_abbe(convention, 1.5168, v).unwrap();
            let (f_nm, reference_nm, c_nm) = convention.lines_nm();
            assert!((medium.ior(reference_nm) - 1.5168).abs() < 1e-15 * 4.0);
            assert!((medium.abbe(convention) / v - 1.0).abs() < 1e-14 * v, "{convention} {v}");
            assert!(
                medium.ior(f_nm) > medium.ior(reference_nm) && medium.ior(reference_nm) > medium.ior(c_nm)
            );
        }
    }
}

#[test]
fn offsets_reproduce_the_index_and_differ_between_conventions() {
    for convention in OffsetConvention::ALL {
        let (f_nm, reference_nm, c_nm) = convention.lines_nm();
        assert_eq!(convention.ior_offset(reference_nm), 0.0);
        assert!((convention.ior_offset(f_nm) - convention.ior_offset(c_nm) - 1.0).abs() < 1e-15);
        let medium = Dispersion::from_abbe(convention, 1.6, 30.0).unwrap();
        for nm in [380.0, 420.0, 550.0, 680.0, 780.0] {
            let from_offset = 1.6 + 0.6 / 30.0 * convention.ior_offset(nm);
            assert!((medium.ior(nm) - from_offset).abs() < 1e-15 * 4.0, "{convention} {nm}");
        }
    }
    // 70 % of n_F - n_C lies on the blue side of d, as KHR_materials_dispersion says.
    assert!((ior_offset_gltf(486.13) - 0.70).abs() < 5e-3, "{}", ior_offset_gltf(486.13));
    // Worked out by hand from 1/lambda^2 in um^-2: (4.232030 - 2.879567) / (4.232030 - 2.321642).
    assert!((ior_offset_specgen(486.1) - 0.707_952).abs() < 1e-6, "{}", ior_offset_specgen(486.1));
    assert!(ior_offset_specgen(587.56) > 0.0);
}

#[test]
fn an_index_below_one_is_refused_with_its_wavelength() {
    // The first whole nanometre beyond sqrt(0.4) um, where 0.99 + 0.004 / lambda^2 reaches 1.
    let error = Dispersion::cauchy(&[0.99, 0.004]).unwrap_err();
    assert!(matches!(error, DispersionError::BelowOne { lambda_nm: 633.0, .. }), "{error}");
    assert!(error.to_string().ends_with("at 633 nm: it must be at least 1 from 380 to 780 nm"), "{error}");
    assert_eq!(Dispersion::constant(0.999), Err(DispersionError::BelowOne { n: 0.999, lambda_nm: 380.0 }));
    assert!(matches!(Dispersion::from_khr(0.0, 0.0), Err(DispersionError::BelowOne { .. })));
    assert!(matches!(Dispersion::from_khr(0.5, 0.3), Err(DispersionError::BelowOne { .. })));
    assert!(matches!(
        Dispersion::from_abbe(OffsetConvention::Gltf, 1.5, 0.5),
        Err(DispersionError::BelowOne { .. })
    ));
    // n^2 < 0: a root of a negative number is no index either.
    assert!(
        matches!(Dispersion::sellmeier([[-3.0, 0.01]]), Err(DispersionError::BelowOne { n, .. }) if n.is_nan())
    );
    assert_eq!(Dispersion::constant(1.0), Ok(Dispersion::Constant { n: 1.0 }));
}

#[test]
fn a_dip_between_whole_nanometres_is_found() {
    // Minimum at u = 1 / 0.5005^2 um^-2, by less than the 1 nm samples on both sides show.
    let u0 = 1.0 / (0.5005 * 0.5005);
    let (c, dip) = (1e3, 1e-12);
    let medium = Dispersion::Cauchy { a: 1.0 - dip + c * u0 * u0, b_um2: -2.0 * c * u0, c_um4: c };
    assert!(medium.ior(500.0) > 1.0 && medium.ior(501.0) > 1.0);
    let Err(DispersionError::BelowOne { lambda_nm, .. }) = medium.validate() else {
        panic!("{:?}", medium.validate())
    };
    assert!((lambda_nm - 500.5).abs() < 1e-9, "{lambda_nm}");
}

#[test]
fn bad_numbers_are_refused_by_name() {
    let message = |result: Result<Dispersion, DispersionError>| result.unwrap_err().to_string();
    assert_eq!(message(Dispersion::constant(f64::NAN)), "the refractive index is NaN: it must be finite");
    assert_eq!(message(Dispersion::cauchy(&[1.5, f64::INFINITY])), "Cauchy B is inf: it must be finite");
    assert_eq!(
        message(Dispersion::cauchy(&[1.5])),
        "got 1 Cauchy coefficients: expected 2 or 3, [A, B_um2] or [A, B_um2, C_um4]"
    );
    assert!(message(Dispersion::cauchy(&[1.0; 4])).starts_with("got 4"));
    assert!(message(Dispersion::sellmeier(vec![])).contains("at least one pair"));
    assert_eq!(
        message(Dispersion::sellmeier([[1.0, 0.01], [0.2, 0.25]])),
        "Sellmeier term 1 (from 0) has its pole at 500 nm: it must lie outside 380 to 780 nm"
    );
    assert!(message(Dispersion::from_khr(1.5, -0.1)).contains("-0.1"));
    assert!(message(Dispersion::from_khr(1.5, f64::NAN)).contains("finite"));
    assert!(message(Dispersion::from_abbe(OffsetConvention::Gltf, 1.5, 0.0)).contains("Abbe number is 0"));
    assert!(message(Dispersion::from_abbe(OffsetConvention::Gltf, 1.5, f64::NAN)).contains("NaN"));
    assert!(matches!(
        Dispersion::sellmeier([[1e308, 0.14], [1e308, 0.14]]),
        Err(DispersionError::Overflow { .. })
    ));
}

#[test]
fn json_round_trips_and_is_checked() {
    for medium in
        [Dispersion::constant(1.5).unwrap(), Dispersion::cauchy(&[1.5, 0.004, 1e-5]).unwrap(), bk7()]
    {
        let json = serde_json::to_string(&medium).unwrap();
        assert_eq!(serde_json::from_str::<Dispersion>(&json).unwrap(), medium, "{json}");
    }
    let error = serde_json::from_str::<Dispersion>(r#"{"constant":{"n":0.5}}"#).unwrap_err().to_string();
    assert!(error.contains("0.5 at 380 nm"), "{error}");
}

#[test]
fn convention_names_round_trip() {
    for convention in OffsetConvention::ALL {
        assert_eq!(convention.to_string().parse(), Ok(convention));
    }
    assert!("schott".parse::<OffsetConvention>().unwrap_err().to_string().contains("specgen or gltf"));
}

proptest! {
    /// Whatever passes validation has an index that tracing can use, everywhere and not just at whole nanometres.
    #[test]
    fn valid_media_have_usable_indices(
        a in 0.5..3.0, b in -0.1..0.2, c in -0.02..0.02, nm in 380.0..780.0,
    ) {
        if let Ok(medium) = Dispersion::cauchy(&[a, b, c]) {
            let n = medium.ior(nm);
            prop_assert!(n.is_finite() && n >= 1.0, "{:?} {}", medium, n);
        }
    }

    #[test]
    fn khr_values_round_trip(ior in 1.01..3.0, dispersion in 0.01..2.0) {
        let medium = Dispersion::from_khr(ior, dispersion).unwrap();
        prop_assert!((medium.khr_dispersion() - dispersion).abs() < 1e-9);
        prop_assert!((medium.n_d() - ior).abs() < 1e-14);
    }

    #[test]
    fn no_input_panics(a in prop::num::f64::ANY, b in prop::num::f64::ANY, c in prop::num::f64::ANY) {
        for medium in [
            Dispersion::constant(a),
            Dispersion::cauchy(&[a, b, c]),
            Dispersion::sellmeier([[a, b], [b, c]]),
            Dispersion::from_khr(a, b),
            Dispersion::from_abbe(OffsetConvention::Specgen, a, b),
        ].into_iter().flatten() {
            prop_assert!(medium.n_d() >= 1.0 && medium.khr_dispersion() >= 0.0, "{:?}", medium);
        }
    }
}
