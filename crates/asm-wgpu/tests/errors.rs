//! Everything that can go wrong is an error, and the executor goes on after it.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use asm_wgpu::{WgpuExecutor, WgpuOptions};
use device::{executor, read, run, words};
use frame_plan::{ExecuteError, Executor, PassInfo, PassSet, Plan, Resource, ResourceKind, TextureFormat};
use passes::*;

/// After an error the executor still runs a good plan.
fn still_works(executor: &mut WgpuExecutor) {
    assert_eq!(words(&run(executor, &scale_plan(), "output"))[9], 34);
}

fn invalid(executor: &mut WgpuExecutor, plan: &Plan, text: &str) {
    let error = executor.prepare(plan).unwrap_err();
    assert!(matches!(error, ExecuteError::InvalidPlan { .. }), "{error}");
    assert!(error.to_string().contains(text), "{error}");
}

#[test]
fn oversized_resources_are_refused_before_allocation() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let limits = gpu.limits();
    let mut plan = scale_plan();
    plan.resources.push(Resource::buffer("large", limits.max_buffer_bytes / 4 * 4 + 4));
    invalid(&mut gpu, &plan, &format!("the limit is {}", limits.max_buffer_bytes));

    let mut plan = scale_plan();
    plan.resources.push(Resource::texture("wide", TextureFormat::R32Float, [limits.max_texture_size + 1, 1]));
    invalid(&mut gpu, &plan, &format!("allowed are 1 to {}", limits.max_texture_size));

    // Each within its limit, all together beyond the machine's memory: 256 GiB.
    let mut plan = scale_plan();
    let kind =
        ResourceKind::Texture { format: TextureFormat::Rgba32Float, size: [8192; 2], layers: 256, mips: 1 };
    plan.resources.push(Resource { kind, ..Resource::texture("deep", TextureFormat::R32Float, [1, 1]) });
    if limits.max_total_bytes < u64::MAX {
        invalid(&mut gpu, &plan, "all resources together have 274877914944 bytes");
    } else {
        assert!(matches!(gpu.prepare(&plan), Err(ExecuteError::OutOfMemory { .. })));
    }
    still_works(&mut gpu);
}

fn with_wgsl(wgsl: &'static [&'static str]) -> PassSet {
    PassSet(vec![&*Box::leak(Box::new(PassInfo { wgsl, ..SCALE })), &HISTOGRAM].leak())
}

#[test]
fn broken_shaders_are_errors_that_name_the_pass() {
    let missing_entry = "struct Scale { factor: u32 } @compute @workgroup_size(1) fn other() {}";
    let other_binding = "@group(0) @binding(7) var<storage, read_write> extra: array<u32>;
        @compute @workgroup_size(64) fn scale() { extra[0] = 1u; }";
    for (wgsl, says) in
        [("fn broken( {", "expected"), (missing_entry, "entry point"), (other_binding, "binding")]
    {
        let Some(mut gpu) = executor(with_wgsl(Vec::leak(vec![wgsl]))) else { return };
        match gpu.prepare(&scale_plan()).unwrap_err() {
            ExecuteError::Shader { pass, reason, .. } => {
                assert_eq!(pass, "scale");
                assert!(reason.contains(says), "{reason}");
                assert!(!reason.contains('\n'), "{reason}");
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
    let options = WgpuOptions { adapter: Some("no such adapter".into()) };
    match WgpuExecutor::new(PASSES, &options).err() {
        Some(ExecuteError::NoDevice { executor, reason }) => {
            assert_eq!(executor, "wgpu");
            assert!(reason.contains("no such adapter"), "{reason}");
            assert!(asm_wgpu::adapters().iter().all(|info| reason.contains(&info.device)), "{reason}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn adapters_are_chosen_by_part_of_their_name() {
    for info in asm_wgpu::adapters() {
        let part = info.device.chars().take(6).collect::<String>().to_uppercase();
        let executor = WgpuExecutor::new(PASSES, &WgpuOptions { adapter: Some(part) }).unwrap();
        assert_eq!(executor.info().executor, "wgpu");
        assert!(!executor.info().driver.is_empty());
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
    let Some(mut gpu) = executor(PASSES) else { return };
    let plan = scale_plan();
    gpu.prepare(&plan).unwrap();
    gpu.execute().unwrap();
    gpu.device().destroy();
    let result = gpu.execute().and_then(|()| gpu.read(plan.resource("output").unwrap()));
    assert!(matches!(result, Err(ExecuteError::Device { .. })), "{result:?}");
    assert!(gpu.prepare(&plan).is_err());
}
