//! Everything that can go wrong is an error, and the executor goes on after it.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
mod host;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use std::borrow::Cow;

use asm_vulkan::{VulkanExecutor, VulkanOptions};
use device::{compiled, executor, executor_of, read, run, words};
use frame_plan::spirv::SpirvPasses;
use frame_plan::{ExecuteError, Executor, Plan, Resource, ResourceKind, TextureFormat};
use host::{Host, Spoil, spoil};
use passes::*;

/// After an error the executor still runs a good plan.
fn still_works(executor: &mut VulkanExecutor) {
    assert_eq!(words(&run(executor, &scale_plan(), "output"))[9], 34);
}

fn invalid(executor: &mut VulkanExecutor, plan: &Plan, text: &str) {
    let error = executor.prepare(plan).unwrap_err();
    assert!(matches!(error, ExecuteError::InvalidPlan { .. }), "{error}");
    assert!(error.to_string().contains(text), "{error}");
}

#[test]
fn oversized_resources_are_refused_before_allocation() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let limits = gpu.limits();
    let before = gpu.live_objects();
    let mut plan = scale_plan();
    plan.resources.push(Resource::buffer("large", limits.max_buffer_bytes / 4 * 4 + 4));
    invalid(&mut gpu, &plan, &format!("the limit is {}", limits.max_buffer_bytes));

    let mut plan = scale_plan();
    plan.resources.push(Resource::texture("wide", TextureFormat::R32Float, [limits.max_texture_size + 1, 1]));
    invalid(&mut gpu, &plan, &format!("allowed are 1 to {}", limits.max_texture_size));

    // Each within its limit, all together beyond any machine's memory: 256 GiB.
    let mut plan = scale_plan();
    let kind =
        ResourceKind::Texture { format: TextureFormat::Rgba32Float, size: [8192; 2], layers: 256, mips: 1 };
    plan.resources.push(Resource { kind, ..Resource::texture("deep", TextureFormat::R32Float, [1, 1]) });
    invalid(&mut gpu, &plan, "all resources together have 274877914944 bytes");
    assert_eq!(gpu.live_objects(), before, "nothing was made");
    still_works(&mut gpu);
}

#[test]
fn missing_and_broken_spirv_are_errors_that_name_the_pass() {
    let whole = compiled(PASSES);
    let spoilt = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut modules = whole.modules.to_vec();
        let scale = modules.iter_mut().find(|m| m.entry_point == "scale").unwrap();
        change(scale.unchecked.to_mut());
        change(scale.restricted.to_mut());
        SpirvPasses { passes: PASSES, modules: modules.into() }
    };
    let without = whole.modules.iter().filter(|m| m.entry_point != "scale").cloned().collect();
    let cases = [
        (SpirvPasses { passes: PASSES, modules: Cow::Owned(without) }, "there is no SPIR-V"),
        (spoilt(&|bytes| bytes.truncate(12)), "no SPIR-V"),
        (spoilt(&|bytes| bytes[0] ^= 1), "no SPIR-V"),
        (spoilt(&|bytes| bytes.truncate(bytes.len() - 1)), "no SPIR-V"),
    ];
    for (passes, says) in cases {
        let Some(mut gpu) = executor_of(passes) else { return };
        match gpu.prepare(&scale_plan()).unwrap_err() {
            ExecuteError::Shader { pass, reason, .. } => {
                assert_eq!(pass, "scale");
                assert!(reason.contains(says), "{reason}");
            }
            other => panic!("{other}"),
        }
        assert!(matches!(gpu.execute(), Err(ExecuteError::Usage(_))), "nothing is prepared");
        let mut plan = indirect_plan();
        plan.steps.truncate(2);
        gpu.prepare(&plan).unwrap();
        gpu.execute().unwrap();
        assert_eq!(words(&read(&mut gpu, &plan, "bins")).iter().sum::<u32>(), 5000);
    }
}

#[test]
fn unknown_adapters_are_refused_with_a_list() {
    let options = VulkanOptions { adapter: Some("no such adapter".into()), ..VulkanOptions::default() };
    match VulkanExecutor::new(compiled(PASSES), &options).err() {
        Some(ExecuteError::NoDevice { executor, reason }) => {
            assert_eq!(executor, "vulkan");
            let adapters = asm_vulkan::adapters();
            assert!(adapters.is_empty() || reason.contains("no such adapter"), "{reason}");
            assert!(adapters.iter().all(|info| reason.contains(&info.device)), "{reason}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn adapters_are_chosen_by_part_of_their_name() {
    for info in asm_vulkan::adapters() {
        let part = info.device.chars().take(6).collect::<String>().to_uppercase();
        let options = VulkanOptions { adapter: Some(part), ..VulkanOptions::default() };
        let executor = VulkanExecutor::new(compiled(PASSES), &options).unwrap();
        assert_eq!(executor.info().executor, "vulkan");
        assert!(!executor.info().driver.is_empty());
        assert!(executor.info().subpixel_bits.is_some_and(|bits| bits >= 4), "Vulkan guarantees 4");
    }
}

#[test]
fn calls_that_do_not_fit_are_refused() {
    let Some(mut gpu) = executor(PASSES) else { return };
    assert!(matches!(gpu.execute(), Err(ExecuteError::Usage(_))));
    let mut plan = scale_plan();
    let hidden = plan.add_resource(Resource::buffer("hidden", 16));
    gpu.prepare(&plan).unwrap();
    assert!(matches!(gpu.read(hidden), Err(ExecuteError::Usage(_))));
    assert!(matches!(gpu.write_buffer(hidden, 12, &[0; 8]), Err(ExecuteError::Usage(_))));
    assert!(matches!(gpu.set_params(plan.params_id("scale").unwrap(), &[]), Err(ExecuteError::Usage(_))));
    still_works(&mut gpu);
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(host) = Host::new(true) else { return };
    let mut gpu = host.executor(compiled(PASSES));
    let plan = scale_plan();
    gpu.prepare(&plan).unwrap();
    gpu.execute().unwrap();
    spoil(Spoil { lose_device: true, ..Spoil::default() });
    let result = gpu.execute();
    assert!(matches!(result, Err(ExecuteError::Device { .. })), "{result:?}");
    spoil(Spoil::default());
    // It stays lost, whatever is asked of it.
    for result in [gpu.execute(), gpu.read(plan.resource("output").unwrap()).map(drop), gpu.prepare(&plan)] {
        assert!(
            matches!(&result, Err(ExecuteError::Device { reason, .. }) if reason.contains("lost")),
            "{result:?}"
        );
    }
    // The commands that were recorded and refused are forgotten with the executor.
    drop(gpu);
}

#[test]
fn running_out_of_memory_is_an_error_with_the_numbers() {
    let Some(host) = Host::new(true) else { return };
    let mut gpu = host.executor(compiled(PASSES));
    let before = gpu.live_objects();
    spoil(Spoil { no_memory: true, ..Spoil::default() });
    match gpu.prepare(&scale_plan()).unwrap_err() {
        ExecuteError::OutOfMemory { executor, reason } => {
            assert_eq!(executor, "vulkan");
            assert!(reason.contains("4000 bytes") && reason.contains("input"), "{reason}");
        }
        other => panic!("{other}"),
    }
    spoil(Spoil::default());
    let pipelines = |counts: &[(&str, usize)]| {
        let others = counts.iter().filter(|(kind, _)| !kind.contains("pipeline") && !kind.contains("layout"));
        others.map(|(_, count)| *count).collect::<Vec<_>>()
    };
    assert_eq!(pipelines(&gpu.live_objects()), pipelines(&before), "what was made is gone again");
    still_works(&mut gpu);
}
