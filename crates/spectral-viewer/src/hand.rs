//! The user's hand on the picture, followed event by event: where a drag ends does not depend on how many frames were drawn meanwhile.
//!
//! egui's own drags are per frame: one frame in which the pointer came from elsewhere and pressed counts all the way as dragged, one
//! in which it moved and let go counts nothing. Frames of this window may take a good part of a second.

use egui::{Event, Modifiers, PointerButton, Pos2, Vec2};

/// What a button takes hold of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Grip {
    /// What the picture is for: it turns a scene or a sky, and drops a pebble into water.
    Main,
    /// The picture, sideways.
    Shift,
    /// The chosen lamp, or the sun; the view, where the picture is for turning the sky.
    Lamp,
}

/// What the hand does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Touch {
    /// A button goes down on the stage, at this point of the window.
    Press(Grip, Pos2),
    /// What is held is dragged by so many points.
    Drag(Grip, Vec2),
}

impl Grip {
    /// What a button takes hold of.
    fn of(button: PointerButton, modifiers: Modifiers) -> Option<Self> {
        match button {
            PointerButton::Secondary => Some(Self::Lamp),
            PointerButton::Middle => Some(Self::Shift),
            PointerButton::Primary if modifiers.command || modifiers.ctrl => Some(Self::Lamp),
            PointerButton::Primary if modifiers.shift => Some(Self::Shift),
            PointerButton::Primary => Some(Self::Main),
            _ => None,
        }
    }
}

/// Where the pointer was when it last dragged something.
#[derive(Clone, Copy, Debug)]
struct Held {
    grip: Grip,
    button: PointerButton,
    at: Pos2,
}

/// What the pointer drags, from the press of a button to its release.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hand(Option<Held>);

impl Hand {
    /// What an event does. Where there is more than the picture, `on_picture` says which points are on it.
    pub(crate) fn take(&mut self, event: &Event, on_picture: impl FnOnce(Pos2) -> bool) -> Option<Touch> {
        let (Event::PointerMoved(pos) | Event::PointerButton { pos, .. }) = *event else { return None };
        let held = self.0.as_mut();
        let dragged = held.map(|held| Touch::Drag(held.grip, pos - std::mem::replace(&mut held.at, pos)));
        if let Event::PointerButton { button, pressed, modifiers, .. } = *event {
            match self.0 {
                Some(held) if held.button == button && !pressed => self.0 = None,
                None if pressed && on_picture(pos) => {
                    self.0 = Grip::of(button, modifiers).map(|grip| Held { grip, button, at: pos });
                    return self.0.map(|held| Touch::Press(held.grip, pos));
                }
                _ => {}
            }
        }
        dragged
    }

    /// Let go of what no button holds any more: a release may have gone to another window.
    pub(crate) fn keep(&mut self, is_down: impl FnOnce(PointerButton) -> bool) {
        if self.0.is_some_and(|held| !is_down(held.button)) {
            self.0 = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{pos2, vec2};

    fn button(pos: Pos2, button: PointerButton, pressed: bool, modifiers: Modifiers) -> Event {
        Event::PointerButton { pos, button, pressed, modifiers }
    }

    #[test]
    fn the_way_to_a_press_and_after_a_release_is_no_drag() {
        let mut hand = Hand::default();
        let (a, b, c) = (pos2(400.0, 100.0), pos2(430.0, 90.0), pos2(480.0, 95.0));
        let primary = |pos, pressed| button(pos, PointerButton::Primary, pressed, Modifiers::NONE);
        assert_eq!(hand.take(&Event::PointerMoved(a), |_| true), None);
        assert_eq!(hand.take(&primary(b, true), |_| true), Some(Touch::Press(Grip::Main, b)));
        assert_eq!(hand.take(&Event::PointerMoved(c), |_| true), Some(Touch::Drag(Grip::Main, c - b)));
        assert_eq!(hand.take(&primary(a, false), |_| true), Some(Touch::Drag(Grip::Main, a - c)));
        assert_eq!(hand.take(&Event::PointerMoved(b), |_| true), None);
    }

    #[test]
    fn a_press_beside_the_picture_drags_nothing_and_a_drag_may_leave_it() {
        let mut hand = Hand::default();
        let on_picture = |pos: Pos2| pos.x > 300.0;
        let secondary = |x, pressed| button(pos2(x, 0.0), PointerButton::Secondary, pressed, Modifiers::NONE);
        let moved = |x| Event::PointerMoved(pos2(x, 0.0));
        assert_eq!(hand.take(&secondary(200.0, true), on_picture), None);
        assert_eq!(hand.take(&moved(400.0), on_picture), None);
        hand.take(&secondary(400.0, false), on_picture);
        hand.take(&secondary(400.0, true), on_picture);
        assert_eq!(hand.take(&moved(200.0), on_picture), Some(Touch::Drag(Grip::Lamp, vec2(-200.0, 0.0))));
        hand.keep(|button| button != PointerButton::Secondary);
        assert_eq!(hand.take(&moved(300.0), on_picture), None);
    }

    #[test]
    fn buttons_and_modifiers_say_what_is_gripped() {
        use PointerButton::{Extra1, Middle, Primary, Secondary};
        for (button, modifiers, grip) in [
            (Primary, Modifiers::NONE, Some(Grip::Main)),
            (Primary, Modifiers::SHIFT, Some(Grip::Shift)),
            (Primary, Modifiers::CTRL, Some(Grip::Lamp)),
            (Middle, Modifiers::NONE, Some(Grip::Shift)),
            (Secondary, Modifiers::NONE, Some(Grip::Lamp)),
            (Extra1, Modifiers::NONE, None),
        ] {
            assert_eq!(Grip::of(button, modifiers), grip, "{button:?} {modifiers:?}");
        }
    }
}
