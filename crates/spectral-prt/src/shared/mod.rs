//! Host sides of what several passes share.

pub mod prt_picture;
