//! What the workspace's commands and its cross-crate tests share: who runs plans, on which scenes, and how results
//! are held against each other.

pub mod checks;
pub mod executor_entry;
pub mod executors;
pub mod flip;
pub mod html;
pub mod oracle_picture;
pub mod picture_distance;
pub mod ponds;
pub mod prt;
pub mod sabotage;
pub mod subject;
pub mod terminal_percent;
pub mod whole_file;

pub use spectral_cli::{frame_time, kept, layers, metrics, net_error};
