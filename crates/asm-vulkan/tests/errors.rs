//! Everything that can go wrong is an error, and the executor goes on after it.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/on_device/errors.rs"]
mod errors;
mod host;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use std::borrow::Cow;

use device::{compiled, executor_of};
use errors::{names_the_broken_pass, still_works};
use frame_plan::spirv::SpirvPasses;
use frame_plan::{ExecuteError, Executor};
use host::{Host, Spoil, spoil};
use passes::*;

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
        names_the_broken_pass(&mut gpu, says);
    }
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
