//! A whole ladder, tiny: two scenes' worth of work would be too slow here, so one scene, two rungs and the CPU.

use std::fs;

use asm_core::{Emission, GapFilling, Method, Refraction};
use xtask::prt::Way;

use super::*;

fn tiny() -> Effort {
    Effort {
        receiver_size: [32, 32],
        pond_samples: 24,
        picture_size: [32, 18],
        oracle: Photons::Photons(1 << 15),
        oracle_samples: 2,
        oracle_picture_photons: 1 << 10,
        rounds: 1,
    }
}

fn rung(emission_size: u32) -> Rung {
    Rung {
        method: Method::CausticsMap,
        wavelengths: 3,
        emission_size,
        emission: Emission::Grid,
        refraction: Refraction::ImageSpace,
        gap_filling: GapFilling::None,
        map_size: 64,
    }
}

fn climbed(rungs: &[Rung], sabotage: Option<Sabotage>, kept: &Kept) -> Ladder {
    let subject = Subject::open("sphere", &paths::workspace_root()).expect("a bundled scene");
    let cpu = executors::named(&["cpu".into()]).expect("an executor");
    let mut climbers: Vec<_> = cpu.into_iter().map(|c| Climber::new(c, "")).collect();
    let mut ladder = Ladder::new(tiny(), sabotage);
    let truth = truth::of(&subject, &ladder.effort, kept, "test").expect("an oracle");
    ladder.climb(&subject, &truth, rungs, &mut climbers);
    ladder.executors = climbers.into_iter().map(|climber| climber.entry).collect();
    ladder
}

#[test]
fn a_small_ladder_has_every_method_and_unknown_ones_are_named() {
    let (small, all) = (super::rungs(&[], true), super::rungs(&[], false));
    assert!(small.len() < all.len() && small.iter().all(|rung| all.contains(rung)));
    for axes in LADDER {
        let name = axes.method.name();
        let own = super::rungs(&[name.to_owned()], true);
        assert!(!own.is_empty() && own.iter().all(|rung| rung.method == axes.method), "{name}");
    }
    assert!(LADDER.iter().map(|axes| axes.method.name()).eq(page::FAMILY.methods.iter().copied()));
    for name in pond::METHODS {
        let own = pond::rungs(&[name.to_owned()], true);
        assert!(!own.is_empty() && own.iter().all(|rung| rung.method() == name), "{name}");
        assert!(
            check_methods(&[name.to_owned()]).is_ok() && super::rungs(&[name.to_owned()], true).is_empty()
        );
    }
    for name in prt::METHODS {
        let own = prt::rungs(&[name.to_owned()], true);
        assert!(!own.is_empty() && own.iter().all(|rung| rung.way.basis() == name), "{name}");
        let all = prt::rungs(&[name.to_owned()], false);
        assert!(own.len() < all.len() && own.iter().all(|rung| all.contains(rung)), "{name}");
        assert!(
            check_methods(&[name.to_owned()]).is_ok() && pond::rungs(&[name.to_owned()], true).is_empty()
        );
    }
    let error = check_methods(&["asn".to_owned()]).expect_err("no such method").to_string();
    assert!(error.contains("asn") && error.contains("caustics-map, acm, asm"), "{error}");
}

fn folder(test: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("spectral-ladder-{test}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

#[test]
fn rungs_have_prices_and_refused_ones_are_rows() {
    let folder = folder("whole");
    let kept = Kept::in_folder(folder.join("oracle"));
    // No device has a view of this size.
    let ladder = climbed(&[rung(32), rung(64), rung(20_000)], None, &kept);
    assert_eq!(ladder.failures(false), Vec::<String>::new());
    assert_eq!((ladder.rows.len(), ladder.refused()), (3, 1));
    let outcome = ladder.rows[1].outcome.as_ref().expect("measured");
    assert!(outcome.error.rms_64 > 0.0 && outcome.error.rms_64 < 0.3, "{outcome:?}");
    assert!(outcome.frame.ms > 0.0 && outcome.photons > 0 && outcome.flip.is_some(), "{outcome:?}");
    assert!(ladder.rows.iter().any(|row| row.on_delta_e_front));
    assert!(!ladder.rows[2].on_delta_e_front && !ladder.rows[2].on_rms_front);
    assert!(ladder.controls.len() == 3 && ladder.controls.iter().all(|control| control.failed));

    ladder.write(&folder).expect("written");
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&read("ladder.json")).expect("JSON");
    assert_eq!(json["rows"][0]["rung"]["method"], "caustics-map");
    assert_eq!(json["rows"][2]["problem"]["kind"], "refused");
    let csv = read("ladder.csv");
    assert_eq!(csv.lines().count(), 4, "{csv}");
    assert!(csv.starts_with("scene,executor,method,") && csv.contains("20000"), "{csv}");
    let html = read("ladder.html");
    assert!(html.contains("<svg") && html.contains("halving the error cost"), "{html}");
    assert!(read("ladder.svg").contains("sphere"));
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn a_second_run_takes_the_oracle_that_was_kept_and_a_damaged_one_is_made_again() {
    let folder = folder("kept");
    let kept = Kept::in_folder(folder.clone());
    let subject = Subject::open("gem", &paths::workspace_root()).expect("a bundled scene");
    let truth = |program: &str| truth::of(&subject, &tiny(), &kept, program).expect("an oracle");
    let first = truth("v1");
    assert!(!first.noise.kept && first.noise.half.rms > 0.0);
    let again = truth("v1");
    assert!(again.noise.kept);
    assert_eq!((&again.maps, &again.noise.half), (&first.maps, &first.noise.half));
    assert_eq!(again.noise.half_flip, first.noise.half_flip);
    assert!(!truth("v2").noise.kept, "another program");
    for entry in fs::read_dir(&folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let mut bytes = fs::read(&path).expect("kept");
        bytes.truncate(bytes.len() / 2);
        fs::write(&path, bytes).expect("written");
    }
    let third = truth("v1");
    assert!(!third.noise.kept);
    assert_eq!(third.maps, first.maps);
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn sabotage_is_noticed_and_never_ends_well() {
    let folder = folder("sabotage");
    let kept = Kept::in_folder(folder.clone());
    let ladder = climbed(&[rung(64)], Some(Sabotage::Ior), &kept);
    assert!(ladder.rows[0].spoiled && !ladder.rows[0].on_delta_e_front);
    assert_eq!(
        ladder.failures(false),
        [
            "every refractive index 0.05 too large: 1 of 1 spoiled rungs are farther from the oracle than as they were"
        ]
    );
    fs::remove_dir_all(folder).expect("removed");
}

/// A small pond's price list on the CPU.
fn climbed_pond(sabotage: Option<Sabotage>) -> Ladder {
    let cpu = executors::named(&["cpu".into()]).expect("an executor");
    let mut climbers: Vec<_> = cpu.into_iter().map(|c| Climber::new(c, "")).collect();
    let mut ladder = Ladder::new(tiny(), sabotage);
    let mut pairs = pond::Pair::of(&mut climbers, "");
    let samples = ladder.effort.pond_samples;
    ladder.climb_pond(&PRICED_PONDS[0], samples, &pond::rungs(&[], true), &mut pairs);
    pairs.into_iter().for_each(pond::Pair::settle);
    ladder.executors = climbers.into_iter().map(|climber| climber.entry).collect();
    ladder
}

#[test]
fn a_pond_has_prices_of_every_method_and_controls_that_fail() {
    let folder = folder("pond");
    let ladder = climbed_pond(None);
    assert_eq!(ladder.failures(false), Vec::<String>::new());
    let rms = |row: &pond::Row| row.outcome.as_ref().expect("measured").error.rms;
    let of = |method: &str| -> Vec<f64> {
        ladder.pond_rows.iter().filter(|row| row.rung.method() == method).map(rms).collect()
    };
    // The paper's expansion knows nothing of light from 20 degrees; terms keep what they were asked for, nearly.
    assert!(of("convolution").iter().all(|rms| *rms > 0.5), "{:?}", of("convolution"));
    let low_rank = of("low-rank");
    assert!(low_rank.iter().zip([0.1, 0.01, 0.001]).all(|(rms, asked)| *rms < 1.3 * asked), "{low_rank:?}");
    assert!(of("photon").iter().all(|rms| *rms < 0.05), "{:?}", of("photon"));
    // Three of the sums, three of photons.
    assert!(ladder.controls.len() == 6 && ladder.controls.iter().all(|control| control.failed));
    assert!(ladder.pond_rows.iter().filter(|row| row.rung.method() == "photon").all(|row| row.on_front));

    ladder.write(&folder).expect("written");
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&read("ladder.json")).expect("JSON");
    assert_eq!(json["pond_rows"][0]["rung"]["method"], "convolution");
    assert!(json["ponds"][0]["exact_ms"].as_f64().is_some_and(|ms| ms > 0.0));
    assert_eq!(read("ladder.csv").lines().count(), 1 + ladder.pond_rows.len());
    let html = read("ladder.html");
    assert!(html.contains("pond-gentle-20") && html.contains("halving the error cost"), "{html}");
    assert!(read("ladder-pond.svg").contains("pond-gentle-20"));
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn a_spoiled_pond_never_ends_well() {
    let ladder = climbed_pond(Some(Sabotage::Channel));
    assert!(ladder.pond_rows.iter().all(|row| row.spoiled && !row.on_front));
    assert_eq!(ladder.controls.len(), ladder.pond_rows.len());
    assert!(ladder.controls.iter().all(|control| control.failed || control.name.contains("convolution")));
    assert!(!ladder.failures(false).is_empty());
}

/// A small figure's price list on the CPU: RGB and five coefficients with few bands and with many.
fn climbed_figure(test: &str, sabotage: Option<Sabotage>) -> Ladder {
    let folder = folder(test);
    let cpu = executors::named(&["cpu".into()]).expect("an executor");
    let mut climbers: Vec<_> = cpu.into_iter().map(|c| Climber::new(c, "")).collect();
    let mut ladder = Ladder::new(tiny(), sabotage);
    let mut relighting = prt::climbers(&climbers, "");
    let rungs = prt::rungs(&[], true).into_iter().filter(|rung| match rung.way {
        Way::Rgb | Way::Optimal(5 | 8) => rung.bands.count() != 5,
        _ => false,
    });
    let subject = PRICED_PRT.iter().find(|subject| subject.name == "prt-soft-box").expect("a figure");
    ladder.climb_prt(subject, &rungs.collect::<Vec<_>>(), &folder, &mut relighting);
    prt::settle(relighting, &mut climbers);
    ladder.executors = climbers.into_iter().map(|climber| climber.entry).collect();
    fs::remove_dir_all(folder).expect("removed");
    ladder
}

#[test]
fn a_figure_has_prices_and_controls_that_fail() {
    let folder = folder("figure");
    let ladder = climbed_figure("figure-transfer", None);
    assert_eq!(ladder.failures(false), Vec::<String>::new());
    let mean = |way: Way, bands: usize| {
        let row =
            ladder.figure_rows.iter().find(|row| row.rung.way == way && row.rung.bands.count() == bands);
        row.and_then(|row| row.outcome.as_ref()).expect("measured").error.cie94_mean
    };
    // A lamp 20 degrees wide is more than three bands can tell; RGB errs with any number of them.
    assert!(mean(Way::Optimal(5), 3) > 3.0 * mean(Way::Optimal(5), 8));
    assert!(mean(Way::Rgb, 8) > 5.0 && mean(Way::Rgb, 3) > 5.0);
    assert!(mean(Way::Optimal(8), 8) < mean(Way::Optimal(5), 8));
    // Two of the plan, four of frames.
    assert!(ladder.controls.len() == 6 && ladder.controls.iter().all(|control| control.failed));
    assert!(ladder.figure_rows.iter().any(|row| row.on_front));
    assert!(ladder.figures[0].judged_share > 0.0);

    ladder.write(&folder).expect("written");
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("a file");
    let json: serde_json::Value = serde_json::from_str(&read("ladder.json")).expect("JSON");
    let row = &json["figure_rows"][0];
    assert_eq!((&row["rung"]["basis"], &row["rung"]["bands"]), (&"rgb".into(), &3.into()));
    assert!(row["outcome"]["cie94_mean"].as_f64().is_some_and(|v| v > 5.0), "{row}");
    assert_eq!(read("ladder.csv").lines().count(), 1 + ladder.figure_rows.len());
    let html = read("ladder.html");
    assert!(html.contains("prt-soft-box") && html.contains("halving the error cost"), "{html}");
    assert!(read("ladder-prt.svg").contains("prt-soft-box"));
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn a_spoiled_figure_never_ends_well_and_nothing_to_spoil_is_said() {
    let ladder = climbed_figure("figure-spoiled", Some(Sabotage::Channel));
    assert!(ladder.figure_rows.iter().all(|row| row.spoiled && !row.on_front));
    assert_eq!(ladder.controls.len(), ladder.figure_rows.len());
    assert!(ladder.controls.iter().all(|control| control.failed) && !ladder.failures(false).is_empty());
    let nothing = climbed_figure("figure-ior", Some(Sabotage::Ior));
    assert!(nothing.controls.is_empty() && nothing.figure_rows.iter().all(|row| !row.spoiled));
    assert!(nothing.failures(false).iter().any(|failure| failure.starts_with("nothing to spoil")));
}
