//! Faults that a comparison of relit figures must find: in what a frame is given, and in a plan.

use std::borrow::Cow;

use frame_plan::{Plan, Step};
use glam::{DMat3, DVec3};
use spectral_core::illuminant::Illuminant;
use spectral_prt::figures::power;

use crate::sabotage::Sabotage;

/// A fault in what a frame is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Each reflectance is that of 5 nm farther on.
    Reflectances,
    /// 0.1 % more light.
    Light,
    /// The sky is turned by 0.1 degrees.
    Sky,
    /// The light is another lamp's.
    Lamp,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Reflectances, Self::Light, Self::Sky, Self::Lamp];

    /// In a few words.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Reflectances => "reflectances 5 nm off",
            Self::Light => "light 0.1 % off",
            Self::Sky => "sky turned by 0.1 degrees",
            Self::Lamp => "another lamp",
        }
    }

    /// Reflectances with this fault.
    #[must_use]
    pub fn reflectances(self, reflectances: &[Vec<f64>]) -> Cow<'_, [Vec<f64>]> {
        match self {
            Self::Reflectances => {
                reflectances.iter().map(|r| [&r[1..], &r[r.len() - 1..]].concat()).collect()
            }
            _ => Cow::Borrowed(reflectances),
        }
    }

    /// The light of a lamp with this fault.
    pub(super) fn light(self, lamp: Illuminant) -> Vec<f64> {
        match self {
            Self::Light => power(lamp).into_iter().map(|v| 1.001 * v).collect(),
            Self::Lamp if lamp == OTHER_LAMPS[0] => power(OTHER_LAMPS[1]),
            Self::Lamp => power(OTHER_LAMPS[0]),
            _ => power(lamp),
        }
    }

    /// How the sky is turned with this fault; about no axis that a figure's light is even about.
    pub(super) fn rotation(self) -> DMat3 {
        match self {
            Self::Sky => DMat3::from_axis_angle(DVec3::new(1.0, 0.2, 0.5).normalize(), 0.1_f64.to_radians()),
            _ => DMat3::IDENTITY,
        }
    }
}

/// One that others are mistaken for, and what it is mistaken for.
const OTHER_LAMPS: [Illuminant; 2] = [Illuminant::Fl11, Illuminant::A];

/// What a fault is in a plan of relighting, in a few words.
#[must_use]
pub const fn fault(sabotage: Sabotage) -> &'static str {
    match sabotage {
        Sabotage::Ior => "no index to be wrong about",
        Sabotage::Channel => "palette without Z",
        Sabotage::Pass => "vertices without light",
    }
}

/// The plan with this fault; nothing here has an index of refraction.
#[must_use]
pub fn spoiled(plan: &Plan, sabotage: Sabotage) -> Plan {
    let mut spoiled = plan.clone();
    match sabotage {
        Sabotage::Ior => {}
        Sabotage::Channel => {
            let palette = spoiled.resources.iter_mut().find(|resource| resource.name == "palette");
            if let Some(bytes) = palette.and_then(|palette| palette.initial.as_mut()) {
                // Blocks of four terms for X, for Y and for Z.
                bytes.chunks_exact_mut(3 * BLOCK_BYTES).for_each(|block| block[2 * BLOCK_BYTES..].fill(0));
            }
        }
        Sabotage::Pass => spoiled.steps.retain(|step| match step {
            Step::Dispatch { pass, .. } => pass.pass != "prt_vertex",
            _ => true,
        }),
    }
    spoiled
}

/// Four numbers in f32.
const BLOCK_BYTES: usize = 16;
