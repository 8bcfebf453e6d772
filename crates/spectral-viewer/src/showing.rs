//! What the user of every window has set, whatever it shows.

use egui::Key;
use frame_plan::DeviceInfo;
use spectral_cli::values::Exposure;
use spectral_cli::view::ViewArgs;
use spectral_core::display::{Display, ToneMap};

use crate::hand::Hand;
use crate::runner::Runner;

/// The luminance that soft highlights reach white at: caustics are several times brighter than what is lit directly.
const SOFT_WHITE: f64 = 4.0;
/// Longest time that animation goes on by in one frame, seconds: a hitch is no leap.
const LONGEST_STEP_S: f64 = 0.25;

/// State of a window, without the window.
#[derive(Clone, Debug)]
pub(crate) struct Showing {
    /// The name of what is shown.
    pub(crate) name: String,
    /// What runs plans.
    pub(crate) runner: Runner,
    /// What the pointer drags.
    pub(crate) hand: Hand,
    /// Factor on the picture; none until it is found out from a picture.
    pub(crate) exposure: Option<f64>,
    /// Stops on top of it.
    pub(crate) stops: f64,
    /// Highlights are brought down softly, not cut.
    pub(crate) soft: bool,
    /// Pictures are made only where something has changed.
    pub(crate) paused: bool,
}

impl Showing {
    /// Keys of every window: [`Showing::press`] says what they do.
    pub(crate) const KEYS: [Key; 2] = [Key::Space, Key::E];

    /// What the command line asks for, of what has this name, in a window on the device `window`.
    pub(crate) fn new(name: &str, args: &ViewArgs, window: &DeviceInfo) -> Self {
        Self {
            name: name.into(),
            runner: Runner::of(args.backend, window),
            hand: Hand::default(),
            exposure: match args.exposure {
                Exposure::Auto => None,
                Exposure::Factor(factor) => Some(factor),
            },
            stops: 0.0,
            soft: true,
            paused: false,
        }
    }

    /// Press a key.
    pub(crate) fn press(&mut self, key: Key) {
        match key {
            Key::Space => self.paused = !self.paused,
            Key::E => self.runner = after(&Runner::ALL, &self.runner),
            _ => {}
        }
    }

    /// Seconds that animation goes on by where so many have passed.
    pub(crate) fn step_s(&self, seconds: f64) -> f64 {
        if self.paused { 0.0 } else { seconds.min(LONGEST_STEP_S) }
    }

    /// From XYZ to the screen.
    pub(crate) fn display(&self) -> Display {
        let tone_map = if self.soft { ToneMap::Reinhard { white: SOFT_WHITE } } else { ToneMap::Clip };
        Display { exposure: self.exposure.unwrap_or(1.0) * self.stops.exp2(), tone_map }
    }
}

/// The one after `now` in a list, the first one after the last and for what is not in it.
pub(crate) fn after<T: PartialEq + Copy>(all: &[T], now: &T) -> T {
    all[all.iter().position(|one| one == now).map_or(0, |i| (i + 1) % all.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_go_round() {
        let list = [None, Some(1), Some(21)];
        assert_eq!(after(&list, &None), Some(1));
        assert_eq!(after(&list, &Some(21)), None);
        assert_eq!(after(&list, &Some(5)), None);
    }
}
