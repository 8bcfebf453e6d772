//! The oracle's answer to a scene, and how far a method's is from it.

use asm_core::{Method, Settings, Statistics, bake_plan};
use frame_plan::{Executor, Limits};
use spectral_reference::{BakeSettings, Effort};
use spectral_scene::Scene;
use workspace_tests::agreement::on_one_driver;
use workspace_tests::executors;
use xtask::metrics::{Map, Metrics, compare, mean_of};
use xtask::net_error::{self, Net};
use xtask::subject::Subject;

use crate::stage::cpu;

/// Texels across and down the receiver.
pub(crate) const SIZE: u32 = 64;

/// Light that has been in glass, texel by texel.
pub(crate) type Layer = Vec<[f32; 3]>;

pub(crate) fn footprints(cells: u32) -> Settings {
    Settings { emission_size: cells + 1, ..Settings::of(Method::Footprint) }
}

/// What the receiver called `receiver` gets, on this executor; the books balance.
pub(crate) fn light_on(
    executor: &mut dyn Executor,
    scene: &Scene,
    settings: &Settings,
) -> (Layer, Statistics) {
    let plan = bake_plan(scene, scene.receiver("receiver").unwrap(), [SIZE; 2], settings, &Limits::default())
        .unwrap();
    let (maps, statistics) = xtask::executors::bake(&plan, executor).unwrap();
    assert!(
        statistics.lights.iter().flat_map(|l| &l.ledgers).all(|ledger| ledger.balances()),
        "{statistics:?}"
    );
    (maps.refracted, statistics)
}

/// On the CPU.
pub(crate) fn light_of(scene: &Scene, settings: &Settings) -> Layer {
    light_on(&mut cpu(), scene, settings).0
}

/// How far from the oracle, its noise taken away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Distance {
    /// Of Y, over the RMS of the oracle's.
    pub(crate) rms: Net,
    /// Mean CIEDE2000.
    delta_e: Net,
    /// Of all Y, over the oracle's.
    total_y: f64,
}

/// Most of each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Most {
    pub(crate) rms: f64,
    pub(crate) delta_e: f64,
    pub(crate) total_y: f64,
}

impl Distance {
    fn is_within(&self, most: Most) -> bool {
        self.rms.error <= most.rms
            && self.delta_e.error <= most.delta_e
            && (self.total_y - 1.0).abs() <= most.total_y
    }
}

/// The oracle's answer: the mean of two halves of it, and one half's distance from that, which is the mean's own.
pub(crate) struct Answer {
    pub(crate) mean: Layer,
    noise: Metrics,
    white_xyz: [f64; 3],
}

impl Answer {
    /// Of paths of one wavelength each, in all.
    pub(crate) fn of(scene: &Scene, photons: u64) -> Self {
        let receiver = scene.receiver("receiver").unwrap();
        let half = |seed| {
            let settings = BakeSettings {
                size: [SIZE; 2],
                effort: Effort::Photons(photons / 2),
                direct_samples: 1,
                seed,
                ..BakeSettings::default()
            };
            spectral_reference::bake(scene, receiver, &settings, &|_| {}).unwrap().maps.refracted
        };
        let halves = [half(1), half(2)];
        let mean = mean_of(&halves[0], &halves[1]);
        let white_xyz = Subject { name: scene.name.clone(), scene: scene.clone(), receiver }.white_xyz();
        let noise = metrics(&halves[0], &mean, white_xyz);
        Self { mean, noise, white_xyz }
    }

    pub(crate) fn distance(&self, layer: &[[f32; 3]]) -> Distance {
        let metrics = metrics(layer, &self.mean, self.white_xyz);
        Distance {
            rms: net_error::rms(&metrics, &self.noise),
            delta_e: net_error::delta_e_mean(&metrics, &self.noise).unwrap(),
            total_y: metrics.total_y,
        }
    }

    /// `layer` is the oracle's light, and `other`, light of a scene or of settings that differ in what the case is about, is not.
    pub(crate) fn tells(&self, case: &str, layer: &[[f32; 3]], other: &[[f32; 3]], most: Most) {
        let (own, others) = (self.distance(layer), self.distance(other));
        println!("{case}: {own:?}; control {others:?}; noise {:?}", self.noise);
        assert!(own.is_within(most), "{case}: {own:?}, at most {most:?}");
        assert!(!others.is_within(most), "{case}: the control went unnoticed: {others:?}, {most:?}");
    }
}

fn metrics(layer: &[[f32; 3]], reference: &[[f32; 3]], white_xyz: [f64; 3]) -> Metrics {
    let map = |xyz| Map { size: [SIZE as usize; 2], xyz };
    compare(&map(layer), &map(reference), white_xyz).unwrap()
}

/// Every executor's light is the CPU's: rounding only, and nothing at all on one driver. On a map of twice the floor's texels:
/// footprints are laid texel by texel, and round alike in any.
pub(crate) fn same_on_every_executor(case: &str, scene: &Scene, settings: &Settings) {
    let settings = &Settings { map_size: Some(2 * SIZE), ..settings.clone() };
    let made: Vec<_> = executors()
        .iter_mut()
        .map(|(id, executor)| (*id, executor.info().clone(), light_on(executor.as_mut(), scene, settings).0))
        .collect();
    let white_xyz = Subject { name: scene.name.clone(), scene: scene.clone(), receiver: 0 }.white_xyz();
    for (i, (a, device_a, light_a)) in made.iter().enumerate() {
        for (b, device_b, light_b) in &made[..i] {
            let apart = metrics(light_a, light_b, white_xyz);
            println!("{case}, {a} and {b}: {apart:?}");
            if on_one_driver(device_a, device_b) {
                assert!(light_a == light_b, "{case}, {a} and {b}, on one driver");
            }
            // A thousandth of the light may fall to the other side of an edge.
            assert!(apart.rms < 1e-3 && (apart.total_y - 1.0).abs() < 1e-4, "{case}, {a} and {b}: {apart:?}");
        }
    }
}
