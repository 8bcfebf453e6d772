//! Faults put into a plan: what a comparison must notice.
//!
//! A plan is plain data, so a fault is a change to its bytes or steps; executors know nothing of it.

use asm_core::BakePlan;
use asm_core::passes::photon_trace::{Band, Optics};
use clap::ValueEnum;
use frame_plan::{Plan, Step};
use serde::Serialize;

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sabotage {
    /// Refractive indices 0.05 too large.
    Ior,
    /// Photons carry no Z.
    Channel,
    /// Photons are not traced.
    Pass,
}

/// Enough to displace every caustic by more than rounding, little enough to look right at a glance.
const IOR_ERROR: f32 = 0.05;

impl Sabotage {
    /// Every fault.
    pub const ALL: [Self; 3] = [Self::Ior, Self::Channel, Self::Pass];

    /// In a few words.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Ior => "every refractive index 0.05 too large",
            Self::Channel => "photons without Z",
            Self::Pass => "photon_trace left out",
        }
    }

    /// The plan with this fault. A plan without refractors stays as it is: it has none of these parts.
    #[must_use]
    pub fn spoil(self, plan: &BakePlan) -> BakePlan {
        let mut spoiled = plan.clone();
        let plan = &mut spoiled.plan;
        match self {
            Self::Ior => change::<Optics>(plan, "optics", |optics| {
                if optics.index > 1.0 {
                    optics.index += IOR_ERROR;
                }
            }),
            Self::Channel => change::<Band>(plan, "bands", |band| band.weight[2] = 0),
            Self::Pass => plan.steps.retain(|step| match step {
                Step::Dispatch { pass, .. } | Step::DispatchIndirect { pass, .. } => {
                    pass.pass != "photon_trace"
                }
                _ => true,
            }),
        }
        spoiled
    }
}

/// Change every record of a buffer's initial contents.
fn change<T: bytemuck::Pod>(plan: &mut Plan, buffer: &str, change: impl Fn(&mut T)) {
    let Some(id) = plan.resource(buffer) else { return };
    let Some(bytes) = plan.resources[id.0 as usize].initial.as_mut() else { return };
    for record in bytes.chunks_exact_mut(size_of::<T>()) {
        let mut value: T = bytemuck::pod_read_unaligned(record);
        change(&mut value);
        record.copy_from_slice(bytemuck::bytes_of(&value));
    }
}
