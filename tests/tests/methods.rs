//! What the methods promise, on every executor.

use asm_core::{BakePlan, Emission, Settings, Statistics, bake_plan};
use frame_plan::{Executor, Limits};
use workspace_tests::{executors, subject};
use xtask::subject::Subject;

/// Words of a buffer after a frame, and the statistics.
fn buffer_of(
    subject: &Subject,
    settings: &Settings,
    name: &str,
    executor: &mut dyn Executor,
) -> (Vec<u8>, Statistics) {
    let mut plan: BakePlan =
        bake_plan(&subject.scene, subject.receiver, [32; 2], settings, &Limits::default())
            .unwrap_or_else(|error| panic!("{}: {error}", subject.name));
    let buffer = plan.plan.resource(name).unwrap_or_else(|| panic!("no buffer {name}"));
    plan.plan.resources[buffer.0 as usize].readable = true;
    executor.prepare(&plan.plan).unwrap_or_else(|error| panic!("{}: {error}", subject.name));
    let mut frame = || {
        executor.execute().unwrap_or_else(|error| panic!("{}: {error}", subject.name));
        executor.read(buffer).unwrap_or_else(|error| panic!("{}: {error}", subject.name))
    };
    let first = frame();
    let again = frame();
    assert!(first == again, "{}: {name} differs from frame to frame", subject.name);
    let (_, statistics) = plan.read(executor).unwrap_or_else(|error| panic!("{}: {error}", subject.name));
    (first, statistics)
}

fn small() -> Settings {
    Settings { emission_size: 120, map_size: Some(96), wavelengths: Some(3), ..Settings::default() }
}

#[test]
fn adaptive_emission_gives_the_grids_map_on_every_executor() {
    for name in ["ring", "gem", "water"] {
        let subject = subject(name);
        let mut counts = Vec::new();
        for (id, executor) in &mut executors() {
            let mut map = |emission| {
                let settings = Settings { emission: Some(emission), ..small() };
                buffer_of(&subject, &settings, "map", executor.as_mut())
            };
            let (grid, books) = map(Emission::Grid);
            assert!(grid.iter().any(|&b| b != 0), "{name} on {id}: an empty map shows nothing");
            for levels in [1, 3, 6] {
                let (adaptive, adaptive_books) = map(Emission::Adaptive { levels });
                assert!(adaptive == grid, "{name} on {id}: {levels} levels give another map");
                assert_eq!(adaptive_books.photons, books.photons, "{name} on {id}");
                for ledger in adaptive_books.lights.iter().flat_map(|l| &l.ledgers) {
                    assert!(ledger.balances(), "{name} on {id}: {ledger:?}");
                }
                counts.push((levels, adaptive_books.lights[0].levels.clone()));
            }
        }
        // Silhouettes may fall to the other side of a texel's centre.
        for (levels, of_one) in &counts {
            for (_, of_other) in counts.iter().filter(|(other, _)| other == levels) {
                for (a, b) in of_one.iter().zip(of_other) {
                    let room = 2 + a.cells / 500;
                    assert!(a.cells.abs_diff(b.cells) <= room, "{name}: {a:?} against {b:?}");
                }
            }
        }
    }
}
