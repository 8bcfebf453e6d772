//! Tables and maths of spectral light transport: no GPU, no files, no threads.
#![no_std]

extern crate alloc;

pub mod basis;
pub mod color;
pub mod color_checker;
mod csv_table;
pub mod dispersion;
pub mod display;
pub mod glass;
pub mod grid;
pub mod header;
pub mod illuminant;
pub mod light;
pub mod mat3;
pub mod matrices;
pub mod observer;
pub mod optics;
pub mod patch;
pub mod quality;
pub mod rgb;
pub mod singular;
pub mod upsample;
pub mod wavelengths;
