//! Working units: what shaders compute in.

use glam::{DVec3, UVec2, Vec3};
use serde::{Deserialize, Serialize};
use spectral_scene::{Camera, Scene};

use crate::lights::REACH;
use crate::shared::view::View;
use crate::view_fit::camera_view;

/// The scene moved and scaled so that f32 serves a millimetre and ten kilometres alike.
///
/// The origin is the middle of the refractors' bounds, where floats are finest, or of all bounds where nothing refracts; the
/// unit is the distance from there to the farthest corner of the scene's bounds. Tolerances of the passes (2e-5 units)
/// therefore suit refractors that are not smaller than about a thousandth of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WorkingSpace {
    /// Origin in world space, metres.
    pub center_m: DVec3,
    /// Metres per unit.
    pub metres_per_unit: f64,
}

impl WorkingSpace {
    /// The space of a valid scene; one metre per unit where it has no extent.
    pub fn of(scene: &Scene) -> Self {
        let middle = |(low, high): (DVec3, DVec3)| 0.5 * (low + high);
        let all = scene.bounds(0..scene.objects.len());
        let center_m = scene.bounds(scene.refractors()).or(all).map_or(DVec3::ZERO, middle);
        let reach = all.map_or(0.0, |(low, high)| (high - center_m).max(center_m - low).length());
        Self { center_m, metres_per_unit: if reach > 0.0 { reach } else { 1.0 } }
    }

    /// A point in working units.
    pub fn working_from_world(&self, p_m: DVec3) -> DVec3 {
        (p_m - self.center_m) / self.metres_per_unit
    }

    /// A camera's view of a picture of `size` pixels, of which the space holds everything.
    pub fn camera_view(&self, camera: &Camera, size: UVec2) -> View {
        camera_view(camera, size, self, REACH)
    }

    /// As [`WorkingSpace::working_from_world`], rounded as passes see it.
    pub(crate) fn point(&self, p_m: DVec3) -> Vec3 {
        self.working_from_world(p_m).as_vec3()
    }
}
