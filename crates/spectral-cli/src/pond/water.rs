//! The water of each frame: heights, or the impulses that plans make them of by themselves.

use std::cell::OnceCell;
use std::path::Path;

use caustic_heightfield::{
    HeightField, HeightSource, Moment, PondError, PondPlan, PondScene, Surface, wall_images,
};
use frame_plan::Executor;

use super::output::Series;

/// The water of a series.
#[derive(Clone, Copy)]
pub(super) struct Waters<'a> {
    /// The scene and the folder that its other files are in.
    pub(super) scene: &'a PondScene,
    pub(super) folder: &'a Path,
    /// Samples in x and y, of a surface without a grid of its own.
    pub(super) size: [usize; 2],
    pub(super) series: Series,
}

/// The water of one frame.
pub(super) struct Water<'a> {
    scene: &'a PondScene,
    folder: &'a Path,
    size: [usize; 2],
    moment: Moment,
    heights: OnceCell<HeightField>,
}

impl<'a> Waters<'a> {
    /// The water of a frame.
    pub(super) fn at(&self, frame: usize) -> Water<'a> {
        let moment = Moment { frame, after_s: frame as f64 * self.series.step_s };
        let Self { scene, folder, size, .. } = *self;
        Water { scene, folder, size, moment, heights: OnceCell::new() }
    }
}

impl Water<'_> {
    /// Its heights, which are computed or read when they are first asked for.
    ///
    /// # Errors
    /// Numbers out of range, files that hold no heights.
    pub(super) fn heights(&self) -> Result<&HeightField, PondError> {
        if let Some(heights) = self.heights.get() {
            return Ok(heights);
        }
        let heights = self.scene.heights(self.size, self.folder, self.moment)?;
        Ok(self.heights.get_or_init(|| heights))
    }

    /// Let the next frame of a plan for this scene's [`height_source`] have it.
    ///
    /// # Errors
    /// As [`Water::heights`]; what the plan says.
    pub(super) fn write(&self, plan: &PondPlan, executor: &mut dyn Executor) -> Result<(), PondError> {
        match (height_source(self.scene), &self.scene.surface) {
            (HeightSource::Impulses { .. }, Surface::Impulses { ripple, impulses, walls, time_s }) => {
                let time_s = time_s + self.moment.after_s;
                plan.write_impulses(executor, ripple, impulses, *walls, time_s)
            }
            _ => plan.write_heights(executor, self.heights()?),
        }
    }
}

/// Where plans for a scene have their heights from: where it is of impulses, and not of too many, their waves are summed by a pass.
pub(super) fn height_source(scene: &PondScene) -> HeightSource {
    let Surface::Impulses { impulses, walls, .. } = &scene.surface else { return HeightSource::Host };
    let images = impulses.first().map_or(1, |first| wall_images(first, scene.extent_m, *walls).len());
    let capacity = (impulses.len() * images).max(1);
    if capacity > HeightSource::MOST_IMPULSES {
        return HeightSource::Host;
    }
    HeightSource::Impulses { capacity, distance_levels: None }
}
