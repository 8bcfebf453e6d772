//! Physics of the plans, run by the CPU executor.

mod books;
mod colour;
mod hard_cases;
mod lamps;
mod plans;
mod stage;
mod white;
