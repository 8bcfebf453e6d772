//! Khronos' validation and synchronization validation find nothing in what executors do, and do find what is spoiled.

#![allow(clippy::unwrap_used, reason = "tests")]
#![allow(unsafe_code, reason = "a host hands its own commands over")]

mod device;
mod host;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use std::collections::HashMap;

use asm_core::{Method, Settings, bake_plan, render_plan};
use asm_vulkan::{ASM_PASSES, VulkanExecutor};
use device::compiled;
use frame_plan::spirv::SpirvPasses;
use frame_plan::{Executor, Plan, ResourceId, Step, TextureFormat};
use host::{Host, Spoil, barriers, spoil};
use passes::*;

const SIZE: [u32; 2] = [61, 47];

/// The same shaders for a layer that looks for writes to a variable through one access chain, as that of Vulkan 1.3.239 does, and
/// misses those through chains of chains, which naga writes.
fn with_flat_access_chains(passes: SpirvPasses) -> SpirvPasses {
    let mut modules = passes.modules.into_owned();
    for module in &mut modules {
        for bytes in [&mut module.unchecked, &mut module.restricted] {
            let words = bytemuck::pod_collect_to_vec(bytes);
            *bytes = flat_access_chains(&words).into_iter().flat_map(u32::to_le_bytes).collect();
        }
    }
    SpirvPasses { modules: modules.into(), ..passes }
}

fn flat_access_chains(words: &[u32]) -> Vec<u32> {
    const HEADER_WORDS: usize = 5;
    const OP_ACCESS_CHAIN: u32 = 65;
    let (header, mut rest) = words.split_at(HEADER_WORDS);
    let mut flat = header.to_vec();
    // The first base of a chain, and all indices from there.
    let mut chains: HashMap<u32, Vec<u32>> = HashMap::new();
    while let Some(first) = rest.first() {
        let (instruction, later) = rest.split_at((first >> 16) as usize);
        rest = later;
        if first & 0xffff != OP_ACCESS_CHAIN {
            flat.extend(instruction);
            continue;
        }
        let [_, ty, result, base, indices @ ..] = instruction else { panic!("an access chain has a base") };
        let mut chain = chains.get(base).cloned().unwrap_or_else(|| vec![*base]);
        chain.extend(indices);
        flat.push(((chain.len() as u32 + 3) << 16) | OP_ACCESS_CHAIN);
        flat.extend([ty, result]);
        flat.extend(&chain);
        chains.insert(*result, chain);
    }
    flat
}

fn frame(host: &Host, gpu: &mut VulkanExecutor) {
    // SAFETY: the host submits the commands at once and waits for them.
    host.frame(|commands| unsafe { gpu.record(commands) }.unwrap());
}

/// Two clean frames, then one for each barrier of a frame without it; returns what was found for each.
fn without_each_barrier(passes: SpirvPasses, plan: &Plan) -> Option<Vec<Vec<String>>> {
    let host = Host::new(true)?;
    if !host.is_validated() {
        return None;
    }
    let mut gpu = host.executor(with_flat_access_chains(passes));
    gpu.prepare(plan).unwrap();
    for _ in 0..2 {
        spoil(Spoil::default());
        frame(&host, &mut gpu);
    }
    let readable: Vec<_> = plan.resources.iter().filter(|r| r.readable).collect();
    readable.iter().for_each(|r| drop(device::read(&mut gpu, plan, &r.name)));
    assert_eq!(host.messages(), [""; 0], "{}", plan.name);
    spoil(Spoil::default());
    frame(&host, &mut gpu);
    let count = barriers();
    let found = (0..count)
        .map(|i| {
            spoil(Spoil { barrier: Some(i), ..Spoil::default() });
            frame(&host, &mut gpu);
            spoil(Spoil::default());
            let found = host.messages();
            // Layouts that a missing barrier left behind are put right by starting over.
            gpu.prepare(plan).unwrap();
            frame(&host, &mut gpu);
            assert_eq!(host.messages(), [""; 0], "{} after a spoiled frame", plan.name);
            found
        })
        .collect();
    Some(found)
}

/// Passes and copies that hand buffers on to each other in every way: read after write, write after read, write after write.
fn chain_plan() -> Plan {
    let mut plan = scale_plan();
    let [input, output] = ["input", "output"].map(|name| plan.resource(name).unwrap());
    let params = plan.params_id("scale").unwrap();
    let middle = buffer(&mut plan, "middle", 4000);
    let copy = buffer(&mut plan, "copy", 4000);
    let scale =
        |from: ResourceId, to: ResourceId| dispatch("scale", Some(params), &[from.into(), to.into()], 16);
    plan.steps = vec![
        scale(input, middle),
        scale(middle, output),
        Step::CopyBuffer {
            source: output,
            source_offset_bytes: 0,
            target: copy,
            target_offset_bytes: 0,
            size_bytes: 4000,
        },
        Step::ClearBuffer { buffer: output },
        scale(copy, output),
        Step::ClearBuffer { buffer: copy },
        scale(output, copy),
    ];
    plan
}

#[test]
fn each_missing_barrier_between_buffers_is_found() {
    let Some(messages) = without_each_barrier(compiled(PASSES), &chain_plan()) else { return };
    // The first orders a frame after the one before: layers that look at one command buffer at a time do not see it.
    let [_, rest @ ..] = &*messages else { panic!("no barriers") };
    assert_eq!(rest.len(), 6, "one before each step");
    for messages in rest {
        assert!(messages.iter().any(|m| m.contains("SYNC-HAZARD")), "{messages:?}");
    }
}

#[test]
fn each_missing_change_of_layout_is_found() {
    for plan in [mips_plan(), visibility_plan(SIZE, &fan(), 3)] {
        let Some(messages) = without_each_barrier(compiled(PASSES), &plan) else { return };
        assert!(messages.len() >= 2);
        assert!(messages.iter().all(|m| !m.is_empty()), "{}: {messages:?}", plan.name);
    }
}

#[test]
fn other_steps_are_clean() {
    let color = |pass, format| color_plan(pass, format, SIZE, &fan());
    let plans = [
        indirect_plan(),
        uint_plan(),
        layers_plan(1, 1),
        color("glow", TextureFormat::Rgba16Float),
        color("shaded", TextureFormat::Rgba32Float),
    ];
    for plan in plans {
        if without_each_barrier(compiled(PASSES), &plan).is_none() {
            return;
        }
    }
}

#[test]
fn caustics_are_clean_and_missing_barriers_are_found() {
    let Some(host) = Host::new(true) else { return };
    let limits = host.executor(ASM_PASSES).limits();
    let scene = spectral_scene::bundled("gem").unwrap();
    let settings = Settings { emission_size: 32, map_size: Some(32), ..Settings::of(Method::CausticsMap) };
    let receiver = scene.receiver("receiver").unwrap();
    let bake = bake_plan(&scene, receiver, [16, 16], &settings, &limits).unwrap();
    let render = render_plan(&scene, 0, [24, 16], &settings, &limits).unwrap();
    for plan in [bake.plan, render.plan] {
        let Some(messages) = without_each_barrier(ASM_PASSES, &plan) else { return };
        // Not seen are those between frames, and between atomics: the layer does not take these for writes.
        let count = messages.iter().filter(|m| !m.is_empty()).count();
        assert!(2 * count > messages.len(), "{count} of {} barriers", messages.len());
    }
}
