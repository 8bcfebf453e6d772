//! A picture to be made, and what comes back.

use asm_core::{AsmError, AsmRenderer, Settings, Statistics};
use frame_plan::Executor;
use spectral_scene::Scene;

use super::pose::Pose;
use crate::subject::{Job, Report};

/// The one camera of a view.
const CAMERA: usize = 0;

/// A picture to be made.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PictureJob {
    /// Where everything is.
    pub(crate) pose: Pose,
    /// Pixels.
    pub(crate) size: [u32; 2],
    /// How.
    pub(crate) settings: Settings,
}

/// What became of the light, a frame late.
pub(crate) type SceneFacts = Option<Statistics>;

impl Job for PictureJob {
    type Facts = SceneFacts;

    fn size(&self) -> [u32; 2] {
        self.size
    }
}

impl PictureJob {
    /// Bring the renderer to this picture: by numbers alone, unless the structure of its plan has changed. Leaves `scene` as
    /// the picture has it.
    ///
    /// # Errors
    /// Those of the plan and of the device.
    pub(super) fn prepare<E: Executor>(
        &self,
        renderer: &mut AsmRenderer<E>,
        scene: &mut Scene,
    ) -> Result<(), AsmError> {
        self.pose.apply(scene);
        renderer.update(scene, CAMERA, self.size, &self.settings).map(drop)
    }
}

/// Of what `renderer` has run.
pub(super) fn report<E: Executor>(renderer: &mut AsmRenderer<E>) -> Report<SceneFacts> {
    let decisions = renderer.prepared().map(|prepared| prepared.plan.decisions.clone()).unwrap_or_default();
    let statistics = renderer.latest_statistics();
    Report::of(renderer.executor(), decisions, statistics)
}
