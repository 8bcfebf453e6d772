//! A floor to be computed, and what comes back.

use std::sync::Arc;

use asm_core::Picture;
use caustic_heightfield::{HeightField, Pond, PondError, Ripple, WallImages, impulse_heights};
use frame_plan::{DeviceInfo, DeviceType, Made, StepTime};
use spectral_cli::Floor;
use spectral_core::light::LightSpectrum;

use super::choices::Choices;
use super::pebbles::Waves;
use crate::subject::{Job, Report};

/// What stays as it is while a window shows a pond.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Basin {
    /// Length in x and y, metres.
    pub(crate) extent_m: [f64; 2],
    /// What waves are like.
    pub(crate) ripple: Ripple,
    /// How walls reflect them.
    pub(crate) walls: WallImages,
    /// Room for pebbles and their images.
    pub(crate) capacity: usize,
    /// The light's spectrum, and its colour: XYZ with Y = 1.
    pub(crate) spectrum: LightSpectrum,
    pub(crate) white_xyz: [f64; 3],
}

/// The light on a floor to be computed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FloorJob {
    /// Where.
    pub(crate) basin: Arc<Basin>,
    /// Water, and light from where the sun is.
    pub(crate) pond: Pond,
    /// What moves the surface.
    pub(crate) waves: Waves,
    /// Height of the next pebble's waves, metres.
    pub(crate) amplitude_m: f64,
    /// How.
    pub(crate) choices: Choices,
}

/// What is known of a floor.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FloorFacts {
    /// What the method is fitted with, in a sentence.
    pub(crate) fit: String,
    /// Share of values that are not as those that it was fitted to.
    pub(crate) outside: f64,
}

impl Job for FloorJob {
    type Facts = FloorFacts;

    fn size(&self) -> [u32; 2] {
        [self.choices.samples as u32; 2]
    }
}

impl FloorJob {
    /// Samples of the surface.
    pub(super) fn samples(&self) -> [usize; 2] {
        [self.choices.samples; 2]
    }

    /// The surface.
    ///
    /// # Errors
    /// Numbers out of range.
    pub(super) fn surface(&self) -> Result<HeightField, PondError> {
        let Waves { impulses, time_s } = &self.waves;
        let Basin { extent_m, ripple, walls, .. } = &*self.basin;
        impulse_heights(self.samples(), *extent_m, ripple, impulses, *walls, *time_s)
    }
}

/// What is known of a floor that no executor computed, but this program in so many milliseconds.
pub(super) fn report_of_host(choices: &Choices, milliseconds: f64, facts: FloorFacts) -> Report<FloorFacts> {
    let (method, precision) = (choices.floor.method.name(), choices.floor.precision);
    let device = DeviceInfo {
        executor: "cpu".into(),
        device: format!("the processor's cores, in {precision}"),
        driver: "no plan, and so no executor".into(),
        device_type: DeviceType::Cpu,
        subpixel_bits: None,
    };
    let step_times = vec![StepTime { name: method.into(), milliseconds }];
    Report { device, step_times, decisions: Vec::new(), made: Made::default(), facts }
}

/// A floor as a picture; light of one index of refraction has its own colour everywhere.
pub(super) fn picture(floor: &Floor, white_xyz: [f64; 3]) -> Picture {
    let [width, height] = floor.light.grid.size.map(|side| side as u32);
    let xyz = match &floor.xyz {
        Some(xyz) => xyz.iter().map(|xyz| xyz.map(|v| v as f32)).collect(),
        None => floor.light.irradiance.iter().map(|y| white_xyz.map(|w| (w * y) as f32)).collect(),
    };
    Picture { width, height, xyz }
}
