//! A picture to be made, and what comes back.

use asm_core::{AsmError, AsmRenderer, Settings, Statistics};
use frame_plan::{Decision, DeviceInfo, Executor, Made, StepTime};
use spectral_scene::Scene;

use crate::pose::Pose;

/// The one camera of a view.
const CAMERA: usize = 0;

/// A picture to be made.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Job {
    /// Where everything is.
    pub(crate) pose: Pose,
    /// Pixels.
    pub(crate) size: [u32; 2],
    /// How.
    pub(crate) settings: Settings,
}

/// What is known of a picture that was made.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    /// Who made it.
    pub(crate) device: DeviceInfo,
    /// How long each step took; of an earlier frame where the device works behind the host's back.
    pub(crate) step_times: Vec<StepTime>,
    /// Which passes ran, which did not, and why.
    pub(crate) decisions: Vec<Decision>,
    /// What became of the light, a frame late likewise.
    pub(crate) statistics: Option<Statistics>,
    /// What the executor has allocated and compiled so far.
    pub(crate) made: Made,
}

impl Job {
    /// Bring the renderer to this picture: by numbers alone, unless the structure of its plan has changed. Leaves `scene` as
    /// the picture has it.
    ///
    /// # Errors
    /// Those of the plan and of the device.
    pub(crate) fn prepare<E: Executor>(
        &self,
        renderer: &mut AsmRenderer<E>,
        scene: &mut Scene,
    ) -> Result<(), AsmError> {
        self.pose.apply(scene);
        renderer.update(scene, CAMERA, self.size, &self.settings).map(drop)
    }
}

impl Report {
    /// Of what `renderer` has run.
    pub(crate) fn of<E: Executor>(renderer: &mut AsmRenderer<E>) -> Self {
        let decisions =
            renderer.prepared().map(|prepared| prepared.plan.decisions.clone()).unwrap_or_default();
        let statistics = renderer.latest_statistics();
        let executor = renderer.executor();
        let (device, step_times, made) = (executor.info().clone(), executor.step_times(), executor.made());
        Self { device, step_times, decisions, statistics, made }
    }
}
