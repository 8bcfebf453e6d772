//! Bakes the caustic of the bundled glass sphere without a window, and says what it cost.
//!
//! `cargo run -p asm-wgpu --example headless [SCENE] [ADAPTER]`

use asm_core::{PASSES, Settings, bake_plan};
use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::Executor;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (scene, _) = spectral_scene::open(&arguments.next().unwrap_or_else(|| "sphere".into()))?;
    let mut executor = WgpuExecutor::new(PASSES, &WgpuOptions { adapter: arguments.next() })?;
    println!("{}", executor.info());

    let receiver = scene.receiver("receiver")?;
    let bake = bake_plan(&scene, receiver, [256, 256], &Settings::default(), &executor.limits())?;
    executor.prepare(&bake.plan)?;
    executor.execute()?;
    let (maps, statistics) = bake.read(&mut executor)?;

    let brightest = maps.refracted.iter().map(|[_, y, _]| *y).fold(0.0, f32::max);
    println!("{} photons met glass; the brightest texel has {brightest:.3} lx", statistics.photons);
    for step in &statistics.step_times {
        println!("{:9.3} ms  {}", step.milliseconds, step.name);
    }
    Ok(())
}
