//! Frames of a scene in which light, camera and glass move: what they make on the device, how long they take, how they flicker.

use std::f64::consts::TAU;
use std::time::Instant;

use frame_plan::{Executor, Made};
use glam::{DMat3, DMat4, DVec3};
use serde::{Deserialize, Serialize};
use spectral_scene::{LightShape, Scene};

use crate::flicker::{Flicker, FlickerMeter};
use crate::{AsmError, Planner, Settings, Statistics};

/// Lights and cameras swing round the vertical axis through the refractors' centre by up to this angle, radians.
const SWING_RAD: f64 = 0.1;
/// Refractors sway by up to this part of their largest extent, and turn by up to this angle.
const SWAY: f64 = 0.05;

/// A smooth motion of everything in a scene that may move from frame to frame, closed after a phase of 1.
pub struct Motion {
    start: Scene,
    centre_m: DVec3,
    sway_m: f64,
}

impl Motion {
    /// From a scene that is valid.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let corners = scene.refractors().flat_map(|object| scene.world_mesh(object).positions);
        let (low, high) = crate::geometry::bounds(corners).unwrap_or_default();
        Self { start: scene.clone(), centre_m: (low + high) / 2.0, sway_m: SWAY * (high - low).max_element() }
    }

    /// Move lights, cameras and refractors of `scene`, a copy of the one it was made from, to where they are at `phase`.
    pub fn move_to(&self, phase: f64, scene: &mut Scene) {
        // Each with a phase of its own, so that they do not move as one.
        let swing = |own: f64| (TAU * (phase + own)).sin();
        let about_centre = |angle: f64| {
            let centre = DMat4::from_translation(self.centre_m);
            centre * DMat4::from_rotation_y(angle) * DMat4::from_translation(-self.centre_m)
        };
        let turned = DMat3::from_rotation_y(SWING_RAD * swing(0.0));
        let carried = about_centre(SWING_RAD * swing(0.0));
        for (light, start) in scene.lights.iter_mut().zip(&self.start.lights) {
            light.shape = match start.shape {
                LightShape::Directional { direction } => {
                    LightShape::Directional { direction: turned * direction }
                }
                LightShape::Point { position_m, range_m } => {
                    LightShape::Point { position_m: carried.transform_point3(position_m), range_m }
                }
                LightShape::Spot { position_m, direction, inner_cone_rad, outer_cone_rad, range_m } => {
                    LightShape::Spot {
                        position_m: carried.transform_point3(position_m),
                        direction: turned * direction,
                        inner_cone_rad,
                        outer_cone_rad,
                        range_m,
                    }
                }
            };
        }
        for (camera, start) in scene.cameras.iter_mut().zip(&self.start.cameras) {
            camera.world_from_camera = about_centre(SWING_RAD * swing(0.3)) * start.world_from_camera;
        }
        let sway = DMat4::from_translation(DVec3::new(swing(0.6), 0.0, swing(0.85)) * self.sway_m);
        let moved = sway * about_centre(SWAY * swing(0.6));
        let refractors: Vec<_> = self.start.refractors().collect();
        for object in refractors {
            scene.objects[object].world_from_mesh = moved * self.start.objects[object].world_from_mesh;
        }
    }
}

/// What [`run`] runs.
#[derive(Clone, Copy, Debug)]
pub struct MovingFrames {
    /// How many; at least 3.
    pub frames: u32,
    /// Pixels of the pictures that are timed.
    pub picture: [u32; 2],
    /// The object whose texels are watched for flicker.
    pub receiver: usize,
    /// Its texels in u and v.
    pub texels: [u32; 2],
}

/// What became of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MovingRun {
    /// What the executor had made by the end of the second picture.
    pub made_by_second: Made,
    /// What it had made by the last: the same, in real time.
    pub made: Made,
    /// Milliseconds per picture after the second: the plan, what goes over, the frame.
    pub milliseconds: f64,
    /// Of these, the host's for the plan.
    pub plan_milliseconds: f64,
    /// Of refracted light on the receiver, all together.
    pub total_y: Flicker,
    /// Of refracted light in each texel of the receiver.
    pub texel_y: Flicker,
    /// Of the last bake.
    pub statistics: Statistics,
}

/// Run pictures of the moving scene's first camera without reading anything back; then the same motion once more on a receiver,
/// whose texels stay with it while the camera moves, and watch these.
///
/// # Errors
/// Those of the plans and their runs; [`AsmError::Update`] if the motion changes the plan's structure.
pub fn run(
    executor: &mut dyn Executor,
    scene: &Scene,
    settings: &Settings,
    setup: &MovingFrames,
) -> Result<MovingRun, AsmError> {
    let motion = Motion::new(scene);
    let mut moving = scene.clone();
    let phases = || (0..setup.frames).map(|frame| f64::from(frame) / f64::from(setup.frames));
    let limits = executor.limits();
    let mut planner = Planner::default();
    let mut render = |scene: &Scene| planner.render(scene, 0, setup.picture, settings, &limits);
    let mut current = render(&moving)?;
    executor.prepare(&current.plan)?;
    current.watch_statistics(executor)?;
    let (mut made_by_second, mut start, mut planning) = (Made::default(), Instant::now(), 0.0);
    for (frame, phase) in phases().enumerate() {
        if frame == 2 {
            made_by_second = executor.made();
            (start, planning) = (Instant::now(), 0.0);
        }
        motion.move_to(phase, &mut moving);
        let begin = Instant::now();
        let next = render(&moving)?;
        planning += begin.elapsed().as_secs_f64();
        current.update(executor, next)?;
        executor.execute()?;
        current.latest_statistics(executor);
    }
    let made = executor.made();
    current.read(executor)?;
    let per_frame = 1e3 / f64::from(setup.frames.saturating_sub(2).max(1));
    let (milliseconds, plan_milliseconds) = (start.elapsed().as_secs_f64() * per_frame, planning * per_frame);

    let (total_y, texel_y, statistics) = flicker(executor, scene, settings, setup, phases())?;
    Ok(MovingRun { made_by_second, made, milliseconds, plan_milliseconds, total_y, texel_y, statistics })
}

/// Flicker of the total and of the texels of refracted light on a receiver, where a scene's motion takes these phases one after
/// the other; 0 in the dark. With the statistics of the last.
///
/// # Errors
/// As [`run`].
pub fn flicker(
    executor: &mut dyn Executor,
    scene: &Scene,
    settings: &Settings,
    setup: &MovingFrames,
    phases: impl IntoIterator<Item = f64>,
) -> Result<(Flicker, Flicker, Statistics), AsmError> {
    let motion = Motion::new(scene);
    let mut moving = scene.clone();
    let limits = executor.limits();
    let mut planner = Planner::default();
    let mut bake = |scene: &Scene| planner.bake(scene, setup.receiver, setup.texels, settings, &limits);
    let mut current = bake(&moving)?;
    executor.prepare(&current.plan)?;
    let (mut meter, mut last) = (FlickerMeter::default(), Statistics::default());
    for phase in phases {
        motion.move_to(phase, &mut moving);
        current.update(executor, bake(&moving)?)?;
        executor.execute()?;
        let (maps, statistics) = current.read(executor)?;
        meter.add(maps.refracted.iter().map(|xyz| xyz[1]));
        last = statistics;
    }
    let (total, texel) = meter.flicker().unwrap_or_default();
    Ok((total, texel, last))
}
