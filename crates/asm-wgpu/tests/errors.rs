//! Everything that can go wrong is an error, and the executor goes on after it.

#![allow(clippy::unwrap_used, reason = "tests")]

mod device;
#[path = "../../frame-plan/tests/on_device/errors.rs"]
mod errors;
#[path = "../../frame-plan/tests/passes/mod.rs"]
mod passes;

use device::executor;
use errors::names_the_broken_pass;
use frame_plan::{ExecuteError, Executor, PassInfo, PassSet};
use passes::*;

fn with_wgsl(wgsl: &'static [&'static str]) -> PassSet {
    PassSet(vec![&*Box::leak(Box::new(PassInfo { wgsl, ..SCALE })), &HISTOGRAM].leak())
}

#[test]
fn broken_shaders_are_errors_that_name_the_pass() {
    for (wgsl, says) in BROKEN_SCALES {
        let Some(mut gpu) = executor(with_wgsl(wgsl)) else { return };
        names_the_broken_pass(&mut gpu, says);
    }
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
