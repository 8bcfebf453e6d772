//! The pond in the window: a click drops a pebble, the sun is dragged, methods are switched, and the error is measured meanwhile.
//!
//! Without a window, and so tested without one: `pebbles` and their time, the `sun`, where on the water a click falls (`plan_view`),
//! what the user has chosen (`choices`), all of it together (`view`) and a picture to be made (`job`). With one: who makes pictures inside the
//! window's frames (`frames`) or beside them (`beside`), of the surfaces that methods are fitted to (`fit`), who measures their error (`gauge`), and
//! the pond's part of the panel (`controls`).

mod beside;
mod choices;
mod controls;
mod fit;
mod frames;
mod gauge;
mod job;
mod pebbles;
mod plan_view;
mod sun;
mod view;

pub(crate) use view::View;
