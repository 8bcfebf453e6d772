//! The CPU executor: runs the mirrors.

mod mirror;

pub use mirror::*;
