//! What tests on devices share whichever executor they run: the rule for skipping, and reading what frames leave behind.

use frame_plan::{ExecuteError, Executor, Lifetime, Plan, Resource, TextureFormat};

/// What an executor's device gives times of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timed {
    /// All steps.
    Steps,
    /// Those that run passes.
    Passes,
    Nothing,
}

/// What was made, or none if there is no device and `SPECTRAL_ALLOW_SKIP=1` allows to skip the test.
pub fn made_or_skipped<T>(result: Result<T, ExecuteError>) -> Option<T> {
    match result {
        Ok(made) => Some(made),
        Err(ExecuteError::NoDevice { reason, .. })
            if std::env::var("SPECTRAL_ALLOW_SKIP").is_ok_and(|v| v == "1") =>
        {
            eprintln!("skipped: {reason}");
            None
        }
        Err(error) => panic!(
            "{error}\nThese tests need a device: install a Vulkan driver (Mesa's lavapipe will do), or set \
             SPECTRAL_ALLOW_SKIP=1 to skip them."
        ),
    }
}

/// Run one frame of a plan and read a resource.
pub fn run(executor: &mut dyn Executor, plan: &Plan, name: &str) -> Vec<u8> {
    executor.prepare(plan).unwrap();
    executor.execute().unwrap();
    read(executor, plan, name)
}

pub fn read(executor: &mut dyn Executor, plan: &Plan, name: &str) -> Vec<u8> {
    executor.read(plan.resource(name).unwrap()).unwrap()
}

/// Imports an `image` and does nothing: to read what a host has.
pub fn image_plan(format: TextureFormat, size: [u32; 2]) -> Plan {
    let mut plan = Plan { name: "read".into(), ..Plan::default() };
    let image = Resource::texture("image", format, size).readable();
    plan.add_resource(image.with_lifetime(Lifetime::Imported));
    plan
}

pub fn words(bytes: &[u8]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(bytes)
}

pub fn floats(bytes: &[u8]) -> Vec<f32> {
    bytemuck::pod_collect_to_vec(bytes)
}

pub fn halves(bytes: &[u8]) -> Vec<f32> {
    bytemuck::pod_collect_to_vec::<u8, u16>(bytes)
        .into_iter()
        .map(|h| half::f16::from_bits(h).to_f32())
        .collect()
}
