//! Passes on the CPU executor, each by its own time in the frame, and what the host does to move a plan on.

use std::time::Duration;

use asm_core::{Method, PASSES, RenderPlan, Settings, Splat, render_plan};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use frame_plan::cpu::CpuExecutor;
use frame_plan::{Executor, Limits};
use spectral_scene::{Scene, bundled};

/// Pixels of a frame.
const SIZE: [u32; 2] = [320, 180];

fn scene(name: &str) -> Scene {
    bundled(name).expect("a bundled scene")
}

fn plan(scene: &Scene, settings: &Settings, limits: &Limits) -> RenderPlan {
    render_plan(scene, 0, SIZE, settings, limits).expect("bundled scenes make plans")
}

/// Passes of a method on a scene; photons per second for those that trace them.
fn passes(criterion: &mut Criterion, name: &str, settings: &Settings, passes: &[&str]) {
    let mut executor = CpuExecutor::new(PASSES, None).expect("threads start");
    let limits = executor.limits();
    let plan = plan(&scene(name), settings, &limits);
    executor.prepare(&plan.plan).expect("the plan fits the processor");
    executor.execute().expect("a prepared plan runs");
    let photons = plan.read(&mut executor).expect("a frame has run").1.photons;
    let mut group = criterion.benchmark_group(format!("{name}, {:?}, {:?}", settings.method, settings.splat));
    group.sample_size(10);
    for pass in passes {
        if *pass == "photon_trace" {
            group.throughput(Throughput::Elements(photons));
        }
        group.bench_function(*pass, |bencher| {
            bencher.iter_custom(|frames| {
                let mut milliseconds = 0.0;
                for _ in 0..frames {
                    executor.execute().expect("a prepared plan runs");
                    let times = executor.step_times();
                    let own = times.iter().filter(|step| step.name.split(" (").next() == Some(pass));
                    milliseconds += own.map(|step| step.milliseconds).sum::<f64>();
                }
                Duration::from_secs_f64(1e-3 * milliseconds)
            });
        });
    }
    group.finish();
}

fn hot_passes(criterion: &mut Criterion) {
    let asm = Settings { emission_size: 256, ..Settings::of(Method::Asm) };
    passes(criterion, "sphere", &asm, &["visibility", "photon_trace", "shade", "deferred_refraction"]);
    passes(criterion, "sphere", &Settings { splat: Splat::Point, ..asm.clone() }, &["photon_trace"]);
    passes(criterion, "gem", &asm, &["photon_trace"]);
    passes(criterion, "prism", &asm, &["gap_reach", "gap_fill", "map_resolve"]);
    passes(criterion, "organic", &asm, &["visibility", "photon_trace"]);
}

/// What a frame costs the host whose scene has moved.
fn plans(criterion: &mut Criterion) {
    let settings = Settings::of(Method::Asm);
    for name in ["sphere", "ring", "organic"] {
        let scene = scene(name);
        criterion.bench_function(&format!("plan of {name}"), |b| {
            b.iter(|| plan(&scene, &settings, &Limits::default()));
        });
    }
}

criterion_group!(benches, hot_passes, plans);
criterion_main!(benches);
