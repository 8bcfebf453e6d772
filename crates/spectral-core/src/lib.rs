//! Tables and maths of spectral light transport: no GPU, no files, no threads.
#![no_std]

extern crate alloc;

mod csv_table;
pub mod illuminant;
pub mod observer;
