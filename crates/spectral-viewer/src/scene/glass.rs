//! Glass that is moved by hand or by itself.

use std::f64::consts::TAU;

use glam::{DMat4, DVec3};
use spectral_scene::Scene;

/// Seconds that a turn of moving glass takes.
const TURN_S: f64 = 18.0;
/// Seconds in which moving glass goes up and down once.
const BOB_S: f64 = 4.0;
/// How far it goes, in parts of its radius.
const BOB: f64 = 0.15;

/// All refractors of a scene, which move as one.
#[derive(Clone, Debug)]
pub(crate) struct Glass {
    home: Vec<(usize, DMat4)>,
    centre: DVec3,
    radius_m: f64,
    /// Displacement in x, y and z, in parts of the glass's radius.
    pub(crate) offset: [f64; 3],
    /// Turned about the vertical by this, degrees.
    pub(crate) turn_deg: f64,
    /// Whether it moves by itself.
    pub(crate) moving: bool,
    /// How long it has moved by itself, seconds.
    moved_s: f64,
}

impl Glass {
    /// As the scene has it.
    pub(crate) fn new(scene: &Scene) -> Self {
        let home: Vec<_> = scene.refractors().map(|i| (i, scene.objects[i].world_from_mesh)).collect();
        let (low, high) = scene.bounds(scene.refractors()).unwrap_or_default();
        Self {
            home,
            centre: (low + high) / 2.0,
            radius_m: low.distance(high) / 2.0,
            offset: [0.0; 3],
            turn_deg: 0.0,
            moving: false,
            moved_s: 0.0,
        }
    }

    /// The scene has any.
    pub(crate) fn exists(&self) -> bool {
        !self.home.is_empty()
    }

    /// The middle of its bounds, before it moved.
    pub(crate) fn centre(&self) -> DVec3 {
        self.centre
    }

    /// Back to where it began, at rest.
    pub(crate) fn reset(&mut self) {
        (self.offset, self.turn_deg, self.moving, self.moved_s) = ([0.0; 3], 0.0, false, 0.0);
    }

    /// Let it move by itself for so many seconds, if it does.
    pub(crate) fn advance(&mut self, seconds: f64) {
        if self.moving {
            self.moved_s += seconds;
            self.turn_deg = (self.turn_deg + 180.0 + 360.0 * seconds / TURN_S).rem_euclid(360.0) - 180.0;
        }
    }

    /// Where the refractors are now: index into [`Scene::objects`] and placement.
    pub(crate) fn placements(&self) -> Vec<(usize, DMat4)> {
        let bob = BOB * (TAU * self.moved_s / BOB_S).sin();
        let offset = self.radius_m * (DVec3::from(self.offset) + DVec3::Y * bob);
        let moved = DMat4::from_translation(self.centre + offset)
            * DMat4::from_rotation_y(self.turn_deg.to_radians())
            * DMat4::from_translation(-self.centre);
        // Unmoved is unmoved to the last bit.
        let at_home = offset == DVec3::ZERO && self.turn_deg == 0.0;
        self.home.iter().map(|&(i, home)| (i, if at_home { home } else { moved * home })).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glass() -> (Scene, Glass) {
        let scene = spectral_scene::bundled("ring").expect("bundled");
        let glass = Glass::new(&scene);
        (scene, glass)
    }

    fn centre_of(scene: &mut Scene, glass: &Glass) -> DVec3 {
        for (i, placement) in glass.placements() {
            scene.objects[i].world_from_mesh = placement;
        }
        Glass::new(scene).centre()
    }

    #[test]
    fn glass_that_nobody_moves_stays_where_it_is() {
        let (scene, mut glass) = glass();
        glass.advance(7.0);
        for (i, placement) in glass.placements() {
            assert_eq!(placement, scene.objects[i].world_from_mesh);
        }
        assert!(glass.exists());
    }

    #[test]
    fn an_offset_of_one_is_a_radius() {
        let (mut scene, mut glass) = glass();
        glass.offset = [1.0, 0.0, -0.5];
        let moved = centre_of(&mut scene, &glass) - glass.centre();
        let radius = glass.radius_m;
        assert!(moved.distance(DVec3::new(radius, 0.0, -0.5 * radius)) < 1e-6 * radius, "{moved}");
    }

    #[test]
    fn moving_glass_turns_about_its_own_middle() {
        let (mut scene, mut glass) = glass();
        glass.moving = true;
        glass.advance(BOB_S);
        assert!((glass.turn_deg - 360.0 * BOB_S / TURN_S).abs() < 1e-9);
        let moved = centre_of(&mut scene, &glass) - glass.centre();
        assert!(moved.y.abs() < 1e-6 * glass.radius_m, "{moved}");
        glass.advance(TURN_S / 2.0);
        assert!((-180.0..180.0).contains(&glass.turn_deg), "{}", glass.turn_deg);
        glass.reset();
        assert_eq!(glass.placements()[0].1, glass.home[0].1);
    }

    #[test]
    fn a_scene_without_glass_has_none_to_move() {
        let glass = Glass::new(&Scene::default());
        assert!(!glass.exists() && glass.placements().is_empty());
    }
}
