//! The water as a refractor, on the executor that the options ask for.

use std::cell::RefCell;

use asm_core::Settings;
use asm_core::shared::footprint::MOST_NODES;
use caustic_heightfield::{FloorGrid, HeightField, Photon, PhotonSettings, PondScene};
use serde_json::json;

use super::floors::Floor;
use super::method::{MethodArgs, Prepared};
use super::water::Water;
use crate::backend::SCENES;
use crate::error::CliError;

impl MethodArgs {
    /// The method for surfaces of this one's grid: at the pond's index, or with `dispersed` light, of so many wavelengths if that is said.
    pub(super) fn photon(
        &self,
        scene: &PondScene,
        example: &HeightField,
        dispersed: Option<Option<usize>>,
    ) -> Result<Prepared, CliError> {
        let wavelengths = dispersed.flatten();
        if let Some(n) = wavelengths.filter(|&n| n > MOST_NODES) {
            return Err(CliError::Usage(format!(
                "--wavelengths {n}: --method photon traces 1 to {MOST_NODES} and has all colours between them"
            )));
        }
        let footprints = Settings { wavelengths: wavelengths.map(|n| n as u32), ..Settings::default() };
        let in_color = dispersed.is_some();
        let mut details = json!({
            "wavelengths": if in_color { footprints.wavelength_count() } else { 1 },
            "scattering": "none, whatever the pond's is",
        });
        let settings = PhotonSettings {
            dispersion: in_color,
            spectrum: scene.spectrum.clone(),
            footprints,
            ..PhotonSettings::default()
        };
        let mut photon = Photon::new(&scene.pond, settings).map_err(CliError::failed)?;
        let mut executor = self.executor(&SCENES, &mut details)?;
        let plan = photon.prepare(example, FloorGrid::below(example), executor.as_mut());
        details["facets_per_sample"] = json!(plan.map_err(CliError::failed)?.facets_per_sample);
        let running = RefCell::new((photon, executor));
        let floor = move |water: &Water<'_>| {
            let surface = water.heights()?;
            let (photon, executor) = &mut *running.borrow_mut();
            let floor = photon.floor(surface, FloorGrid::below(surface), executor.as_mut())?;
            Ok(Floor { xyz: in_color.then_some(floor.xyz), ..floor.light.into() })
        };
        Ok(Prepared { details, floor: Box::new(floor) })
    }
}
