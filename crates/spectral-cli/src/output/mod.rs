//! Files we write: whole or not at all.

pub mod atomic_file;
pub mod exr;
pub mod png;
