//! Everything that moves between two frames of one structure.

use glam::DMat4;
use spectral_scene::{Camera, LightShape, Scene};

/// Where camera, lights and glass are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Pose {
    /// The scene's first camera.
    pub(crate) camera: Camera,
    /// All lights of the scene.
    pub(crate) lights: Vec<LightShape>,
    /// Objects by index.
    pub(crate) objects: Vec<(usize, DMat4)>,
}

impl Pose {
    /// Put the scene that this was made from into it.
    pub(crate) fn apply(&self, scene: &mut Scene) {
        match scene.cameras.first_mut() {
            Some(camera) => camera.clone_from(&self.camera),
            None => scene.cameras.push(self.camera.clone()),
        }
        for (light, shape) in scene.lights.iter_mut().zip(&self.lights) {
            light.shape = *shape;
        }
        for (object, placement) in &self.objects {
            scene.objects[*object].world_from_mesh = *placement;
        }
    }
}
