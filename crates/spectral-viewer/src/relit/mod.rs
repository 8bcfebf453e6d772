//! Matt surfaces under a spectral sky in the window, by precomputed transfer: the sky is dragged, illuminants and coefficients are
//! switched, and the error against sampling is measured meanwhile. Transfer is never computed again.
//!
//! Without a window, and so tested without one: what the user has chosen (`choices`), all of it together (`view`), a picture to be made
//! (`job`), frames of it (`frames`) and their error (`gauge`). With one: who makes pictures (`making`) and its part of the
//! panel (`controls`).

mod choices;
mod controls;
mod frames;
mod gauge;
mod job;
mod making;
mod view;

pub(crate) use view::View;
