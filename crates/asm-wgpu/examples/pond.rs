//! Pebbles in a pond, without a window: the light on its floor frame by frame, of the list of pebbles alone.
//!
//! `cargo run -p asm-wgpu --example pond [ADAPTER]`. A Vulkan program differs in one line: the executor is
//! `VulkanExecutor::new(caustic_heightfield::SPIRV_PASSES, &options)`, with feature `spirv` of `caustic-heightfield`.

use asm_wgpu::{WgpuExecutor, WgpuOptions};
use caustic_heightfield::{
    HeightSource, Impulse, LowRank, LowRankSettings, PASSES, PlanSettings, Pond, Ripple, WallImages,
    impulse_heights, light_tilted_deg,
};
use frame_plan::Executor;

/// Samples of the surface and the floor.
const SIZE: [usize; 2] = [128, 128];
/// Metres.
const EXTENT_M: [f64; 2] = [1.0, 1.0];
const FRAMES: u32 = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut executor = WgpuExecutor::new(PASSES, &WgpuOptions { adapter: std::env::args().nth(1) })?;
    println!("{}", executor.info());

    let pebble = |x, y, start_s| Impulse { position_m: [x, y], start_s, amplitude_m: 0.002 };
    let pebbles = [pebble(0.3, 0.4, 0.0), pebble(0.8, 0.7, 0.7)];
    let heights =
        |time_s| impulse_heights(SIZE, EXTENT_M, &Ripple::PEBBLE, &pebbles, WallImages::Four, time_s);

    // The terms are made once, for waves like those of some moments and light from 30 degrees.
    let pond = Pond { light_direction: light_tilted_deg(30.0), ..Pond::default() };
    let moments = [0.3, 0.9, 1.5].map(heights).into_iter().collect::<Result<Vec<_>, _>>()?;
    let terms = LowRank::<f32>::new(&moments, &pond, LowRankSettings::default())?;
    let source = HeightSource::Impulses { capacity: 64, distance_levels: None };
    let plan = terms.plan(&PlanSettings { heights: source, ..PlanSettings::default() })?;
    println!("{} terms for {:.2} %", terms.report().terms, 100.0 * terms.report().error);

    executor.prepare(&plan.plan)?;
    for frame in 0..FRAMES {
        let time_s = 2.0 * f64::from(frame) / f64::from(FRAMES);
        plan.write_impulses(&mut executor, &Ripple::PEBBLE, &pebbles, WallImages::Four, time_s)?;
        executor.execute()?;
    }
    let last = plan.read(&mut executor)?;
    let [low, high] = [f64::min, f64::max].map(|pick| last.light.irradiance.iter().copied().reduce(pick));
    println!("the floor has {:.3} to {:.3} of the light above", low.unwrap_or(0.0), high.unwrap_or(0.0));
    println!("{} samples of the surface are unlike the moments", last.outside_states);
    for step in executor.step_times() {
        println!("{:9.3} ms  {}", step.milliseconds, step.name);
    }
    Ok(())
}
