//! What the workspace's commands and its cross-crate tests share: who runs plans, on which scenes, and how results
//! are held against each other.

pub mod checks;
pub mod executors;
pub mod flip;
pub mod layers;
pub mod metrics;
pub mod sabotage;
pub mod subject;
