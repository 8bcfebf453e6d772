//! Frames of relit surfaces on the CPU executor, against the same light in f64.

mod colours;
mod frames;
mod gloss;
mod refused;
mod stage;
