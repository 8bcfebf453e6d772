//! Tables and maths of spectral light transport: no GPU, no files, no threads.
#![no_std]

extern crate alloc;
