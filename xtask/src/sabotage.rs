//! Faults put into a plan: what a comparison must notice.
//!
//! A plan is plain data, so a fault is a change to its bytes or steps; executors know nothing of it.

use asm_core::BakePlan;
use asm_core::shared::optics::Optics;
use asm_core::shared::photons::Band;
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

/// The passes whose light every fault is about.
const PHOTONS: [&str; 3] = ["photon_trace", "photon_path", "path_trace"];

impl Sabotage {
    /// Every fault.
    pub const ALL: [Self; 3] = [Self::Ior, Self::Channel, Self::Pass];

    /// In a few words.
    pub const fn description(self) -> &'static str {
        match self {
            Self::Ior => "every refractive index 0.05 too large",
            Self::Channel => "photons without Z",
            Self::Pass => "photons not traced",
        }
    }

    /// The plan with this fault. A plan without photons stays as it is: it has none of these parts, and whatever is left of
    /// them in its buffers, no pass reads. Nor has glass of index 1 an index to be wrong about.
    #[must_use]
    pub fn spoil(self, plan: &BakePlan) -> BakePlan {
        let mut spoiled = plan.clone();
        let mut photons = false;
        plan.plan.for_each_pass(&mut |step| photons |= PHOTONS.contains(&step.pass.as_str()));
        if !photons {
            return spoiled;
        }
        let plan = &mut spoiled.plan;
        match self {
            Self::Ior => change::<Optics>(plan, "optics", |optics| {
                if optics.index > 1.0 {
                    optics.index += IOR_ERROR;
                }
            }),
            // Running bands are pairs of records that look like bands.
            Self::Channel => change::<Band>(plan, "bands", |band| band.weight[2] = 0),
            Self::Pass => plan.steps.retain(|step| match step {
                Step::Dispatch { pass, .. } | Step::DispatchIndirect { pass, .. } => {
                    !PHOTONS.contains(&pass.pass.as_str())
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

#[cfg(test)]
mod tests {
    use asm_core::{Method, Settings, bake_plan};
    use frame_plan::Limits;
    use spectral_core::dispersion::Dispersion;
    use spectral_scene::{Scene, bundled};

    use super::*;

    fn plan(scene: &Scene) -> BakePlan {
        let settings =
            Settings { emission_size: 32, map_size: Some(32), ..Settings::of(Method::CausticsMap) };
        let receiver = scene.receiver("receiver").expect("a receiver");
        bake_plan(scene, receiver, [8; 2], &settings, &Limits::default()).expect("a plan")
    }

    #[test]
    fn every_fault_is_in_the_plan_of_a_scene_with_glass() {
        let plan = plan(&bundled("gem").expect("a bundled scene"));
        for sabotage in Sabotage::ALL {
            assert!(sabotage.spoil(&plan) != plan, "{sabotage:?}");
        }
    }

    #[test]
    fn what_no_pass_reads_is_left_alone() {
        let mut scene = bundled("gem").expect("a bundled scene");
        let glass = scene.refractors().next().expect("glass");
        scene.objects.remove(glass);
        let bare = plan(&scene);
        for sabotage in Sabotage::ALL {
            assert!(sabotage.spoil(&bare) == bare, "{sabotage:?}");
        }
    }

    #[test]
    fn glass_of_index_one_has_no_index_to_spoil() {
        let mut scene = bundled("gem").expect("a bundled scene");
        scene.materials.iter_mut().for_each(|m| m.dispersion = Dispersion::Constant { n: 1.0 });
        let air = plan(&scene);
        assert!(Sabotage::Ior.spoil(&air) == air);
        assert!(Sabotage::Channel.spoil(&air) != air);
    }
}
