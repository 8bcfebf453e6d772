//! The same plans on Vulkan and on wgpu over the same driver: equal bit for bit.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use asm_core::{Method, Settings, bake_plan, render_plan};
use asm_vulkan::{ASM_PASSES, VulkanExecutor};
use asm_wgpu::{WgpuExecutor, WgpuOptions};
use frame_plan::{Executor, PassSet, Plan, ResourceKind, TextureFormat};
use glam::DVec3;
use passes::*;
use spectral_scene::LightShape;

/// wgpu on the same device: both call it the same.
fn wgpu(passes: PassSet, vulkan: &VulkanExecutor) -> WgpuExecutor {
    let options = WgpuOptions { adapter: Some(vulkan.info().device.clone()) };
    let wgpu = WgpuExecutor::new(passes, &options).unwrap();
    assert_eq!(wgpu.info().device, vulkan.info().device);
    wgpu
}

/// Run a plan with everything that can be read made readable, and compare all of it; returns how many bytes were compared.
fn compare(mut plan: Plan, vulkan: &mut VulkanExecutor, wgpu: &mut WgpuExecutor, frames: u32) -> usize {
    for resource in &mut plan.resources {
        let multisized =
            matches!(resource.kind, ResourceKind::Texture { mips, layers, .. } if (mips, layers) != (1, 1));
        resource.readable = !matches!(resource.kind, ResourceKind::Sampler { .. }) && !multisized;
    }
    vulkan.prepare(&plan).unwrap();
    wgpu.prepare(&plan).unwrap();
    for _ in 0..frames {
        vulkan.execute().unwrap();
        wgpu.execute().unwrap();
    }
    let mut compared = 0;
    for resource in plan.resources.iter().filter(|r| r.readable) {
        let ours = device::read(vulkan, &plan, &resource.name);
        let theirs = device::read(wgpu, &plan, &resource.name);
        assert_eq!(ours.len(), theirs.len());
        let differ = ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{}: bytes of {} that differ, of {}", plan.name, resource.name, ours.len());
        compared += ours.len();
    }
    compared
}

#[test]
fn every_kind_of_step_gives_the_same_bits() {
    let Some(mut vulkan) = device::executor(PASSES) else { return };
    let mut wgpu = wgpu(PASSES, &vulkan);
    let size = [61, 47];
    let plans = [
        scale_plan(),
        indirect_plan(),
        uint_plan(),
        mips_plan(),
        layers_plan(1, 1),
        visibility_plan(size, &fan(), 3),
        color_plan("shaded", TextureFormat::Rgba32Float, size, &fan()),
        color_plan("glow", TextureFormat::Rgba16Float, size, &fan()),
    ];
    for plan in plans {
        assert!(compare(plan, &mut vulkan, &mut wgpu, 2) > 0);
    }
}

/// Maps, visibility, books and irradiance of bakes, and pictures.
#[test]
fn caustics_give_the_same_bits() {
    let Some(mut vulkan) = device::executor_of(ASM_PASSES) else { return };
    let mut wgpu = wgpu(asm_core::PASSES, &vulkan);
    let limits = vulkan.limits().common(wgpu.limits());
    let settings = Settings { emission_size: 128, map_size: Some(128), ..Settings::of(Method::CausticsMap) };
    for name in ["sphere", "gem", "prism"] {
        let scene = spectral_scene::bundled(name).unwrap();
        let receiver = scene.receiver("receiver").unwrap();
        let bake = bake_plan(&scene, receiver, [64, 64], &settings, &limits).unwrap();
        assert!(bake.plan.resources.iter().any(|r| r.name.contains("map")), "maps are compared, too");
        assert!(compare(bake.plan, &mut vulkan, &mut wgpu, 1) > 100_000);
        let render = render_plan(&scene, 0, [96, 64], &settings, &limits).unwrap();
        assert!(compare(render.plan, &mut vulkan, &mut wgpu, 1) > 100_000);
    }
}

/// A lamp that moves: frames that follow it by new numbers are those of plans made anew, and make no objects.
#[test]
fn a_moving_lamp_gives_the_same_bits_and_no_objects() {
    let Some(mut vulkan) = device::executor_of(ASM_PASSES) else { return };
    let mut wgpu = wgpu(asm_core::PASSES, &vulkan);
    let limits = vulkan.limits().common(wgpu.limits());
    let settings = Settings { emission_size: 64, map_size: Some(64), ..Settings::of(Method::CausticsMap) };
    let mut scene = spectral_scene::bundled("sphere").unwrap();
    let receiver = scene.receiver("receiver").unwrap();
    let plan = |scene: &_| bake_plan(scene, receiver, [32, 32], &settings, &limits).unwrap();
    let mut bake = plan(&scene);
    vulkan.prepare(&bake.plan).unwrap();
    vulkan.execute().unwrap();
    let mut last = device::read(&mut vulkan, &bake.plan, "irradiance");
    let before = vulkan.live_objects();
    for _ in 0..4 {
        let LightShape::Directional { direction } = &mut scene.lights[0].shape else { panic!("a sun") };
        *direction = (*direction + DVec3::X * 0.01).normalize();
        bake.update(&mut vulkan, plan(&scene)).unwrap();
        vulkan.execute().unwrap();
        let moved = device::read(&mut vulkan, &bake.plan, "irradiance");
        assert_ne!(moved, last, "the caustic moves");
        assert!(moved == device::run(&mut wgpu, &plan(&scene).plan, "irradiance"), "as a plan made anew");
        last = moved;
    }
    assert_eq!(vulkan.live_objects(), before);
}

/// Negative control: the comparison above sees another glass.
#[test]
fn another_glass_gives_other_bits() {
    let Some(mut vulkan) = device::executor_of(ASM_PASSES) else { return };
    let mut wgpu = wgpu(asm_core::PASSES, &vulkan);
    let settings = Settings { emission_size: 64, map_size: Some(64), ..Settings::of(Method::CausticsMap) };
    let scene = spectral_scene::bundled("sphere").unwrap();
    let receiver = scene.receiver("receiver").unwrap();
    let mut other = scene.clone();
    for material in &mut other.materials {
        if let spectral_core::dispersion::Dispersion::Cauchy { a, .. } = &mut material.dispersion {
            *a += 0.01;
        }
    }
    assert_ne!(other, scene);
    let limits = vulkan.limits().common(wgpu.limits());
    let bake = |scene| bake_plan(scene, receiver, [64, 64], &settings, &limits).unwrap();
    let ours = device::run(&mut vulkan, &bake(&scene).plan, "irradiance");
    let theirs = device::run(&mut wgpu, &bake(&other).plan, "irradiance");
    assert_ne!(ours, theirs);
}
