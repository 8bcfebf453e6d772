//! Prices of one scene on one executor.

use std::time::{Duration, Instant};

use asm_core::{Price, PriceList, Rung, bake_plan, render_plan, rungs};
use frame_plan::{Executor, Plan};
use serde::Serialize;
use spectral_reference::{BakeSettings, bake};
use spectral_scene::IrradianceMaps;

use super::{Frame, Subject};
use crate::error::CliError;
use crate::frame_time::WarmFrames;
use crate::lamps::white_xyz;
use crate::layers::Layer;
use crate::metrics::{Map, Metrics, compare, mean_of};
use crate::net_error::delta_e_mean;

/// What a list costs.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Effort {
    /// Texels across and down where errors are taken: few, so that the oracle has many photons for each.
    pub(super) texels: [u32; 2],
    /// Of each of the oracle's two halves.
    pub(super) photons: u64,
    /// What is tried, cheap ones first.
    pub(super) rungs: Vec<Rung>,
    /// No further rung is begun then.
    pub(super) patience: Duration,
    /// Of the oracle.
    pub(super) threads: Option<usize>,
}

impl Default for Effort {
    fn default() -> Self {
        let mut rungs = rungs();
        rungs.sort_by_key(Rung::aimed);
        let patience = Duration::from_secs(60);
        Self { texels: [64, 64], photons: 1 << 22, rungs, patience, threads: None }
    }
}

/// The oracle's share of the progress.
const ORACLE_PROGRESS: f64 = 0.3;

/// Measure. A rung that the device cannot do has no price.
///
/// # Errors
/// If the oracle fails, sees no light to compare, or no rung has a price.
pub(super) fn list(
    subject: &Subject<'_>,
    effort: &Effort,
    executor: &mut dyn Executor,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<PriceList, CliError> {
    let oracle = Oracle::of(subject, effort, &|share| progress(ORACLE_PROGRESS * share))?;
    let start = Instant::now();
    let (mut list, mut problem) = (PriceList::default(), String::new());
    for (i, rung) in effort.rungs.iter().enumerate() {
        if start.elapsed() > effort.patience {
            break;
        }
        match price(subject, effort, &oracle, rung, executor) {
            Ok(price) => list.prices.push(price),
            Err(why) => problem = format!("{rung}: {why}"),
        }
        let done = (i + 1) as f64 / effort.rungs.len() as f64;
        progress(ORACLE_PROGRESS + (1.0 - ORACLE_PROGRESS) * done);
    }
    if list.prices.is_empty() {
        let scene = &subject.scene.name;
        return Err(CliError::failed(format!("{scene}: nothing can be priced on this device; {problem}")));
    }
    Ok(list)
}

fn price(
    subject: &Subject<'_>,
    effort: &Effort,
    oracle: &Oracle,
    rung: &Rung,
    executor: &mut dyn Executor,
) -> Result<Price, String> {
    let (limits, settings) = (executor.limits(), rung.settings());
    let Subject { scene, receiver, frame } = *subject;
    let small = bake_plan(scene, receiver, effort.texels, &settings, &limits).map_err(|e| e.to_string())?;
    run_once(executor, &small.plan)?;
    let (maps, _) = small.read(executor).map_err(|e| e.to_string())?;
    let delta_e = oracle.delta_e(&maps)?;
    let plan = match frame {
        Frame::Bake(size) => {
            bake_plan(scene, receiver, [size.width, size.height], &settings, &limits).map(|plan| plan.plan)
        }
        Frame::Picture { camera, size } => {
            render_plan(scene, camera, [size.width, size.height], &settings, &limits).map(|plan| plan.plan)
        }
    };
    let plan = plan.map_err(|e| e.to_string())?;
    run_once(executor, &plan)?;
    let ms = WarmFrames::of(&plan, executor).and_then(|warm| warm.round_ms(executor));
    Ok(Price { rung: rung.clone(), ms: ms.map_err(|e| e.to_string())?, delta_e })
}

fn run_once(executor: &mut dyn Executor, plan: &Plan) -> Result<(), String> {
    executor.prepare(plan).and_then(|()| executor.execute()).map_err(|error| error.to_string())
}

/// The mean of two independent halves, and what tells its noise.
struct Oracle {
    size: [usize; 2],
    layer: Layer,
    xyz: Vec<[f32; 3]>,
    noise: Metrics,
    white_xyz: [f64; 3],
}

impl Oracle {
    fn of(subject: &Subject<'_>, effort: &Effort, progress: &(dyn Fn(f64) + Sync)) -> Result<Self, CliError> {
        let half = |seed: u64| {
            let settings = BakeSettings {
                size: effort.texels,
                effort: spectral_reference::Effort::Photons(effort.photons),
                threads: effort.threads,
                seed,
                ..BakeSettings::default()
            };
            let progress = |share: f64| progress(0.5 * (seed as f64 + share));
            bake(subject.scene, subject.receiver, &settings, &progress).map_err(CliError::failed)
        };
        let halves = [half(0)?.maps, half(1)?.maps];
        let layer = Layer::of_caustic(&halves[0]);
        let name = &subject.scene.objects[subject.receiver].name;
        let layer = layer.ok_or_else(|| {
            CliError::failed(format!("{name} is black: there is no error to price anything by"))
        })?;
        let [half, other] = halves.each_ref().map(|maps| layer.of(maps));
        let xyz = mean_of(half.xyz, other.xyz);
        let white_xyz = white_xyz(subject.scene);
        let noise = compare(&half, &Map { xyz: &xyz, ..half }, white_xyz).map_err(CliError::failed)?;
        Ok(Self { size: half.size, layer, noise, white_xyz, xyz })
    }

    /// Mean CIEDE2000 without the oracle's noise.
    fn delta_e(&self, maps: &IrradianceMaps) -> Result<f64, String> {
        let oracle = Map { size: self.size, xyz: &self.xyz };
        let distance = compare(&self.layer.of(maps), &oracle, self.white_xyz).map_err(|e| e.to_string())?;
        let net = delta_e_mean(&distance, &self.noise);
        net.map(|net| net.error).ok_or_else(|| "too little of the receiver is lit to judge colour".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::Size;
    use asm_core::PASSES;
    use frame_plan::cpu::CpuExecutor;
    use spectral_scene::bundled;

    /// A list of few rungs, with its progress.
    fn listed(scene: &str, frame: Frame, rungs: Vec<Rung>) -> Result<PriceList, CliError> {
        let scene = bundled(scene).expect("a bundled scene");
        let receiver = scene.receiver("receiver").expect("a receiver");
        let effort = Effort { texels: [32; 2], photons: 1 << 15, rungs, ..Effort::default() };
        let mut executor = CpuExecutor::new(PASSES, None).expect("the CPU");
        list(&Subject { scene: &scene, receiver, frame }, &effort, &mut executor, &|_| {})
    }

    const SMALL: Size = Size { width: 32, height: 32 };

    #[test]
    fn rungs_get_prices_for_bakes_and_pictures() {
        let cheapest = Effort::default().rungs[..1].to_vec();
        for frame in [Frame::Bake(SMALL), Frame::Picture { camera: 0, size: SMALL }] {
            let list = listed("sphere", frame, cheapest.clone()).expect("a list");
            let [price] = list.prices.as_slice() else { panic!("{list:?}") };
            assert!(price.ms > 0.0 && price.delta_e > 0.0 && price.delta_e < 50.0, "{price:?}");
        }
    }

    #[test]
    fn rungs_that_cannot_be_done_have_no_price_and_none_at_all_is_an_error() {
        let mut rungs = Effort::default().rungs[..2].to_vec();
        rungs[0].emission_size = 20_000;
        let list = listed("sphere", Frame::Bake(SMALL), rungs.clone()).expect("a list");
        assert_eq!(list.prices.len(), 1);
        let error = listed("sphere", Frame::Bake(SMALL), rungs[..1].to_vec()).expect_err("nothing");
        assert!(error.to_string().contains("emission_size"), "{error}");
    }
}
