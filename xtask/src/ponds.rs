//! The ponds that executors are compared on and measured with: the waves of the book's page, the plans of their floors, and faults put
//! into these.

use std::f64::consts::TAU;

use bytemuck::Zeroable;
use caustic_heightfield::passes::pond_surface::PondSurface;
use caustic_heightfield::{
    FloorGrid, HeightField, PhotonPlan, Pond, PondError, PondFrame, PondPlan, light_tilted_deg, relative_rms,
};
use frame_plan::{Executor, Plan, Step};
use serde::Serialize;
use spectral_core::rgb::D65_WHITE_XYZ;

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

/// Ponds that are compared: gentle and steep waves, light from above and from the side.
pub const PONDS: [PondSubject; 4] = [
    gentle("pond-gentle-40", 40.0),
    gentle("pond-gentle-0", 0.0),
    steep("pond-steep-40", 40.0),
    steep("pond-steep-0", 0.0),
];

/// Ponds of the price list: the paper's expansion is good at 0 degrees, fails at 20, and 60 is a low sun.
pub const PRICED_PONDS: [PondSubject; 6] = [
    gentle("pond-gentle-20", 20.0),
    gentle("pond-gentle-0", 0.0),
    gentle("pond-gentle-60", 60.0),
    steep("pond-steep-20", 20.0),
    steep("pond-steep-0", 0.0),
    steep("pond-steep-60", 60.0),
];

const fn gentle(name: &'static str, tilt_deg: f64) -> PondSubject {
    PondSubject { name, amplitude_m: 0.004, tilt_deg }
}

const fn steep(name: &'static str, tilt_deg: f64) -> PondSubject {
    PondSubject { name, amplitude_m: 0.01, tilt_deg }
}

/// The name of all ponds together.
const ALL_PONDS: &str = "pond";

/// Those of `ponds` with these names; all of them where none is named, the first in a quick run.
#[must_use]
pub fn named_ponds(
    ponds: &'static [PondSubject],
    names: &[String],
    quick: bool,
) -> Vec<&'static PondSubject> {
    let wanted = |pond: &&PondSubject| match names {
        [] => !quick || pond.name == ponds[0].name,
        names => names.iter().any(|name| name == pond.name || name == ALL_PONDS),
    };
    ponds.iter().filter(wanted).collect()
}

/// Whether this names one of `ponds`, or all, and no scene.
#[must_use]
pub fn is_pond(ponds: &[PondSubject], name: &str) -> bool {
    name == ALL_PONDS || ponds.iter().any(|pond| pond.name == name)
}

/// Length of the pond in x and y, metres.
pub const EXTENT_M: [f64; 2] = [1.0, 1.0];
/// Exponent of the lobe of nearly clear water, per square of the samples across the pond: it is a tenth of a texel wide.
const NEARLY_CLEAR: f64 = 5.0;
/// Least relative deviation from the mean of a floor with waves above it.
const VARIES: f64 = 0.01;

impl PondSubject {
    /// 0.3 m of water whose lobe is as narrow as the book's page has it.
    #[must_use]
    pub fn pond(&self) -> Pond {
        Pond { scattering: 50.0, light_direction: light_tilted_deg(self.tilt_deg), ..Pond::default() }
    }

    /// The same water without what it scatters, but for so little that an integral over its lobe can be taken; `side` samples across.
    #[must_use]
    pub fn nearly_clear(&self, side: usize) -> Pond {
        Pond { scattering: NEARLY_CLEAR * (side * side) as f64, ..self.pond() }
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

/// A part of the floor, half as many texels across as there are samples: the integral of narrow lobes takes long.
#[must_use]
pub fn window(side: usize) -> FloorGrid {
    FloorGrid {
        size: [side / 2; 2],
        corner_m: EXTENT_M.map(|m| 0.3 * m),
        extent_m: EXTENT_M.map(|m| 0.5 * m),
    }
}

/// As planes of X, Y and Z.
#[must_use]
pub fn white(irradiance: &[f64]) -> Vec<f64> {
    D65_WHITE_XYZ.iter().flat_map(|w| irradiance.iter().map(move |y| w * y)).collect()
}

/// How far a floor is from another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FloorDistance {
    /// RMS of the difference by RMS of the other.
    pub rms: f64,
    /// Light by light of the other.
    pub total_y: f64,
}

impl FloorDistance {
    /// Of `a` from `b`.
    ///
    /// # Errors
    /// What makes either of them no floor below waves: black, even, or no numbers.
    pub fn of(a: &[f64], b: &[f64]) -> Result<Self, Vec<String>> {
        let mut problems = Vec::new();
        for (name, floor) in [("a", a), ("b", b)] {
            let mean = floor.iter().sum::<f64>() / floor.len() as f64;
            let deviation = relative_rms(floor, &vec![mean; floor.len()]);
            if !(mean > 0.0 && mean < 1.0 && deviation.is_finite()) {
                problems.push(format!("nothing to compare, {name}: mean irradiance {mean}"));
            } else if deviation < VARIES {
                problems.push(format!("nothing to compare, {name}: varies by {deviation} only"));
            }
        }
        if !problems.is_empty() {
            return Err(problems);
        }
        Ok(Self { rms: relative_rms(a, b), total_y: a.iter().sum::<f64>() / b.iter().sum::<f64>() })
    }
}

/// A plan that gives a floor.
#[derive(Clone)]
pub enum FloorPlan<'a> {
    /// Sums of convolutions for this surface, for executors of the pond's passes.
    Sums(Box<PondPlan>, &'a HeightField),
    /// Light through a mesh of water, for executors of the scenes' passes.
    Photon(Box<PhotonPlan>),
}

impl FloorPlan<'_> {
    /// What executors run.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        match self {
            Self::Sums(plan, _) => &plan.plan,
            Self::Photon(plan) => &plan.bake.plan,
        }
    }

    /// The same with this fault.
    #[must_use]
    pub fn spoiled(&self, sabotage: Sabotage) -> Self {
        match self {
            Self::Sums(plan, surface) => Self::Sums(Box::new(spoiled(plan, sabotage)), surface),
            Self::Photon(plan) => {
                let mut spoiled = plan.clone();
                spoiled.bake = sabotage.spoil(&plan.bake);
                Self::Photon(spoiled)
            }
        }
    }

    /// What that fault is in a few words.
    #[must_use]
    pub const fn fault(&self, sabotage: Sabotage) -> &'static str {
        match self {
            Self::Sums(..) => fault(sabotage),
            Self::Photon(_) => sabotage.description(),
        }
    }

    /// Prepare it and give it its surface.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn start(&self, executor: &mut dyn Executor) -> Result<(), PondError> {
        executor.prepare(self.plan())?;
        match self {
            Self::Sums(plan, surface) => plan.write_heights(executor, surface),
            Self::Photon(_) => Ok(()),
        }
    }

    /// Irradiance after a frame; of photons X, Y and Z, one plane after the other.
    ///
    /// # Errors
    /// Those of the executor.
    pub fn floor(&self, executor: &mut dyn Executor) -> Result<Vec<f64>, PondError> {
        self.start(executor)?;
        executor.execute()?;
        match self {
            Self::Sums(plan, _) => Ok(plan.read(executor)?.light.irradiance),
            Self::Photon(plan) => {
                let xyz = plan.read(executor)?.xyz;
                Ok((0..3).flat_map(|c| xyz.iter().map(move |xyz| xyz[c])).collect())
            }
        }
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
