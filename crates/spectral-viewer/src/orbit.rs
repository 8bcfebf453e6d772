//! A camera that goes round what it looks at.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat4, DQuat, DVec3};
use spectral_scene::Camera;

/// The camera stays this far from straight up and straight down, radians.
const POLE_RAD: f64 = 0.02;
/// Least and greatest distance from the pivot, as a factor on the first one.
const DISTANCE_RANGE: (f64, f64) = (0.02, 20.0);

/// A camera, and the point on its line of sight that it turns about.
#[derive(Clone, Debug)]
pub(crate) struct Orbit {
    camera: Camera,
    pivot: DVec3,
    home: (Camera, DVec3),
}

impl Orbit {
    /// Beginning at `camera`, about the point on its line of sight that is next to `centre`.
    pub(crate) fn new(camera: Camera, centre: DVec3) -> Self {
        let eye = camera.world_from_camera.w_axis.truncate();
        let forward = -camera.world_from_camera.z_axis.truncate();
        // A camera that turns its back on the centre still needs a pivot in front of it.
        let ahead = (centre - eye).dot(forward).max(2.0 * camera.znear_m);
        let pivot = eye + ahead * forward;
        Self { home: (camera.clone(), pivot), camera, pivot }
    }

    /// The camera as it is now.
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Back to where it began.
    pub(crate) fn reset(&mut self) {
        (self.camera, self.pivot) = self.home.clone();
    }

    /// Turn the scene under the camera: what is in front moves right and down on the screen by these angles.
    pub(crate) fn turn(&mut self, right_rad: f64, down_rad: f64) {
        let [right, _, backward] = axes(&self.camera);
        let elevation = backward.y.clamp(-1.0, 1.0).asin();
        let most = FRAC_PI_2 - POLE_RAD;
        let down_rad = (elevation + down_rad).clamp(-most.max(-elevation), most.max(elevation)) - elevation;
        let turn = DQuat::from_rotation_y(-right_rad) * DQuat::from_axis_angle(right, -down_rad);
        let about_pivot = DMat4::from_translation(self.pivot)
            * DMat4::from_quat(turn)
            * DMat4::from_translation(-self.pivot);
        self.camera.world_from_camera = about_pivot * self.camera.world_from_camera;
    }

    /// Go to `factor` of the distance from the pivot, within limits.
    pub(crate) fn zoom(&mut self, factor: f64) {
        let first = distance(&self.home.0, self.home.1);
        let now = distance(&self.camera, self.pivot);
        let wanted = (now * factor).clamp(first * DISTANCE_RANGE.0, first * DISTANCE_RANGE.1);
        let [_, _, backward] = axes(&self.camera);
        self.camera.world_from_camera.w_axis = (self.pivot + wanted * backward).extend(1.0);
        // What is near stays visible from near.
        self.camera.znear_m = self.home.0.znear_m * (wanted / first).min(1.0);
    }

    /// Move the scene on the screen by these parts of the picture's height, as it moves at the pivot's distance.
    pub(crate) fn shift(&mut self, right: f64, down: f64) {
        let height = 2.0 * (self.camera.yfov_rad / 2.0).tan() * distance(&self.camera, self.pivot);
        let [x, y, _] = axes(&self.camera);
        let by = height * (down * y - right * x);
        self.pivot += by;
        self.camera.world_from_camera.w_axis += by.extend(0.0);
    }
}

/// A camera's right, up and backward.
pub(crate) fn axes(camera: &Camera) -> [DVec3; 3] {
    let m = &camera.world_from_camera;
    [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().normalize_or_zero())
}

fn distance(camera: &Camera, pivot: DVec3) -> f64 {
    camera.world_from_camera.w_axis.truncate().distance(pivot)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orbit() -> Orbit {
        Orbit::new(Camera::look_at(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO), DVec3::new(0.2, 0.0, 0.0))
    }

    /// Where the camera shows a point: right and up of the middle, in units of its depth.
    fn on_screen(orbit: &Orbit, point: DVec3) -> [f64; 2] {
        let p = orbit.camera().world_from_camera.inverse().transform_point3(point);
        [p.x / -p.z, p.y / -p.z]
    }

    #[test]
    fn begins_with_the_scene_s_camera_and_comes_back_to_it() {
        let mut orbit = orbit();
        let home = Camera::look_at(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO);
        assert_eq!(orbit.camera(), &home);
        orbit.turn(1.0, 0.3);
        orbit.zoom(0.5);
        orbit.shift(0.1, 0.2);
        assert_ne!(orbit.camera(), &home);
        orbit.reset();
        assert_eq!(orbit.camera(), &home);
    }

    #[test]
    fn what_is_in_front_follows_the_pointer() {
        let mut orbit = orbit();
        let front = DVec3::new(0.0, 0.1, 0.3);
        let before = on_screen(&orbit, front);
        orbit.turn(0.2, 0.0);
        let right = on_screen(&orbit, front);
        assert!(right[0] > before[0] + 0.01, "{before:?} {right:?}");
        orbit.turn(0.0, 0.2);
        assert!(on_screen(&orbit, front)[1] < right[1] - 0.01);
    }

    #[test]
    fn turning_keeps_pivot_distance_and_upright() {
        let mut orbit = orbit();
        let far = distance(orbit.camera(), orbit.pivot);
        for step in 0..100 {
            orbit.turn(0.3, if step % 3 == 0 { 0.4 } else { -0.1 });
            let [x, y] = on_screen(&orbit, orbit.pivot);
            assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
            assert!((distance(orbit.camera(), orbit.pivot) - far).abs() < 1e-9);
            let [right, up, _] = axes(orbit.camera());
            assert!(right.y.abs() < 1e-9 && up.y > 0.0, "{right} {up}");
        }
    }

    #[test]
    fn never_goes_over_the_pole() {
        let mut orbit = orbit();
        orbit.turn(0.0, 10.0);
        let [_, up, backward] = axes(orbit.camera());
        assert!(up.y > 0.0 && backward.y > 0.99);
        orbit.turn(0.0, -20.0);
        let [_, up, backward] = axes(orbit.camera());
        assert!(up.y > 0.0 && backward.y < -0.99);
    }

    #[test]
    fn zoom_has_ends() {
        let mut orbit = orbit();
        let first = distance(orbit.camera(), orbit.pivot);
        orbit.zoom(0.5);
        assert!((distance(orbit.camera(), orbit.pivot) / first - 0.5).abs() < 1e-12);
        orbit.zoom(1e-9);
        assert!((distance(orbit.camera(), orbit.pivot) / first - DISTANCE_RANGE.0).abs() < 1e-12);
        assert!(orbit.camera().znear_m < distance(orbit.camera(), orbit.pivot));
        orbit.zoom(1e9);
        assert!((distance(orbit.camera(), orbit.pivot) / first - DISTANCE_RANGE.1).abs() < 1e-9);
    }

    #[test]
    fn shifting_by_a_height_moves_the_pivot_by_a_height() {
        let mut orbit = orbit();
        let before = orbit.pivot;
        let edge = (orbit.camera().yfov_rad / 2.0).tan();
        orbit.shift(0.25, -0.5);
        let [x, y] = on_screen(&orbit, before);
        assert!((x - 0.5 * edge).abs() < 1e-9 && (y - edge).abs() < 1e-9, "{x} {y}");
    }

    #[test]
    fn a_camera_with_its_back_to_the_centre_turns_about_a_point_before_it() {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z);
        let orbit = Orbit::new(camera, DVec3::Z * 5.0);
        assert!(orbit.pivot.z < 0.0);
    }
}
