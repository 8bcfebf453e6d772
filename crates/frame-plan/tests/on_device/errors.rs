//! Everything that can go wrong is an error, and the executor goes on after it. Executors include this beside their `device`,
//! which makes them.

use frame_plan::{ExecuteError, Executor, Plan, Resource, ResourceKind, TextureFormat};

use crate::device::{self, executor, read, run, words};
use crate::passes::*;

/// After an error the executor still runs a good plan.
pub(crate) fn still_works(executor: &mut dyn Executor) {
    assert_eq!(words(&run(executor, &scale_plan(), "output"))[9], 34);
}

fn invalid(executor: &mut dyn Executor, plan: &Plan, text: &str) {
    let error = executor.prepare(plan).unwrap_err();
    assert!(matches!(error, ExecuteError::InvalidPlan { .. }), "{error}");
    assert!(error.to_string().contains(text), "{error}");
}

#[test]
fn oversized_resources_are_refused_before_allocation() {
    let Some(mut gpu) = executor(PASSES) else { return };
    let limits = gpu.limits();
    let before = gpu.made();
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
    if limits.max_total_bytes < u64::MAX {
        invalid(&mut gpu, &plan, "all resources together have 274877914944 bytes");
        assert_eq!(gpu.made(), before, "nothing was made");
    } else {
        // The API does not say how much memory there is, but when it runs out.
        assert!(matches!(gpu.prepare(&plan), Err(ExecuteError::OutOfMemory { .. })));
    }
    still_works(&mut gpu);
}

/// The shader of the pass `scale` is refused for what `says`; plans without it go on.
pub(crate) fn names_the_broken_pass(gpu: &mut dyn Executor, says: &str) {
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
    assert_eq!(words(&read(gpu, &plan, "bins")).iter().sum::<u32>(), 5000);
}

#[test]
fn unknown_adapters_are_refused_with_a_list() {
    match device::open(PASSES, Some("no such adapter".into())).err() {
        Some(ExecuteError::NoDevice { executor, reason }) => {
            assert_eq!(executor, device::ID);
            let adapters = device::adapters();
            assert!(adapters.is_empty() || reason.contains("no such adapter"), "{reason}");
            assert!(adapters.iter().all(|info| reason.contains(&info.device)), "{reason}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn adapters_are_chosen_by_part_of_their_name() {
    for info in device::adapters() {
        let part = info.device.chars().take(6).collect::<String>().to_uppercase();
        let executor = device::open(PASSES, Some(part)).unwrap();
        assert_eq!(executor.info().executor, device::ID);
        assert!(!executor.info().driver.is_empty());
        assert!(executor.info().subpixel_bits.is_none_or(|bits| bits >= 4), "Vulkan guarantees 4");
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
    assert!(matches!(gpu.watch(&[hidden]), Err(ExecuteError::Usage(_))));
    assert!(matches!(gpu.write_buffer(hidden, 12, &[0; 8]), Err(ExecuteError::Usage(_))));
    assert!(matches!(gpu.set_params(plan.params_id("scale").unwrap(), &[]), Err(ExecuteError::Usage(_))));
    still_works(&mut gpu);
}
