//! Bakes the caustic of the bundled glass sphere without a window, and says what it cost.
//!
//! `cargo run -p asm-vulkan --example vulkan_headless [SCENE] [ADAPTER]`

use asm_core::{Settings, bake_plan};
use asm_vulkan::{ASM_PASSES, VulkanExecutor, VulkanOptions};
use frame_plan::Executor;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (scene, _) = spectral_scene::open(&arguments.next().unwrap_or_else(|| "sphere".into()))?;
    let options = VulkanOptions { adapter: arguments.next(), ..VulkanOptions::default() };
    let mut executor = VulkanExecutor::new(ASM_PASSES, &options)?;
    println!("{}, {}", executor.info().device, executor.info().driver);

    let receiver = scene.receiver("receiver")?;
    let bake = bake_plan(&scene, receiver, [256, 256], &Settings::default(), &executor.limits())?;
    executor.prepare(&bake.plan)?;
    executor.execute()?;
    let (maps, statistics) = bake.read(&mut executor)?;

    let texels = maps.direct.len() as f64;
    for (name, layer) in [("direct", &maps.direct), ("refracted", &maps.refracted)] {
        let mean = |c: usize| layer.iter().map(|t| f64::from(t[c])).sum::<f64>() / texels;
        let most = layer.iter().map(|t| t[1]).fold(0.0, f32::max);
        println!("{name}: mean XYZ {:.4} {:.4} {:.4}, largest Y {most:.3}", mean(0), mean(1), mean(2));
    }
    let landed: u64 =
        statistics.lights.iter().flat_map(|l| &l.ledgers).map(|l| u64::from(l.landed.photons)).sum();
    println!("{} photons met glass, {landed} landed", statistics.photons);
    for step in &statistics.step_times {
        println!("{:9.3} ms  {}", step.milliseconds, step.name);
    }
    Ok(())
}
