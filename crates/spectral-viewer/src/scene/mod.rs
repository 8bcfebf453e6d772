//! A scene in the window: an orbiting camera, lamps and glass to drag, and every method's caustics.
//!
//! Without a window, and so tested without one: `lamps`, `glass`, what the user has chosen (`choices`), all of
//! it together (`view`), a picture to be made (`job`, with the `pose` that changes from frame to frame) and what became of its light
//! (`fates`). With one: who makes the picture (`making`) and its part of the panel (`controls`).

mod choices;
mod controls;
mod fates;
mod glass;
mod job;
mod lamps;
mod making;
mod pose;
mod view;

pub(crate) use view::View;
#[cfg(test)]
pub(crate) use view::tests::view;
