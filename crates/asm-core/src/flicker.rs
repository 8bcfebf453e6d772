//! How much what frames show jumps, apart from steady motion.

use serde::{Deserialize, Serialize};

/// Second differences over successive frames, |a - 2 b + c|: steady change does not count, what comes and goes does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Flicker {
    /// Mean over the frames (and the texels), by the mean of what flickers.
    pub mean: f64,
    /// Largest, by the mean of what flickers: a total, or for texels the brightest of a frame.
    pub max: f64,
}

/// Watches frames of equal size.
#[derive(Clone, Debug, Default)]
pub struct FlickerMeter {
    /// The two frames before, the older first.
    before: [Vec<f64>; 2],
    frames: u32,
    /// Sums over the frames.
    total: f64,
    brightest: f64,
    /// Sums over the second differences, and the largest.
    total_changes: (f64, f64),
    texel_changes: (f64, f64),
}

impl FlickerMeter {
    /// See the Y of the texels of the next frame.
    pub fn add(&mut self, y: impl IntoIterator<Item = f32>) {
        let now: Vec<f64> = y.into_iter().map(f64::from).collect();
        let [a, b] = &self.before;
        if self.frames >= 2 {
            let change = |a: f64, b: f64, c: f64| (a - 2.0 * b + c).abs();
            let texels = a.iter().zip(b).zip(&now).map(|((&a, &b), &c)| change(a, b, c));
            let (sum, most) = texels.fold((0.0, 0.0), |(sum, most): (f64, f64), d| (sum + d, most.max(d)));
            let total = change(a.iter().sum(), b.iter().sum(), now.iter().sum());
            self.total_changes = (self.total_changes.0 + total, self.total_changes.1.max(total));
            self.texel_changes = (self.texel_changes.0 + sum, self.texel_changes.1.max(most));
        }
        self.frames += 1;
        self.total += now.iter().sum::<f64>();
        self.brightest += now.iter().copied().fold(0.0, f64::max);
        self.before.rotate_left(1);
        self.before[1] = now;
    }

    /// Of the total Y and of the texels' Y; none before the third frame or in the dark.
    #[must_use]
    pub fn flicker(&self) -> Option<(Flicker, Flicker)> {
        if self.frames < 3 || self.total <= 0.0 {
            return None;
        }
        let (frames, changes) = (f64::from(self.frames), f64::from(self.frames - 2));
        let (total, brightest) = (self.total / frames, self.brightest / frames);
        let flicker = |(sum, most): (f64, f64), largest: f64| Flicker {
            mean: sum / changes / total,
            max: most / largest,
        };
        Some((flicker(self.total_changes, total), flicker(self.texel_changes, brightest)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(frames: impl IntoIterator<Item = [f32; 2]>) -> Option<(Flicker, Flicker)> {
        let mut meter = FlickerMeter::default();
        frames.into_iter().for_each(|frame| meter.add(frame));
        meter.flicker()
    }

    #[test]
    fn steady_change_does_not_count_and_jumps_do() {
        let none = Flicker::default();
        assert_eq!(of((0..10).map(|i| [i as f32, 20.0 - 2.0 * i as f32])), Some((none, none)));
        // Light that goes to and fro between two texels: the total stays, every texel jumps by 2 x 1.
        let swapped = of((0..10).map(|i| if i % 2 == 0 { [1.0, 2.0] } else { [2.0, 1.0] })).unwrap();
        assert_eq!(swapped, (none, Flicker { mean: 4.0 / 3.0, max: 1.0 }));
        // A single frame that is brighter by a tenth: second differences of 0.1, 0.2 and 0.1 in 8.
        let (total, texel) = of((0..10).map(|i| if i == 5 { [1.1; 2] } else { [1.0; 2] })).unwrap();
        assert!(
            (total.mean - 0.05 / 1.01).abs() < 1e-6 && (total.max - 0.2 / 1.01).abs() < 1e-6,
            "{total:?}"
        );
        assert!((texel.mean - total.mean).abs() < 1e-9 && (texel.max - total.max).abs() < 1e-9, "{texel:?}");
    }

    #[test]
    fn there_is_no_flicker_of_two_frames_or_in_the_dark() {
        assert_eq!(of([[1.0; 2]; 2]), None);
        assert_eq!(of([[0.0; 2]; 5]), None);
    }
}
