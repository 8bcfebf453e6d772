//! Footprints where light is hard to follow: each case with the oracle's answer, and with a change that must be noticed.

#![allow(clippy::unwrap_used, reason = "tests")]

mod answer;
mod contacts;
mod folds;
mod maps;
mod prisms;
mod solids;
#[path = "../../../crates/asm-core/tests/caustics/stage.rs"]
#[allow(dead_code, reason = "made for asm-core's own tests")]
mod stage;
