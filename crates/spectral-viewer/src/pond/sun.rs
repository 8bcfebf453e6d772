//! The sun over the pond, as it is dragged over a dial that is seen from above.

/// Farthest from straight above that the sun is dragged, degrees: from 90 on there is no light from above.
const MOST_TILT_DEG: f64 = 75.0;

/// Where the light comes from.
#[derive(Clone, Debug)]
pub(crate) struct Sun {
    /// The sun on the dial: x and y of the direction to it, which is of length 1. The dial's rim is the horizon.
    at: [f64; 2],
    home: [f64; 2],
}

impl Sun {
    /// Where light that travels in this direction of length 1 comes from.
    pub(crate) fn new([x, y, _]: [f64; 3]) -> Self {
        Self { at: [-x, -y], home: [-x, -y] }
    }

    /// Back to where it began.
    pub(crate) fn reset(&mut self) {
        self.at = self.home;
    }

    /// Drag it by these parts of the way from the zenith to the horizon; it stays off the horizon.
    pub(crate) fn drag(&mut self, [right, down]: [f64; 2]) {
        let moved = [self.at[0] + right, self.at[1] + down];
        let most = MOST_TILT_DEG.to_radians().sin();
        let scale = (most / moved[0].hypot(moved[1])).min(1.0);
        self.at = moved.map(|x| scale * x);
    }

    /// On the dial: 0 is the zenith, 1 away from it the horizon.
    pub(crate) fn on_dial(&self) -> [f64; 2] {
        self.at
    }

    /// Direction of travel of its light, of length 1.
    pub(crate) fn light_direction(&self) -> [f64; 3] {
        let [x, y] = self.at;
        [-x, -y, -(1.0 - x * x - y * y).max(0.0).sqrt()]
    }

    /// Away from straight above, degrees.
    pub(crate) fn tilt_deg(&self) -> f64 {
        self.at[0].hypot(self.at[1]).min(1.0).asin().to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use caustic_heightfield::light_tilted_deg;

    #[test]
    fn it_is_where_its_light_comes_from() {
        let mut sun = Sun::new(light_tilted_deg(20.0));
        assert!((sun.tilt_deg() - 20.0).abs() < 1e-9);
        assert!(sun.on_dial()[0] < 0.0, "light towards +x comes from -x");
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
        sun.drag([0.6, 0.1]);
        let light = sun.light_direction();
        assert!(light[0] < 0.0 && light[1] < 0.0 && (length(light) - 1.0).abs() < 1e-12, "{light:?}");
        sun.reset();
        for (now, then) in sun.light_direction().iter().zip(light_tilted_deg(20.0)) {
            assert!((now - then).abs() < 1e-12);
        }
    }

    #[test]
    fn it_stays_above_the_horizon() {
        let mut sun = Sun::new([0.0, 0.0, -1.0]);
        for _ in 0..10 {
            sun.drag([3.0, -1.0]);
        }
        assert!((sun.tilt_deg() - MOST_TILT_DEG).abs() < 1e-9, "{}", sun.tilt_deg());
        assert!(sun.light_direction()[2] < -0.2);
        // One that begins lower is left there until it is dragged.
        assert!(Sun::new(light_tilted_deg(85.0)).tilt_deg() > 84.9);
    }
}
