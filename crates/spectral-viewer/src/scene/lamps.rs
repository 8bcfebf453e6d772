//! Lights that are dragged round the scene.

use glam::{DQuat, DVec3};
use spectral_scene::{Camera, LightShape};

use crate::orbit::axes;

/// The scene's lights, one of which is being moved.
#[derive(Clone, Debug)]
pub(crate) struct Lamps {
    now: Vec<LightShape>,
    home: Vec<LightShape>,
    centre: DVec3,
    /// Index of the one that drags move.
    pub(crate) chosen: usize,
}

impl Lamps {
    /// As the scene has them; they go round `centre`.
    pub(crate) fn new(lights: Vec<LightShape>, centre: DVec3) -> Self {
        Self { home: lights.clone(), now: lights, centre, chosen: 0 }
    }

    /// Where they are now.
    pub(crate) fn shapes(&self) -> &[LightShape] {
        &self.now
    }

    /// Back to where they began.
    pub(crate) fn reset(&mut self) {
        self.now.clone_from(&self.home);
    }

    /// Turn the chosen one about the centre as one turns a ball on the screen: what the ball has in front moves right and down by
    /// these angles. Directional lights turn where they come from, others their place, and a spot what it points at.
    pub(crate) fn drag(&mut self, right_rad: f64, down_rad: f64, seen_by: &Camera) {
        let [right, up, _] = axes(seen_by);
        let turn = DQuat::from_axis_angle(up, right_rad) * DQuat::from_axis_angle(right, down_rad);
        let (centre, turned) = (self.centre, |v: &mut DVec3| *v = (turn * *v).normalize());
        let moved = |p: &mut DVec3| *p = centre + turn * (*p - centre);
        match self.now.get_mut(self.chosen) {
            Some(LightShape::Directional { direction }) => turned(direction),
            Some(LightShape::Point { position_m, .. }) => moved(position_m),
            Some(LightShape::Spot { position_m, direction, .. }) => {
                moved(position_m);
                turned(direction);
            }
            None => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera::look_at(DVec3::new(0.0, 2.0, 2.0), DVec3::ZERO)
    }

    #[test]
    fn light_from_above_is_dragged_to_the_side_it_is_pulled_to() {
        let mut lamps = Lamps::new(vec![LightShape::Directional { direction: DVec3::NEG_Y }], DVec3::ZERO);
        lamps.drag(0.3, 0.0, &camera());
        let LightShape::Directional { direction } = lamps.shapes()[0] else { panic!("changed its kind") };
        // It comes from the right now.
        assert!(direction.x < -0.1 && (direction.length() - 1.0).abs() < 1e-12, "{direction}");
        lamps.reset();
        assert_eq!(lamps.shapes()[0], LightShape::Directional { direction: DVec3::NEG_Y });
    }

    #[test]
    fn a_spot_keeps_its_distance_and_what_it_points_at() {
        let centre = DVec3::new(1.0, 0.0, 0.0);
        let position_m = DVec3::new(1.0, 3.0, 0.0);
        let spot = LightShape::Spot {
            position_m,
            direction: DVec3::NEG_Y,
            inner_cone_rad: 0.1,
            outer_cone_rad: 0.2,
            range_m: None,
        };
        let mut lamps = Lamps::new(vec![spot], centre);
        lamps.drag(0.5, -0.4, &camera());
        let LightShape::Spot { position_m: moved, direction, .. } = lamps.shapes()[0] else {
            panic!("changed its kind")
        };
        assert!(moved.distance(position_m) > 0.1);
        assert!((moved.distance(centre) - 3.0).abs() < 1e-12);
        assert!((moved + 3.0 * direction).distance(centre) < 1e-12);
    }

    #[test]
    fn only_the_chosen_one_moves_and_none_is_no_panic() {
        let point = |x: f64| LightShape::Point { position_m: DVec3::new(x, 1.0, 0.0), range_m: None };
        let mut lamps = Lamps::new(vec![point(1.0), point(2.0)], DVec3::ZERO);
        lamps.chosen = 1;
        lamps.drag(0.2, 0.2, &camera());
        assert_eq!(lamps.shapes()[0], point(1.0));
        assert_ne!(lamps.shapes()[1], point(2.0));
        Lamps::new(Vec::new(), DVec3::ZERO).drag(0.1, 0.1, &camera());
    }
}
