//! Pebbles in the water, and its time.

use caustic_heightfield::{Impulse, Ripple, wall_images};
use spectral_cli::view::PondPebbles;

/// Most pebbles that a hand drops into the water: the oldest goes when there is one more.
const MOST_DROPPED: usize = 200;
/// A wave is gone when this share of its height is left.
const GONE: f64 = 1e-3;

/// Waves on the water: those that it began with and those of dropped pebbles.
#[derive(Clone, Debug)]
pub(crate) struct Pebbles {
    begun: PondPebbles,
    extent_m: [f64; 2],
    dropped: Vec<Impulse>,
    time_s: f64,
    /// Height of the next one's waves, metres.
    pub(crate) amplitude_m: f64,
}

/// Pebbles whose waves are there or are to come.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Waves {
    /// They, in the order in which they fell.
    pub(crate) impulses: Vec<Impulse>,
    /// Seconds; 0 where there are none, since water at rest is the same at any time.
    pub(crate) time_s: f64,
}

impl Pebbles {
    /// Height of the waves of a pebble if nothing else is said, metres.
    const AMPLITUDE_M: f64 = 0.003;

    /// As the pond began.
    pub(crate) fn new(begun: PondPebbles, extent_m: [f64; 2]) -> Self {
        let time_s = begun.time_s;
        let amplitude_m = begun.impulses.first().map_or(Self::AMPLITUDE_M, |first| first.amplitude_m.abs());
        Self { begun, extent_m, dropped: Vec::new(), time_s, amplitude_m }
    }

    /// Drop one, now.
    pub(crate) fn drop_at(&mut self, position_m: [f64; 2]) {
        if self.dropped.len() == MOST_DROPPED {
            self.dropped.remove(0);
        }
        self.dropped.push(Impulse { position_m, start_s: self.time_s, amplitude_m: self.amplitude_m });
    }

    /// Let so many seconds pass, and waves that are gone go.
    pub(crate) fn advance(&mut self, seconds: f64) {
        self.time_s += seconds;
        let (now_s, life_s) = (self.time_s, self.life_s());
        self.dropped.retain(|pebble| now_s - pebble.start_s < life_s);
    }

    /// Back to the beginning: its time and its pebbles.
    pub(crate) fn reset(&mut self) {
        self.time_s = self.begun.time_s;
        self.dropped.clear();
    }

    /// The waves there are.
    pub(crate) fn waves(&self) -> Waves {
        let life_s = self.life_s();
        let is_there = |pebble: &&Impulse| self.time_s - pebble.start_s < life_s;
        let all = self.begun.impulses.iter().filter(is_there).chain(&self.dropped);
        let impulses: Vec<Impulse> = all.copied().collect();
        Waves { time_s: if impulses.is_empty() { 0.0 } else { self.time_s }, impulses }
    }

    /// Room for all pebbles there may be and their images.
    pub(crate) fn capacity(&self) -> usize {
        let anywhere = Impulse { position_m: [0.0; 2], start_s: 0.0, amplitude_m: 0.0 };
        let images = wall_images(&anywhere, self.extent_m, self.begun.walls).len();
        (self.begun.impulses.len() + MOST_DROPPED) * images
    }

    /// How long it takes until a pebble's waves are gone everywhere: exp(-beta (c t - D) - alpha t) at the farthest D that an image of it
    /// may have, which is in the tile beside the pond. Without damping, for ever.
    fn life_s(&self) -> f64 {
        let Ripple { front_m_s, alpha_per_s, beta_per_m, .. } = self.begun.ripple;
        let farthest_m = 2.0 * self.extent_m[0].hypot(self.extent_m[1]);
        (beta_per_m * farthest_m - GONE.ln()) / (alpha_per_s + beta_per_m * front_m_s)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use caustic_heightfield::{WallImages, impulse_heights};

    pub(crate) const RIPPLE: Ripple = Ripple {
        front_m_s: 0.5,
        alpha_per_s: 0.4,
        beta_per_m: 3.0,
        wave_number_rad_m: 60.0,
        frequency_rad_s: 30.0,
    };

    pub(crate) fn still() -> PondPebbles {
        PondPebbles { ripple: RIPPLE, impulses: Vec::new(), walls: WallImages::Four, time_s: 0.0 }
    }

    fn highest_m(waves: &Waves) -> f64 {
        let Waves { impulses, time_s } = waves;
        let surface = impulse_heights([64, 64], [1.0, 1.0], &RIPPLE, impulses, WallImages::Four, *time_s)
            .expect("waves");
        surface.heights_m.iter().fold(0.0, |most: f64, h| most.max(h.abs()))
    }

    #[test]
    fn water_at_rest_has_no_time() {
        let mut pebbles = Pebbles::new(still(), [1.0, 1.0]);
        let still = pebbles.waves();
        pebbles.advance(3.0);
        assert_eq!(pebbles.waves(), still);
        assert_eq!(highest_m(&still), 0.0);
    }

    #[test]
    fn a_pebble_makes_waves_that_travel_and_go() {
        let mut pebbles = Pebbles::new(still(), [1.0, 1.0]);
        pebbles.advance(5.0);
        pebbles.drop_at([0.5, 0.25]);
        assert_eq!(pebbles.waves().impulses[0].start_s, 5.0);
        pebbles.advance(0.4);
        let near = pebbles.waves();
        assert!(highest_m(&near) > 1e-3, "{}", highest_m(&near));
        pebbles.advance(0.4);
        assert_ne!(pebbles.waves(), near);
        // They are left out when little is left of them, and not before.
        let life_s = pebbles.life_s();
        pebbles.advance(0.9 * life_s);
        let last = highest_m(&pebbles.waves());
        assert!(last > 0.0 && last < 3.0 * GONE * pebbles.amplitude_m, "{last}");
        pebbles.advance(0.2 * life_s);
        assert_eq!(pebbles.waves(), Waves { impulses: Vec::new(), time_s: 0.0 });
    }

    #[test]
    fn undamped_waves_stay_and_the_oldest_pebble_makes_room() {
        let ripple = Ripple { alpha_per_s: 0.0, beta_per_m: 0.0, ..RIPPLE };
        let mut pebbles = Pebbles::new(PondPebbles { ripple, ..still() }, [1.0, 1.0]);
        for i in 0..=MOST_DROPPED {
            pebbles.drop_at([0.5, 0.5]);
            pebbles.advance(if i == 0 { 1e6 } else { 0.01 });
        }
        let waves = pebbles.waves();
        assert_eq!(waves.impulses.len(), MOST_DROPPED);
        assert!(waves.impulses[0].start_s > 1e5);
        assert_eq!(pebbles.capacity(), 5 * MOST_DROPPED);
    }

    #[test]
    fn the_beginning_has_its_own_pebbles_and_time() {
        let thrown = Impulse { position_m: [0.2, 0.2], start_s: 0.5, amplitude_m: -0.002 };
        let begun = PondPebbles { impulses: vec![thrown], time_s: 1.0, ..still() };
        let mut pebbles = Pebbles::new(begun, [1.0, 1.0]);
        let beginning = pebbles.waves();
        assert_eq!((beginning.time_s, &*beginning.impulses), (1.0, [thrown].as_slice()));
        assert_eq!(pebbles.amplitude_m, 0.002);
        pebbles.drop_at([0.1, 0.9]);
        pebbles.advance(100.0);
        assert!(pebbles.waves().impulses.is_empty());
        pebbles.reset();
        assert_eq!(pebbles.waves(), beginning);
    }
}
