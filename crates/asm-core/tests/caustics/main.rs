//! Physics of the plans, run by the CPU executor.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

mod adaptive;
mod books;
mod colour;
mod decisions;
mod eye;
mod footprints;
mod gaps;
mod glass_view;
mod hard_cases;
mod indices;
mod lamps;
mod map_fit;
mod method_plans;
mod paths;
mod plans;
mod reflections;
mod stage;
mod surfaces;
mod white;
