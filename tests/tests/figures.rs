//! The figures of spectral transfer as `cargo xtask compare` and `ladder` take them, small: executors show the same, and what f64 shows.

use std::path::PathBuf;

use frame_plan::{Executor, Limits};
use spectral_prt::{Bands, Relighting};
use workspace_tests::prt_executors;
use xtask::prt::{
    ColourDistance, Colours, Fault, Lit, PRT, PixelDistance, Reference, Stage, Way, something_to_compare,
    spoiled,
};
use xtask::sabotage::Sabotage;

/// Rounding of some hundred products, as a share of the brightest Y.
const ROUNDING: f64 = 1e-5;
const BANDS: u8 = 4;

/// A figure while it is shown.
struct Shown {
    stage: Stage,
    reference: Reference,
}

impl Shown {
    fn open(name: &str, size: [u32; 2]) -> Self {
        let subject = PRT.iter().find(|subject| subject.name == name).expect("a figure");
        // Tests of one figure, in one process, ask for their own sizes.
        let [width, height] = size;
        let folder: PathBuf =
            std::env::temp_dir().join(format!("spectral-{name}-{width}x{height}-{}", std::process::id()));
        let stage = Stage::open(subject, Bands::new(BANDS).expect("bands"), &folder).expect("a figure");
        std::fs::remove_dir_all(folder).expect("removed");
        let reference = stage.reference(size);
        Self { stage, reference }
    }

    fn lit(&self) -> Lit {
        let lamp = self.stage.subject.lamps[0];
        Lit { lamp, bands: self.stage.transfer.bands(), factor: self.reference.exposure() }
    }

    fn plan(&self, colours: &Colours, fault: Option<Fault>) -> Relighting {
        let own = &self.stage.figure.reflectances;
        let reflectances = fault.map_or(own.into(), |fault| fault.reflectances(own));
        let (transfer, size) = (&self.stage.transfer, self.reference.size);
        self.stage.relighting(colours, &reflectances, transfer, size, &Limits::default()).expect("a plan")
    }

    fn frame(&self, colours: &Colours, fault: Option<Fault>, executor: &mut dyn Executor) -> Vec<[f32; 3]> {
        let plan = self.plan(colours, fault);
        executor.prepare(&plan.plan).expect("a valid plan");
        let xyz = self.stage.frame(&plan, executor, colours, self.lit(), fault).expect("a frame");
        something_to_compare(&xyz).expect("a picture");
        xyz
    }

    /// In f64: sampled every 5 nm, or in these colours.
    fn truth(&self, colours: Option<&Colours>) -> Vec<[f64; 3]> {
        let Lit { lamp, factor, .. } = self.lit();
        self.reference.xyz(&self.stage.paints(lamp, colours), factor)
    }
}

#[test]
fn every_executor_shows_the_chart_on_the_knot_as_f64_does_and_notices_faults() {
    let shown = Shown::open("prt-color-checker", [96, 54]);
    assert!(shown.reference.certain_share() > 0.3, "{}", shown.reference.certain_share());
    let sampled = shown.truth(None);
    for way in [Way::Optimal(5), Way::Rgb] {
        let colours = shown.stage.colours(way).expect("a basis");
        let truth = shown.truth(Some(&colours));
        let apart = |xyz: &[[f32; 3]], truth: &[[f64; 3]]| {
            PixelDistance::of(xyz, truth, shown.reference.certain_pixels(), ROUNDING)
        };
        let mut first: Option<Vec<[f64; 3]>> = None;
        for (id, mut executor) in prt_executors() {
            let xyz = shown.frame(&colours, None, executor.as_mut());
            let of_f64 = apart(&xyz, &truth);
            println!("{way} on {id}, against f64: {of_f64:?}");
            assert!(of_f64.differing == 0.0, "{way} on {id}: {of_f64:?}");
            let first = first.get_or_insert_with(|| xyz.iter().map(|xyz| xyz.map(f64::from)).collect());
            let of_first = apart(&xyz, first);
            assert!(of_first.differing == 0.0, "{way} on {id}, against the first: {of_first:?}");
            let colour = ColourDistance::of(&xyz, &sampled, &shown.reference);
            let accurate = colour.cie94_mean <= 0.1 && colour.cie94_max <= 0.5;
            assert!(accurate == (way != Way::Rgb), "{way} on {id}: {colour:?}");
            for fault in Fault::ALL {
                let spoiled = shown.frame(&colours, Some(fault), executor.as_mut());
                for (what, other) in [("f64", &truth), ("the first", &*first)] {
                    let found = apart(&spoiled, other).differing;
                    assert!(found > 0.1, "{way} on {id}, against {what}: {} in {found}", fault.words());
                }
            }
        }
    }
}

/// Patches are where the chart has them, with their sampled colours, in f64; frames are these, and with a fault they are not.
#[test]
fn patches_are_what_they_are_in_f64_and_faults_have_their_size() {
    let shown = Shown::open("prt-patches", [64, 36]);
    assert!(shown.reference.certain_share() > 0.9);
    let truth = shown.truth(None);
    let paints = shown.stage.paints(shown.lit().lamp, None);
    // The second patch of the third row; patches are eight pixels across.
    let (x, y) = (8 + 8 + 4, 2 + 16 + 4);
    for (got, expected) in truth[y * 64 + x].iter().zip(paints[13]) {
        assert!((got - expected).abs() < 1e-6, "{got} {expected}");
    }
    let colours = shown.stage.colours(Way::Optimal(8)).expect("a basis");
    let (_, mut cpu) = prt_executors().swap_remove(0);
    let mut distance =
        |fault| ColourDistance::of(&shown.frame(&colours, fault, cpu.as_mut()), &truth, &shown.reference);
    let plain = distance(None);
    assert!(plain.cie94_max < 0.1, "{plain:?}");
    let brighter = distance(Some(Fault::Light));
    assert!((brighter.rms - 1e-3).abs() < 1e-4, "{brighter:?}");
    assert!(
        distance(Some(Fault::Lamp)).cie94_max > 1.0 && distance(Some(Fault::Reflectances)).cie94_max > 1.0
    );
    // An even sky has no direction.
    assert!(distance(Some(Fault::Sky)).cie94_max < 0.1);
}

#[test]
fn faults_of_plans_are_in_the_plan_where_there_is_a_place_for_them() {
    let shown = Shown::open("prt-patches", [16, 9]);
    let plan = shown.plan(&shown.stage.colours(Way::Optimal(5)).expect("a basis"), None).plan;
    assert!(spoiled(&plan, Sabotage::Ior) == plan, "nothing refracts");
    for sabotage in [Sabotage::Channel, Sabotage::Pass] {
        assert!(spoiled(&plan, sabotage) != plan, "{sabotage:?}");
    }
}
