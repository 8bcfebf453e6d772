//! What the workspace's commands and its cross-crate tests share.

pub mod flip;
pub mod metrics;
