//! Real time: light, camera and glass move in every frame.

use anyhow::{Context, Result};
use asm_core::Settings;
use asm_core::moving::{self, MovingFrames, MovingRun};
use frame_plan::Executor;
use serde::Serialize;
use spectral_scene::bundled;

use super::{COLUMNS, Column, Turns};

/// The scene that moves.
pub(super) const SCENE: &str = "sphere";

/// Frames of each row.
pub(super) const FRAMES: u32 = 300;

/// Texels of the light's view along each side, pixels of a frame and texels of the receiver: small, since software devices go
/// through all frames twice.
pub(super) const EMISSION_SIZE: u32 = 64;
pub(super) const PICTURE: [u32; 2] = [160, 90];
const TEXELS: [u32; 2] = [32, 32];

/// A row.
#[derive(Serialize)]
pub(super) struct MovingRow {
    /// One of [`COLUMNS`].
    pub(super) method: &'static str,
    pub(super) run: MovingRun,
}

pub(super) fn measure(turns: &mut Turns) -> Result<Vec<MovingRow>> {
    let scene = bundled(SCENE).with_context(|| format!("no scene {SCENE}"))?;
    let setup = MovingFrames {
        frames: FRAMES,
        picture: PICTURE,
        receiver: scene.receiver("receiver")?,
        texels: TEXELS,
    };
    let row = |(column, executor): (&Column, &mut Box<dyn Executor>)| {
        eprintln!("  moving, {}", column.name);
        let settings =
            Settings { emission_size: EMISSION_SIZE, map_size: Some(2 * EMISSION_SIZE), ..column.settings() };
        let run = moving::run(executor.as_mut(), &scene, &settings, &setup)?;
        Ok(MovingRow { method: column.name, run })
    };
    // More wavelengths change nothing of this but the time.
    COLUMNS[..2].iter().zip(turns).map(row).collect()
}
