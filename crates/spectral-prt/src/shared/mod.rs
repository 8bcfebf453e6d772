//! Host sides of what several passes share.

pub(crate) mod harmonics;
pub mod prt_picture;
