//! The ponds that executors are compared on and measured with: the waves of the book's page, and faults put into their plans.

use std::f64::consts::TAU;

use bytemuck::Zeroable;
use caustic_heightfield::passes::pond_surface::PondSurface;
use caustic_heightfield::{HeightField, Pond, PondError, PondFrame, PondPlan, light_tilted_deg};
use frame_plan::{Executor, Step};

use crate::sabotage::Sabotage;

/// A pond with its surface.
pub struct PondSubject {
    /// Name for reports.
    pub name: &'static str,
    /// Height of the first wave, metres.
    pub amplitude_m: f64,
    /// Angle of the light to the vertical, degrees.
    pub tilt_deg: f64,
}

/// Gentle and steep waves, light from above and from the side.
pub const PONDS: [PondSubject; 4] = [
    PondSubject { name: "pond-gentle-40", amplitude_m: 0.004, tilt_deg: 40.0 },
    PondSubject { name: "pond-gentle-0", amplitude_m: 0.004, tilt_deg: 0.0 },
    PondSubject { name: "pond-steep-40", amplitude_m: 0.01, tilt_deg: 40.0 },
    PondSubject { name: "pond-steep-0", amplitude_m: 0.01, tilt_deg: 0.0 },
];

/// Length of the pond in x and y, metres.
pub const EXTENT_M: [f64; 2] = [1.0, 1.0];

impl PondSubject {
    /// 0.3 m of water whose lobe is as narrow as the book's page has it.
    #[must_use]
    pub fn pond(&self) -> Pond {
        Pond { scattering: 50.0, light_direction: light_tilted_deg(self.tilt_deg), ..Pond::default() }
    }

    /// Its waves on a grid.
    ///
    /// # Errors
    /// A grid without samples.
    pub fn surface(&self, size: [usize; 2]) -> Result<HeightField, PondError> {
        HeightField::from_fn(size, EXTENT_M, |x, y| {
            let second = (TAU * (5.0 * x - 4.0 * y) + 1.0).sin();
            self.amplitude_m * ((TAU * (3.0 * x + 2.0 * y)).sin() + 0.8 * second)
        })
    }
}

/// One frame of a plan that is prepared anew.
///
/// # Errors
/// Those of the executor.
pub fn light(
    plan: &PondPlan,
    surface: &HeightField,
    executor: &mut dyn Executor,
) -> Result<PondFrame, PondError> {
    executor.prepare(&plan.plan)?;
    plan.write_heights(executor, surface)?;
    executor.execute()?;
    plan.read(executor)
}

/// How much too large an index of refraction is, spoiled.
const INDEX_ERROR: f32 = 0.05;

/// What a fault is in a pond's plan, in a few words.
#[must_use]
pub const fn fault(sabotage: Sabotage) -> &'static str {
    match sabotage {
        Sabotage::Ior => "index of the water 0.05 too large",
        Sabotage::Channel => "first term without light",
        Sabotage::Pass => "no light below the surface",
    }
}

/// The plan with this fault.
#[must_use]
pub fn spoiled(plan: &PondPlan, sabotage: Sabotage) -> PondPlan {
    let mut spoiled = plan.clone();
    let plan = &mut spoiled.plan;
    match sabotage {
        Sabotage::Ior => {
            let params = plan.params.iter_mut().find(|params| params.name == "pond_surface");
            if let Some(params) = params {
                let mut surface = PondSurface::zeroed();
                bytemuck::bytes_of_mut(&mut surface).copy_from_slice(&params.bytes);
                surface.eta += INDEX_ERROR;
                params.bytes = bytemuck::bytes_of(&surface).to_vec();
            }
        }
        Sabotage::Channel => {
            // The first term's kernel, or its spectrum, lies before the others'.
            let terms = plan.resources.iter().position(|r| r.name.starts_with("kernel"));
            let bytes = terms.and_then(|index| plan.resources[index].initial.as_mut());
            if let Some(bytes) = bytes {
                let first = bytes.len() / KERNELS_AT_LEAST;
                bytes[..first].fill(0);
            }
        }
        // What they start with stays: nothing.
        Sabotage::Pass => plan.steps.retain(|step| match step {
            Step::Dispatch { pass, .. } => !SOURCES.contains(&pass.pass.as_str()),
            _ => true,
        }),
    }
    spoiled
}

/// Passes without which no light is convolved.
const SOURCES: [&str; 2] = ["pond_product", "pond_coefficients"];
/// Spectra come in pairs, kernels in threes or more: the first term has at least this share.
const KERNELS_AT_LEAST: usize = 2;

#[cfg(test)]
mod tests {
    use caustic_heightfield::{LowRank, LowRankSettings, PlanSettings};

    use super::*;

    #[test]
    fn every_fault_is_in_the_plan() {
        let surface = PONDS[0].surface([16, 16]).expect("waves");
        let method = LowRank::<f32>::new(&[surface], &PONDS[0].pond(), LowRankSettings::default());
        let plan = method.and_then(|m| m.plan(&PlanSettings::default())).expect("a plan");
        for sabotage in Sabotage::ALL {
            assert!(spoiled(&plan, sabotage).plan != plan.plan, "{sabotage:?}");
        }
    }
}
