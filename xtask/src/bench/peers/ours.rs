//! Our methods at growing effort.

use anyhow::{Context, Result};
use asm_core::{Method, PASSES, Reflections, Settings, bake_plan};
use frame_plan::Executor;
use frame_plan::cpu::CpuExecutor;
use serde::Serialize;
use spectral_scene::bundled;
use xtask::executors;
use xtask::frame_time::{WarmFrames, median};

use super::report::Truth;
use super::{SCENES, SIZE};
use crate::bench::Args;

/// Methods with their wavelengths and the sides of the light's view that they are tried with.
const COURSES: [(Method, u32, &[u32]); 3] = [
    (Method::Footprint, 3, &[48, 64, 96, 128, 192, 256]),
    (Method::Footprint, 4, &[128]),
    (Method::Asm, 21, &[256, 512]),
];

/// A setting on a mesh.
#[derive(Debug, Serialize)]
pub(super) struct OurResult {
    pub(super) scene: &'static str,
    pub(super) method: &'static str,
    pub(super) wavelengths: u32,
    pub(super) emission_size: u32,
    /// Of a warm frame, on the wall and of all threads.
    pub(super) ms: f64,
    pub(super) cpu_ms: Option<f64>,
    /// RMS of Y by the mean, net of the truth's own error.
    pub(super) error: f64,
}

pub(super) fn measure(truth: &Truth, args: &Args) -> Result<Vec<OurResult>> {
    let mut executor = CpuExecutor::new(PASSES, None)?;
    let mut results = Vec::new();
    for name in SCENES {
        let scene = bundled(name).with_context(|| format!("no scene {name}"))?;
        let receiver = scene.receiver("receiver")?;
        for (method, wavelengths, sizes) in COURSES {
            for &emission_size in sizes {
                // What glass reflects outside is a part of the peers' light.
                let settings = Settings {
                    wavelengths: Some(wavelengths),
                    emission_size,
                    reflections: Reflections::All,
                    ..Settings::of(method)
                };
                let plan = bake_plan(&scene, receiver, [SIZE as u32; 2], &settings, &executor.limits())?;
                let (maps, _) = executors::bake(&plan, &mut executor)?;
                let y = maps.refracted.iter().zip(&maps.reflected).map(|(a, b)| f64::from(a[1] + b[1]));
                let error = truth.error(y);
                let warm = WarmFrames::of(&plan.plan, &mut executor)?;
                let (mut ms, mut cpu_ms) = (Vec::new(), Vec::new());
                for _ in 0..args.rounds {
                    let before = cpu_seconds();
                    ms.push(warm.round_ms(&mut executor)?);
                    let spent = cpu_seconds().zip(before).map(|(after, before)| after - before);
                    cpu_ms.extend(spent.map(|seconds| 1e3 * seconds / f64::from(warm.batch())));
                }
                let result = OurResult {
                    scene: name,
                    method: method.name(),
                    wavelengths,
                    emission_size,
                    ms: median(ms),
                    cpu_ms: (!cpu_ms.is_empty()).then(|| median(cpu_ms)),
                    error,
                };
                eprintln!("  {result}");
                results.push(result);
            }
        }
    }
    Ok(results)
}

impl std::fmt::Display for OurResult {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { scene, method, wavelengths, emission_size, ms, error, .. } = self;
        write!(
            f,
            "{scene}, {method} {wavelengths}, {emission_size} x {emission_size}: {:.2} % in {ms:.1} ms",
            100.0 * error
        )
    }
}

/// Processor time of this process, all threads; `None` where the system does not say. `proc_pid_stat(5)`, fields 14 and 15.
fn cpu_seconds() -> Option<f64> {
    /// Linux reports in hundredths of a second on every architecture that we run on.
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name in parentheses may hold spaces.
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS_PER_SECOND)
}
